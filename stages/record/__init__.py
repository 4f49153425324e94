"""The stage `record`: a rerun recording."""
