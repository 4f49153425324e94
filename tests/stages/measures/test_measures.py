"""Measures of the walker against what it did, what is absent and why, their table, and the recording's share."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from pyarrow import parquet

from golden import jumps
from golden.measures import rows_of
from pcnet3d.examples.walker.camera import aimed, camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.gait.errors import shipped_errors
from pcnet3d.models.gait.events import Stance, Stride, walks
from pcnet3d.models.gait.of_take import body_joints, gait_of, least_step
from pcnet3d.pipeline import H36M17, Z_UP, InputError, Pipeline, PoseSequence, Take, Told
from pcnet3d.pipeline.core.answer import answer
from pcnet3d.pipeline.core.frames import CAMERA, PC_CAMERA, change_frame
from pcnet3d.pipeline.core.measures import Measure, nested, with_bar
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.files.measures import Row, read_measures
from pcnet3d.pipeline.signals.angles import ANGLES, FINE, MIDLINE, UNTRUSTED, near
from pcnet3d.pipeline.signals.foot_angles import ALL_ANGLES
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.clean import Clean
from pcnet3d.stages.export.measures import (
    rows,
    write_measures,
    write_measures_parquet,
    write_strides,
)
from pcnet3d.stages.measures.figures import spread
from pcnet3d.stages.measures.floor import floor
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.measures.strides import peaks, stride_rows
from pcnet3d.stages.measures.walking import along_sight
from pcnet3d.stages.record.measures import measures_markdown
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.report.measures import happened
from pcnet3d.stages.trajectories import Trajectories
from refusals import refused

STAGES = (Rectify(), Trajectories(), Angles(), Measures(("r_elbow_flexion",)))
JUDGED = MadeBy("estimated", shipped_noise().lifter)  # as the stage `lift` says


def measured(poses, stages=STAGES, **told):
    return Pipeline(stages)(Take("walker", poses=poses, told=Told(**told)))


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=12)


@pytest.fixture(scope="module")
def take(walk):
    return measured(walk.poses)


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


@pytest.fixture
def without(walk):
    """without(joint, rows): the walker's poses with that joint missing there."""

    def make(joint, rows):
        joints = walk.poses.joints.copy()
        joints[rows, H36M17.index(joint)] = np.nan
        return walk.poses.with_(joints=joints)

    return make


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
            ("full_range_deg", values.max() - values.min()),
            ("p05_deg", low),
            ("p95_deg", high),
            ("p05_p95_deg", high - low),
        ):
            assert found[key] == pytest.approx(value, abs=1.0), (name, key)
        assert (found["frames"], found["nan_share"]) == (len(walk), 0)


@pytest.mark.parametrize(("fps", "turn_deg"), [(30, -45), (25, 0), (50, 90), (29.97, -160)])
def test_cadence_within_one_per_cent_and_steps_at_their_times(fps, turn_deg):
    walk = walker(fps=fps, seconds=12, turn_deg=turn_deg)
    walking = nested(measured(walk.poses).measures)["walking"]
    assert walking["cadence_spm"] == pytest.approx(walk.cadence_spm, rel=0.01)
    assert walking["mean_step_time_s"] == pytest.approx(60 / walk.cadence_spm, rel=0.01)
    assert abs(walking["step_time_symmetry_index_percent"]) < 2
    for words, side in (("right", "r"), ("left", "l")):
        strikes = walk.heel_strikes_s[side]
        for landing in walking[words]["landings_s"]:
            if landing < strikes[-1] + 0.1:
                assert np.abs(strikes - landing).min() < 0.035  # about a frame
    # Every strike at full speed but the first, which begins the first step or lies at the take's edge.
    landings = sum(len(walking[words]["landings_s"]) for words in ("right", "left"))
    assert landings >= sum(map(len, walk.heel_strikes_s.values())) - 2


def test_a_moving_camera_changes_no_steps_but_paths_are_absent(walk):
    steady = measured(walk.poses, STAGES[:3])
    turns = np.radians(30 * np.sin(walk.time_s))
    pan = np.zeros((len(walk), 3, 3))
    pan[:, 0, 0] = pan[:, 1, 1] = np.cos(turns)
    pan[:, 0, 1], pan[:, 1, 0], pan[:, 2, 2] = -np.sin(turns), np.sin(turns), 1
    level = steady.rectified
    moving = replace(level, R_source_from_level=level.R_source_from_level @ pan, camera="moving")
    seen = np.einsum("tji,tnj->tni", pan, steady.filtered.joints)
    found = nested(
        STAGES[3](steady.with_(rectified=moving, filtered=steady.filtered.with_(joints=seen))).measures
    )
    expected = nested(STAGES[3](steady).measures)
    for words in ("right", "left"):
        np.testing.assert_allclose(
            found["walking"][words]["landings_s"], expected["walking"][words]["landings_s"], atol=1e-4
        )
    assert set(found["paths"]) == {"reason"}
    assert found["range_of_motion"] == expected["range_of_motion"]


def test_one_squat_with_its_depth_and_times(walk, take):
    bends = nested(take.measures)["knee_bends"]
    knee, times = walk.angles_deg["r_knee_flexion_deg"], walk.time_s
    during = walk.during("squat")
    begun = times[during & (knee > knee[during].min() + 0.07 * np.ptp(knee[during]))]
    assert bends["count"] == 1
    assert bends["peak_deg"][0] == pytest.approx(knee[during].max(), abs=0.5)
    # Two frames: the filter spreads the slow beginning.
    assert bends["start_s"][0] == pytest.approx(begun[0], abs=2 / 30)
    assert bends["stop_s"][0] == pytest.approx(begun[-1], abs=2 / 30)
    # Minimum-jerk steps, which the filter and the cut at 5 % of the speed change little.
    assert bends["sparc_up"] == pytest.approx(-1.40, abs=0.03)
    assert bends["log_dimensionless_jerk_down"] == pytest.approx(-4.42, abs=0.1)
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
    kinematics = {
        **take.kinematics,
        "r_shoulder_flexion_deg": near(swing, 60.0),
        "l_shoulder_flexion_deg": near(360 * walk.time_s, 60.0),
    }
    found = nested(STAGES[3](take.with_(kinematics=kinematics)).measures)
    assert found["range_of_motion"]["r_shoulder_flexion"]["full_range_deg"] == pytest.approx(6, abs=0.2)
    assert found["range_of_motion"]["l_shoulder_flexion"]["full_range_deg"] == pytest.approx(
        348, abs=1
    )  # 12 degrees a frame
    curve = np.array(found["walking"]["cycles"]["r_shoulder_flexion"]["mean_deg"])
    assert np.abs(near(curve - 240, 0.0)).max() < 3.1
    assert np.abs(np.diff(curve)).max() < 1


def test_knees_that_bend_together_in_a_step_make_no_squat(walk, take):
    bent = dict(take.kinematics)
    for side in "rl":  # a crouched walk: both knees beyond 60 degrees around every landing
        landings = [
            t for words in ("right", "left") for t in nested(take.measures)["walking"][words]["landings_s"]
        ]
        bumps = sum(80 * np.exp(-(((walk.time_s - landing) / 0.1) ** 2)) for landing in landings)
        bent[f"{side}_knee_flexion_deg"] = bent[f"{side}_knee_flexion_deg"] + bumps
    bends = nested(STAGES[3](take.with_(kinematics=bent)).measures)["knee_bends"]
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


def test_strides_carry_curves_with_their_spread(walk, take):
    walking = nested(take.measures)["walking"]
    for side, words in (("r", "right"), ("l", "left")):
        curve = walking["cycles"][f"{side}_knee_flexion"]
        assert curve["count"] == walking[words]["strides"] >= 2
        assert np.max(curve["mean_deg"]) == pytest.approx(60, abs=1.5)
        assert "sd_deg" not in curve  # of fewer than six strides
        assert "6" in walking[words]["sd_reason"]


def test_symmetry_of_a_symmetric_person_and_of_a_stiff_leg(walk, take):
    symmetry = nested(take.measures)["symmetry"]
    assert abs(symmetry["knee_flexion"]["symmetry_index_percent"]) < 2
    assert "below" in symmetry["hip_abduction"]["reason"]
    assert set(symmetry) - {"formula"} == {name[2:] for name in ANGLES if name not in MIDLINE}
    halved = dict(take.kinematics)
    halved["l_knee_flexion_deg"] = halved["l_knee_flexion_deg"] / 2
    stiff = nested(STAGES[3](take.with_(kinematics=halved)).measures)["symmetry"]["knee_flexion"]
    assert stiff["symmetry_index_percent"] == pytest.approx(100 * (1 - 0.5) / 0.75, abs=2)


def test_paths_from_the_pelvis_and_the_way_of_the_pelvis(walk, take):
    paths = nested(take.measures)["paths"]
    for joint, points in (("r_wrist", walk.joint("r_wrist") - walk.root), ("root", walk.root)):
        length = np.linalg.norm(np.diff(points, axis=0), axis=-1).sum()
        assert paths[joint]["path_length"] == pytest.approx(length, rel=0.01)
        assert paths[joint]["duration_s"] == pytest.approx(walk.time_s[-1], rel=1e-5)


def test_missing_joints_make_figures_absent_with_a_reason(without):
    found = nested(measured(without("r_knee", slice(None))).measures)
    knee = found["range_of_motion"]["r_knee_flexion"]
    assert knee == {"reason": "fewer than 10 frames have this angle", "frames": 0, "nan_share": 1.0}
    assert found["symmetry"]["knee_flexion"] == {"reason": "one side has no range"}
    assert "reason" in found["knee_bends"]
    assert "count" not in found["knee_bends"]
    assert "both legs" in found["walking"]["reason"]
    assert found["arm_raises"]["right"]["count"] == 2


@pytest.mark.parametrize("joint", ["l_ankle", "r_wrist"])
def test_what_legs_or_arms_that_are_missing_would_show_is_not_said_to_be_absent(joint, without):
    """Floor and jumps of a walker without an ankle were "nobody walks" and a count of 0."""
    found = nested(measured(without(joint, slice(None))).measures)
    assert found["jumps"] == {
        "outcome": "cannot-be-told",
        "reason": "fewer than 10 frames have the trunk, both arms and both legs",
    }
    if joint == "l_ankle":
        assert found["floor"] == {"reason": found["walking"]["reason"]}
    else:
        assert "floor_height" in found["floor"]


def test_a_gap_in_the_squat_is_counted_as_missing_and_no_squat(walk, without):
    rows = slice(*(int(30 * second) for second in np.add(walk.phases_s["squat"], (1.2, -1.2))))
    found = nested(measured(without("r_ankle", rows)).measures)
    assert found["knee_bends"]["count"] == 0
    assert found["knee_bends"]["nan_share"] == pytest.approx((rows.stop - rows.start) / len(walk), abs=0.02)
    begin, end = walk.time_s[rows.start - 1], walk.time_s[rows.stop]
    assert found["knee_bends"]["reason"] == f"not seen from {begin:.2f} to {end:.2f} s"


def test_a_gap_that_cuts_one_of_several_squats_is_told(walk):
    """Four squats, the third without a hip for 0.9 s: three, of which nobody can say that they were all."""
    rows = np.flatnonzero(walk.during("squat"))
    joints = np.concatenate([walk.poses.joints[rows]] * 4)
    whole = PoseSequence(joints, H36M17, Z_UP, time_s=np.arange(len(joints)) / 30)
    assert {"count": 4, "squats": 4}.items() <= nested(measured(whole).measures)["knee_bends"].items()
    middle = 2 * len(rows) + len(rows) // 2
    cut = joints.copy()
    cut[middle - 13 : middle + 14, H36M17.index("r_hip")] = np.nan
    take = measured(whole.with_(joints=cut))
    found = nested(take.measures)["knee_bends"]
    begin, end = (middle - 14) / 30, (middle + 14) / 30
    assert found["count"] == 3
    assert found["count_reason"] == f"not seen from {begin:.2f} to {end:.2f} s"
    assert answer(take)[0].startswith(
        f"Squatted at least 3 times (not seen from {begin:.2f} to {end:.2f} s) to "
    )
    assert f"There may be more: {found['count_reason']}." in happened(take.measures, "m")


def test_means_are_of_the_repetitions_that_were_seen_whole(walk):
    """Of four squats that are alike a gap hides how the third began: what was left of it counted as a whole one."""
    rows = np.flatnonzero(walk.during("squat"))
    joints = np.concatenate([walk.poses.joints[rows]] * 4)
    poses = PoseSequence(joints, H36M17, Z_UP, time_s=np.arange(len(joints)) / 30)
    whole = nested(measured(poses).measures)["knee_bends"]
    begins = round(30 * whole["start_s"][2])
    cut = joints.copy()
    cut[begins - 3 : begins + 9, H36M17.index("r_hip")] = np.nan
    found = nested(measured(poses.with_(joints=cut)).measures)["knee_bends"]
    assert found["count"] == len(found["peak_deg"]) == 4
    assert found["mean_rise_deg"] == pytest.approx(whole["mean_rise_deg"], abs=1)
    assert found["mean_duration_s"] == pytest.approx(whole["mean_duration_s"], abs=0.02)
    assert {curve["count"] for curve in found["cycles"].values()} == {3}


def lacking(walk, first, lost_s, numbered, rows=None):
    """The first rows of a walk before a camera, without images from row `first` on for so long. numbered: whether frame
    numbers tell of them."""
    poses = camera_poses(walk, side_camera(walk))
    kept = np.delete(np.arange(rows or len(walk)), np.arange(first, first + round(30 * lost_s)))
    fewer = poses.with_(
        joints=poses.joints[kept],
        confidence=None,
        time_s=walk.time_s[kept],
        frame_index=kept if numbered else np.arange(len(kept)),
    )
    return measured(fewer, (Clean(), *STAGES))


@pytest.mark.parametrize("lost_s", [2 / 30, 0.2])
def test_images_that_a_video_lacks_take_no_step(walk, lost_s):
    """As of a phone that dropped two, whose video numbers the others without a gap: a whole walk was none."""
    video, rows = (lacking(walk, 70, lost_s, numbered) for numbered in (False, True))
    found, expected = nested(video.measures)["walking"], nested(rows.measures)["walking"]
    assert found["steps"] == expected["steps"] > 5
    for side in ("left", "right"):
        np.testing.assert_allclose(found[side]["landings_s"], expected[side]["landings_s"], atol=0.02)
    (told,) = (event for event in video.notices if event.code.startswith("images-lacking"))
    assert (told.weight, f"from 2.30 to {2.3 + lost_s + 1 / 30:.2f} s" in told.text) == ("repair", True)
    assert len(video.poses) + round(30 * lost_s) == len(rows.poses)


def test_images_that_a_video_lacks_for_long_end_a_walk_and_are_named(walk):
    video = lacking(walk, 35, 1.0, False, rows=100)
    assert nested(video.measures)["walking"]["steps"] == 0
    assert (
        "there is no image from 1.13 to 2.17 s, where a walk ends"
        in nested(video.measures)["walking"]["reason"]
    )
    (told,) = (event for event in video.notices if event.code.startswith("images-lacking"))
    assert (told.weight, told.about) == ("warning", "view")
    assert "from 1.13 to 2.17 s" in told.text
    assert told.code == "images-lacking-long"


def test_a_take_that_is_not_levelled_has_no_steps(take):
    lying = replace(take.rectified, level_ok=False, level_reason="the person lies")
    walking = nested(STAGES[3](take.with_(rectified=lying)).measures)["walking"]
    assert walking == {"outcome": "cannot-be-told", "reason": "the take is not levelled: the person lies"}


def test_a_take_of_a_few_frames_has_reasons_only(walk):
    short = walk.poses.with_(
        joints=walk.poses.joints[:4], confidence=None, time_s=walk.time_s[:4], frame_index=np.arange(4)
    )
    found = nested(measured(short).measures)
    assert all("reason" in entry for entry in found["range_of_motion"].values())
    assert "reason" in found["knee_bends"]
    assert "reason" in found["walking"]


def test_without_angles_there_are_reasons(take):
    bare = {name: values for name, values in take.kinematics.items() if "_deg" not in name}
    found = nested(STAGES[3](take.with_(kinematics=bare)).measures)
    assert all("reason" in entry for entry in found["range_of_motion"].values())
    assert "cadence_spm" in found["walking"]


def test_ready_for_json_without_nan(take):
    json.dumps(nested(take.measures), allow_nan=False)


def test_an_angle_that_is_none_is_refused():
    with pytest.raises(InputError, match="did you mean r_elbow_flexion"):
        Measures(("r_elbow_flexon",))


def test_the_table_holds_every_figure(take, tmp_path):
    write_measures(take, tmp_path / "measures.csv")
    rows = list(csv.DictReader((tmp_path / "measures.csv").read_text().splitlines()))
    assert list(rows[0]) == list(Row._fields)
    found = {(row["measure"], row["item"]): row for row in rows}
    assert len(found) == len(rows)
    measures = nested(take.measures)
    assert float(found["walking.cadence_spm", ""]["value"]) == measures["walking"]["cadence_spm"]
    assert found["walking.cadence_spm", ""]["unit"] == "1/min"
    assert not any("cycles" in row["measure"] for row in rows)
    assert len(rows) < 600
    symmetry = found["symmetry.hip_abduction.reason", ""]
    assert (symmetry["value"], symmetry["text"]) == ("", measures["symmetry"]["hip_abduction"]["reason"])


def test_every_stride_has_a_row_for_each_per_cent(take, tmp_path):
    write_strides(take, tmp_path / "strides.csv")
    rows = list(csv.DictReader((tmp_path / "strides.csv").read_text().splitlines()))
    assert {"trunk_lean_sagittal_deg", "pelvis_obliquity_sd_deg", "r_knee_flexion_deg"} <= set(rows[0])
    found = nested(take.measures)
    for side in ("right", "left"):
        own = [row for row in rows if row["movement"] == f"walking.{side}"]
        walk = found["walking"][side]
        assert [int(row["percent"]) for row in own] == [*range(101)] * walk["strides"]
        starts = [float(row["time_s"]) for row in own if row["percent"] == "0"]
        assert starts == pytest.approx(walk["stride_start_s"], abs=1e-3)
        assert [row["event"] for row in own if row["percent"] in ("0", "100")] == [
            "initial contact"
        ] * 2 * len(starts)
        toe_offs = [float(row["time_s"]) for row in own if row["event"] == "toe-off"]
        assert toe_offs == pytest.approx(walk["toe_offs_s"], abs=0.02)
        # The means of summary.json are the means of these.
        angle = f"{side[0]}_knee_flexion"
        curves = np.array([float(row[f"{angle}_deg"]) for row in own]).reshape(-1, 101)
        assert curves.mean(axis=0) == pytest.approx(found["walking"]["cycles"][angle]["mean_deg"], abs=1e-3)
    assert sum(row["movement"] == "knee_bends" for row in rows) == 101 * found["knee_bends"]["count"]


def test_the_peaks_of_each_stride_are_those_of_its_curve(take):
    walk = nested(take.measures)["walking"]["right"]
    rows = [row for row in stride_rows(take) if row["movement"] == "walking.right"]
    for number in range(walk["strides"]):
        own = [row for row in rows if row["number"] == number]
        knee, hip = (
            np.array([row[f"r_{part}_flexion_deg"] for row in own]) for part in ("knee", "thigh_trunk")
        )
        off = next(row["percent"] for row in own if row["event"] == "toe-off")
        assert walk["knee_at_contact_deg"][number] == pytest.approx(knee[0], abs=0.6)
        assert walk["knee_swing_peak_deg"][number] == pytest.approx(knee[off:].max(), abs=0.6)
        assert walk["knee_loading_peak_deg"][number] == pytest.approx(knee[: off // 2 + 1].max(), abs=1.0)
        assert walk["thigh_trunk_lowest_deg"][number] == pytest.approx(hip.min(), abs=0.6)
    assert walk["mean_knee_swing_peak_deg"] == pytest.approx(np.mean(walk["knee_swing_peak_deg"]), abs=0.6)


def test_a_stride_without_the_angle_leaves_a_gap_in_the_list():
    times = np.arange(0, 4, 0.05)
    strides = [Stride("r", i, i + 1, i + 0.6, np.nan, np.nan) for i in range(3)]
    knee = 30 + 30 * np.sin(2 * np.pi * times)
    knee[(times > 0.9) & (times < 1.9)] = np.nan
    found = nested(
        peaks({"r_knee_flexion_deg": knee, "r_knee_flexion_sd_deg": np.full(len(times), 4.0)}, times, strides)
    )
    assert found["knee_at_contact_deg"][1] is None
    assert found["knee_loading_peak_deg"][0] == pytest.approx(60, abs=1)
    assert found["knee_at_contact_error_deg"][0] == 4.0
    assert (
        found["mean_knee_at_contact_error_deg"] >= 4.0
    )  # what all strides have wrong alike does not average out
    assert "thigh_trunk_lowest_deg" not in found


def test_a_standard_deviation_takes_six_values():
    five = nested(spread("rise", "deg", np.arange(5.0)))
    assert "sd_rise_deg" not in five
    assert "6" in five["sd_reason"]
    six = nested(spread("rise", "deg", np.arange(6.0)))
    assert six["sd_rise_deg"] == pytest.approx(1.87, abs=0.01)
    assert "sd_reason" not in six
    assert "sd_reason" not in nested(spread("rise", "deg", np.arange(1.0)))


def test_a_row_has_the_error_the_side_the_unit_and_the_times_of_its_figure():
    bends = {
        "start_s": [1.0, 4.0],
        "stop_s": [2.0, 5.5],
        "peak_deg": [90.0, 101.0],
        "peak_error_deg": [3.0, 4.0],
    }
    walking = {
        "walking_speed": 1.2,
        "walking_speed_error": 0.05,
        "step_time_symmetry_index_percent": 3.0,
        "step_time_within_error": True,
        "left": {"mean_step_length": 0.6},
    }
    poses = PoseSequence(np.zeros((1, 17, 3)), H36M17, Z_UP)
    measures = rows_of({"bends": {"count": 2, **bends}, "walking": walking})
    assert nested(measures) == {"bends": {"count": 2, **bends}, "walking": walking}
    found = list(rows(Take("t", poses=poses, measures=measures)))
    assert [row.measure for row in found] == [
        "bends.count", *["bends.start_s"] * 2, *["bends.stop_s"] * 2, *["bends.peak_deg"] * 2,
        "walking.walking_speed", "walking.step_time_symmetry_index_percent", "walking.step_time_within_error",
        "walking.left.mean_step_length",
    ]  # fmt: skip
    assert found[0] == Row("bends.count", None, None, 2.0, None, None, None, None, None)
    assert found[6] == Row("bends.peak_deg", None, 1, 101.0, 4.0, "deg", 4.0, 5.5, None)
    assert found[7] == Row("walking.walking_speed", None, None, 1.2, 0.05, "m/s", None, None, None)
    assert found[8].unit == "%"
    assert found[9].text == "True"
    assert found[9].value is None
    assert found[10] == Row("walking.left.mean_step_length", "left", None, 0.6, None, "m", None, None, None)


def test_the_parquet_table_is_the_same(take, tmp_path):
    write_measures_parquet(take, tmp_path / "measures.parquet")
    table = parquet.read_table(tmp_path / "measures.parquet")
    assert [Row(**row) for row in table.to_pylist()] == list(rows(take))
    assert table.schema.metadata[b"take"] == b"walker"
    assert str(table.schema.field("value").type) == "double"
    with refused("needs-stage"):
        write_measures_parquet(take.with_(measures=None), tmp_path / "none.parquet")


def test_pandas_opens_the_table_as_it_is(take, tmp_path):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    write_measures(take, tmp_path / "measures.csv")
    found = pandas.read_csv(tmp_path / "measures.csv")
    assert tuple(found.columns) == Row._fields
    assert found.value.dtype == found.error.dtype == float
    cadence = found[found.measure == "walking.cadence_spm"].iloc[0]
    assert cadence.value == nested(take.measures)["walking"]["cadence_spm"]


def test_the_text_of_the_recording_says_figures_and_reasons(take):
    text = measures_markdown(take.measures, "m")
    for said in ("#### walking", "cadence spm: 11", "| knee flexion |", "both ranges are below 5 degrees"):
        assert said in text
    assert max(map(len, text.splitlines())) < 800  # no curves, nor each stride


def columns_with(take, **changes):
    return {**take.kinematics, **changes}


@pytest.mark.parametrize(("sd_deg", "count"), [(3.0, 1), (12.0, 0)])
def test_steps_go_beyond_the_noise_that_the_legs_are_stated_with(sd_deg, count):
    time_s = np.arange(90) / 30
    apart = 0.2 * np.sin(2 * np.pi * time_s)  # of a leg to either side: a shuffle, or nobody moves
    columns = {
        f"{side}_{bone}_sagittal{end}": np.full(90, value)
        for side in "rl"
        for bone in ("thigh", "shank")
        for end, value in (("_deg", 0.0), ("_sd_deg", sd_deg))
    }
    lands = [(0.25, "r"), (0.75, "l"), (1.25, "r"), (1.75, "l"), (2.25, "r"), (2.75, "l")]
    feet = {one: [Stance(one, at, at + 0.6) for at, side in lands if side == one] for one in "rl"}
    between = np.column_stack([apart, np.zeros_like(apart)])
    assert len(walks(feet, between, time_s, least_step(columns))) == count


def test_no_cadence_from_fewer_than_three_strides(walk):
    strikes = np.sort(np.concatenate(list(walk.heel_strikes_s.values())))
    rows = slice(round(30 * (strikes[1] - 0.1)), round(30 * (strikes[4] + 0.25)))
    part = walk.poses.with_(
        joints=walk.poses.joints[rows],
        confidence=None,
        time_s=walk.poses.time_s[rows],
        frame_index=walk.poses.frame_index[rows],
        root=None if walk.poses.root is None else walk.poses.root[rows],
    )
    walking = nested(measured(part).measures)["walking"]
    assert walking["counted"] == f"{walking['steps']} steps between {walking['steps'] + 1} landings"
    assert walking["right"]["strides"] + walking["left"]["strides"] == 2
    assert walking["cadence_reason"] == "fewer than 3 strides"
    assert "cadence_spm" not in walking


def test_files_have_figures_in_full_and_pages_end_them_at_their_error(take):
    walking = nested(take.measures)["walking"]
    cadence, error = walking["cadence_spm"], walking["cadence_error_spm"]
    assert 0.1 < error < 3
    assert cadence != round(cadence, 3)
    assert error != round(error, 3)
    assert with_bar(97.96, 0.25) == "98.0 ± 0.41"
    assert with_bar(97.96, 2.5) == "98 ± 4.1"
    # The walker's strides are all alike: what is left of their spread is the frames'.
    assert "sd_stride_time_s" not in walking
    assert walking["step_time_within_error"]


def test_lengths_of_motion_capture_have_no_errors_of_a_lifter(walk, take):
    """Its angles have columns of standard deviations too, all NaN. Contacts are found alike, whoever made the poses."""
    walking = nested(take.measures)["walking"]
    lifted = nested(measured(seen_from(walk, 90.0)).measures)["walking"]
    for name in ("walking_speed", "mean_step_length", "mean_stride_length", "mean_step_width"):
        assert name in walking
        assert f"{name}_error" not in walking
    assert "step_length_symmetry_index_percent" in walking
    assert not [key for key in walking if key.startswith("step_length_") and ("error" in key)]
    for found, source in ((walking, "measured"), (lifted, "lifted")):
        strides = found["right"]["strides"] + found["left"]["strides"]
        style = {"stance_percent": found["mean_stance_percent"], "step_time_s": found["mean_step_time_s"]}
        error = shipped_errors(source).mean("walking", "stride_time_s", strides, style=style)
        assert found["mean_stride_time_error_s"] == pytest.approx(error, rel=0.05)
        assert "mean_stance_error_percent" in found


def seen_from(walk, heading_deg, flat=1.0):
    """The walker in CAMERA axes, metres, as the built-in lifter's, depth made `flat` of what it is."""
    camera = aimed(walk.root.mean(axis=0), 6.0, heading_deg, 0.0, 0.0)
    poses = camera_poses(walk, camera)
    return poses.with_(
        joints=poses.joints * np.array([1.0, 1.0, flat], np.float32), root=None, made_by=JUDGED
    )


def test_a_walk_along_the_line_of_sight_is_said_to_be_uncountable():
    walk = walker(seconds=12, turn_deg=0)
    walking = nested(measured(seen_from(walk, 0.0, flat=0.15)).measures)["walking"]
    assert "steps" not in walking
    assert "line of sight" in walking["reason"]
    assert "film the walk from the side" in walking["reason"]
    assert nested(measured(seen_from(walk, 90.0)).measures)["walking"]["steps"] >= 3


def test_errors_of_one_side_do_not_depend_on_how_a_camera_s_axes_are_named():
    """How much of a step is depth was read off the camera's third axis, whichever way that points."""
    poses = seen_from(walker(seconds=12, turn_deg=0), 0.0)
    one, other = (
        nested(measured(each).measures)["walking"]["right"]["mean_stance_time_error_s"]
        for each in (poses, change_frame(poses, PC_CAMERA))
    )
    assert one == other


def test_ten_frames_a_second_are_said_where_no_steps_are_found(walk):
    still = np.repeat(walk.poses.joints[-1:], 60, axis=0)
    poses = walk.poses.with_(
        joints=still, confidence=None, time_s=np.arange(60) / 10, frame_index=np.arange(60), root=None
    )
    walking = nested(measured(poses).measures)["walking"]
    assert "steps" not in walking
    assert "10 frames per second" in walking["reason"]


@pytest.mark.parametrize(("depth_deg", "squats"), [(55.0, 0), (80.0, 1)])
def test_a_duck_is_a_knee_bend_and_no_squat(walk, take, depth_deg, squats):
    """The boxer who ducks bends his knees by 55 degrees."""
    squat = walk.during("squat")
    share = depth_deg / walk.angles_deg["r_knee_flexion_deg"][squat].max()
    shallow = columns_with(
        take,
        **{
            f"{side}_knee_flexion_deg": take.kinematics[f"{side}_knee_flexion_deg"]
            * np.where(squat, share, 0)
            for side in "rl"
        },
        **{f"{side}_knee_flexion_sd_deg": np.full(len(walk), 8.0) for side in "rl"},
    )
    bends = nested(STAGES[3](take.with_(kinematics=shallow)).measures)["knee_bends"]
    assert (bends["count"], bends["squats"]) == (1, squats)
    assert bends["peak_deg"][0] == pytest.approx(depth_deg, abs=1)
    assert bends["peak_error_deg"] == [8.0]
    assert bends["mean_rise_error_deg"] == pytest.approx(8 * np.sqrt(2), abs=0.5)


def test_no_repetition_within_its_noise(walk, take):
    vague = columns_with(
        take, **{f"{side}_shoulder_elevation_sd_deg": np.full(len(walk), 60.0) for side in "rl"}
    )
    assert nested(STAGES[3](take.with_(kinematics=vague)).measures)["arm_raises"]["right"]["count"] == 0


def test_a_difference_of_the_sides_within_their_errors_is_said_to_be_none(walk, take):
    def index(sd_deg):
        changed = columns_with(
            take, **{f"{side}_knee_flexion_sd_deg": np.full(len(walk), sd_deg) for side in "rl"}
        )
        changed["l_knee_flexion_deg"] = changed["l_knee_flexion_deg"] * 0.8
        return nested(STAGES[3](take.with_(kinematics=changed)).measures)["symmetry"]["knee_flexion"]

    assert not index(1.0)["within_error"]
    assert index(10.0)["within_error"]
    assert index(10.0)["symmetry_index_percent"] == pytest.approx(22, abs=2)
    assert index(10.0)["symmetry_index_error_percent"] > 10 * index(1.0)["symmetry_index_error_percent"] * 0.9


def test_ranges_beyond_anatomy_are_marked(walk, take):
    turned = columns_with(take, l_elbow_flexion_deg=take.kinematics["l_elbow_flexion_deg"].copy())
    turned["l_elbow_flexion_deg"][40:44] = -156.0  # as a lift of a cyclist had it
    ranges = nested(STAGES[3](take.with_(kinematics=turned)).measures)["range_of_motion"]
    assert ranges["l_elbow_flexion"]["beyond_anatomy_frames"] == 4
    assert [name for name, entry in ranges.items() if "beyond_anatomy_frames" in entry] == ["l_elbow_flexion"]


def test_who_lies_or_hangs_has_no_trunk_beyond_anatomy(walk, take):
    """All angles to gravity turned by 94 degrees back, as of somebody on the floor."""
    lying = {
        name: take.kinematics[f"{name}_deg"] - 94 for name, angle in ANGLES.items() if angle.needs_gravity
    }
    turned = columns_with(take, **{f"{name}_deg": values for name, values in lying.items()})
    ranges = nested(STAGES[3](take.with_(kinematics=turned)).measures)["range_of_motion"]
    assert "trunk_lean_sagittal" in lying
    assert not [name for name, entry in ranges.items() if "beyond_anatomy_frames" in entry]


def test_no_angle_to_gravity_has_limits_of_anatomy():
    """Who kneels on flat feet has toes that point back."""
    limited = [name for name, angle in ALL_ANGLES.items() if np.isfinite(angle.anatomy_deg).any()]
    assert "r_ankle_dorsiflexion" in limited
    assert not [name for name in limited if ALL_ANGLES[name].needs_gravity]


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


def test_the_floor_of_motion_capture_has_a_height_without_an_error(take):
    """Places that are measured are alike to a millimetre, and 0.0009 m was stated with an error of 0.0002."""
    found = nested(take.measures)["floor"]
    assert found["floor_height"] == pytest.approx(0, abs=0.005)
    assert "floor_height_error" not in found
    assert "slope_error_deg" in found


def test_a_treadmill_by_the_drift_of_the_feet_and_by_what_is_told(walk):
    straight = walker(seconds=12, turn_deg=0)
    world = straight.world - straight.root[:, None] * (
        1,
        1,
        0,
    )  # the camera goes with the person, or the floor moves
    on_belt = straight.poses.with_(joints=world)
    found = nested(measured(on_belt).measures)["walking"]
    assert found["belt"] == "its speed is that at which the standing foot drifts back"
    assert found["walking_speed"] == pytest.approx(straight.speed_mps, rel=0.05)
    told = nested(measured(on_belt, (*STAGES[:3], Measures(belt_speed=1.25))).measures)["walking"]
    assert (told["belt"], told["belt_speed"]) == ("its speed was told", 1.25)
    assert told["walking_speed"] == pytest.approx(1.25, rel=0.03)
    nowhere = nested(measured(seen_from(straight, 90.0), (*STAGES[:3], Measures(belt_speed=1.25))).measures)[
        "walking"
    ]
    assert nowhere["mean_step_length"] == pytest.approx(1.25 * 60 / straight.cadence_spm, rel=0.05)
    assert "belt" not in nested(measured(straight.poses).measures)["walking"]
    assert "belt_speed_error" not in found  # which is known of lifted walks only


@pytest.mark.parametrize("incline", [0.0, 0.1])
@pytest.mark.parametrize("belt_speed", [None, 1.25])
def test_a_belt_has_a_height_and_no_slope(incline, belt_speed):
    """The places of feet on it lie beside one another, and their line was called the slope."""
    straight = walker(seconds=30, turn_deg=0)
    rows = straight.during("walk")
    on_belt = straight.world[rows] - straight.root[rows, None] * (1, 1, 0)
    on_belt += np.random.default_rng(0).normal(0, 0.002, on_belt.shape)
    on_belt[..., 2] += incline * on_belt[..., 0]  # the walker goes north
    poses = PoseSequence(
        on_belt, H36M17, Z_UP, time_s=straight.time_s[rows], frame_index=np.flatnonzero(rows)
    )
    floor = nested(measured(poses, (*STAGES[:3], Measures(belt_speed=belt_speed))).measures)["floor"]
    assert floor["slope_reason"] == "the feet are carried by a belt"
    assert {"slope_deg", "slope_error_deg", "stairs"}.isdisjoint(floor)
    assert floor["floor_height"] == pytest.approx(0, abs=0.03)


def test_a_floor_without_a_walk_has_no_slope():
    """A man who stood on one leg had "the slope of the floor along the walk", 17 degrees of a level floor."""
    straight = walker(seconds=12, turn_deg=0)
    rows = straight.during("walk")
    poses = PoseSequence(
        straight.world[rows], H36M17, Z_UP, time_s=straight.time_s[rows], frame_index=np.flatnonzero(rows)
    )
    take = measured(poses, STAGES[:3])
    gait = gait_of(body_joints(take.filtered, take.rectified), take.filtered, take.rectified, take.kinematics)
    found = nested(floor([Measure("steps", 0)], gait, take.filtered, take.rectified, judged=False))
    assert found["slope_reason"] == "there is no walk"
    assert {"slope_deg", "stairs"}.isdisjoint(found)
    assert found["floor_height"] == pytest.approx(0, abs=0.03)


def test_in_a_take_of_less_than_a_stride_the_sides_are_not_compared(take):
    """A runner in view for 0.7 s had five differences of right and left."""
    found = nested(measured(take.poses.rows(0, 40)).measures)
    assert set(found["symmetry"]) == {"reason"}
    assert "count" not in found["arm_raises"]["right"]  # nor is a count of 0 told of what takes longer
    assert "symmetry_index_percent" in nested(take.measures)["symmetry"]["knee_flexion"]


def test_a_ramp_of_motion_capture_has_its_slope_and_no_stairs():
    straight = walker(seconds=12, turn_deg=0)
    rows = straight.during("walk")
    world = straight.world[rows] + np.random.default_rng(0).normal(0, 0.003, straight.world[rows].shape)
    world[..., 2] += np.tan(np.radians(4)) * world[..., 0]
    poses = PoseSequence(world, H36M17, Z_UP, time_s=straight.time_s[rows], frame_index=np.flatnonzero(rows))
    floor = nested(measured(poses).measures)["floor"]
    assert floor["slope_deg"] == pytest.approx(4, abs=0.5)
    assert floor["stairs"] == "none"


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan])
def test_a_belt_that_does_not_run_is_refused(speed):
    with refused("bad-value"):
        Measures(belt_speed=speed)


def test_walking_speed_lengths_and_phases_where_the_place_is_known(walk, take):
    walking = nested(take.measures)["walking"]
    assert walking["gait"] == "walking"
    step_m = 60 * walk.speed_mps / walk.cadence_spm
    assert walking["walking_speed"] == pytest.approx(walk.speed_mps, rel=0.02)
    assert walking["mean_step_length"] == pytest.approx(step_m, rel=0.02)
    assert walking["mean_stance_percent"] + walking["mean_swing_percent"] == pytest.approx(100, abs=1)
    assert 55 < walking["mean_stance_percent"] < 68
    assert walking["right"]["landings_s"][0] < walking["right"]["toe_offs_s"][0]


def test_jumps_with_their_height_and_none_in_a_walk(take):
    assert nested(take.measures)["jumps"] == {"outcome": "none", "count": 0}
    jumping = jumps.jumping()
    poses = jumping.with_(joints=jumping.joints + jumping.root[:, None], frame=Z_UP, root=None)
    found = nested(measured(poses).measures)["jumps"]
    assert found["count"] == 2
    # Stiff legs leave the floor without stretching the ankle: they are seen from 0.12 m on, not from 0.09.
    assert found["jump_height"] == pytest.approx([0.25, 0.25], abs=0.02)
    assert found["flight_time_s"] == pytest.approx([0.47, 0.47], abs=0.03)


def test_one_or_two_durations_are_known_no_better_than_frames_allow():
    """Of one knee bend at 5 frames a second the duration was stated to be known to 0.01 s, of three to 0.06."""
    for values in ([1.0], [1.0, 1.2], [1.0, 1.1, 1.2]):
        said = nested(spread("duration", "s", np.array(values), 0.08, shared=0.01))
        assert said["mean_duration_error_s"] >= 0.08 / np.sqrt(len(values))
    assert "mean_duration_error_s" not in nested(spread("duration", "s", np.array([1.0, 1.2]), 0.08))
    assert nested(spread("rise", "deg", np.full(6, 40.0), shared=np.nan)) == {"mean_rise_deg": 40.0}


def test_what_is_written_is_read_back(take, tmp_path):
    write_measures(take, tmp_path / "measures.csv")
    assert "walking" in nested(read_measures(tmp_path))  # also without curves
    text = json.dumps({"measures": nested(take.measures)})
    (tmp_path / "summary.json").write_text(text, encoding="utf-8")
    found, expected = nested(read_measures(tmp_path)), nested(take.measures)
    for group in (found["walking"], expected["walking"]):
        for side in ("right", "left"):
            group[side] = {key: value for key, value in group[side].items() if value != []}
    # Whether a figure lies within its error is a remark once it was read.
    assert json.loads(json.dumps(found).replace('"True"', "true").replace('"False"', "false")) == expected
    assert read_measures(tmp_path / "nowhere") == ()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a,b\n1,2\n",
        "ROWS\nwalking.steps,up,,1.0,,,,,\n",
        "ROWS\nwalking.steps,,,1.0,,ell,,,\n",
        "ROWS\nx\n",
    ],
)
def test_a_table_that_somebody_has_changed_has_words(tmp_path, text):
    (tmp_path / "measures.csv").write_text(text.replace("ROWS", ",".join(Row._fields)))
    with pytest.raises(InputError, match=r"measures\.csv"):
        read_measures(tmp_path)


@pytest.mark.parametrize(("share", "told"), [(0.04, True), (0.2, False)])
def test_an_angle_that_many_frames_lack_near_its_axis_has_no_range_and_no_difference(walk, take, share, told):
    """Lifted upper arms differed by -146 to +189 %, by which camera looked: the frames that a range lacked were its
    outermost."""
    lacking = np.arange(len(walk)) < share * len(walk)
    name, both = "r_upper_arm_sagittal", "upper_arm_sagittal"
    changed = columns_with(
        take,
        **{f"{side}_{both}_sd_deg": np.full(len(walk), 5.0) for side in "rl"},
        **{f"{name}_deg": np.where(lacking, np.nan, take.kinematics[f"{name}_deg"])},
        **{f"{name}_reason": np.where(lacking, UNTRUSTED, FINE)},
    )
    found = nested(STAGES[3](take.with_(kinematics=changed)).measures)
    assert ("p05_deg" in found["range_of_motion"][name]) == told
    assert ("symmetry_index_percent" in found["symmetry"][both]) == told
    assert ("reason" in found["range_of_motion"][name]) != told


def test_facing_the_camera_hides_a_walk_only_while_it_lasts():
    """One figure for the take said that steps of a man in full profile could not be told."""
    times = np.arange(300) / 30
    level = walker(seconds=10).poses
    rectified = Pipeline(STAGES[:1])(Take("walker", poses=level)).rectified

    def facing(degrees):
        a = np.radians(degrees)
        back = np.stack([np.sin(a), 0 * a, np.cos(a)], axis=-1)
        R = np.stack([back, np.cross((0, 1, 0), back), np.broadcast_to((0.0, 1, 0), back.shape)], axis=-1)
        return along_sight(replace(rectified, R_source_from_body=R), CAMERA, times)

    assert facing(np.full(300, 90.0)) == []
    ((start, stop),) = facing(np.where(times < 4, 10.0, 90.0))
    assert start == 0
    assert stop == pytest.approx(4, abs=0.1)
    assert facing(np.where((times > 4) & (times < 5), 10.0, 90.0)) == []  # no walk is so short
