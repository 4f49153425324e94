"""Whether keypoints have left and right exchanged, by how well the built-in lifter can make a body of either.

In profile nobody sees it in one frame. But the near limbs are larger and lower in the image, and bodies turn: a body
whose sides are exchanged fits its keypoints less well, its bones vary more, and the lifter states a larger error.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL_SPREAD, Camera
from ...pipeline.core.layouts import H36M17, remap
from ...pipeline.core.lifted import ToLift
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.checks import bone_spread
from ...pipeline.signals.visibility import SURE_SCORE, mean_scores
from ..common.residuals import residuals
from ..common.spread import stated_spread
from .builtin import lifted

_ROWS = (30, 1200)  # at least, and the most that are lifted once more
# Logarithms of exchanged over given, weighted by how well they tell validation takes apart. Of 332 sound takes (two
# kinds of cameras) none is below the limit, and 91 % of the same takes with their sides exchanged are.
_WEIGHTS = (0.25, 0.5, 0.25)  # of the distance from the keypoints, the stated error, and the spread of bones
_EXCHANGED = -0.06
# Of the three, that say so: in nearly all of those takes that are told. Where a man leans aside before a camera, the
# spread of bones alone said so, of sides that were right.
_AGREE = 2
# Share of knees, ankles, elbows and wrists that were seen: 0.92 and more in those takes. A trunk alone looks much the
# same from the front and from behind.
_SEEN = 0.75
# And of those of which MoveNet was sure: 0.7 and more in those takes; 0.55 of a small man whose sides were right.
_SURE = 0.65
_OF_LIMBS = H36M17.indices(
    [f"{side}_{part}" for side in "rl" for part in ("knee", "ankle", "elbow", "wrist")]
)


def sides_doubts(asked: ToLift, poses: PoseSequence, model: str | Path = "pcnet3d") -> list[Notice]:
    """A notice where keypoints with left and right exchanged make a better body.

    asked, model: what the lifter was asked, with the image's size; poses: what it answered.
    """
    keypoints = asked.keypoints.rows(0, min(len(asked.keypoints), _ROWS[1]))
    size, layout = asked.image_size, keypoints.layout
    if len(keypoints) < _ROWS[0] or size is None:
        return []
    scores = mean_scores(keypoints, keypoints.frame_index, keypoints.times)
    unsure = scores is not None and (scores[:, _OF_LIMBS] >= SURE_SCORE).mean() < _SURE
    if unsure or is_finite(remap(keypoints, H36M17).joints[:, _OF_LIMBS]).mean() < _SEEN:
        return []
    order = layout.mirror
    exchanged = keypoints.with_(
        joints=keypoints.joints[:, order],
        confidence=None if keypoints.confidence is None else keypoints.confidence[:, order],
    )
    focal = asked.focal_px or float(max(size))
    camera = Camera(size, focal, focal * PRIOR_FOCAL_SPREAD, "told" if asked.focal_px else "prior")
    up = asked.up if asked.up is None or asked.up.ndim == 1 else asked.up[: len(keypoints)]
    other = lifted(replace(asked, keypoints=exchanged, up=up), model).poses
    given = poses.rows(0, len(keypoints))
    with np.errstate(divide="ignore", invalid="ignore"):
        better = np.log(_misfits(other, exchanged, camera)) - np.log(_misfits(given, keypoints, camera))
    if not (np.dot(_WEIGHTS, better) < _EXCHANGED and (better < 0).sum() >= _AGREE):
        return []
    return [
        notice("left-and-right", evidence="with left and right exchanged the keypoints make a better body")
    ]


def _misfits(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> np.ndarray:
    """(3,) distance from the keypoints, stated error, spread of bones; NaN where one is not known."""
    known = [
        values[np.isfinite(values)]
        for values in (residuals(poses, keypoints, camera).whole(), stated_spread(poses))
    ]
    return np.array(
        [*(float(np.median(each)) if len(each) else np.nan for each in known), bone_spread(poses)]
    )
