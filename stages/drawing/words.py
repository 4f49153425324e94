"""Names and figures of the data in words, as every page has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .page import Cell, Soft


def spoken(name: str) -> str:
    """A name of the data in words: `r_knee_flexion` is "right knee flexion"."""
    side = {"r_": "right ", "l_": "left "}.get(name[:2], "")
    return side + (name[2:] if side else name).replace("_", " ")


def range_words(of: Mapping[str, Any]) -> Cell:
    """A range of motion with its error, in grey where some values are such as no joint reaches; None where unknown.
    of: an angle's figures in `range_of_motion`."""
    if "p05_deg" not in of:
        return None
    error = f" ± {of['sd_deg']:.0f}" if "sd_deg" in of else ""
    words = f"{of['p05_deg']:z.0f} to {of['p95_deg']:z.0f}{error}"
    return Soft(words) if of.get("beyond_anatomy_frames") else words
