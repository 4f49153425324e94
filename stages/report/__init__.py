"""The stage `report`: one page for people."""
