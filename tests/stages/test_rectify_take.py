"""A take's one gravity through the stage and a whole run: bad takes, and what a user says about the camera."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.models.angle_error.joint_noise import FOCAL_HEADING
from pcnet3d.pipeline import CAMERA, H36M17, InputError, PoseSequence, Take, Told, change_frame, rotate
from pcnet3d.pipeline.core.camera import Camera as View
from pcnet3d.pipeline.core.camera import Look
from pcnet3d.pipeline.core.frames import GL_CAMERA, IMAGE
from pcnet3d.pipeline.core.measures import SD_90
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.core.rotations import angle_deg
from pcnet3d.pipeline.signals.checks import nobody_upright
from pcnet3d.stages.rectify import Rectify, rectify
from refusals import refused

RECTIFIERS = ("pcnet", "geometric")


@pytest.fixture(scope="module")
def joints(walk, camera):
    return camera_poses(walk, camera).joints


@pytest.fixture(scope="module")
def cut(walk, joints):
    """(joints, up of the second view): from the middle on another camera."""
    other = aimed(walk.root.mean(axis=0), 5, heading_deg=250, pitch_deg=-15, roll_deg=0)
    half = len(joints) // 2
    return np.concatenate([joints[:half], camera_poses(walk, other).joints[half:]]), other.up


def poses_of(joints) -> PoseSequence:
    return PoseSequence(joints, H36M17, CAMERA, time_s=np.arange(len(joints)) / 30)


def warnings(take: Take) -> list[str]:
    return [event.text for event in take.notices if event.weight == "warning"]


def up_of(rectified) -> np.ndarray:
    return rectified.R_source_from_level[..., 2]


# --- bad takes


@pytest.mark.parametrize("rectifier", RECTIFIERS)
@pytest.mark.parametrize("lost", ["every second", "at random", "the middle"])
def test_half_of_the_frames_is_enough(joints, camera, rectifier, lost):
    gone = np.zeros(len(joints), dtype=bool)
    if lost == "every second":
        gone[::2] = True
    elif lost == "at random":
        gone[np.random.default_rng(0).permutation(len(joints))[: len(joints) // 2]] = True
    else:
        gone[60:180] = True
    half = np.where(gone[:, None, None], np.nan, joints)
    take = Rectify(rectifier)(Take("t", poses=poses_of(half)))
    rectified, whole = take.rectified, rectify(poses_of(joints), rectifier)
    assert rectified.level_ok
    assert np.array_equal(np.isnan(rectified.R_source_from_body).all(axis=(1, 2)), gone)
    assert np.isnan(rectified.error_deg[gone]).all()
    assert np.isfinite(rectified.up_error_deg).all()
    assert angle_deg(up_of(rectified), up_of(whole)) < 2
    assert angle_deg(up_of(rectified), camera.up) < rectified.up_error_deg[0]
    assert rectified.up_error_deg[0] > 0.85 * whole.up_error_deg[0]


@pytest.mark.parametrize("rectifier", RECTIFIERS)
def test_a_cut_half_way_has_a_wide_error(cut, camera, rectifier):
    joints, other_up = cut
    take = Rectify(rectifier)(Take("t", poses=poses_of(joints)))
    rectified = take.rectified
    ups = np.where((np.arange(240) < 120)[:, None], camera.up, other_up)
    true = np.sqrt(np.mean(angle_deg(up_of(rectified), ups) ** 2))
    assert true > 15
    assert rectified.up_bound_deg[0] > true


def test_a_cut_is_followed_by_a_moving_camera_and_parted_by_a_clip_boundary(cut, camera):
    joints, other_up = cut
    ups = np.where((np.arange(240) < 120)[:, None], camera.up, other_up)
    poses = poses_of(joints)
    errors = [
        angle_deg(up_of(rectify(given, camera="moving")), ups) for given in (poses, poses.with_(seams=(120,)))
    ]
    assert errors[0][:60].max() < 8
    assert errors[0][-60:].max() < 10
    assert errors[1].max() < 5


@pytest.mark.parametrize(
    "answer",
    [
        lambda R, error: None,
        lambda R, error: R,
        lambda R, error: (R[1:], error[1:]),
        lambda R, error: (R, None),
        lambda R, error: (2 * R, error),
        lambda R, error: (R * [-1, 1, 1], error),
    ],
)
def test_a_rectifier_of_another_package_that_gives_no_rotations_is_refused(joints, answer):
    class Broken:
        method = "broken@1"

        def rotation(self, joints):
            return answer(np.repeat(np.eye(3)[None], len(joints), axis=0), np.zeros(len(joints)))

    with pytest.raises(InputError, match=r"from the rectifier broken@1 .* repair its package"):
        rectify(poses_of(joints[:20]), rectifier=Broken())


# --- what the user says


def test_a_gravity_vector_wins_in_any_axes(walk, camera, joints):
    """Geometry leans with the squat; 1 degree of the user outweighs it."""
    poses = poses_of(joints)
    alone = rectify(poses, "geometric")
    told = rectify(poses, "geometric", gravity=tuple(-9.81 * camera.up))
    assert angle_deg(up_of(alone), camera.up) > 2
    assert angle_deg(up_of(told), camera.up) < 0.2
    assert told.up_bound_deg[0] < 2 < alone.up_bound_deg[0]
    assert sum(told.up_shares.values()) == pytest.approx(1)
    assert told.up_shares["gravity vector"] > 0.9
    seen_by_gl = change_frame(poses, GL_CAMERA.with_(origin="pelvis"))
    same = rectify(seen_by_gl, "geometric", gravity=tuple(-9.81 * camera.up))
    np.testing.assert_allclose(same.level.joints, told.level.joints, atol=1e-4)


def test_pitch_and_roll_say_the_same_as_the_vector(joints, camera):
    """The example's camera looks down by 15 degrees and is rolled by 5, clockwise as seen from behind it, which turns
    the image's content the other way."""
    told = rectify(poses_of(joints), "geometric", pitch_deg=15, roll_deg=5)
    assert angle_deg(up_of(told), camera.up) < 0.5
    assert told.up_shares["camera pitch and roll"] > 0.9


def test_a_camera_on_its_side_is_believed_when_the_user_says_so(joints, camera):
    Q = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    poses = poses_of(rotate(Q, joints))
    assert not rectify(poses, "geometric").level_ok
    told = rectify(poses, "geometric", gravity=tuple(-Q @ camera.up))
    assert told.level_ok
    assert angle_deg(up_of(told), Q @ camera.up) < 0.5


@pytest.mark.parametrize("turn_deg", [90, -90, 180])
def test_a_picture_that_is_turned_is_told_where_its_lines_decide(joints, camera, turn_deg):
    """Lines at right angles look the same on their side and upside down, and the image is believed."""
    Q = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    look = Look(
        0, camera.up, np.radians(0.6) ** 2 * (np.eye(3) - np.outer(camera.up, camera.up)), failure=0.004
    )
    view = View((1000, 1000), 1000.0, 10.0, "lines", looks=(look,))
    upright, turned = (
        Rectify("geometric")(Take("walk", poses=poses_of(rotate(R, joints)), camera=view))
        for R in (np.eye(3), Q)
    )
    assert turned.rectified.level_ok
    assert turned.notices[-1].code == "nobody-upright"
    assert nobody_upright(turned.rectified) == [turned.notices[-1]]
    assert not nobody_upright(upright.rectified)
    said = turned.with_(
        findings=(notice("upside-down", share_percent=90, what="turn the image before the run"),)
    )
    assert not [text for text in warnings(Rectify("geometric")(said.with_(notices=()))) if "trunk" in text]
    told = Rectify("geometric")(
        turned.with_(camera=None, notices=(), told=Told(gravity=tuple(-Q @ camera.up)))
    )
    assert not nobody_upright(told.rectified)
    lies = replace(turned.rectified, up_shares={"camera pitch and roll": 0.9, "frames": 0.1})
    assert not nobody_upright(lies)  # who has told pitch and roll is not asked to
    for step, weight in ((0.0, "warning"), (0.05, "suspicious")):  # of the pelvis, metres a frame
        root = np.arange(len(joints))[:, None] * np.array([step, 0.0, 0.0])
        placed = replace(turned.rectified, level=turned.rectified.level.with_(path=RootPath(root)))
        assert nobody_upright(placed)[0].weight == weight


@pytest.mark.parametrize(
    ("options", "code", "quoted"),
    [
        ({"gravity": (0, 0, 0)}, "bad-value", "got (0, 0, 0)"),
        ({"gravity": (0, np.nan, 1)}, "bad-value", "gravity"),
        ({"pitch_deg": 300.0}, "bad-value", 300.0),
        ({"roll_deg": np.nan}, "bad-value", "nan"),
        ({"gravity": (0, 1, 0), "roll_deg": 2.0}, "option-conflict", "gravity"),
        ({"camera": "moving", "pitch_deg": 3.0, "roll_deg": 0.0}, "option-conflict", "moving"),
        ({"pitch_deg": 3.0}, "needs-input", "only the pitch"),
        ({"roll_deg": 0.0}, "needs-input", "only the roll"),
        ({"camera": "still"}, "bad-value", "'still'"),
    ],
)
def test_options_that_cannot_be_are_refused_before_anything_is_computed(options, code, quoted):
    with refused(code, quoted):
        Told(**options)


def test_who_is_beside_the_axis_of_a_guessed_focal_length_has_a_wider_error(joints, camera):
    """By what the guess turns the heading, which a person before the axis, or a given focal length, has none of."""

    def error_deg(at_px: float, focal_sd_px: float) -> np.ndarray:
        pixels = PoseSequence(np.full((len(joints), 17, 2), [at_px, 540.0]), H36M17, IMAGE)
        view = View((1920, 1080), 1500.0, focal_sd_px, "prior")
        take = Take(Told(), poses=poses_of(joints), keypoints=pixels, camera=view)
        return Rectify()(take).need("rectified").error_deg

    alone = error_deg(960.0, 400.0)
    np.testing.assert_allclose(error_deg(200.0, 0.0), alone)
    share = 400 / 1500
    turned = FOCAL_HEADING * np.degrees(share / (1 + SD_90 * share) * 760 / 1500)
    np.testing.assert_allclose(np.sqrt(error_deg(200.0, 400.0) ** 2 - alone**2), turned, rtol=0.05)
