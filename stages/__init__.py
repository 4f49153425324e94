"""Steps of a pipeline: one file each; a stage is also a plain function on a pose sequence."""

from .rectify import rectify, rectify_together

__all__ = ["rectify", "rectify_together"]
