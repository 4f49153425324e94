"""The stage `place`: who is placed, who is not and why, and what the rest of a run does with an estimated path."""

import numpy as np
import pytest

from golden.walks import FOCAL_PX as FOCAL
from golden.walks import GEOMETRIC, JUDGED, SIZE, filmed
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation.errors import frame_by_frame
from pcnet3d.pipeline import (
    CAMERA,
    H36M17,
    InputError,
    Pipeline,
    PoseSequence,
    Told,
    change_frame,
)
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.pipeline.reading.findings import repaired
from pcnet3d.stages.clean import clean
from pcnet3d.stages.place import Place
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.scale import Scale, scale

AFTER = Pipeline(GEOMETRIC)  # which use the path


@pytest.fixture(scope="module")
def camera(walk):
    return aimed(walk.root.mean(axis=0), 6, heading_deg=walk.heading_deg[0] + 100, pitch_deg=10, roll_deg=3)


@pytest.fixture(scope="module")
def take(walk, camera):
    take = filmed(walk, camera, noise_px=2.0)
    frame = CAMERA.with_(origin="pelvis", unit="m")
    return take.with_(poses=take.poses.with_(frame=frame, made_by=JUDGED))


@pytest.fixture(scope="module")
def placed(take):
    return Place()(take)


@pytest.fixture(scope="module")
def through(placed):
    return AFTER(placed)


def test_the_path_and_its_error_go_with_the_poses(placed, walk, camera):
    true = camera.points(walk.root[:, None])[:, 0]
    assert np.median(np.linalg.norm(placed.poses.root - true, axis=1)) < 0.06
    assert placed.poses.path.sd.shape == (len(walk), 3)
    assert placed.poses.path.sd[:, 2].min() > 3 * placed.poses.path.sd[:, 1].max()
    assert placed.poses.own_root is None
    said = placed.poses.history[-1]
    assert (said.name, said.options["frames_placed"], said.options["focal_sd"]) == ("place", len(walk), 0.02)
    assert placed.poses.path.shared == (said.options["scale_sd"], 0.02)
    assert (placed.notices[-1].code, placed.notices[-1].values["placed"]) == ("placed", 240)


@pytest.mark.parametrize("unit", [1.0, 0.4])
def test_how_well_the_place_is_known_is_said_in_the_unit_that_the_lengths_get(take, unit):
    """It was said in units, of a take of which all other lengths were in metres by a told stature."""
    frame = CAMERA.with_(origin="pelvis", unit="m" if unit == 1.0 else "arbitrary")
    poses = take.poses.with_(joints=unit * take.poses.joints, frame=frame)
    own, scaled = (
        Scale()(Place()(take.with_(poses=poses, told=Told(stature_m=stature_m)))) for stature_m in (None, 1.5)
    )
    (has_unit, gets_metres) = (
        next(one.values for one in each.notices if one.code == "placed") for each in (own, scaled)
    )
    assert (has_unit["unit"], gets_metres["unit"]) == ("m" if unit == 1.0 else "units", "m")
    grown = np.nanmedian(scaled.poses.path.sd[:, 2] / own.poses.path.sd[:, 2])
    assert gets_metres["within"] / has_unit["within"] == pytest.approx(grown, rel=0.06)


def test_a_frame_of_somebody_who_crouches_is_not_said_to_be_as_well_known(take, monkeypatch):
    """Half of the frames of people who crouch were within; by the mean over the frames, three quarters of those of
    people who crouch for a part of the take."""
    within = []
    for share in (0.0, 0.2, 1.0):
        monkeypatch.setattr(
            "pcnet3d.stages.place.folding",
            lambda body, of=share: 0.5 * (np.arange(2 * len(body)).reshape(-1, 2) < of * 2 * len(body)),
        )
        said = next(one for one in Place()(take).notices if one.code == "placed")
        within.append(said.values["within"])
    assert within[1] == within[2] > 2 * within[0]


def test_what_is_said_of_a_frame_holds_for_a_body_whose_size_changes_with_its_posture(take, walk, camera):
    """By the frames' own covariance 47 to 85 % of a man's were inside before four real cameras."""
    size = 1 + 0.015 * np.sqrt(2) * np.sin(2 * np.pi * 0.5 * take.poses.times)  # too little to be levelled
    placed = Place()(take.with_(poses=take.poses.with_(joints=take.poses.joints * size[:, None, None])))
    (said,) = (each.values for each in placed.notices if each.code == "placed")
    true = camera.points(walk.world)[:, H36M17.index("pelvis")]
    off = frame_by_frame(placed.poses.root, true)
    assert (off <= said["within"]).mean() > 0.8
    longer = 1.1 * placed.poses.root * [1, 1, 2.0]  # is said beside
    np.testing.assert_allclose(frame_by_frame(longer, true), off, atol=1e-6)


def test_a_place_that_the_source_knows_is_kept(take):
    own = np.random.default_rng(1).normal(size=(len(take.poses), 3))
    known = take.with_(poses=take.poses.with_(path=RootPath(own)))
    found = Place()(known)
    assert found is known
    assert found.poses.own_root is not None


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda take: take.with_(keypoints=None), "no 2D keypoints"),
        (lambda take: take.with_(told=Told(camera="moving")), "the camera moves"),
        (lambda take: take.with_(camera=None), "image's size is not known"),
        (lambda take: take.with_(poses=walker().poses.with_(path=None)), "not in a camera's axes"),
        (lambda take: take.with_(poses=take.poses.rows(0, 2)), "a path needs 3 frames, got 2"),
        (lambda take: take.with_(keypoints=take.keypoints.with_(joints=take.keypoints.joints + 5000)), "few joints"),
    ],
)  # fmt: skip
def test_who_cannot_be_placed_is_told_why(take, change, why):
    changed = change(take)
    found = Place()(changed)
    assert found.poses.root is None
    (said,) = [event for event in found.notices if event not in changed.notices]
    assert said.code == "not-placed"
    assert why in said.values["reason"]


@pytest.mark.parametrize("changed", [{"told": Told(camera="moving")}, {"rows": 1}])
def test_keypoints_are_not_asked_for_where_they_would_not_help(take, changed):
    """A run on one image asked for keypoints, and with them for more frames."""
    rows = changed.get("rows", len(take.poses))
    alone = take.with_(poses=take.poses.rows(0, rows), keypoints=None, told=changed.get("told", take.told))
    assert "--keypoints" not in Place()(alone).notices[-1].text


def test_without_a_camera_what_is_told_counts_and_a_guess_says_so(take, placed):
    told = Place()(take.with_(camera=None, told=Told(focal_px=FOCAL, image_size=SIZE)))
    assert (told.camera.focal_px, told.camera.image_size, told.camera.focal_source) == (FOCAL, SIZE, "told")
    np.testing.assert_allclose(told.poses.root, placed.poses.root)
    guessed = Place()(take.with_(camera=None, told=Told(image_size=SIZE)))
    assert "a guess" in guessed.notices[-1].text
    assert guessed.poses.path.sd[:, 2].mean() > 3 * placed.poses.path.sd[:, 2].mean()


def test_a_focal_length_for_nothing_is_refused(take):
    with pytest.raises(InputError, match="--focal"):
        Place()(take.with_(camera=None, keypoints=None, told=Told(focal_px=900)))


def test_an_estimated_path_is_no_evidence_on_up(take, placed, walk, camera):
    shares = Rectify(rectifier="geometric")(placed).rectified.up_shares
    without = Rectify(rectifier="geometric")(take).rectified
    assert shares == without.up_shares
    true = take.poses.with_(path=RootPath(camera.points(walk.root[:, None])[:, 0]))
    assert "floor" in Rectify(rectifier="geometric")(take.with_(poses=true)).rectified.up_shares


def test_in_level_it_is_turned_with_its_error(placed, through):
    level, R = through.rectified.level, through.rectified.R_source_from_level
    np.testing.assert_allclose(rotate(R, level.root), placed.poses.root, atol=1e-9)
    np.testing.assert_allclose(R @ level.path.covariance @ R.T, placed.poses.path.covariance, atol=1e-12)
    columns = through.kinematics
    np.testing.assert_array_equal(columns["root_x_sd"], np.float32(level.path.sd[:, 0]))
    moving = Rectify(rectifier="geometric")(placed.telling(camera="moving")).rectified.level
    assert moving.root is None


def test_the_walking_speed_has_the_errors_that_all_strides_share(through, walk, placed, camera):
    found = nested(through.measures)["walking"]
    assert found["walking_speed"] == pytest.approx(walk.speed_mps, rel=0.05)
    assert found["walking_speed_error"] >= 0.9 * 0.037 * found["walking_speed"]
    unsure = Place()(
        placed.with_(
            poses=placed.poses.with_(path=None),
            camera=Camera(SIZE, FOCAL, 0.3 * FOCAL, "prior"),
        )
    )
    way = np.diff(camera.points(walk.root[walk.during("walk")][:, None])[:, 0], axis=0)
    along = (way[:, 2] ** 2).sum() / (way**2).sum()
    expected = found["walking_speed"] * np.hypot(0.037, 0.3 * along)
    assert nested(AFTER(unsure).measures)["walking"]["walking_speed_error"] == pytest.approx(
        expected, rel=0.25
    )


def test_the_error_follows_a_scale_a_turn_a_mirror_and_cleaning(placed):
    poses = placed.poses
    doubled = scale(poses, 3.5 / 2)[0]
    factor = doubled.history[-1].options["factor"]
    np.testing.assert_allclose(doubled.path.sd, factor * poses.path.sd)
    back = change_frame(poses, CAMERA.with_(origin="pelvis", unit="mm"))
    np.testing.assert_allclose(back.path.sd, 1000 * poses.path.sd)
    mirrored = repaired(poses, "mirror")
    np.testing.assert_allclose(mirrored.path.covariance[:, 0, 2], -poses.path.covariance[:, 0, 2])
    kept = np.delete(np.arange(len(poses)), [40, 41])
    broken = PoseSequence(
        poses.joints[kept], H36M17, poses.frame, time_s=poses.times[kept], frame_index=kept,
        path=poses.path.each(lambda values: values[kept]),
    )  # fmt: skip
    assert np.isnan(clean(broken)[0].path.covariance[40:42]).all()
