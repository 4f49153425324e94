"""Whether a movement was seen, was not there, cannot be told, or was not looked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...pipeline.core.measures import CANNOT_BE_TOLD, NONE, NOT_LOOKED_FOR, SEEN, Measure, Remark, Row
from ...pipeline.core.notices import Notice, grave
from ...pipeline.signals.rates import against_rate
from ...pipeline.signals.swaps import left_exchanged

# Seconds of the briefest movement that the program recognises: of knee bends and raised arms the briefest of the
# labelled takes (models/lab/evaluation/movements.json), three steps at 120 a minute (Perry & Burnfield 2010) and a
# flight of 0.2 s with a landing of 0.3 s beside it.
BRIEFEST_S = {"walking": 1.5, "knee_bends": 0.8, "arm_raises": 1.6, "jumps": 0.5}

# Notices that leave open which way the body is turned: lifters and the measures of a movement expect people upright.
_TURNED = {
    "nobody-upright": "the image may be turned",
    "on-its-side": "another axis of the file may be up",
    "picture-upside-down": "the image may be upside down",
    "upside-down": "the vertical axis of the file may be upside down",
}


_BASIS = ("frames", "nan_share")  # stages/measures/figures.py
_BY_TIME = ("walking", "jumps")  # how long it takes, how fast
UNSURE = 0.5  # of the frames, in which the detector is unsure of a limb: the others do not show what it does
# The joints of a side that show each, and whether it takes both sides: one that is seen to do nothing is enough then.
_SHOWN_BY = {
    "walking": (("knee", "ankle"), True),
    "knee_bends": (("knee", "ankle"), True),
    "arm_raises": (("elbow",), False),
    "jumps": (("knee", "ankle"), True),
}


@dataclass(frozen=True)
class Doubts:
    """In words, "" where there is no doubt: which way the body is turned, how fast it moves, which leg is which; of
    each movement, where there is a doubt, whether the limbs are where they seem to be; and that all images of the
    person are one picture."""

    turned: str = ""
    paced: str = ""
    legs: str = ""
    limbs: Mapping[str, str] = field(default_factory=dict)
    still: str = ""


NO_DOUBTS = Doubts()


def doubts_of(said: Iterable[Notice], unsure: Mapping[str, np.ndarray]) -> Doubts:
    """What notices leave open, and joints of which the detector is unsure, each (T,) of
    signals.reprojection.unsure_joints. Of turned bodies those of suspicious or unusable poses count."""
    said = tuple(said)
    exchanged = any(limb == "leg" for limb, *_ in left_exchanged(said))
    return Doubts(
        next((_TURNED[each.code] for each in grave(said) if each.code in _TURNED), ""),
        "the frame rate may be wrong" * bool(against_rate(said)),
        "the legs look exchanged at times" * exchanged,
        _limbs(unsure),
        "all images of the person are the same" * any(each.code == "image-still" for each in said),
    )


def _limbs(unsure: Mapping[str, np.ndarray]) -> dict[str, str]:
    limbs = {}
    for movement, (joints, both) in _SHOWN_BY.items() if unsure else ():
        sides = [np.any([unsure[f"{side}_{joint}"] for joint in joints], axis=0).mean() for side in "rl"]
        if (share := (min if both else max)(sides)) > UNSURE:
            limb = "the legs" if both else "an arm"
            limbs[movement] = f"the detector is unsure of {limb} in {100 * share:.0f} % of the frames"
    return limbs


def with_outcome(
    movement: str,
    rows: Sequence[Row],
    lasts_s: float,
    looked: bool = True,
    doubt: Doubts = NO_DOUBTS,
) -> list[Row]:
    """The rows of a movement with the remark `outcome` in front of them, a code of pipeline/core/measures.py. lasts_s:
    the take's length, in one shorter than the movement a count of 0 does not say that there was none. looked: False
    where something is lacking without which nobody can look for it. doubt: of `doubts_of`, with which a count of 0
    says as little.

    A count of 0 says that there was none, unless its `reason` says where one may be hidden. A hold is seen too. Of legs
    that look exchanged there may be more steps than were counted.
    """
    rows = list(rows)
    counts = [row for row in rows if isinstance(row, Measure) and row.name in ("count", "steps")]
    hidden = any(isinstance(row, Remark) and row.name == "reason" for row in rows)
    of_pace, of_legs = doubt.paced * (movement in _BY_TIME), doubt.legs * (movement == "walking")
    why = doubt.still or doubt.turned or (of_pace or of_legs or doubt.limbs.get(movement, "")) * (not hidden)
    seen = any(row.value for row in counts) and not doubt.still
    too_short = lasts_s < BRIEFEST_S[movement]
    looked = looked or not lasts_s  # of a single frame that is reason enough
    if looked and not seen and (too_short or why):
        short = "the take is too short" if lasts_s else "a single frame shows no movement"
        rows = [row for row in rows if isinstance(row, Measure) and row.name in _BASIS]
        rows = [*rows, Remark("reason", short if too_short else why)]
        hidden = True
    if seen:
        code = SEEN
        told = any(isinstance(row, Remark) and row.name == "count_reason" for row in rows)
        rows += [Remark("count_reason", of_legs)] if of_legs and not told else []
    elif not looked:
        code = NOT_LOOKED_FOR
    else:
        code = NONE if counts and not hidden else CANNOT_BE_TOLD
    return [Remark("outcome", code), *rows]
