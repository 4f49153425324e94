"""`pcnet3d lab bench`: speed and memory on this machine."""
