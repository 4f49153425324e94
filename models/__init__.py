"""Rectifiers and lifters, and what makes them."""

from .lifter.load import load_lifter
from .rectifier.load import load_rectifier

__all__ = ["load_lifter", "load_rectifier"]
