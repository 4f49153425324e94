"""Skeletons: forward kinematics of chains whose answer is known, joints found under everybody's names."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.files.skeletons import Skeleton, h36m17_named, h36m17_of_skeleton, match, place

CHAIN = Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0, 2, 0], [0, 1, 0]], dtype=float))
LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")


def about(axis, degrees):
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def test_a_chain_of_two_bones():
    """The first turns by 90 degrees about z, the second by 90 degrees back: an L."""
    R = np.stack([about("z", 90), about("z", -90), np.eye(3)])[None]
    joints, R_world = place(CHAIN, np.array([[5.0, 0, 0]]), R)
    np.testing.assert_allclose(joints[0], [[5, 0, 0], [3, 0, 0], [3, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(R_world[0, 1], np.eye(3), atol=1e-12)


def test_bones_keep_their_length_and_a_turned_root_turns_everything():
    rng = np.random.default_rng(0)
    R = Rotation.random(15, rng=rng).as_matrix().reshape(5, 3, 3, 3)
    joints, _ = place(CHAIN, np.zeros((5, 3)), R)
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints, axis=1), axis=-1), [[2, 1]] * 5)
    Q = Rotation.random(rng=rng).as_matrix()
    turned = R.copy()
    turned[:, 0] = Q @ R[:, 0]
    np.testing.assert_allclose(place(CHAIN, np.zeros((5, 3)), turned)[0], joints @ Q.T, atol=1e-12)


@pytest.mark.parametrize(
    "names",
    [
        "Hips LHipJoint LeftUpLeg LeftLeg LeftFoot RHipJoint RightUpLeg RightLeg RightFoot LowerBack Neck Neck1 Head "
        "LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand",
        "root lhipjoint lfemur ltibia lfoot rhipjoint rfemur rtibia rfoot lowerback lowerneck upperneck head lclavicle "
        "lhumerus lradius lwrist lhand rclavicle rhumerus rradius rwrist rhand",
        "hip lThigh lShin lFoot rThigh rShin rFoot abdomen chest neck head lCollar lShldr lForeArm lHand rCollar "
        "rShldr rForeArm rHand",
        "mixamorig:Hips mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:RightUpLeg "
        "mixamorig:RightLeg mixamorig:RightFoot mixamorig:Neck mixamorig:Head mixamorig:LeftShoulder mixamorig:LeftArm "
        "mixamorig:LeftForeArm mixamorig:LeftHand mixamorig:RightArm mixamorig:RightForeArm mixamorig:RightHand",
        "pelvis thigh_l calf_l foot_l thigh_r calf_r foot_r spine_01 neck_01 head upperarm_l lowerarm_l hand_l "
        "upperarm_r lowerarm_r hand_r",
        "Hips LeftThigh LeftShin LeftFoot RightThigh RightShin RightFoot Spine1 Neck Head LeftShoulder LeftArm "
        "LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand",
        "joint_Root Hips Spine Chest Neck Head Shoulder_L UpperArm_L LowerArm_L Hand_L Shoulder_R UpperArm_R "
        "LowerArm_R Hand_R UpperLeg_L LowerLeg_L Foot_L UpperLeg_R LowerLeg_R Foot_R",
        "thigh.L shin.L foot.L thigh.R shin.R foot.R neck head upper_arm.L forearm.L hand.L upper_arm.R forearm.R "
        "hand.R",
        "Hip Ab Neck Head LShoulder LUArm LFArm LHand RShoulder RUArm RFArm RHand LThigh LShin LFoot RThigh RShin "
        "RFoot",
        "HIP_LEFT KNEE_LEFT ANKLE_LEFT HIP_RIGHT KNEE_RIGHT ANKLE_RIGHT NECK HEAD SHOULDER_LEFT ELBOW_LEFT WRIST_LEFT "
        "SHOULDER_RIGHT ELBOW_RIGHT WRIST_RIGHT",
        "pelvis L_Hip L_Knee L_Ankle R_Hip R_Knee R_Ankle Spine1 Neck Head L_Collar L_Shoulder L_Elbow L_Wrist "
        "R_Shoulder R_Elbow R_Wrist",
    ],
)
def test_names_in_use(names):
    names = names.split()
    found = match(names)
    assert set(found) == {"neck", "head", *(f"{s}_{j}" for s in "lr" for j in LIMBS)}
    assert len(set(found.values())) == len(found)
    words = {
        "hip": "up(per)?leg|femur|thigh|hip",
        "elbow": "fore_?arm|radius|lowerarm|farm|elbow",
        "knee": "leg|tibia|shin|calf|knee",
    }
    for side in "lr":
        for joint, allowed in words.items():
            name = names[found[f"{side}_{joint}"]].lower().rpartition(":")[2]
            assert re.search(allowed, name), name
            assert name.startswith(side) or re.search(rf"[_.]{side}(eft|ight)?$", name), name


def test_biped_names_with_spaces_and_a_shared_prefix():
    names = ["Bip01"] + [f"Bip01 {n}" for n in ("Pelvis", "Spine", "Neck", "Head")]
    names += [
        f"Bip01 {s} {n}" for s in "LR" for n in ("Thigh", "Calf", "Foot", "UpperArm", "Forearm", "Hand")
    ]
    found = match(names)
    assert names[found["l_wrist"]] == "Bip01 L Hand"
    assert names[found["r_ankle"]] == "Bip01 R Foot"


def test_made_joints_of_a_t_pose():
    """Known places: mid-hips, on the back, up the neck, and nose and crown on a head that is turned."""
    names = ["root", *(f"{s}_{j}" for s in "lr" for j in LIMBS), "spine", "neck", "head"]
    parents = [-1] + [0] * (len(names) - 2) + [len(names) - 2]
    points = {name: np.zeros(3) for name in names}
    for side, x in (("l", 1), ("r", -1)):
        heights = (-0.1, -0.5, -0.9, 0.5, 0.5, 0.5)
        points |= {
            f"{side}_{j}": np.array([x * w, y, 0])
            for j, y, w in zip(LIMBS, heights, (0.1, 0.1, 0.1, 0.2, 0.5, 0.8), strict=True)
        }
    points |= {"spine": np.array([0, 0.2, 0]), "neck": np.array([0, 0.5, 0]), "head": np.array([0, 0.1, 0])}
    skeleton = Skeleton(tuple(names), tuple(parents), np.array([points[name] for name in names]))
    R = np.tile(np.eye(3), (1, len(names), 1, 1))
    R[0, -1] = about("y", 90)  # the head looks to its left, +x, as a fencer's does all the time
    joints, R_world = place(skeleton, np.zeros((1, 3)), R)
    made = dict(zip(H36M17.joints, h36m17_of_skeleton(skeleton, joints, R_world)[0][0], strict=True))
    np.testing.assert_allclose(made["pelvis"], [0, -0.1, 0], atol=1e-12)
    np.testing.assert_allclose(made["spine"], [0, -0.1 + 0.43 * 0.6, 0], atol=1e-12)
    np.testing.assert_allclose(made["thorax"], [0, 0.525, 0], atol=1e-12)
    np.testing.assert_allclose(made["nose"], [0.05, 0.6, 0], atol=1e-12)
    np.testing.assert_allclose(made["head"], [0, 0.73, 0], atol=1e-12)
    np.testing.assert_allclose(made["l_wrist"], [0.8, 0.5, 0], atol=1e-12)


@pytest.mark.parametrize("missing", ["neck", "spine1", "l_hip"])
def test_a_marker_that_is_missing_in_the_first_frame_takes_the_spine_of_that_frame_alone(missing):
    names = [*(f"{s}_{j}" for s in "lr" for j in LIMBS), "spine1", "neck", "head"]
    joints = np.tile(np.random.default_rng(0).normal(size=(len(names), 3)), (3, 1, 1))
    whole = h36m17_named(joints, names)[:, H36M17.index("spine")]
    joints[0, names.index(missing)] = np.nan
    spine = h36m17_named(joints, names)[:, H36M17.index("spine")]
    np.testing.assert_allclose(spine[1:], whole[1:])
