"""Upstream formats: one file each. `read` finds the right one by content."""

from ..pipeline.reading.load import read, read_all

__all__ = ["read", "read_all"]
