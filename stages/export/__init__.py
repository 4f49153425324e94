"""The stage `export`: tables and formats of other programs."""
