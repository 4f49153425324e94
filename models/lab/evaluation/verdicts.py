"""Whether the verdict follows the error:  pcnet3d lab evaluate verdicts -o DIR

Takes of all kinds of motion, whose images tell up; two in three by keypoints that are worse in unusual postures than
their scores say. A take is far off where its joints are by over 100 mm on average, the body rotated onto the truth in
each frame, in one scale.
"""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from ....pipeline.core.notices import verdict
from ....pipeline.core.rotations import is_finite
from ....pipeline.core.take import Take
from ...common.metrics import rigid_error
from ..common.metrics import person_size
from ..mocap.clips import Clip
from .lifter import motion_classes
from .runs import Question, finished
from .testbed import SeenTake

FAR_MM = 100.0
# How many times larger a detector's errors are in unusual postures, without its scores telling.
_KEYPOINTS = {
    "as detectors have them": 1.0,
    "3 times the errors, unsuspected": 3.0,
    "6 times the errors, unsuspected": 6.0,
}
_ON_FLOOR, _WALKS = 1 / 3, 1 / 2  # of the frames, from which a take counts as one of these
ABOUT = (
    "By verdict, by kind of motion and by keypoints: how many takes are off by over 100 mm (far), median error and "
    "what nine in ten stay under (p50, p90), mm."
)


def kind_of(truth: SeenTake) -> str:
    """By what the person does for long enough; what is neither on the floor nor a walk is told by its set."""
    motion = motion_classes(truth.world, truth.keypoints.fps)
    if (truth.lying | motion["squatting"]).mean() >= _ON_FLOOR:
        return "floor work, crouching"
    if motion["walking"].mean() >= _WALKS:
        return "walks"
    return "tennis" if truth.source == "arena" else "other: sport, dance, everyday"


def error_mm(take: Take, truth: SeenTake) -> float:
    """Mean over frames and joints, the body rotated onto the truth in each frame; NaN of a take without a whole one."""
    poses = take.need("poses")
    found, true = poses.joints.astype(np.float64), truth.truth[poses.frame_index].astype(np.float64)
    whole = is_finite(found).all(axis=1) & is_finite(true).all(axis=1)
    if not whole.any():
        return float("nan")
    found, true = found[whole], true[whole]
    return float(1000 * rigid_error(found * person_size(true) / person_size(found), true).mean())


def tables(question: Question) -> dict[str, Any]:
    """{"verdicts": {verdict: figures}, "kinds": {kind: ...}, "keypoints": {keypoints: ...}}, figures: {"takes", "far",
    "p50", "p90"}."""
    errors: dict[tuple[str, ...], list[float]] = {}
    for number, (keypoints, times) in enumerate(_KEYPOINTS.items()):
        how = question.how(image=True, unsuspected=times)
        for one in finished(
            question, how, only=lambda clip, number=number: _kind_of_keypoints(clip) == number
        ):
            judged = "unusable" if one.take is None else verdict(one.take.judged)
            mm = float("nan") if one.take is None else error_mm(one.take, one.truth)
            if np.isfinite(mm):
                for of in (("verdicts",), ("kinds", kind_of(one.truth)), ("keypoints", keypoints)):
                    errors.setdefault((*of, judged), []).append(mm)
    results: dict[str, Any] = {**question.heading(), "verdicts": {}, "kinds": {}, "keypoints": {}}
    for (table, *of, judged), every in errors.items():
        rows = results[table]
        for name in of:
            rows = rows.setdefault(name, {})
        rows[judged] = {
            "takes": len(every), "far": float((np.array(every) > FAR_MM).mean()),
            "p50": float(np.median(every)), "p90": float(np.quantile(every, 0.9)),
        }  # fmt: skip
    return results


def _kind_of_keypoints(clip: Clip) -> int:
    return zlib.crc32(clip.name.encode()) % len(_KEYPOINTS)
