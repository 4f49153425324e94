"""Rectifiers and what makes them."""
