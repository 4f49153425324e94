"""Whether the verdict follows the error:  pcnet3d lab evaluate verdicts -o DIR

Takes of all kinds of motion, whose images tell up; two in three by keypoints that are worse in unusual postures than
their scores say. By verdict: how many takes are far off, their joints by over 100 mm on average, the body rotated onto
the truth in each frame, in one scale; and p50 / mean / p95 of the takes' errors, mm.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ....pipeline.core.notices import verdict
from ....pipeline.core.rotations import is_finite
from ...common.metrics import rigid_error
from ..common.cases import Row
from ..common.metrics import Figure, person_size
from ..mocap.clips import Clip
from .runs import Configuration, Finished, finished

FAR_MM = 100.0
# How many times larger a detector's errors are in unusual postures, without its scores telling.
_TIMES = (1.0, 3.0, 6.0)


def error_mm(run: Finished) -> float:
    """Mean over frames and joints, the body rotated onto the truth in each frame; NaN of a take without a whole one."""
    found, true = run.done.need("poses").joints.astype(np.float64), run.truth.truth[run.rows]
    whole = is_finite(found).all(axis=1) & is_finite(true).all(axis=1)
    if not whole.any():
        return float("nan")
    found, true = found[whole], true[whole]
    return float(1000 * rigid_error(found * person_size(true) / person_size(found), true).mean())


def rows(asked: Configuration) -> Iterator[Row]:
    """("verdicts", verdict): mm of each take that has one."""
    for number, times in enumerate(_TIMES):

        def has_keypoints(clip: Clip, number: int = number) -> bool:
            return zlib.crc32(clip.name.encode()) % len(_TIMES) == number

        for run in finished(replace(asked, image=True, unsuspected=times), only=has_keypoints):
            if run.take is not None and np.isfinite(mm := error_mm(run)):
                yield ("verdicts", verdict(run.take.judged)), mm


def summary(values: list[float]) -> dict[str, Any]:
    """Of the takes' errors in mm."""
    far = float((np.array(values) > FAR_MM).mean())
    return {"takes": len(values), "far": far, "error": Figure.of(np.array(values))}
