"""Training of the built-in rectifier."""
