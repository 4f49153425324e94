"""BVH as the truth of a comparison."""

import numpy as np
import pytest

from golden.skeleton import bvh
from pcnet3d.stages.study.compare.truth import read_truth


def test_a_t_pose_that_is_left_out_does_not_shift_the_clock(tmp_path):
    frames = np.zeros((40, 16, 3))
    frames[1:, 2] = 5.0
    (tmp_path / "01_01.bvh").write_text(bvh(frames, fps=120))
    poses = read_truth(tmp_path / "01_01.bvh")
    assert poses.times[0] == pytest.approx(10 / 120, rel=1e-4)
    assert len(poses) == 30
    thigh = np.linalg.norm(poses.joint("l_knee") - poses.joint("l_hip"), axis=-1)
    np.testing.assert_allclose(thigh, 0.42, atol=1e-3)
