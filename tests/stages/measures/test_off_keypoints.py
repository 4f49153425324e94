"""Limbs that are exchanged between poses and keypoints, or that the detector is unsure of, on the walker with exact
keypoints."""

import numpy as np
import pytest

from golden.walks import unsure
from pcnet3d.models.angle_error.take_angles import AngleSeries, widened, without_exchanged
from pcnet3d.models.common.motion import Motion, agrees, in_doubt, motion_of, steady
from pcnet3d.models.common.residuals import Residuals, limb_scores
from pcnet3d.pipeline import H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.reading.exchanged import treated
from pcnet3d.pipeline.signals.angles import ANGLES, EXCHANGED
from pcnet3d.pipeline.signals.swaps import Kind, kinds
from pcnet3d.stages.measures.off_keypoints import exchanged
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

LEGS, ARMS = kinds(H36M17)
DOUBTED = slice(20, 50)


def motion(take: Take) -> Motion:
    return motion_of(Trajectories()(Rectify("geometric")(take)))


def codes(take: Take) -> list[str]:
    return [each.code for each in exchanged(take, motion(take))]


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


@pytest.mark.parametrize("which", ["poses", "keypoints"])
@pytest.mark.parametrize("way", [LEGS, ARMS], ids=lambda way: way.name)
def test_legs_that_fit_each_others_keypoints_are_said_to_be_exchanged(filmed, which, way):
    """A lift had a walker's legs exchanged, and the page said only that both contradict the keypoints."""
    wrong = swapped(getattr(filmed, which), way, DOUBTED)
    assert codes(filmed.with_(**{which: wrong})) == ["swapped-to-keypoints"]


def test_legs_that_are_elsewhere_are_not_said_to_be_exchanged(filmed):
    assert codes(elsewhere(filmed)) == []
    assert codes(filmed) == []
    assert codes(filmed.with_(keypoints=None)) == []


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
    _, _, said, _ = treated(wrong, None, "report")
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
    _, _, said, _ = treated(wrong, None, "report")
    doubt = in_doubt(filmed.with_(poses=wrong).saying(*said))
    (rows,) = (np.flatnonzero(of) for of in doubt.values())
    assert rows.tolist() == list(range(20, 26))
    assert in_doubt(filmed.saying(*treated(wrong, None, "mask")[2])) == {}
    found = without_exchanged(dict.fromkeys(ANGLES, steadily(len(wrong), 8.0, 8.0)), doubt)
    gone = {name for name, of in found.items() if np.isnan(of.value_deg).any()}
    assert {"r_elbow_flexion", "l_shoulder_flexion", "thorax_pelvis_rotation"} <= gone
    assert not gone & {"r_knee_flexion", "l_thigh_sagittal", "trunk_lean_sagittal", "pelvis_obliquity"}
    assert (np.flatnonzero(found["r_elbow_flexion"].reason == EXCHANGED) == rows).all()


def test_exchanged_keypoints_say_nothing_of_poses_that_were_not_lifted_from_them(filmed):
    _, _, said, _ = treated(None, swapped(filmed.keypoints, LEGS), "report")
    assert in_doubt(filmed.saying(*said)) == {}
    lifted = filmed.poses.with_(made_by=MadeBy("estimated", "pcnet3d", in_run=True))
    assert in_doubt(filmed.with_(poses=lifted).saying(*said))["leg"].sum() == 6


@pytest.mark.parametrize(("how", "doubted"), [("report", True), ("mask", False)])
def test_legs_that_were_masked_leave_no_doubt_which_leg_is_which(filmed, how, doubted):
    """Beside arms that were not."""
    legs, arms = kinds(filmed.keypoints.layout)
    wrong = swapped(swapped(filmed.keypoints, legs, slice(30, 33)), arms, slice(45, None))
    _, _, said, _ = treated(None, wrong, how)
    lifted = filmed.poses.with_(made_by=MadeBy("estimated", "pcnet3d", in_run=True))
    assert in_doubt(filmed.with_(poses=lifted).saying(*said)).keys() == {"arm", *["leg"] * doubted}
