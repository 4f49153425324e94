"""Entry points: the protocols that plugins follow, the registry that finds them, checks of options."""
