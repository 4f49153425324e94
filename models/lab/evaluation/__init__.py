"""`pcnet3d lab evaluate` and the test beds."""
