"""Training of the built-in networks, a script each."""
