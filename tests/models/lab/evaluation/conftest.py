"""The walker as captured, after a run."""

import pytest

from golden.virtual import walked
from golden.walks import GEOMETRIC, measured
from pcnet3d.models.lab.beds import Finished, see
from pcnet3d.pipeline import CAMERA
from pcnet3d.pipeline.core.pose import MadeBy


@pytest.fixture(scope="package")
def captured_walk():
    seen = see(walked("walker", seconds=8, turn_deg=0), 0)
    poses = seen.keypoints.with_(
        joints=seen.truth, frame=CAMERA, confidence=None, made_by=MadeBy("measured", "motion capture")
    )
    return Finished(measured(poses, GEOMETRIC), seen, "here")
