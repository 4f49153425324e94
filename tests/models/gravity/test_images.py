"""Up and focal length from rendered images whose cameras are known, images that do not tell, and what of a moving
camera's up a lift may rest on."""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.gravity import levelling
from pcnet3d.models.gravity.evidence import TakeUp
from pcnet3d.models.gravity.images import TOLD_SPREAD, ImageUp, Unknown, segments_of, up_from_images
from pcnet3d.models.gravity.levelling import known_moving_up, known_up, timed, with_looks
from pcnet3d.models.gravity.view import ASSUMED_FOCAL_SD, known_camera, moving_camera, static_camera
from pcnet3d.models.gravity.votes import USUAL_SPREAD, PersonFrames
from pcnet3d.pipeline import InputError, PoseSequence
from pcnet3d.pipeline.core.camera import Look
from pcnet3d.pipeline.core.measures import SD_90
from pcnet3d.pipeline.core.rotations import angle_deg, rotate
from refusals import refused
from rooms import NO_LINES, no_lines, street

SEEDS = (4, 7, 10)


@pytest.fixture(scope="module")
def streets():
    return {seed: street(seed) for seed in SEEDS}


@pytest.fixture(scope="module")
def answers(streets):
    """What one image of each street tells."""
    return {seed: up_from_images([shown.image], boxes=[shown.boxes]) for seed, shown in streets.items()}


def test_streets_tell_up(streets, answers):
    for seed, answer in answers.items():
        assert isinstance(answer, ImageUp)
        assert angle_deg(answer.look.up, streets[seed].camera.up) < 0.5
        assert answer.look.error_deg < 2.0


def test_several_images_of_one_camera_are_one_answer_of_the_same_error(streets, answers):
    shown, one = streets[4], answers[4]
    three = up_from_images([shown.image] * 3, boxes=[shown.boxes] * 3)
    np.testing.assert_allclose(three.look.up, one.look.up, atol=1e-3)
    assert three.look.error_deg == pytest.approx(
        one.look.error_deg, rel=0.05
    )  # the same lines three times are no news


def test_a_larger_image_tells_the_same(streets, answers):
    larger = up_from_images(
        [cv2.resize(streets[4].image, None, fx=2.5, fy=2.5)], boxes=[2.5 * streets[4].boxes]
    )
    assert angle_deg(larger.look.up, answers[4].look.up) < 0.3
    assert larger.focal_px == pytest.approx(2.5 * answers[4].focal_px, rel=0.02)


def test_a_told_focal_length_is_obeyed_and_an_impossible_one_refused(streets):
    shown = streets[10]
    answer = up_from_images([shown.image], shown.camera.focal_px, [shown.boxes])
    assert answer.focal_px == pytest.approx(shown.camera.focal_px, rel=0.05)
    with refused("bad-value"):
        up_from_images([shown.image], 0.8)


@pytest.mark.parametrize("kind", NO_LINES)
def test_images_that_do_not_tell_are_refused_in_words(kind):
    answer = up_from_images([no_lines(kind, 3)])
    assert isinstance(answer, Unknown)
    assert "line" in answer.reason
    assert isinstance(up_from_images([np.full((16, 24), 128, np.uint8)]), Unknown)  # small and grey


def test_a_pattern_on_one_plane_is_believed_less_than_a_room(answers):
    """Only the bodies can tell that a plaid hangs askew; an answer by three directions is no such thing."""
    for seed in (2, 3):
        flat = up_from_images([no_lines("diagonal pattern", seed)])
        assert isinstance(flat, ImageUp)
        assert flat.look.failure > 0.1
    assert answers[4].look.failure < 0.05


@pytest.mark.parametrize(
    ("images", "words"),
    [
        ([], "got none"),
        ([np.zeros((40, 60, 3))], "uint8"),
        ([np.zeros((40, 60, 4), np.uint8)], "RGB"),
        ([np.zeros((40, 60), np.uint8), np.zeros((60, 40), np.uint8)], "one size"),
    ],
)
def test_what_is_no_image_is_refused(images, words):
    with pytest.raises(InputError, match=words):
        up_from_images(images)


def test_who_says_the_focal_length():
    size = (1920, 1080)
    for told_px, file_px, focal_px, source in (
        (1500.0, 1400.0, 1500.0, "told"),
        (None, 1400.0, 1400.0, "file"),
    ):
        known = known_camera(size, told_px, file_px)
        assert (known.focal_px, known.focal_source) == (focal_px, source)
    known = known_camera(size, None, None)
    assert (known.focal_px, known.focal_source) == (0.8 * 1920, "prior")
    assert known.focal_sd_px / known.focal_px == pytest.approx(ASSUMED_FOCAL_SD)
    lenses = 1920 * np.geomspace(0.65, 2.0, 1001)  # nine in ten of which lie within the bar
    within = np.abs(lenses - known.focal_px) <= SD_90 * known.focal_sd_px
    assert within.mean() == pytest.approx(0.9, abs=0.01)


def test_a_camera_looks_at_its_first_image_first():
    shown = street(10)
    found = static_camera({7: shown.image, 3: shown.image}, {7: shown.boxes, 3: shown.boxes})
    (look,) = found.looks
    assert look.frame == 3
    assert found.image_size == shown.image.shape[1::-1]


def test_lines_of_people_are_left_out():
    shown = street(10)
    middles = segments_of([shown.image], [shown.boxes]).middle * shown.camera.width + np.array([320, 240])
    ((left, top, right, bottom),) = shown.boxes
    assert not ((middles > [left, top]) & (middles < [right, bottom])).all(axis=1).any()


@pytest.mark.parametrize("times", [1.0, 1.04])
def test_the_focal_length_that_is_told_is_the_cameras(streets, times):
    """Also where lines tell it better: up is fitted with theirs, and the told one stays as it was told."""
    shown = streets[7]
    told_px = times * shown.camera.focal_px
    found = static_camera({0: shown.image}, {0: shown.boxes}, told_px)
    assert (found.focal_px, found.focal_sd_px, found.focal_source) == (told_px, TOLD_SPREAD * told_px, "told")
    assert angle_deg(found.looks[0].up, shown.camera.up) < 0.5


def test_a_moving_camera_says_why_it_knows_nothing():
    grass = no_lines("grass", 0)
    found = moving_camera([(0, grass), (10, grass)], grass.shape[1::-1], {})
    assert found.looks == ()
    assert "line" in found.reason


def look(time_s, up):
    return time_s, Look(int(30 * time_s), up, np.radians(0.6) ** 2 * np.eye(3), 0.004)


def ups(pitch_deg):
    pitch = np.radians(pitch_deg)
    return np.stack([0 * pitch, -np.cos(pitch), -np.sin(pitch)], axis=-1)


def heard(up, error_deg, time_s, looks, seams=()) -> TakeUp:
    """The bodies' up (T, 3) with what images say."""
    frames, error = len(up), np.full(len(up), float(error_deg))
    seen = PersonFrames(np.zeros((frames, 17, 3)), np.full((frames, 3, 3), np.nan), error, time_s, seams)
    return with_looks(TakeUp(up, error), seen, looks)


def test_between_the_images_of_a_moving_camera_up_is_interpolated():
    time_s = np.arange(120) / 30
    true = ups(10 + 5 * time_s)
    looks = [*map(look, time_s[::10], true[::10])]
    found = heard(ups(18 + 5 * time_s), 7.0, time_s, looks)
    assert not found.notices
    inside = slice(0, 111)
    assert np.max(angle_deg(found.up, true)[inside]) < 0.5
    assert np.max(found.error_deg[inside]) < 2.0
    assert found.shares["image"] > 0.9


def test_one_look_that_is_quite_another_counts_less():
    time_s = np.arange(90) / 30
    true = ups(np.full(90, 10.0))
    looks = [look(t, true[0]) for t in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5)]
    looks[3] = look(1.5, ups(np.array(40.0)))
    assert np.max(angle_deg(heard(true, 6.0, time_s, looks).up, true)) < 2.0


@pytest.mark.parametrize("last_s", [6.0, 12.0])
def test_bodies_that_images_outvote_speak_again_where_none_was_looked_at(last_s):
    """Of 20 s the first 6 or 12 were looked at; how a body leans there says little about the rest."""
    time_s = np.arange(600) / 30
    true, bodies = ups(np.full(600, 10.0)), ups(np.full(600, 45.0))
    found = heard(bodies, 6.0, time_s, [look(t, true[0]) for t in np.arange(0, last_s + 0.1, 0.5)])
    assert "35 degrees" in found.notices[0].text
    assert np.max(angle_deg(found.up, true)[time_s <= last_s]) < 0.5
    assert np.max(angle_deg(found.up, bodies)[time_s > last_s + 3]) < 1.0
    assert np.max(found.error_deg) < 10.0
    assert np.max(angle_deg(found.up[1:], found.up[:-1])) < 5.0  # no jump


def test_a_contradiction_is_that_of_the_frames_looked_at():
    """A camera that is level for 10 s, with bodies that lean, and looks down by 60 degrees ever after."""
    time_s = np.arange(600) / 30
    bodies = ups(np.where(time_s < 10, 30.0, 60.0))
    found = heard(bodies, 6.0, time_s, [look(t, ups(np.array(0.0))) for t in np.arange(10.0)])
    (warning,) = found.notices
    assert "by 30 degrees: pitch 0, roll 0 by the image" in warning.text.replace("-0", "0")
    assert "pitch 30, roll 0 by the body" in warning.text.replace("-0", "0")


@pytest.mark.parametrize(("failure", "close"), [(0.004, False), (0.06, True), (0.15, True), (0.99, False)])
def test_where_two_answers_are_about_as_likely_the_bound_reaches_both(failure, close):
    time_s = np.arange(90) / 30
    bodies, image = ups(np.full(90, 30.0)), ups(np.array(10.0))
    looks = [
        (at, replace(one, failure=failure)) for at, one in (look(t, image) for t in (0.0, 1.0, 2.0, 2.9))
    ]
    found = heard(bodies, 5.0, time_s, looks)
    assert len(found.notices) == 1
    assert (found.bound_deg > 20.0).all() == close
    assert (found.bound_deg < 10.0).all() == (not close)


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
    monkeypatch.setattr(levelling, "stated_spread", lambda poses: np.full(len(poses), USUAL_SPREAD))
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
