"""From 2D keypoints alone: the lift stage on the walker, whose camera and joints are known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import InputError, Take
from pcnet3d.pipeline.core.camera import Camera, Look
from pcnet3d.pipeline.core.intrinsics import Intrinsics, undistorted
from pcnet3d.pipeline.core.rotations import kabsch, rotate
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.stages.lift import Lift

IMAGE_SIZE = (640, 360)


@pytest.fixture(scope="module")
def walk() -> Walk:
    return walker(seconds=4)


@pytest.fixture(scope="module")
def files(walk, tmp_path_factory):
    return write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk))


@pytest.fixture(scope="module")
def take(files) -> Take:
    return open_take(RunOptions(video=files.video, keypoints=files.keypoints))


def test_the_walker_is_recognised_from_his_keypoints(walk, take):
    """Far from what the lifter can do on people: a loose bound that a mirrored or turned lift would break."""
    lifted = Lift()(take).poses
    truth = camera_poses(walk, side_camera(walk)).joints[lifted.frame_index].astype(float)
    truth -= truth[:, :1]
    joints = lifted.joints.astype(float)
    joints *= (joints * truth).sum() / (joints * joints).sum()
    error = np.linalg.norm(joints - truth, axis=-1).mean()
    mirrored = np.linalg.norm(joints * [1, 1, -1] - truth, axis=-1).mean()
    assert error < 0.15
    assert error < 0.7 * mirrored
    R = kabsch(truth, joints)
    assert np.linalg.norm(rotate(R, joints) - truth, axis=-1).mean() < 0.1


def test_the_videos_rotation_flag_turns_the_image_size(take, monkeypatch):
    sizes = []

    def spy(asked, model):
        sizes.append(asked.image_size)
        raise InputError("bad-value", "seen")

    monkeypatch.setattr("pcnet3d.models.lifter.builtin.lifted", spy)
    for rotation in (0, 90):
        turned = take.with_(video=replace(take.video, rotation_deg=rotation))
        with pytest.raises(InputError, match="seen"):
            Lift()(turned)
    assert sizes[0] == sizes[1][::-1]


def test_an_image_size_beside_a_video_has_to_be_its_own(files):
    """The lift would take one size, and the border of the image and the place the other."""
    options = RunOptions(video=files.video, keypoints=files.keypoints, image_size=(320, 180))
    with pytest.raises(InputError, match="which shows 640x360; got 320x180"):
        open_take(options)
    assert open_take(options.model_copy(update={"image_size": IMAGE_SIZE})).keypoints is not None


def test_without_a_video_the_image_size_must_be_given(take):
    alone = take.with_(video=None)
    with pytest.raises(InputError, match=r"--set read\.image_size"):
        Lift()(alone)
    assert Lift()(alone.telling(image_size=IMAGE_SIZE)).poses is not None


def test_a_wide_lens_hides_nobody_at_the_border_of_its_image(take, walk):
    """A person at the border, of whom most of the picture without distortion shows nothing, is lifted as in the
    middle, where the lens hardly distorts."""
    lens = Intrinsics((420.0, 420.0), (320.0, 180.0), (-0.3, 0.05, 0.0, 0.0), image_size=IMAGE_SIZE)
    camera = Camera(IMAGE_SIZE, lens.pinhole_focal_px, 0.0, "told", intrinsics=lens)
    middle = take.keypoints.joints.astype(float)
    rays = np.concatenate([(middle - [320, 180]) / 900, np.ones((*middle.shape[:2], 1))], axis=-1)
    turn = Rotation.from_euler("y", 33, degrees=True).as_matrix()

    def filmed(R):
        pixels, _ = cv2.projectPoints(
            (rays @ R.T).reshape(-1, 1, 3), np.zeros(3), np.zeros(3), lens.matrix, np.array(lens.distortion)
        )
        return take.keypoints.with_(joints=pixels.reshape(middle.shape))

    aside = filmed(turn)
    inside = np.nanmean((aside.joints[..., 0] > 3) & (aside.joints[..., 0] < 637))
    assert inside > 0.95
    assert np.nanmean(undistorted(aside.joints, lens)[..., 0] > 640) > 0.5
    alone = take.with_(video=None, camera=camera).telling(image_size=IMAGE_SIZE)
    one, other = (Lift()(alone.with_(keypoints=k)).poses for k in (filmed(np.eye(3)), aside))
    apart = rotate(turn, one.joints.astype(float)) - other.joints
    assert np.nanmean(np.linalg.norm(apart, axis=-1)) < 0.05


def test_most_keypoints_outside_the_filmed_picture_are_refused_with_a_lens_too(take):
    lens = Intrinsics((500.0, 500.0), (320.0, 180.0), (-0.3, 0.05, 0.0, 0.0), image_size=IMAGE_SIZE)
    camera = Camera(IMAGE_SIZE, lens.pinhole_focal_px, 0.0, "told", intrinsics=lens)
    beyond = take.keypoints.with_(joints=take.keypoints.joints + np.array([700, 0]))
    with pytest.raises(InputError, match=r"got 640x360, outside|missing"):
        Lift()(take.with_(video=None, camera=camera, keypoints=beyond).telling(image_size=IMAGE_SIZE))


def test_a_frame_of_somebody_else_is_left_out_of_the_lift(take):
    """A tracker's last frame on another person bent a trunk by 80 degrees."""
    joints = take.keypoints.joints.copy()
    middle = joints[-1].mean(axis=0)
    joints[-1] = 2 * middle - joints[-1]  # upside down
    spoilt = Lift()(take.with_(keypoints=take.keypoints.with_(joints=joints)))
    assert any(event.code == "frames-without-joints" and "1 frame" in event.text for event in spoilt.notices)
    trunk = spoilt.poses.joint("thorax") - spoilt.poses.joint("pelvis")
    assert trunk[-1] @ trunk[-2] > 0.9 * np.linalg.norm(trunk[-1]) * np.linalg.norm(trunk[-2])


@pytest.mark.parametrize(("by", "told"), [(0.3, False), (1.5, True)])
def test_who_is_suddenly_somewhere_else_may_be_another(take, by, told):
    """A man went out of the image, the track went on with a woman at its other side, and nothing was said."""
    points = take.keypoints.joints.copy()
    points[60:, :, 0] += by * np.ptp(points[60, :, 1]) / 3
    found = Lift()(take.with_(keypoints=take.keypoints.with_(joints=points))).findings
    said = [each for each in found if each.code == "leap-between-people"]
    assert [each.values["frame"] for each in said] == [take.keypoints.frame_index[60]] * told


def up_known(take, **told) -> bool:
    return Lift()(take.telling(**told)).poses.history[-1].options["up_known"]


def test_the_lift_uses_the_up_that_is_known(take, walk):
    up = side_camera(walk).R_camera_from_world[:, 2]
    look = Look(0, up, np.radians(0.5) ** 2 * (np.eye(3) - np.outer(up, up)), failure=0.004)
    seen = Camera(IMAGE_SIZE, 500.0, 20.0, "lines", (look,))
    assert not up_known(take)
    assert up_known(take.with_(camera=seen))
    assert up_known(take, gravity=tuple(-up))
    assert not up_known(take.with_(camera=seen), camera="moving")  # one look tells little of a whole take
    often = tuple(replace(look, frame=frame) for frame in range(0, 120, 10))
    assert up_known(take.with_(camera=replace(seen, looks=often)), camera="moving")
    unsure = replace(look, covariance=look.covariance * 100)
    assert not up_known(take.with_(camera=replace(seen, looks=(unsure,))))


def test_an_up_that_the_skeletons_contradict_does_not_bend_the_lift(take):
    """A pattern of diagonal lines once said that a camera was rolled by 45 degrees."""
    up = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0])
    look = Look(0, up, np.radians(0.5) ** 2 * (np.eye(3) - np.outer(up, up)), failure=0.05)
    seen = take.with_(camera=Camera(IMAGE_SIZE, 500.0, 20.0, "lines", (look,)))
    np.testing.assert_array_equal(
        Lift()(seen.telling(focal_px=500.0)).poses.joints, Lift()(take.telling(focal_px=500.0)).poses.joints
    )
