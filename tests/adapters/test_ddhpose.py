"""DDHPose, D3DP and MixSTE: clips of 243 put together into the video they came from (formats.md 2)."""

import numpy as np
import pytest

from golden.bodies import turning
from golden.lifters import CLIP, in_clips, with_steps_and_proposals
from pcnet3d.adapters import ddhpose, read
from pcnet3d.pipeline import InputError
from refusals import refused


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
