"""`pcnet3d bench`: speed and memory on this machine."""
