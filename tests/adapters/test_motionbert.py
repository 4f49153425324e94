"""MotionBERT's X3D.npy: clips of 243 whose first root depth is 0, in units of the image (formats.md 2)."""

import numpy as np
import pytest

from golden import lifters
from golden.bodies import turning
from pcnet3d.adapters import read
from pcnet3d.pipeline import InputError
from refusals import refused

FRAMES = 600
RELATIVE = turning(FRAMES)  # (600, 17, 3): the body relative to its pelvis, in MotionBERT's units.


@pytest.fixture
def x3d(save):
    """x3d(change) writes X3D.npy as infer_wild.py does, after change(array), and returns its path."""
    return lambda change=np.copy: save(change(lifters.x3d(RELATIVE)), "X3D.npy")


def as_pixels(joints: np.ndarray, width: int = 1280, height: int = 720) -> np.ndarray:
    """What --pixel does: everything scaled by half the shorter side, x and y moved to the image's corner."""
    joints = joints * (min(width, height) / 2)
    joints[..., :2] += np.array([width, height]) / 2
    return joints


def test_clip_length(x3d):
    assert read(x3d(), clip=200).seams == (200, 400)
    assert read(x3d(), clip=FRAMES).seams == ()
    with pytest.raises(InputError, match="clip"):
        read(x3d(), clip=0)


def test_pixels(x3d):
    path = x3d(as_pixels)
    poses = read(path, pixel=True)
    np.testing.assert_allclose(poses.joints, RELATIVE * 360, atol=1e-3)
    assert poses.frame.unit == "arbitrary"


def test_option_pixel_must_fit_the_values(x3d):
    with refused("wrong-axes", "got values far beyond 2; pass pixel=true"):
        read(x3d(as_pixels))
    with refused("wrong-axes", "got normalised coordinates", "alone"):
        read(x3d(), pixel=True)


def test_person_in_the_middle_of_the_image_is_still_motionbert(x3d):
    """Its root is then as near to 0 as VideoPose3D's; the forced depth of the first frame tells."""
    near = RELATIVE + np.where(np.arange(FRAMES)[:, None, None] % 243, 0.01, [0.01, 0.01, 0])
    assert read(x3d(lambda _: near)).history[0].options["adapter"] == "motionbert"


def test_root_relative_configuration_is_ambiguous(x3d):
    """Exact zeros at the root, and as tall in its units as a person is in metres: nobody can tell."""
    path = x3d(lambda joints: joints - joints[:, :1])
    with pytest.raises(InputError, match=r"ddhpose.*motionbert.*videopose3d"):
        read(path)
    np.testing.assert_allclose(read(path, "motionbert").joints, RELATIVE, atol=1e-6)


def test_root_relative_and_too_small_for_metres_is_motionbert(x3d):
    path = x3d(lambda joints: 0.5 * (joints - joints[:, :1]))
    assert read(path).frame.unit == "arbitrary"


@pytest.mark.data("native")
@pytest.mark.parametrize(("file", "frames"), [("boxing", 301), ("cycling", 434), ("broken", 392)])
def test_real_files(data, file, frames):
    path = data / "native" / "motionbert" / f"{file}_X3D.npy"
    poses = read(path)
    assert poses.history[0].options["adapter"] == "motionbert"
    assert len(poses) == frames
    assert poses.seams == (243,)
    stored = np.load(path)
    np.testing.assert_allclose(poses.joints, stored - stored[:, :1], atol=1e-6)
