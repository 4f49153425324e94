"""The built-in lifter's network and its training (torch)."""
