"""Names and figures of the data in words, as every page has them."""

from __future__ import annotations

from ...pipeline.core.measures import Measures
from ...pipeline.core.take import AngleErrors
from .page import Cell, Soft

ERRORS_OF_ANGLES: dict[AngleErrors, str] = {
    "judged": "as measured for the built-in lifter",
    "disagreement": "from disagreement with the built-in lifter",
    "file": "from the given file",
    "none": "not known",
}


def errors_of_angles(how: AngleErrors | None) -> str:
    """A sentence: the source of the errors of a take's angles and what is made from them; empty without angles."""
    words = "Errors of angles, and of ranges, repetitions and symmetry with them"
    return "" if how is None else f"{words}: {ERRORS_OF_ANGLES[how]}."


def range_words(of: Measures) -> Cell:
    """A range of motion with the wider 90 % bar of its ends, broken before ± at most, in grey where some values
    are such as no joint reaches; None where unknown. of: an angle's figures in `range_of_motion`."""
    low, high = (of.figure(name) for name in ("p05", "p95"))
    if low is None or high is None:
        return None
    bars = [end.bar for end in (low, high) if end.bar is not None]
    ends = f"{low.value:z.0f} to {high.value:z.0f}".replace(" ", "\u00a0")
    words = f"{ends} ±\u00a0{max(bars):.0f}" if bars else ends
    return Soft(words) if of.value("beyond_anatomy_frames") else words
