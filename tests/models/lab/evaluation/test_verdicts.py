"""How far off takes are that verdicts are about."""

import numpy as np
import pytest

from golden import jumps as golden
from pcnet3d.models.lab.evaluation.runs import Finished
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.lab.evaluation.verdicts import error_mm
from pcnet3d.models.lab.mocap.clips import Clip
from pcnet3d.pipeline import CAMERA, H36M17, Take


def test_the_error_is_of_the_body_in_its_own_axes_and_one_scale():
    truth = see(Clip("01_jump", "01", "asfamc", 30.0, golden.toe_jump().world.astype(np.float32)), 0)
    poses = truth.keypoints.with_(
        joints=0.5 * truth.truth @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
        layout=H36M17,
        frame=CAMERA.with_(origin="pelvis", unit="arbitrary"),
        confidence=None,
    )
    assert error_mm(Finished(Take("t", poses=poses), truth, "")) == pytest.approx(0, abs=0.1)
    off = poses.joints.copy()
    off[:, H36M17.index("r_wrist")] += (0, 0.5, 0)
    assert 50 < error_mm(Finished(Take("t", poses=poses.with_(joints=off)), truth, "")) < 250
    lost = poses.with_(joints=np.full_like(off, np.nan))
    assert np.isnan(error_mm(Finished(Take("t", poses=lost), truth, "")))
