"""Helpers shared by adapters."""
