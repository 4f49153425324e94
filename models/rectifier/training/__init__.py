"""The rectifier's network and its training (torch)."""
