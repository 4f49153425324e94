"""One frame at a time: the take's answer in the end, an honest error on the way, and nothing taken back."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden import levelled, ups
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.common.metrics import relative
from pcnet3d.models.gravity.evidence import direction
from pcnet3d.models.gravity.levelling import HEADING_S, level_static
from pcnet3d.models.gravity.live import KEPT, LiveRectifier
from pcnet3d.models.gravity.votes import LEAN_DEG, OWN_LEAN_DEG, TILT_SHARE, PersonFrames
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg

UP = np.array([0.0, -1.0, 0.0])
# R_camera_from_world, +z of the world up.
LEVEL_CAMERA = Rotation.from_euler("x", 90, degrees=True).as_matrix()
POSE = np.random.default_rng(0).normal(size=(17, 3))


class Scripted:
    """A rectifier whose answers are known: the rotations one after the other, whatever it is shown."""

    method = "scripted"

    def __init__(self, R, error_deg=6.0):
        self.R, self.error_deg, self.row = np.asarray(R), error_deg, 0

    def rotation(self, joints):
        assert joints.shape == (1, 17, 3)
        self.row += 1
        return self.R[[self.row - 1]], np.array([self.error_deg])


def answers(live, joints, time_s) -> list:
    return [live.update(frame, float(t)) for frame, t in zip(joints, time_s, strict=True)]


def stated_deg(votes_deg) -> float:
    """What is stated of an up without pitch, of votes that ask for an error of votes_deg."""
    return float(np.hypot(*ups.stated_deg(UP, votes_deg)))


def scripted(R, error_deg=6.0, fps=30, others=()) -> list:
    live = LiveRectifier(Scripted(R, error_deg), others)
    return answers(live, [POSE] * len(R), np.arange(len(R)) / fps)


def headed(heading_deg) -> np.ndarray:
    """Upright before a camera that stands straight."""
    return LEVEL_CAMERA @ levelled.headed(heading_deg)


def heading_deg(frames) -> np.ndarray:
    return levelled.heading_deg(LEVEL_CAMERA.T @ [frame.R_camera_from_body for frame in frames])


def jittering(count, scatter_deg, seed=0) -> np.ndarray:
    """Upright, and tilted by as much in each of two directions, frame by frame."""
    tilt = np.random.default_rng(seed).normal(scale=np.radians(scatter_deg) / np.sqrt(2), size=(count, 3))
    return LEVEL_CAMERA @ Rotation.from_rotvec(tilt * [1, 1, 0]).as_matrix()


@pytest.mark.parametrize(("fps", "name"), [(30, "pcnet"), (30, "geometric"), (120, "geometric")])
def test_at_the_end_it_says_what_the_whole_take_says(fps, name):
    """With 120 frames a second more votes than are kept. What came last may not be pooled yet."""
    walk = walker(fps=fps, seconds=5)
    joints = relative(camera_poses(walk, side_camera(walk)).joints.astype(float))
    rectifier = load_rectifier(name)
    frames = answers(LiveRectifier(rectifier), joints, walk.time_s)
    static = level_static(PersonFrames(joints, *rectifier.rotation(joints), walk.time_s))
    assert angle_deg(frames[-1].up, static.R_camera_from_level[:, 2]) < 0.05 * static.up_error_deg[0]
    assert frames[-1].up_error_deg == pytest.approx(static.up_error_deg[0], rel=0.05)
    assert geodesic_deg(frames[-1].R_camera_from_body, static.R_camera_from_body[-1]) < 1


def test_the_error_is_wide_at_first_and_shrinks_as_votes_come_in():
    frames = scripted(jittering(300, 10), error_deg=12, fps=3)
    stated = np.array([frame.up_error_deg for frame in frames])
    assert stated[0] == pytest.approx(stated_deg(TILT_SHARE * 12), rel=0.01)
    assert stated[20] < 0.8 * stated[0]
    assert stated_deg(LEAN_DEG) < stated[-1]
    of_votes = np.sqrt(stated**2 - OWN_LEAN_DEG**2)  # a person's own lean stays
    assert of_votes[-1] < 0.5 * of_votes[0]
    true = np.array([angle_deg(frame.up, UP) for frame in frames])
    assert np.mean(true < [frame.up_bound_deg for frame in frames]) > 0.9
    assert true[-50:].max() < 1
    assert frames[-1].error_deg < frames[0].error_deg


def test_a_frame_without_a_torso_is_nan_and_up_stays():
    walk = walker(seconds=2)
    joints = camera_poses(walk, side_camera(walk)).joints[:20].copy()
    joints[10:12, H36M17.indices(("l_hip", "r_hip"))] = np.nan
    joints[12, H36M17.index("pelvis")] = np.nan
    joints[13] = np.nan
    frames = answers(LiveRectifier("geometric"), joints, walk.time_s[:20])
    for frame in frames[10:14]:
        assert np.isnan(frame.R_camera_from_body).all()
        assert np.isnan(frame.error_deg)
        np.testing.assert_array_equal(frame.up, frames[9].up)
        assert frame.up_error_deg == frames[9].up_error_deg
    assert all(np.isfinite(frame.R_camera_from_body).all() for frame in frames[:10] + frames[14:])


def test_a_sensor_is_heard_before_the_first_vote_and_weighed_after():
    sensor = direction("sensor", [0.0, -np.cos(0.1), np.sin(0.1)], 1.0)
    live = LiveRectifier(Scripted([np.full((3, 3), np.nan), LEVEL_CAMERA], 6.0), [sensor])
    before, after = answers(live, [POSE, POSE], [0.0, 0.1])
    assert angle_deg(before.up, UP) == pytest.approx(np.degrees(0.1))
    assert before.up_error_deg == pytest.approx(1)
    assert 0.9 * np.degrees(0.1) < angle_deg(after.up, UP) < np.degrees(0.1)
    assert after.up_error_deg < 1


def test_a_constant_heading_is_kept_and_a_turn_passes_180_degrees_without_a_jump():
    np.testing.assert_allclose(heading_deg(scripted(headed(np.full(20, 77.0)))), 77)
    turned = heading_deg(scripted(headed(np.linspace(100, 260, 90))))
    assert np.abs((np.diff(turned) + 180) % 360 - 180).max() < 2


def test_the_heading_lags_behind_a_turn_by_the_stated_time():
    heading = 90 * np.arange(200) / 100
    frames = scripted(headed(heading), fps=100)
    assert heading[-1] - heading_deg(frames)[-1] == pytest.approx(90 * HEADING_S, rel=0.1)


def test_after_a_long_gap_the_heading_is_the_new_frames():
    R = headed([20.0] * 10 + [np.nan] * 60 + [100.0])
    assert heading_deg(scripted(R))[-1] == pytest.approx(100, abs=0.01)


def test_a_heading_that_jumps_is_said_to_be_uncertain():
    frames = scripted(headed([20.0] * 30 + [120.0]))
    assert frames[-1].error_deg > 60
    assert frames[-2].error_deg < 7


def test_its_memory_does_not_grow_and_its_votes_cover_the_whole_time():
    """Votes lean by 3 degrees to one side in the first half, to the other in the second; both count the same at last,
    but for the few that are not pooled yet."""
    half = 5 * KEPT
    lean = (
        LEVEL_CAMERA
        @ Rotation.from_rotvec(np.repeat([[0.05, 0, 0], [-0.05, 0, 0]], half, axis=0)).as_matrix()
    )
    live = LiveRectifier(Scripted(lean))
    sizes, frame = [], None
    for row in range(2 * half):
        frame = live.update(POSE, row / 30)
        if row in (half, 2 * half - 1):
            sizes.append(len(pickle.dumps(live)))
    assert frame is not None
    assert angle_deg(frame.up, UP) < 0.4
    assert abs(sizes[1] - sizes[0]) < 8 * KEPT  # so much as the weights of the votes last pooled


@pytest.mark.parametrize(
    ("joints", "time_s", "words"),
    [
        (np.zeros((16, 3)), 1.0, "16, 3"),
        (np.zeros((1, 17, 3)), 1.0, "1, 17, 3"),
        (np.full((17, 3), np.inf), 1.0, "infinite"),
        (POSE, 0.0, "later"),
        (POSE, -1.0, "later"),
        (POSE, np.nan, "later"),
        (POSE, np.inf, "later"),
    ],
)
def test_bad_frames_are_refused_and_leave_no_trace(joints, time_s, words):
    live = LiveRectifier(Scripted(headed([10.0, 10.0, 10.0])))
    live.update(POSE, 0.0)
    with pytest.raises(InputError, match=words):
        live.update(joints, time_s)
    assert live.update(POSE, 0.5).up_error_deg == pytest.approx(stated_deg(TILT_SHARE * 6))
