"""The lifter's run time: what goes in, what comes out, what is refused; frame rates and holes that its network was not
trained on."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.lifts import lift
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import rectifier
from pcnet3d.models.common.metrics import joint_error
from pcnet3d.models.lab.cases import scaled
from pcnet3d.models.lifter.builtin import LiveLifter, reach, run
from pcnet3d.models.lifter.features import HALF_WINDOW, features, ray_rotation
from pcnet3d.models.lifter.keypoints import clock_of
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, PoseSequence
from pcnet3d.pipeline.core.rotations import geodesic_deg, is_finite, rotate, unit
from refusals import refused

SIZE = (1920, 1080)
RECTIFIER = Path(rectifier.__file__).with_name("pcnet.onnx")
FLAT = {
    "pelvis": (0, 0), "r_hip": (-30, 0), "r_knee": (-35, 120), "r_ankle": (-40, 240),
    "l_hip": (30, 0), "l_knee": (35, 120), "l_ankle": (40, 240), "spine": (0, -65), "thorax": (0, -135),
    "nose": (0, -165), "head": (0, -210), "l_shoulder": (50, -130), "l_elbow": (65, -50), "l_wrist": (75, 20),
    "r_shoulder": (-50, -130), "r_elbow": (-65, -50), "r_wrist": (-75, 20),
}  # fmt: skip


def person(frames=60, at=(960, 540), seed=0):
    """(frames, 17, 2) pixels: someone who faces the camera and sways."""
    rng = np.random.default_rng(seed)
    flat = np.array([FLAT[name] for name in H36M17.joints], dtype=float)
    sway = np.sin(np.arange(frames)[:, None, None] / 10 + rng.uniform(0, 6, (17, 2))) * 8
    return flat + sway + np.array(at)


def poses(pixels, **changes):
    return PoseSequence(pixels, H36M17, IMAGE, frame_index=np.arange(len(pixels)), **changes)


def test_chunks_make_no_clip_boundary():
    x, _ = features(person(700), np.full((700, 17), np.nan), np.array(SIZE, dtype=float), np.array(1920.0))
    whole = run(x, chunk=10_000)[0]
    for chunk in (100, 257):
        np.testing.assert_allclose(run(x, chunk=chunk)[0], whole, atol=1e-5)


def test_a_facing_person_comes_out_upright_with_left_on_the_right():
    lifted = lift(poses(person()), SIZE)
    assert str(lifted.frame.unit) == "arbitrary"
    np.testing.assert_array_equal(lifted.joint("pelvis"), 0)
    trunk = (lifted.joint("thorax") - lifted.joint("pelvis")).mean(axis=0)
    assert -trunk[1] > 0.9 * np.linalg.norm(trunk)
    assert (lifted.joint("l_shoulder")[:, 0] > lifted.joint("r_shoulder")[:, 0]).all()
    height = (lifted.joint("l_ankle") - lifted.joint("head"))[:, 1]
    assert 1.2 < height.mean() < 2.0
    assert lifted.history[-1].name == "lift"


@pytest.mark.parametrize("rate", [30, 100])
def test_a_long_take_in_pieces_has_the_answer_of_the_whole(rate, monkeypatch):
    pixels = person(450)
    pixels[300:305] = np.nan  # nobody is seen for a moment, and a joint for longer
    pixels[290:330, 4] = np.nan
    given = poses(pixels, time_s=np.arange(450) / rate)
    whole = lift(given, SIZE)
    monkeypatch.setattr("pcnet3d.models.lifter.builtin._ROWS", 101)
    pieces = lift(given, SIZE)
    np.testing.assert_allclose(pieces.joints, whole.joints, atol=1e-5)
    np.testing.assert_allclose(pieces.covariance, whole.covariance, atol=1e-5)


def test_far_frames_do_not_matter():
    """What the stated reach promises: a frame's answer depends on frames near it only."""
    pixels = person(900)
    other = pixels.copy()
    other[600:] += 100 * np.random.default_rng(0).normal(size=other[600:].shape)
    a, b = (lift(poses(p), SIZE).joints for p in (pixels, other))
    near = 600 - reach() - HALF_WINDOW
    np.testing.assert_allclose(a[:near], b[:near], atol=1e-5)
    assert np.abs(a[600:] - b[600:]).max() > 0.01


def test_a_size_is_averaged_over_as_many_frames_on_each_side():
    pixels = np.repeat(person(1), 250, axis=0)
    nearer = pixels.copy()
    nearer[120] = 1.5 * (pixels[120] - [960, 540]) + [960, 540]
    averaged = [
        features(each, np.ones((250, 17)), np.array(SIZE, dtype=float), np.array(1920.0))[0][:, 4 * 17 + 3]
        for each in (pixels, nearer)
    ]
    changed = np.flatnonzero(~np.isclose(*averaged, rtol=1e-6))
    assert changed.tolist() == list(range(120 - HALF_WINDOW, 120 + HALF_WINDOW + 1))


def test_image_size_does_not_matter():
    small = lift(poses(person(30)), SIZE).joints
    large = lift(poses(person(30) * 2), (3840, 2160)).joints
    np.testing.assert_allclose(large, small, atol=1e-4)


def test_the_ray_to_the_body_turns_the_answer():
    """The same image of a person elsewhere: same skeleton in the ray frame, turned by the ray in the camera."""
    size, focal = np.array(SIZE, dtype=float), np.array(1000.0)
    middle = person(1)
    rays = np.concatenate([(middle - size / 2) / focal, np.ones((1, 17, 1))], axis=-1)
    x, straight = features(middle, np.full((1, 17), np.nan), size, focal)
    R = ray_rotation(np.array([0.4, -0.2]))
    moved = np.einsum("ij,tkj->tki", R, rays)
    pixels = moved[..., :2] / moved[..., 2:] * focal + size / 2
    y, turned = features(pixels, np.full((1, 17), np.nan), size, focal)
    np.testing.assert_allclose(x[..., :34], y[..., :34], atol=0.03)
    angle = np.degrees(np.arctan(np.hypot(0.4, 0.2)))
    assert geodesic_deg(straight, turned)[0] == pytest.approx(angle, abs=1.0)


def test_a_camera_that_rolls_meanwhile_gives_the_same_skeleton_where_each_frames_up_is_known():
    pixels, size = person(40, at=(960, 620)), np.array(SIZE, dtype=float)
    R = Rotation.from_euler("z", np.linspace(-40, 40, 40)[:, None], degrees=True).as_matrix()
    up = unit(np.array([0.0, -1.0, -0.3]))
    rolled = np.einsum("tij,tkj->tki", R[:, :2, :2], pixels - size / 2) + size / 2
    keep = np.r_[0:10, 14:40]  # rows that a file leaves out are frames all the same
    straight, turned = (
        lift(PoseSequence(p[keep], H36M17, IMAGE, frame_index=keep), SIZE, 1500.0, up=told).joints
        for p, told in ((pixels, up), (rolled, (R @ up)[keep]))
    )
    np.testing.assert_allclose(turned, rotate(R[keep], straight.astype(np.float64)), atol=0.004)
    late = lift(PoseSequence(rolled[keep], H36M17, IMAGE, frame_index=keep), SIZE, 1500.0, up=(R @ up)[:36])
    assert np.abs(late.joints - turned).max() > 0.02


def test_frames_that_a_file_leaves_out_count_as_frames():
    pixels = person(60)
    keep = np.r_[0:20, 28:60]
    blank = pixels.copy()
    blank[20:28] = np.nan
    sparse = PoseSequence(pixels[keep], H36M17, IMAGE, frame_index=keep * 2 + 7)
    np.testing.assert_allclose(lift(sparse, SIZE).joints, lift(poses(blank), SIZE).joints[keep], atol=1e-5)


def two_people():
    pixels = person(60, at=(300, 540))
    pixels[::2] = person(60, at=(1500, 540))[::2]
    return poses(pixels)


def test_bad_input_is_refused_in_words():
    for keypoints, size, options, words in [
        (lambda: PoseSequence(np.zeros((3, 17, 3)), H36M17, CAMERA), SIZE, {}, "IMAGE"),
        (lambda: poses(person() / 960 - 1), SIZE, {}, "look normalised"),
        (lambda: poses(person()), None, {}, "width and height"),
        (lambda: poses(person() * 3), SIZE, {}, "outside which 100 % of them lie"),
        (lambda: poses(person()).with_(frame=IMAGE.with_(unit="mm")), SIZE, {}, "in pixels, got them in"),
        *((lambda: poses(person()), size, {}, "image size") for size in ((0, 1080), (1920,), (1920, np.nan))),
        (lambda: poses(person()), SIZE, {"focal_px": -5.0}, "focal length"),
        (lambda: poses(person() * np.nan), SIZE, {}, "every joint of every frame is missing"),
        (two_people, SIZE, {}, "two people look mixed"),
        (
            lambda: poses(person(3)).with_(frame_index=[0, 1, 10**12]),
            SIZE,
            {},
            "3 rows numbered 0 to 10{12};",
        ),
        (lambda: poses(person()), SIZE, {"model": "nowhere.onnx"}, "No such file"),
        (lambda: poses(person()), SIZE, {"model": __file__}, r"Expected a lifter in an \.onnx file"),
        (
            lambda: poses(person()),
            SIZE,
            {"model": RECTIFIER},
            r"trained with pcnet3d, got .*pcnet\.onnx; .*--poses",
        ),
    ]:
        with pytest.raises(InputError, match=words):
            lift(keypoints(), size, **options)


def test_a_scene_cut_is_not_two_people():
    pixels = person(60, at=(300, 540))
    pixels[30:] = person(60, at=(1500, 540))[30:]
    assert np.isfinite(lift(poses(pixels), SIZE).joints).all()


def test_the_stated_error_is_largest_along_the_ray_and_turns_with_it():
    lifted = lift(poses(person(at=(300, 300))), SIZE, 1500.0)
    ray = np.array([300 - 960, 300 - 540, 1500.0]) / np.linalg.norm([300 - 960, 300 - 540, 1500.0])
    values, axes = np.linalg.eigh(lifted.covariance[30, H36M17.index("l_wrist")].astype(float))
    assert values[2] > 2 * values[1] == pytest.approx(2 * values[0], rel=1e-3)
    assert abs(axes[:, 2] @ ray) > 0.995
    assert (lifted.covariance[:, H36M17.index("pelvis")] == 0).all()


SECONDS = 6.0


@cache
def walked(fps):
    """The walker's keypoints with a pixel or two of error that changes within 0.2 s, the camera, and the truth."""
    walk = walker(fps=fps, seconds=SECONDS)
    camera = side_camera(walk)
    exact = camera.project(walk.world)
    moments = np.arange(0, SECONDS + 0.2, 0.2)
    error = np.random.default_rng(0).normal(0, 1.5, (len(moments), 17 * 2))
    error = np.stack([np.interp(walk.time_s, moments, each) for each in error.T], axis=-1).reshape(
        exact.shape
    )
    frames = np.arange(len(walk.time_s))
    score = np.full(exact.shape[:2], 0.9)
    keypoints = PoseSequence(
        exact + error, H36M17, IMAGE, confidence=score, time_s=walk.time_s, frame_index=frames
    )
    return keypoints, camera, camera_poses(walk, camera).joints.astype(np.float64)


def size_of(camera):
    return camera.width, camera.height


def mpjpe(keypoints, camera, truth):
    """mm, one scale for the take; and of the motion from frame to frame, mm a second."""
    lifted = lift(keypoints, size_of(camera), camera.focal_px).joints.astype(np.float64)
    off = scaled(lifted, truth, "take") - truth
    speed = np.linalg.norm(np.diff(off, axis=0), axis=-1).mean() * keypoints.fps
    return 1000 * joint_error(off, 0 * off).mean(), 1000 * speed


def some(keypoints, rows):
    return PoseSequence(
        keypoints.joints[rows],
        H36M17,
        IMAGE,
        confidence=keypoints.confidence[rows],
        time_s=keypoints.time_s[rows],
        frame_index=keypoints.frame_index[rows],
    )


@pytest.fixture(scope="module")
def usual() -> tuple[float, float]:
    """Both at thirty frames a second."""
    return mpjpe(*walked(30))


@pytest.mark.parametrize("fps", [2, 10, 24, 50, 60, 240])
def test_any_frame_rate_is_lifted_about_as_well_as_thirty(fps, usual):
    error, speed = mpjpe(*walked(fps))
    assert error < 1.3 * usual[0]
    assert speed < 1.6 * usual[1]


def test_an_odd_row_among_every_third_changes_nothing_much():
    keypoints, camera, truth = walked(60)
    every = np.arange(0, len(keypoints), 3)
    odd = np.append(every, every[-1] + 1)
    regular, _ = mpjpe(some(keypoints, every), camera, truth[every])
    with_odd, _ = mpjpe(some(keypoints, odd), camera, truth[odd])
    assert with_odd < 1.1 * regular


@pytest.mark.parametrize("what", ["joints", "rows"])
def test_what_is_missing_here_and_there_costs_hardly_anything(what, usual):
    keypoints, camera, truth = walked(30)
    lost = np.random.default_rng(3).uniform(size=keypoints.joints.shape[: 2 if what == "joints" else 1]) < 0.3
    pixels = keypoints.joints.copy()
    pixels[lost] = np.nan
    error, speed = mpjpe(keypoints.with_(joints=pixels), camera, truth)
    assert error < 1.05 * usual[0]
    assert speed < 1.15 * usual[1]


def test_joints_on_a_line_are_counted_and_longer_gaps_are_left_to_the_network():
    keypoints, camera, _ = walked(30)
    pixels = keypoints.joints.copy()
    pixels[10:14, 3] = np.nan
    pixels[20:50, 5] = np.nan
    pixels[:4, 6] = np.nan  # before it was first seen
    said = lift(keypoints.with_(joints=pixels), size_of(camera)).history[-1].options
    assert said["joints_on_a_line"] == 4


def test_a_line_goes_from_sighting_to_sighting():
    pixels = np.full((9, 2, 2), np.nan)
    pixels[[0, 4, 8], 0] = [[0, 0], [4, 40], [8, 0]]
    pixels[3, 1] = 7.0
    score = np.where(is_finite(pixels), 0.5, 0.0)
    score[0, 0] = 0.3
    filled, confidence = clock_of(30.0).rows(pixels, score)
    np.testing.assert_allclose(filled[:, 0, 0], np.arange(9))
    np.testing.assert_allclose(filled[:, 0, 1], [0, 10, 20, 30, 40, 30, 20, 10, 0])
    np.testing.assert_allclose(confidence[:, 0], [0.3, 0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 0.5, 0.5])
    np.testing.assert_array_equal(np.isfinite(filled[:, 1, 0]), np.arange(9) == 3)


@pytest.mark.parametrize(("fps", "up"), [(10, None), (40, None), (40, np.array([0.28, -0.96, 0.0]))])
def test_live_is_the_last_of_a_lift_of_all_so_far_at_any_rate(fps, up):
    keypoints, camera, _ = walked(fps)
    live = LiveLifter(H36M17, size_of(camera), up=up)
    rows = min(len(keypoints), 90)
    answers = [
        live.update(keypoints.joints[i], keypoints.confidence[i], keypoints.time_s[i]) for i in range(rows)
    ]
    for last in (7, rows // 2, rows - 1):
        whole = lift(keypoints.rows(0, last + 1), size_of(camera), up=up).joints[-1]
        np.testing.assert_allclose(answers[last], whole, atol=2e-5)


@pytest.mark.parametrize(("fps", "rows"), [(10, 6), (30, 16), (240, 121)])
def test_half_a_second_without_anybody_is_missing_at_any_rate(fps, rows):
    keypoints, camera, _ = walked(fps)
    for count, missing in ((rows, rows), (rows - 1, 0)):
        pixels = keypoints.joints.copy()
        pixels[8 : 8 + count] = np.nan
        lifted = lift(keypoints.with_(joints=pixels), size_of(camera)).joints
        assert np.isnan(lifted).all(axis=(1, 2)).sum() == missing


def test_who_crosses_the_image_at_two_frames_a_second_is_one_person():
    keypoints, camera, _ = walked(2)
    pixels = keypoints.joints.astype(np.float64)
    pixels += np.arange(len(pixels))[:, None, None] * [1.2 * np.ptp(pixels, axis=1).max(), 0.0]
    wide = int(pixels.max()) + 50, camera.height
    assert np.isfinite(lift(keypoints.with_(joints=pixels), wide).joints).all()
    with refused("people-mixed"):
        lift(keypoints.with_(joints=pixels, time_s=keypoints.time_s / 15), wide)


def paused(keypoints, at, pause_s):
    """The same frames by their numbers, with a pause before one that the time stamps alone tell."""
    return keypoints.with_(time_s=keypoints.time_s + pause_s * (np.arange(len(keypoints)) >= at))


@pytest.mark.parametrize("pause_s", [8.0, 100.0, 36000.0])
def test_what_lies_behind_a_hole_in_the_recording_has_no_say(pause_s):
    """A pause of 100 s made 30 frames a second 2, and all of them were lifted 14 times slower."""
    keypoints, camera, _ = walked(30)
    other = keypoints.with_(joints=np.concatenate([keypoints.joints[:60], keypoints.joints[:59:-1]]))
    one, two = (lift(paused(each, 60, pause_s), size_of(camera)).joints for each in (keypoints, other))
    np.testing.assert_allclose(one[:60], two[:60], atol=1e-6)
    alone = lift(keypoints.rows(60, 180), size_of(camera)).joints
    assert (
        np.abs(one[60:] - alone)[30:].mean() < 0.002
    )  # near its edge a take is lifted otherwise than near a hole


def test_images_that_were_dropped_are_missing_rows():
    keypoints, camera, _ = walked(30)
    there = np.delete(np.arange(len(keypoints)), np.arange(60, 68))
    numbered = lift(some(keypoints, there), size_of(camera))
    counted = some(keypoints, there).with_(
        frame_index=np.arange(len(there))
    )  # as a video's own stamps tell it
    np.testing.assert_allclose(lift(counted, size_of(camera)).joints, numbered.joints, atol=1e-6)


def test_half_a_second_without_anybody_is_half_a_second_beside_a_hole():
    keypoints, camera, _ = walked(30)
    pixels = keypoints.joints.copy()
    pixels[30:34] = np.nan
    lifted = lift(paused(keypoints.with_(joints=pixels), 90, 100.0), size_of(camera))
    assert lifted.history[-1].options["frames_without_joints"] == 0
    pixels[88:92] = np.nan  # on both sides of the pause: not to be bridged
    lifted = lift(paused(keypoints.with_(joints=pixels), 90, 100.0), size_of(camera))
    assert not is_finite(lifted.joints[88:92]).any()


@pytest.mark.parametrize("fps", [30, 120, 240, 1000])
def test_a_few_rows_of_any_rate_are_lifted(fps):
    """Three rows at 240 frames a second are of three takes; the fourth, without a row, ended in a traceback."""
    for rows in [1, 2, 3, 5]:
        keypoints, camera, _ = walked(30)
        short = keypoints.rows(0, rows).with_(time_s=np.arange(rows) / fps)
        assert is_finite(lift(short, size_of(camera)).joints).all()


def test_live_is_not_for_ever_misled_by_a_burst():
    """Two images a millisecond apart made every later one look like one behind a hole."""
    keypoints, camera, _ = walked(30)
    burst = LiveLifter(H36M17, size_of(camera))
    for i in range(120):
        late = keypoints.time_s[i] if i > 3 else keypoints.time_s[3] - 0.001 * (3 - i)
        answer = burst.update(keypoints.joints[i], keypoints.confidence[i], late)
    np.testing.assert_allclose(answer, lift(keypoints.rows(0, 120), size_of(camera)).joints[-1], atol=2e-5)


@pytest.mark.parametrize("pause_s", [1.0, 20.0, 600.0])
def test_live_sees_the_hole_too(pause_s):
    """The rows of a pause of more than 5 s lay so far apart that the stream went on at 7 or less than one a second."""
    keypoints, camera, _ = walked(30)
    live = LiveLifter(H36M17, size_of(camera))
    late = paused(keypoints, 20, pause_s)
    for i in range(30):
        answer = live.update(late.joints[i], late.confidence[i], late.time_s[i])
    np.testing.assert_allclose(answer, lift(late.rows(0, 30), size_of(camera)).joints[-1], atol=2e-5)
