"""Measures of the walker against what it did, what is absent and why, their table, and the recording's share."""

import numpy as np
import pytest

from golden.walks import STAGES, measured, remeasured
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.pipeline import H36M17, Z_UP, InputError, PoseSequence
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.running.sentences import answer
from pcnet3d.pipeline.signals.angles import ANGLES, FINE, MIDLINE, UNTRUSTED, near
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.report.measures import happened


@pytest.mark.parametrize("camera", ["static", "moving"])
def test_a_take_shows_the_same_whenever_it_was(walk, camera):
    """Stamps that count from 1970: what was done when is told from then, and as well as it was."""
    poses = camera_poses(walk, side_camera(walk))
    found, late = (
        nested(measured(poses.with_(time_s=poses.times + s), camera=camera).measures) for s in (0.0, 1.7e9)
    )
    assert late["walking"]["steps"] == found["walking"]["steps"] > 5
    assert late["walking"]["cadence_spm"] == pytest.approx(found["walking"]["cadence_spm"], rel=1e-5)
    groups = [("knee_bends", "start_s"), ("knee_bends", "stop_s"), ("walking", "left", "landings_s")]
    for group, *keys in groups:
        own, later = found[group], late[group]
        for key in keys:
            own, later = own[key], later[key]
        np.testing.assert_allclose(np.array(later) - 1.7e9, own, atol=2e-3)


def test_ranges_of_motion_within_a_degree(walk, take):
    made = walk.angles_deg
    expected = {
        f"{side}_{joint}_flexion": made[f"{side}_{joint}_flexion_deg"]
        for side in "rl"
        for joint in ("knee", "elbow", "thigh_trunk", "shoulder")
    } | {
        "trunk_lean_sagittal": made["trunk_lean_deg"],
        "thorax_pelvis_rotation": -2 * made["pelvis_turn_deg"],
    }
    for name, values in expected.items():
        found = nested(take.measures)["range_of_motion"][name]
        low, high = np.percentile(values, [5, 95])
        for key, value in (
            ("lowest_deg", values.min()),
            ("highest_deg", values.max()),
            ("p05_deg", low),
            ("p95_deg", high),
            ("p05_p95_deg", high - low),
        ):
            assert found[key] == pytest.approx(value, abs=1.0), (name, key)
        assert found["nan_share"] == 0


def test_one_squat_with_its_depth_and_times(walk, take):
    bends = nested(take.measures)["knee_bends"]
    knee, times = walk.angles_deg["r_knee_flexion_deg"], walk.time_s
    during = walk.during("squat")
    bent = knee - knee[during].min() > 0.07 * np.ptp(knee[during])
    speed = np.gradient(knee, times)
    fast = times[during & (speed > 0.2 * speed[during].max())]
    assert bends["count"] == 1
    assert bends["peak_deg"][0] == pytest.approx(knee[during].max(), abs=0.5)
    # Two frames: the filter spreads the slow beginning.
    assert bends["start_s"][0] == pytest.approx(fast[0], abs=2 / 30)
    assert bends["stop_s"][0] == pytest.approx(times[during & bent][-1], abs=2 / 30)
    assert set(bends["cycles"]) == {
        "r_knee_flexion", "l_knee_flexion", "r_thigh_trunk_flexion", "l_thigh_trunk_flexion", "trunk_lean_sagittal",
    }  # fmt: skip
    curve = bends["cycles"]["r_knee_flexion"]
    share = np.linspace(bends["start_s"][0], bends["stop_s"][0], 101)
    np.testing.assert_allclose(curve["mean_deg"], np.interp(share, times, knee), atol=0.6)
    assert (curve["count"], "sd_deg" in curve) == (1, False)


def test_an_angle_across_the_end_of_its_range_has_the_range_and_the_cycles_that_it_swings(walk, take):
    """Shoulder flexion lies in -120 to 240 degrees, where every circle of an arm passes its end."""
    swing = 240 + 3 * np.sin(2 * np.pi * walk.time_s)
    circles = near(360 * walk.time_s, 60.0)
    found = remeasured(take, r_shoulder_flexion_deg=near(swing, 60.0), l_shoulder_flexion_deg=circles)
    for side, full_deg in (("r", 6), ("l", 348)):  # 12 degrees a frame
        of_side = found["range_of_motion"][f"{side}_shoulder_flexion"]
        assert of_side["highest_deg"] - of_side["lowest_deg"] == pytest.approx(full_deg, abs=1)
    curve = np.array(found["walking"]["cycles"]["r_shoulder_flexion"]["mean_deg"])
    assert np.abs(near(curve - 240, 0.0)).max() < 3.1
    assert np.abs(np.diff(curve)).max() < 1


def test_knees_that_bend_together_in_a_step_make_no_squat(walk, take):
    bent = {}
    for side in "rl":  # a crouched walk: both knees beyond 60 degrees around every landing
        landings = [
            t for words in ("right", "left") for t in nested(take.measures)["walking"][words]["landings_s"]
        ]
        bumps = sum(80 * np.exp(-(((walk.time_s - landing) / 0.1) ** 2)) for landing in landings)
        bent[f"{side}_knee_flexion_deg"] = take.kinematics[f"{side}_knee_flexion_deg"] + bumps
    bends = remeasured(take, **bent)["knee_bends"]
    assert bends["count"] == 1
    assert bends["start_s"][0] > walk.phases_s["squat"][0]


def test_arms_go_up_in_the_squat_and_overhead(walk, take):
    for side in ("right", "left"):
        arm = nested(take.measures)["arm_raises"][side]
        assert arm["count"] == 2
        for start, stop, peak, phase in zip(
            arm["start_s"], arm["stop_s"], arm["peak_deg"], ("squat", "arms"), strict=True
        ):
            low, high = walk.phases_s[phase]
            assert low < start < stop < high
            assert peak == pytest.approx(
                walk.angles_deg["r_shoulder_flexion_deg"][walk.during(phase)].max(), abs=0.5
            )
    assert set(nested(take.measures)["arm_raises"]["cycles"]) >= {
        "r_shoulder_elevation",
        "l_shoulder_elevation",
    }


def test_symmetry_of_a_symmetric_person_and_of_a_stiff_leg(walk, take):
    symmetry = nested(take.measures)["symmetry"]
    assert abs(symmetry["knee_flexion"]["symmetry_index_percent"]) < 2
    assert symmetry["hip_abduction"]["symmetry_index_withheld"] == "range-too-small"
    assert set(symmetry) == {name[2:] for name in ANGLES if name not in MIDLINE}
    halved = take.kinematics["l_knee_flexion_deg"] / 2
    stiff = remeasured(take, l_knee_flexion_deg=halved)["symmetry"]["knee_flexion"]
    assert stiff["symmetry_index_percent"] == pytest.approx(100 * (1 - 0.5) / 0.75, abs=2)


def test_missing_joints_make_figures_absent_with_a_reason(walk):
    joints = walk.poses.joints.copy()
    joints[:, H36M17.index("r_knee")] = np.nan
    found = nested(measured(walk.poses.with_(joints=joints)).measures)
    knee = found["range_of_motion"]["r_knee_flexion"]
    assert knee == {"withheld": "few-frames", "nan_share": 1.0}
    assert found["symmetry"]["knee_flexion"] == {"withheld": "side-missing"}
    assert found["knee_bends"] == found["walking"] == found["jumps"] == {"observable_percent": 0.0}
    assert found["arm_raises"]["right"]["count"] == 2


_COPIED = (*STAGES[:3], Measures(unusable=True))  # a clip that plays more than once is found to


@pytest.fixture
def squats(walk):
    """Four squats that are alike."""
    joints = np.concatenate([walk.poses.joints[np.flatnonzero(walk.during("squat"))]] * 4)
    return PoseSequence(joints, H36M17, Z_UP, time_s=np.arange(len(joints)) / 30)


def without_hip(poses, rows):
    joints = poses.joints.copy()
    joints[rows, H36M17.index("r_hip")] = np.nan
    return poses.with_(joints=joints)


def test_a_gap_that_cuts_one_of_several_squats_is_told(squats):
    """Four squats, the third without a hip for 0.9 s: three, of which nobody can say that they were all."""
    assert {"count": 4, "squats": 4}.items() <= nested(measured(squats, _COPIED).measures)[
        "knee_bends"
    ].items()
    middle = 2 * len(squats) // 4 + len(squats) // 8
    take = measured(without_hip(squats, slice(middle - 13, middle + 14)), _COPIED)
    found = nested(take.measures)["knee_bends"]
    assert (found["count"], found["count_at_least"]) == (3, True)
    assert answer(take)[0].startswith("At least 3 squats, peak of both knees ")
    assert "at least 3" in happened(take.measures, metric=True)


def test_an_angle_that_is_none_is_refused():
    with pytest.raises(InputError, match="did you mean r_elbow_flexion"):
        Measures(("r_elbow_flexon",))


@pytest.mark.parametrize(("depth_deg", "squats"), [(55.0, 0), (85.0, 1)])
def test_a_duck_is_a_knee_bend_and_no_squat(walk, take, depth_deg, squats):
    """The boxer who ducks bends his knees by 55 degrees."""
    squat = walk.during("squat")
    share = depth_deg / walk.angles_deg["r_knee_flexion_deg"][squat].max()
    found = remeasured(
        take,
        **{
            f"{side}_knee_flexion_deg": take.kinematics[f"{side}_knee_flexion_deg"]
            * np.where(squat, share, 0)
            for side in "rl"
        },
        **{f"{side}_knee_flexion_sd_deg": np.full(len(walk), 8.0) for side in "rl"},
    )
    bends = found["knee_bends"]
    assert (bends["count"], bends["squats"]) == (1, squats)
    assert bends["peak_deg"][0] == pytest.approx(depth_deg, abs=1)
    assert bends["peak_error_deg"] == [8.0]
    assert bends["mean_rise_error_deg"] == pytest.approx(8 * np.sqrt(2), abs=0.5)


def test_ranges_beyond_anatomy_are_marked(walk, take):
    turned = take.kinematics["l_elbow_flexion_deg"].copy()
    turned[40:44] = -156.0  # as a lift of a cyclist had it
    ranges = remeasured(take, l_elbow_flexion_deg=turned)["range_of_motion"]
    assert ranges["l_elbow_flexion"]["beyond_anatomy_frames"] == 4
    assert [name for name, entry in ranges.items() if "beyond_anatomy_frames" in entry] == ["l_elbow_flexion"]


def test_who_lies_or_hangs_has_no_trunk_beyond_anatomy(walk, take):
    """All angles to gravity turned by 94 degrees back, as of somebody on the floor."""
    lying = {
        name: take.kinematics[f"{name}_deg"] - 94 for name, angle in ANGLES.items() if angle.needs_gravity
    }
    ranges = remeasured(take, **{f"{name}_deg": values for name, values in lying.items()})["range_of_motion"]
    assert "trunk_lean_sagittal" in lying
    assert not [name for name, entry in ranges.items() if "beyond_anatomy_frames" in entry]


@pytest.mark.parametrize("ahead_deg", [2.0, -2.0])
@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_arms_raised_sideways_have_one_range_in_front_of_the_shoulders_and_behind(walk, ahead_deg, noise_m):
    """On the way flexion is not defined, and steps by about half a turn. Two degrees behind the shoulders that went to
    -180 and was beyond anatomy, while the columns of the same take ended at 187."""
    still = walk.world[-1]
    rise = np.radians(8 + 81 * (1 - np.cos(np.pi * walk.time_s / 2)))
    ahead = np.radians(ahead_deg)
    world = np.tile(still, (len(walk), 1, 1))
    for side, out in (("r", -1.0), ("l", 1.0)):  # the walker stands facing north, the left to the west
        arm = np.stack(
            [np.sin(rise) * np.sin(ahead), out * np.sin(rise) * np.cos(ahead), -np.cos(rise)], axis=-1
        )
        shoulder, elbow, wrist = H36M17.indices([f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")])
        upper, lower = (np.linalg.norm(still[a] - still[b]) for a, b in ((elbow, shoulder), (wrist, elbow)))
        world[:, elbow] = still[shoulder] + upper * arm
        world[:, wrist] = still[shoulder] + (upper + lower) * arm
    world += noise_m * np.random.default_rng(0).normal(size=world.shape)
    raised = measured(walk.poses.with_(joints=world))
    assert nested(raised.measures)["arm_raises"]["right"]["count"] == 3
    for side in "rl":
        found = nested(raised.measures)["range_of_motion"][f"{side}_shoulder_flexion"]
        column = raised.kinematics[f"{side}_shoulder_flexion_deg"]
        assert found["lowest_deg"] == pytest.approx(np.nanmin(column), abs=1e-3)
        assert found["highest_deg"] == pytest.approx(np.nanmax(column), abs=1e-3)
        assert "beyond_anatomy_frames" not in found


@pytest.mark.parametrize(("share", "told"), [(0.04, True), (0.2, False)])
def test_an_angle_that_many_frames_lack_near_its_axis_has_no_range_and_no_difference(walk, take, share, told):
    """Lifted upper arms differed by -146 to +189 %, by which camera looked: the frames that a range lacked were its
    outermost."""
    lacking = np.arange(len(walk)) < share * len(walk)
    name, both = "r_upper_arm_sagittal", "upper_arm_sagittal"
    found = remeasured(
        take,
        **{f"{side}_{both}_sd_deg": np.full(len(walk), 5.0) for side in "rl"},
        **{f"{name}_deg": np.where(lacking, np.nan, take.kinematics[f"{name}_deg"])},
        **{f"{name}_reason": np.where(lacking, UNTRUSTED, FINE)},
    )
    assert ("p05_deg" in found["range_of_motion"][name]) == told
    assert ("symmetry_index_percent" in found["symmetry"][both]) == told
    assert ("withheld" in found["range_of_motion"][name]) != told


def test_in_a_take_of_less_than_a_stride_the_sides_are_not_compared(take):
    """A runner in view for 0.7 s had five differences of right and left."""
    found = nested(measured(take.poses.rows(0, 40)).measures)
    assert found["symmetry"] == {"withheld": "take-too-short"}
    assert "symmetry_index_percent" in nested(take.measures)["symmetry"]["knee_flexion"]
