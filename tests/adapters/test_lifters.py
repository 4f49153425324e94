"""Arrays of lifters: MotionBERT's clips of 243 whose first root depth is 0, VideoPose3D's and its kin's metres, and the
clips of DDHPose, D3DP and MixSTE put together into the video they came from (formats.md 2)."""

import numpy as np
import pytest

from golden import lifters
from golden.bodies import turning
from golden.lifters import CLIP, in_clips, with_steps_and_proposals
from pcnet3d.adapters import ddhpose, read, videopose3d
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
def test_real_files_of_motionbert(data, file, frames):
    path = data / "native" / "motionbert" / f"{file}_X3D.npy"
    poses = read(path)
    assert poses.history[0].options["adapter"] == "motionbert"
    assert len(poses) == frames
    assert poses.seams == (243,)
    stored = np.load(path)
    np.testing.assert_allclose(poses.joints, stored - stored[:, :1], atol=1e-6)


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
    assert read(export(), clip=243).seams == (243, 486)
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
def test_real_files_of_mhformer(data, inside):
    folder = data / "native" / "mhformer" / "skating"
    poses = read(folder / inside, gives="poses")
    assert poses.history[0].options["adapter"] == "videopose3d"
    with np.load(folder / "output_3D" / "output_keypoints_3d.npz") as stored:
        np.testing.assert_array_equal(poses.joints, stored["reconstruction"])
    assert not videopose3d.sniff(folder / "input_2D" / "keypoints.npz")


def seams(frames: int) -> tuple[int, ...]:
    return tuple(range(CLIP, frames, CLIP))


@pytest.mark.parametrize(
    ("frames", "steps", "proposals"),
    [
        *((frames, 0, 0) for frames in (600, 486, 487, 485, 244, 243, 100, 1)),
        *((frames, *stack) for frames in (600, 100) for stack in ((1, 1), (3, 1), (1, 5), (2, 5))),
    ],
)
def test_clips_become_the_video_they_came_from(save, frames, steps, proposals):
    clips = in_clips(turning(frames))
    if steps:
        stack = with_steps_and_proposals(turning(frames), steps, proposals)
        clips = np.moveaxis(in_clips(np.moveaxis(stack, 2, 0)), 1, 3)
        assert clips.shape == (len(clips), steps, proposals, CLIP, 17, 3)
    poses = read(save(clips), frames=frames)
    assert poses.history[0].options["adapter"] == "ddhpose"
    np.testing.assert_allclose(poses.joints, turning(frames), atol=1e-6)
    assert poses.seams == seams(frames)


@pytest.mark.parametrize("frames", [600, 100])
def test_steps_and_proposals_of_the_whole_video(save, frames):
    """D3DP's in-the-wild output (K, H, T, 17, 3)."""
    path = save(with_steps_and_proposals(turning(frames), 2, 5))
    poses = read(path)
    assert poses.history[0].options["adapter"] == "ddhpose"
    np.testing.assert_allclose(poses.joints, turning(frames), atol=1e-6)
    assert poses.seams == seams(frames)
    assert len(read(path, frames=frames)) == frames
    with pytest.raises(InputError, match=f"expected {frames + 1} frames"):
        read(path, frames=frames + 1)


@pytest.mark.parametrize("frames", [600, 243])
def test_clips_need_the_number_of_frames(save, frames):
    with pytest.raises(InputError, match="frames=N"):
        read(save(in_clips(turning(frames))))


@pytest.mark.parametrize("wrong", [0, 486, 730])
def test_number_of_frames_must_fit_the_clips(save, wrong):
    with pytest.raises(InputError, match=f"487 to 729 frames, got the option frames={wrong}"):
        read(save(in_clips(turning(600))), frames=wrong)


def test_squeezed_axis_is_not_guessed(save):
    """(2, 5, 243, 17, 3): two steps of one clip, or two clips that lost their single step."""
    path = save(with_steps_and_proposals(turning(243), 2, 5))
    with pytest.raises(InputError, match="squeeze"):
        read(path)
    np.testing.assert_allclose(read(path, frames=243).joints, turning(243), atol=1e-6)
    with pytest.raises(InputError, match="squeeze"):
        read(path, frames=486)


def test_axis_of_length_1_was_not_squeezed(save):
    path = save(with_steps_and_proposals(turning(243), 1, 5))
    np.testing.assert_allclose(read(path).joints, turning(243), atol=1e-6)


def test_values_at_the_clamp_are_counted(save):
    video = turning(300)
    video[10, 13], video[299, 16, 1] = [1.1, -0.2, -1.1], 1.1
    steps = {step.name: step.options for step in read(save(video), "ddhpose").history}
    assert steps["clamped"]["values"] == 3
    steps = {step.name for step in read(save(turning(300)), "ddhpose").history}
    assert "clamped" not in steps


def test_heights_rebased_for_display_are_refused(save):
    path = save(with_steps_and_proposals(turning(300), 2, 5) + np.array([0, 0, 0.9]))
    assert not ddhpose.sniff(path)
    with refused("wrong-axes"):
        read(path, "ddhpose")


def test_nan_in_one_proposal_spoils_the_mean(save):
    stack = with_steps_and_proposals(turning(300), 2, 5)
    stack[-1, 3, 20, 5] = np.nan
    poses = read(save(stack))
    assert [each.code for each in poses.notices] == ["frames-as-gaps"]
    assert np.flatnonzero(np.isnan(poses.joints).any(axis=(1, 2))).tolist() == [20]
