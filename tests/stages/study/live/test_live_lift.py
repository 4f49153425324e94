"""The live lifter takes keypoints as a detector gives them."""

import numpy as np

from golden.lifts import lift
from pcnet3d.models.lifter.builtin import LiveLifter
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence, remap
from pcnet3d.pipeline.core.layouts import COCO17

SIZE = (640, 360)


def test_joints_of_a_detector_without_a_clock_are_lifted_and_nobody_is_no_pose(joints_px):
    xy, score = joints_px.copy(), np.full(joints_px.shape[:2], 0.9)
    xy[40:43] = np.nan
    xy[50, 5] = np.nan
    live = LiveLifter(COCO17, SIZE)
    answers = [live.update(*frame) for frame in zip(xy, score, strict=True)]
    assert np.flatnonzero(np.isnan(answers).all(axis=(1, 2))).tolist() == [40, 41, 42]
    seen = remap(PoseSequence(xy, COCO17, IMAGE, confidence=score), H36M17)
    np.testing.assert_allclose(answers[-1], lift(seen, SIZE).joints[-1], atol=2e-5)
