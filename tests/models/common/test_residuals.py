"""Poses against keypoints, limbs that are exchanged between the two, or that the detector is unsure of, and the one
number of a lifter's stated error: known answers on the walker with exact keypoints."""

import warnings

import numpy as np
import pytest

from golden.walks import unsure
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.take_angles import AngleSeries, widened, without_exchanged
from pcnet3d.models.common.motion import Motion, agrees, in_doubt, motion_of, steady
from pcnet3d.models.common.residuals import LIMBS, Residuals, limb_scores, residuals, stated_spread
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.signals.angles import ANGLES, EXCHANGED
from pcnet3d.pipeline.signals.swaps import Kind, kinds, swaps_of_take
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

SIZE, FOCAL = (1280, 720), 900.0
LENS = Camera(SIZE, FOCAL, 0.0, "told")


@pytest.fixture
def scene(filmed):
    """The walker's body (PoseSequence) and its exact keypoints."""
    return filmed.poses, filmed.keypoints


def moved(body, joint, by) -> PoseSequence:
    joints = body.joints.copy()
    joints[:, H36M17.index(joint)] += by
    return body.with_(joints=joints)


def test_exact_poses_are_on_their_keypoints(scene):
    found = residuals(*scene, LENS)
    assert np.nanmax(found.whole()) < 0.002
    assert all(np.nanmax(found.limb(limb)) < 0.003 for limb in LIMBS)


def test_a_wrist_that_is_off_is_off_in_its_limb_alone_and_by_as_much(scene):
    body, keypoints = scene
    stature = implied_stature(body.joints)
    found = residuals(moved(body, "r_wrist", [0, 0.1 * stature, 0]), keypoints, LENS)
    assert np.nanmedian(found.limb("r_arm")) == pytest.approx(0.1 / np.sqrt(2), rel=0.1)
    assert np.nanmax(found.limb("l_arm")) < 0.01
    wrist = H36M17.index("r_wrist")
    assert (found.statures[:, wrist, 1] > 0.05).all()  # y down: the joint's image is below its keypoint


def test_residuals_do_not_depend_on_the_unit_of_the_poses(scene):
    body, keypoints = scene
    one = residuals(moved(body, "r_knee", 0.05), keypoints, LENS)
    mm = moved(body, "r_knee", 0.05)
    other = residuals(mm.with_(joints=1000 * mm.joints), keypoints, LENS)
    assert np.allclose(one.statures, other.statures, atol=1e-4, equal_nan=True)


def test_a_joint_without_a_keypoint_has_no_residual(scene):
    body, keypoints = scene
    pixels = keypoints.joints.copy()
    pixels[:, H36M17.index("l_ankle")] = np.nan
    found = residuals(body, keypoints.with_(joints=pixels), LENS)
    assert np.isnan(found.limb("l_leg")).all()
    assert np.isfinite(found.whole()).all()


def test_it_is_the_geometric_mean_of_the_deviations_in_statures():
    joints = walker().world[:10].astype(np.float32)
    covariance = np.zeros((10, 17, 3, 3))
    covariance[:] = np.diag([0.01, 0.01, 0.08]) ** 2
    covariance[:, H36M17.index("pelvis")] = 0
    covariance[3, 5] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, covariance=covariance)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = stated_spread(poses)
    assert found[0] == pytest.approx(0.02 / implied_stature(joints), rel=1e-4)
    assert np.isnan(found[3])
    assert np.isnan(stated_spread(poses.with_(covariance=None))).all()


LEGS, ARMS = kinds(H36M17)
DOUBTED = slice(20, 50)


def motion(take: Take) -> Motion:
    return motion_of(Trajectories()(Rectify("geometric")(take)))


def swapped(poses: PoseSequence, way: Kind, rows: slice = slice(20, 26)) -> PoseSequence:
    """With these limbs exchanged in these rows."""
    joints = poses.joints.copy()
    joints[rows] = way.applied(joints[rows])
    return poses.with_(joints=joints)


def elsewhere(take: Take) -> Take:
    """With both legs where nobody sees them."""
    joints = take.poses.joints.copy()
    joints[DOUBTED, H36M17.indices(("r_ankle", "l_ankle"))] += [0.4, 0.0, 0.0]
    return take.with_(poses=take.poses.with_(joints=joints))


def steadily(rows: int, value_deg: float, sd_deg: float) -> AngleSeries:
    sd = np.full(rows, sd_deg)
    return AngleSeries(np.full(rows, value_deg), sd, np.zeros(rows, np.int8), sd)


def test_errors_grow_where_the_detector_is_unsure_of_an_arm_and_nowhere_else(filmed):
    """Of a woman seen from behind: "left arm raised to 81 degrees (± 11)", where it was at 50, hidden by her body."""
    own = steadily(len(filmed.poses), 81.0, 7.0)
    series = {f"{side}_{angle}": own for side in "rl" for angle in ("shoulder_elevation", "knee_flexion")}
    series |= {name: own for name in ANGLES if name not in series}
    found = widened(series, None, limb_scores(unsure(filmed, "l_elbow", DOUBTED, 0.35)))
    wide = found["l_shoulder_elevation"].sd_deg
    np.testing.assert_allclose(wide[25:45], np.hypot(7, 22.5))
    assert (wide[:15] == 7).all()
    assert found["r_shoulder_elevation"].sd_deg.max() == found["l_knee_flexion"].sd_deg.max() == 7


@pytest.mark.parametrize(
    ("joint", "score", "detector", "known"),
    [
        ("l_elbow", 0.4, "movenet@0", False),
        ("l_elbow", 0.55, "movenet@0", True),
        ("l_elbow", 0.4, "yolo@0", True),
    ],
)
def test_a_joint_of_which_the_detector_is_unsure_is_not_known(filmed, joint, score, detector, known):
    of = motion(unsure(filmed, joint, DOUBTED, score, detector))
    assert of.has([joint])[25:45].all() == known
    assert of.has([joint])[:15].all()
    assert of.has(["r_elbow", "l_knee"]).all()


def test_a_limb_that_contradicts_its_keypoints_or_may_be_exchanged_is_not_known(filmed):
    contradicted = motion(elsewhere(filmed))
    assert not contradicted.has(["r_ankle"])[25:45].any()
    assert contradicted.has(["r_ankle"])[:15].all()
    wrong = swapped(filmed.poses, ARMS)
    said, _ = swaps_of_take(wrong, None)
    exchanged_arms = motion(filmed.with_(poses=wrong, keypoints=None).saying(*said))
    assert not exchanged_arms.has(["l_elbow"])[20:26].any()
    assert exchanged_arms.has(["l_knee"]).all()


def test_errors_grow_where_a_limb_contradicts_its_keypoints_and_nowhere_else():
    off = np.full((60, 17, 2), 0.0)
    off[..., 0] += 0.01 * np.arange(17)  # usual residuals
    off[20:40, H36M17.index("r_wrist")] += 0.4
    residuals = Residuals(off)
    series = {f"{side}_elbow_flexion": steadily(60, 50.0, 8.0) for side in "rl"}
    found = widened(series, residuals, {})
    assert agrees(residuals) > 0
    wide = found["r_elbow_flexion"]
    assert (wide.reason[22:38] != 0).all()  # beyond MAX_SD_DEG
    assert (wide.sd_deg[:18] == 8).all()
    assert (found["l_elbow_flexion"].sd_deg == 8).all()
    assert widened(series, None, {}) == series


def test_a_residual_of_one_frame_is_the_keypoints():
    residual = np.full(30, 0.02)
    residual[10] = 0.5
    assert steady(residual).max() == pytest.approx(0.02)


def test_angles_of_limbs_that_may_be_exchanged_are_withheld(filmed):
    """Of a cyclist whose arms were exchanged: "chest turned 46 right to 65 left" rested on these frames."""
    wrong = swapped(filmed.poses, ARMS)
    said, _ = swaps_of_take(wrong, None)
    doubt = in_doubt(filmed.with_(poses=wrong).saying(*said))
    (rows,) = (np.flatnonzero(of) for of in doubt.values())
    assert rows.tolist() == list(range(20, 26))
    found = without_exchanged(dict.fromkeys(ANGLES, steadily(len(wrong), 8.0, 8.0)), doubt)
    gone = {name for name, of in found.items() if np.isnan(of.value_deg).any()}
    assert {"r_elbow_flexion", "l_shoulder_flexion", "thorax_pelvis_rotation"} <= gone
    assert not gone & {"r_knee_flexion", "l_thigh_sagittal", "trunk_lean_sagittal", "pelvis_obliquity"}
    assert (np.flatnonzero(found["r_elbow_flexion"].reason == EXCHANGED) == rows).all()


def test_exchanged_keypoints_say_nothing_of_poses_that_were_not_lifted_from_them(filmed):
    said, _ = swaps_of_take(None, swapped(filmed.keypoints, LEGS))
    assert in_doubt(filmed.saying(*said)) == {}
    lifted = filmed.poses.with_(made_by=MadeBy("estimated", "pcnet3d", in_run=True))
    assert in_doubt(filmed.with_(poses=lifted).saying(*said))["leg"].sum() == 6
