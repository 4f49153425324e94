"""Names and figures of the data in words, as every page has them."""

from __future__ import annotations

from ...pipeline.core.measures import Group, measure, value
from ...pipeline.core.take import AngleErrors
from .page import Cell, Soft

ERRORS_OF_ANGLES: dict[AngleErrors, str] = {
    "judged": "as measured for the built-in lifter",
    "disagreement": "from disagreement with the built-in lifter",
    "file": "from the given file",
    "none": "not known",
}


_PLAINLY = {
    "root": "pelvis",  # whose path it is
    "thorax_pelvis_rotation": "turn of the chest against the pelvis",
    "thigh_trunk_flexion": "thigh against trunk",
    "trunk_lean_sagittal": "trunk lean forward",
    "trunk_lean_frontal": "trunk lean to the side",
    **{
        f"{part}_{plane}": f"{part.replace('_', ' ')} {way}"
        for part in ("thigh", "shank", "upper_arm")
        for plane, way in (("sagittal", "forward"), ("frontal", "to the side"))
    },
}


def errors_of_angles(how: AngleErrors | None) -> str:
    """A sentence: the source of the errors of a take's angles and what is made from them; empty without angles."""
    words = "Errors of angles, and of ranges, repetitions and symmetry with them"
    return "" if how is None else f"{words}: {ERRORS_OF_ANGLES[how]}."


def spoken(name: str) -> str:
    """A name of the data in words: `r_knee_flexion` is "right knee flexion"."""
    side = {"r_": "right ", "l_": "left "}.get(name[:2], "")
    plain = name[2:] if side else name
    return side + _PLAINLY.get(plain, plain.replace("_", " "))


def range_words(of: Group) -> Cell:
    """A range of motion with the wider 90 % bar of its ends, broken before ± at most, in grey where some values
    are such as no joint reaches; None where unknown. of: an angle's figures in `range_of_motion`."""
    low, high = (measure(of, name) for name in ("p05", "p95"))
    if low is None or high is None:
        return None
    bars = [end.bar for end in (low, high) if end.bar is not None]
    ends = f"{low.value:z.0f} to {high.value:z.0f}".replace(" ", "\u00a0")
    words = f"{ends} ±\u00a0{max(bars):.0f}" if bars else ends
    return Soft(words) if value(of, "beyond_anatomy_frames") else words
