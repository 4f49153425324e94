"""`pcnet3d live`."""
