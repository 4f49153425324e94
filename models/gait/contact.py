"""How likely each foot is on the floor, from how the legs move relative to the pelvis.

A foot on the floor moves back under the body as evenly as the body moves ahead, low and straight. A small network
recognises that in a window of 1.6 s of both legs, in BODY axes and leg lengths. It uses no scale, no place in the room,
no heading and no frame rate, so it also works on a treadmill, with a moving camera, and for a lifter without a place.

contact.json was learned once, by the lab at commit b7136e6e, on 1,567,156 frames of feet of 24
people (CMU's and ACCAD's train subjects), lifted and as captured, their straight walks also in 6 drawn styles;
models/lab/evaluation/gait.py has the rule by which a foot was in contact.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import known_median, norm
from ...pipeline.signals.filters import runs

CONTACT_FILE = Path(__file__).with_name("contact.json")
SIDES = {"right": "r", "left": "l"}
OTHER = {"r": "l", "l": "r"}
_AHEAD_S = (0.033, 0.067, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8)  # of the window, and as far back
_OFFSETS_S = np.array([-s for s in reversed(_AHEAD_S)] + [0.0, *_AHEAD_S])
# To either side: within a stride the length of a lifted leg varies, averaged over two it does not.
_UNIT_S = 1.5
_VALUES = 9  # of a moment: three joints
_MIRROR = np.array([1.0, -1.0, 1.0])  # BODY's y is right


@dataclass(frozen=True, eq=False)
class ContactNet:
    """One hidden layer. centre, scale: (F,) of the features; weights and biases: (F, H), (H,), (H,), scalar."""

    centre: np.ndarray
    scale: np.ndarray
    hidden: np.ndarray
    hidden_bias: np.ndarray
    out: np.ndarray
    out_bias: float

    def probability(self, features: np.ndarray) -> np.ndarray:
        """(N,) of features (N, F); NaN where any is."""
        layer = np.tanh((features - self.centre) / self.scale @ self.hidden + self.hidden_bias)
        return 1 / (1 + np.exp(-(layer @ self.out + self.out_bias)))


@cache
def shipped_net() -> ContactNet:
    """What contact.json holds."""
    content = json.loads(CONTACT_FILE.read_text(encoding="utf-8"))
    arrays = [np.array(content[name]) for name in ("centre", "scale", "hidden", "hidden_bias", "out")]
    return ContactNet(*arrays, out_bias=content["out_bias"])


def contacts(body: np.ndarray, time_s: np.ndarray, seams: tuple[int, ...] = ()) -> dict[str, np.ndarray]:
    """{"r", "l": (T,) probability that this foot is on the floor}; NaN where a leg is missing.

    body: (T, 17, 3) H36M17 in BODY axes, relative to the pelvis, in any unit, through the usual 6 Hz low-pass; time_s:
    (T,). Nothing is taken across a gap or the row of a seam.
    """
    net = shipped_net()
    result = {side: np.full(len(body), np.nan) for side in "rl"}
    for side in result:
        for rows, features in windows(body, time_s, side, seams):
            result[side][rows] = net.probability(features)
    return result


def windows(
    body: np.ndarray, time_s: np.ndarray, side: str, seams: tuple[int, ...] = ()
) -> Iterator[tuple[slice, np.ndarray]]:
    """(N, F) features of one foot in rows that have them, some minutes at a time, for they are 2 KB a frame: both
    ankles and its knee over the window in lengths of a leg, mirrored for the left foot; beyond the ends of an unbroken
    piece its last values are repeated. body, time_s, seams: as those of `contacts`."""
    names = (f"{side}_ankle", f"{OTHER[side]}_ankle", f"{side}_knee")
    mirror = 1 if side == "r" else _MIRROR
    legs = np.concatenate(
        [body[:, H36M17.index(name)].astype(np.float64) * mirror for name in names], axis=-1
    )
    legs /= leg_lengths(body, time_s, seams)[:, None]
    for piece in runs(np.asarray(np.isfinite(legs).all(axis=1)), time_s, seams):
        for part in blocks(piece.stop - piece.start):
            rows = slice(piece.start + part.start, piece.start + part.stop)
            at_s = time_s[rows, None] + _OFFSETS_S
            columns = [np.interp(at_s, time_s[piece], legs[piece, i]) for i in range(_VALUES)]
            yield rows, np.stack(columns, axis=-1).reshape(len(at_s), -1)


def leg_length(joints: np.ndarray) -> float:
    """The median length of thigh and shank together, mean of both legs, in the unit of joints (T, 17, 3); NaN where no
    frame has both legs."""
    return known_median(_legs(joints))


def leg_lengths(joints: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(T,) the same around each moment: the median of the frames within 1.5 s between the same seams, interpolated
    where none of them has both legs. The unit of some estimators grows as the person comes nearer. joints: as of
    `leg_length`; time_s: (T,). NaN between seams where no frame has both legs."""
    both = _legs(joints)
    result = np.full(len(both), np.nan)
    for start, stop in pairwise([0, *seams, len(both)]):
        rows = start + np.flatnonzero(np.isfinite(both[start:stop]))
        if not len(rows):
            continue
        visible_s, length = time_s[rows], both[rows]
        count = int(np.ceil(np.ptp(visible_s) / _UNIT_S))
        step_s = np.ptp(visible_s) / max(count, 1)
        # Only the points of an even grid that lie beside rows: a gap in the times may last for years.
        beside = np.unique(np.floor((visible_s - visible_s[0]) / max(step_s, 1e-9))[:, None] + [-1, 0, 1, 2])
        at_s = visible_s[0] + step_s * beside[(beside >= 0) & (beside <= count)]
        spans = np.searchsorted(visible_s, [at_s - _UNIT_S, at_s + _UNIT_S], side="right")
        filled = spans[0] < spans[1]
        medians = [np.median(length[slice(*span)]) for span in spans.T[filled]]
        result[start:stop] = np.interp(time_s[start:stop], at_s[filled], medians)
    return result


def _legs(joints: np.ndarray) -> np.ndarray:
    """(T,) the length of thigh and shank together, mean of both legs."""
    bones = [(f"{side}_{a}", f"{side}_{b}") for side in "rl" for a, b in pairwise(("hip", "knee", "ankle"))]
    lengths = [norm(joints[:, H36M17.index(b)] - joints[:, H36M17.index(a)]) for a, b in bones]
    return np.sum(lengths, axis=0) / 2
