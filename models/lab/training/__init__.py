"""Training of the built-in networks, a package each."""
