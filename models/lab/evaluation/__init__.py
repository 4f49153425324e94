"""`pcnet3d evaluate` and the test beds."""
