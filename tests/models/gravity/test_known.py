"""What of a moving camera's up a lift may rest on: all of a stretch between two clip boundaries, or nothing."""

from collections.abc import Iterable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.gravity import levelling, moving
from pcnet3d.models.gravity.levelling import known_up
from pcnet3d.models.gravity.moving import known_moving_up, timed
from pcnet3d.models.gravity.votes import USUAL_SPREAD
from pcnet3d.pipeline import PoseSequence
from pcnet3d.pipeline.core.camera import Look
from pcnet3d.pipeline.core.rotations import angle_deg, rotate

GEOMETRIC = load_rectifier("geometric")


@pytest.fixture(scope="module")
def turning() -> tuple[PoseSequence, np.ndarray]:
    """The walker, (T, 17, 3), before a camera that rolls by 30 degrees meanwhile, and its up (T, 3)."""
    walk = walker(seconds=4)
    camera = side_camera(walk)
    poses = camera_poses(walk, camera)
    R = Rotation.from_euler("z", np.linspace(-15, 15, len(poses))[:, None], degrees=True).as_matrix()
    return poses.with_(joints=rotate(R, poses.joints.astype(float))), R @ camera.up


# How often lines are quite wrong: good ones, and those on one plane alone.
GOOD, FLAT = 0.004, 0.15


def looks(up: np.ndarray, frames: Iterable[int], failure: float = GOOD) -> list[Look]:
    """What images say at these frames of a camera's up (T, 3)."""
    return [Look(frame, up[frame], np.radians(0.5) ** 2 * np.eye(3), failure) for frame in frames]


def test_known_for_most_of_a_take_it_is_told_throughout_else_nowhere(turning):
    """Told in some frames only, lifted joints jump where that begins."""
    poses, up = turning
    count = len(poses)
    most = known_moving_up(poses, GEOMETRIC, looks(up, range(0, 3 * count // 4, 10)))
    assert np.isfinite(most).all()
    assert known_moving_up(poses, GEOMETRIC, looks(up, range(0, count // 4, 10))) is None


def test_no_clip_is_told_what_another_one_knows(turning):
    poses, up = turning
    cut = len(poses) // 2
    known = known_moving_up(poses.with_(seams=(cut,)), GEOMETRIC, looks(up, range(cut + 5, len(poses), 10)))
    np.testing.assert_array_equal(np.isfinite(known).all(axis=1), np.arange(len(poses)) >= cut)


def test_images_that_the_skeletons_contradict_are_not_believed(turning):
    """A pattern of diagonal lines looks like a camera that is rolled by 45 degrees."""
    poses, up = turning
    c = np.sqrt(0.5)
    diagonal = up @ np.array([[c, -c, 0], [c, c, 0], [0, 0, 1.0]]).T
    assert known_moving_up(poses, GEOMETRIC, looks(diagonal, range(0, len(poses), 10), FLAT)) is None


class Sure:
    """A rectifier with which the skeletons' own up is known better than a lift needs."""

    method = "sure"

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R, error_deg = GEOMETRIC.rotation(joints)
        return R, np.full(len(error_deg), 3.0)


def test_what_surer_skeletons_say_is_not_known_from_elsewhere(turning, monkeypatch):
    """A diagonal pattern that they contradict, and an image that was looked at a moment only."""
    for module in (levelling, moving):
        monkeypatch.setattr(module, "stated_spread", lambda poses: np.full(len(poses), USUAL_SPREAD))
    poses, up = turning
    still = poses.with_(joints=np.repeat(poses.joints[:1], len(poses), axis=0))
    diagonal = Rotation.from_rotvec([0, 0, np.pi / 5]).apply(up)
    throughout = [*range(0, len(poses), 10), len(poses) - 1]
    for shown, frames, failure in ((diagonal, throughout, FLAT), (up, [0], GOOD)):
        assert known_moving_up(poses, Sure(), looks(shown, frames, failure)) is None
    assert known_up(still, Sure(), look=looks(diagonal, [0], FLAT)[0]) is None
    assert np.max(angle_deg(known_up(still, Sure(), look=looks(up, [0])[0]), up[0])) < 1.0
    assert np.max(angle_deg(known_moving_up(poses, Sure(), looks(up, throughout)), up)) < 1.0


def test_images_from_before_and_after_a_person_say_nothing_about_their_frames(turning):
    """Of several people everybody's images are looked at, while one may be there for a part only."""
    poses, up = turning
    rows = slice(40, 80)
    part = PoseSequence(
        poses.joints[rows],
        poses.layout,
        poses.frame,
        time_s=poses.times[rows],
        frame_index=poses.frame_index[rows],
    )
    all_along = looks(up, range(0, len(poses), 10))
    assert [look.frame for _, look in timed(all_along, part)] == [40, 50, 60, 70]
    known = known_moving_up(part, GEOMETRIC, all_along)
    assert np.max(angle_deg(known, up[rows])) < 3.0
