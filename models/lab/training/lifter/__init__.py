"""Training of the built-in lifter."""
