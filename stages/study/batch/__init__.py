"""`pcnet3d batch`."""
