"""`pcnet3d compare`."""
