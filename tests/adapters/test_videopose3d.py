"""VideoPose3D and its kin: metres in camera axes, as .npy, .npz or a vis.py folder (formats.md 2)."""

import numpy as np
import pytest

from golden import lifters
from golden.bodies import turning
from pcnet3d.adapters import read, videopose3d
from pcnet3d.pipeline import InputError

FRAMES = 300
RELATIVE = turning(FRAMES)


@pytest.fixture
def export(save):
    """export(change) writes what run.py --viz-export saves: the pelvis near 0, but not at it."""
    return lambda change=np.copy: save(change(lifters.viz_export(RELATIVE)))


def test_keypoints_beside_are_not_taken_for_poses(tmp_path):
    path = lifters.vis_folder(tmp_path, RELATIVE) / "input_2D" / "keypoints.npz"
    assert not videopose3d.sniff(path)
    with pytest.raises(InputError, match="expected an array of shape"):
        read(path, "videopose3d")
    # MotionAGFormer saves (people, frames, 17, 3) pixels and score under the same key.
    np.savez(path, reconstruction=np.full((1, FRAMES, 17, 3), 300.0))
    assert not videopose3d.sniff(path)


def test_clip_boundaries_of_a_lifter_that_works_in_clips(export):
    assert read(export(), clip=243).seams == (243,)
    with pytest.raises(InputError, match="clip"):
        read(export(), clip=0)


def test_with_trajectory(export):
    """VideoPose3D adds the trajectory when it has a model for it: the person is then somewhere before the camera."""
    path = export(lambda joints: joints + np.array([0.5, 0.2, 4.0]))
    np.testing.assert_allclose(read(path, "videopose3d").joints, RELATIVE, atol=1e-5)


def test_display_coordinates_are_refused(export):
    """After camera_to_world and rebasing the heights, which assume the tilt of one camera."""
    path = export(lambda _: lifters.displayed(RELATIVE))
    assert not videopose3d.sniff(path)
    with pytest.raises(InputError, match="made for display"):
        read(path, "videopose3d")


@pytest.mark.parametrize("value", [np.nan, 0.0], ids=["NaN", "zeros"])
def test_no_pose_at_all(export, value):
    with pytest.raises(InputError, match="there are no poses in it"):
        read(export(lambda joints: np.full_like(joints, value)), "videopose3d")


@pytest.mark.data("native")
@pytest.mark.parametrize("inside", [".", "output_3D/output_keypoints_3d.npz"], ids=["folder", "file"])
def test_real_files(data, inside):
    folder = data / "native" / "mhformer" / "skating"
    poses = read(folder / inside, gives="poses")
    assert poses.history[0].options["adapter"] == "videopose3d"
    with np.load(folder / "output_3D" / "output_keypoints_3d.npz") as stored:
        np.testing.assert_array_equal(poses.joints, stored["reconstruction"])
    assert not videopose3d.sniff(folder / "input_2D" / "keypoints.npz")
