"""Poses that were turned for display: D3DP's *_postprocess.npy and its like (formats.md 2.2, 2.4, 2.6)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.lifters import QUATERNION_XYZW, displayed, squatting
from pcnet3d.adapters import read
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.find import adapters

FRAMES = 300
# formats.md 2.2: where the display puts the camera's right, down and forward, to three digits
COLUMNS = np.array([[-0.915, 0.402, 0.026], [0.052, 0.180, -0.982], [-0.399, -0.898, -0.186]]).T


@pytest.fixture
def bodies(turning) -> np.ndarray:
    return squatting(turning(FRAMES))


def test_the_rotation_is_that_of_the_documents():
    np.testing.assert_allclose(Rotation.from_quat(QUATERNION_XYZW).as_matrix(), COLUMNS, atol=1e-3)


@pytest.mark.parametrize("each_frame", [False, True], ids=["file", "each frame"])
def test_golden(save, bodies, each_frame):
    path = save(displayed(bodies, each_frame))
    poses = read(path, fps=25, undo=True)
    np.testing.assert_allclose(poses.joints, bodies, atol=1e-5)
    assert (poses.frame.name, poses.frame.unit, poses.frame.origin) == ("CAMERA", "m", "pelvis")
    assert (poses.frames_known, poses.seams) == (False, ())
    (step,) = [step for step in poses.history if step.name == "undo display"]
    assert step.options["rebase"] == ("each frame" if each_frame else "the file")


def test_d3dp_with_steps_and_proposals(save, bodies):
    """(K, H, T, 17, 3): the last step, the mean of the proposals."""
    around = np.array([-0.02, 0, 0.02])[:, None, None, None] * [1, 0, 0]
    proposals = bodies + around * (np.arange(17) > 0)[:, None]
    path = save(displayed(np.stack([1.1 * proposals, proposals])))
    assert [name for name, each in adapters().items() if each.sniff(path)] == ["display"]
    poses = read(path, undo=True)
    np.testing.assert_allclose(poses.joints, bodies, atol=1e-5)
    assert poses.seams == (243,)


def test_it_has_to_be_asked_for(save, bodies):
    with pytest.raises(InputError, match=r"turned for display.* lowest joint of the file .*undo=true"):
        read(save(displayed(bodies)))


def test_raw_output_is_not_turned(save, bodies):
    path = save(bodies.astype(np.float32) + 0.001)
    assert not adapters()["display"].sniff(path)
    with pytest.raises(InputError, match="adapter videopose3d or ddhpose reads the raw output"):
        read(path, "display", undo=True)
