"""The live lifter says what the lifter says of the last frame so far."""

from __future__ import annotations

import numpy as np
import pytest

from golden.lifts import lift
from pcnet3d.models.lifter.live import LiveLifter
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence, remap
from pcnet3d.pipeline.core.layouts import COCO17

SIZE = (640, 360)


@pytest.mark.parametrize("up", [None, np.array([0.28, -0.96, 0.0])])
def test_each_answer_is_the_last_of_a_lift_of_all_so_far(joints_px, up):
    rng = np.random.default_rng(0)
    xy = np.concatenate([joints_px, joints_px[::-1]]) + rng.normal(0, 1, (120, 17, 2)).astype(np.float32)
    score = rng.uniform(0.3, 1, (120, 17)).astype(np.float32)
    xy[40:43] = np.nan
    xy[70, 5] = np.nan
    live = LiveLifter(COCO17, SIZE, up=up)
    answers = [live.update(*frame) for frame in zip(xy, score, strict=True)]
    there = np.isfinite(answers).all(axis=(1, 2))
    assert np.flatnonzero(~there).tolist() == [40, 41, 42]  # without anybody
    for last in (0, 5, 39, 43, 90, 110, 119):
        so_far = PoseSequence(xy[: last + 1], COCO17, IMAGE, confidence=score[: last + 1])
        whole = lift(remap(so_far, H36M17), SIZE, up=up).joints[-1]
        np.testing.assert_allclose(answers[last], whole, atol=2e-5)
