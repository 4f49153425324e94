"""The types that everything passes on, and what they need; imports nothing else of pcnet3d."""
