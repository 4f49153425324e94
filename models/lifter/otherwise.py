"""Whether keypoints are what they are taken for, by how well the built-in lifter can make a body of them otherwise.

In profile nobody sees in one frame that left and right are exchanged. But the near limbs are larger and lower in the
image, and bodies turn: a body whose sides or joints are exchanged, or that an image makes wider than it is, fits its
keypoints less well, its bones vary more, and the lifter states a larger error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL_SPREAD, Camera
from ...pipeline.core.conversions import remap
from ...pipeline.core.layouts import ARM, H36M17, LEG
from ...pipeline.core.lifted import ToLift
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.checks import bone_spread
from ...pipeline.signals.visibility import SURE_SCORE, mean_scores
from ..common.residuals import residuals, stated_spread
from .builtin import lifted

_ROWS = (36, 160)  # at least, and the most that are lifted once more
# Logarithms of otherwise over given, weighted by how well they tell validation takes apart.
_WEIGHTS = (0.25, 0.5, 0.25)  # of the distance from the keypoints, the stated error, and the spread of bones
# Of the three, that say so: in nearly all takes that are told. Where a man leans aside before a camera, the spread of
# bones alone said so, of sides that were right.
_AGREE = 2
# Share of knees, ankles, elbows and wrists that were seen: 0.92 and more in validation takes. A trunk alone looks much
# the same from the front and from behind.
_SEEN = 0.75
# And of those of which MoveNet was sure: 0.7 and more in those takes; 0.55 of a small man whose sides were right.
_SURE = 0.65
_OF_LIMBS = H36M17.indices(
    [f"{side}_{part}" for side in "rl" for part in ("knee", "ankle", "elbow", "wrist")]
)
_NARROWER = 0.75  # of the width; from 16 to 9 to 4 to 3


def _exchanged(asked: ToLift, parts: tuple[str, ...]) -> ToLift:
    """Left and right of these joints exchanged, of all where there are none."""
    keypoints, layout = asked.keypoints, asked.keypoints.layout
    order = np.arange(len(layout))
    rows = layout.indices([name for name in layout.joints if not parts or name[2:] in parts])
    order[rows] = layout.mirror[rows]
    confidence = keypoints.confidence[:, order]
    return replace(asked, keypoints=keypoints.with_(joints=keypoints.joints[:, order], confidence=confidence))


def _narrower(asked: ToLift) -> ToLift:
    """The image less wide, and its keypoints with it."""
    assert asked.image_size is not None
    width, height = asked.image_size
    joints = asked.keypoints.joints * np.array([_NARROWER, 1.0], np.float32)
    size = (round(width * _NARROWER), height)
    return replace(asked, keypoints=asked.keypoints.with_(joints=joints), image_size=size)


# Of 222 sound takes (two kinds of cameras), and 160 of 36 to 90 rows, none is better by more than 0.05 with joints
# exchanged, and nine in ten of the same takes with these exchanged are by more than 0.08, or 0.12 with some of them.
# Narrower none is better by more than 0.113. Of 150 takes of test people, who kick and lie, three were better by 0.064,
# 0.067 and, in 45 rows, 0.31 with joints exchanged, and two in a narrower image, at closer limits, for which these are
# wider now. Higher images, a longer focal length and a clip that runs backwards are as good.
_PARTS = {
    "": (), " legs": LEG, " arms": ARM, **{f" {part}s": (part,) for part in (*LEG, *ARM)},
}  # fmt: skip


def _readings(asked: ToLift) -> Iterator[tuple[ToLift, float, float, Notice]]:
    """Other readings of the keypoints: what is asked then; the weighted logarithm, and that of the stated error, below
    which it makes a better body; what is said then."""
    for whose, parts in _PARTS.items():
        evidence = f"with left and right{whose} exchanged the keypoints make a better body"
        said = notice("left-and-right", evidence=evidence)
        yield _exchanged(asked, parts), -0.12 if parts else -0.08, np.inf, said
    yield _narrower(asked), -0.15, -0.07, notice("image-stretched", times=1 / _NARROWER)


def otherwise_better(asked: ToLift, poses: PoseSequence, model: str | Path = "pcnet3d") -> list[Notice]:
    """A notice where another reading of the keypoints makes a better body: the one that makes the best.

    asked, model: what the lifter was asked, with the image's size; poses: what it answered.
    """
    first = max(len(asked.keypoints) - _ROWS[1], 0) // 2
    keypoints = asked.keypoints.rows(first, min(first + _ROWS[1], len(asked.keypoints)))
    if len(keypoints) < _ROWS[0] or asked.image_size is None:
        return []
    scores = mean_scores(keypoints, keypoints.frame_index, keypoints.times)
    unsure = scores is not None and (scores[:, _OF_LIMBS] >= SURE_SCORE).mean() < _SURE
    if unsure or is_finite(remap(keypoints, H36M17).joints[:, _OF_LIMBS]).mean() < _SEEN:
        return []
    up = asked.up
    up = up if up is None or up.ndim == 1 else up[first : first + len(keypoints)]
    asked = replace(asked, keypoints=keypoints, up=up)
    given = _misfits(asked, poses.rows(first, first + len(keypoints)))
    best: tuple[float, list[Notice]] = (0.0, [])
    for changed, least_better, least_surer, said in _readings(asked):
        with np.errstate(divide="ignore", invalid="ignore"):
            better = np.log(_misfits(changed, lifted(changed, model).poses)) - np.log(given)
        weighted = float(np.dot(_WEIGHTS, better))
        told = better[1] < least_surer and (better < 0).sum() >= _AGREE
        if told and weighted < min(least_better, best[0]):
            best = weighted, [said]
    return best[1]


def _misfits(asked: ToLift, poses: PoseSequence) -> np.ndarray:
    """(3,) distance from the keypoints, stated error, spread of bones; NaN where one is not known."""
    assert asked.image_size is not None
    focal = asked.focal_px or float(max(asked.image_size))
    source = "told" if asked.focal_px else "prior"
    camera = Camera(asked.image_size, focal, focal * PRIOR_FOCAL_SPREAD, source)
    known = [
        values[np.isfinite(values)]
        for values in (residuals(poses, asked.keypoints, camera).whole(), stated_spread(poses))
    ]
    return np.array(
        [*(float(np.median(each)) if len(each) else np.nan for each in known), bone_spread(poses)]
    )
