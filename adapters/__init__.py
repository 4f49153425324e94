"""Upstream formats: one file each. `read` finds the right one by content."""

from typing import TYPE_CHECKING

from ..pipeline.core.faces import lazily

if TYPE_CHECKING:
    from ..pipeline.reading.load import read, read_all

__all__ = ["read", "read_all"]

__getattr__, __dir__ = lazily(__name__)
