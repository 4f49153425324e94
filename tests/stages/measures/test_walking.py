"""Walks, their floor and jumps: figures of the walker against what it did, and why some are absent; which flights are
jumps, and what they leave of a run; and stated errors of lifted takes, which are to hold in nine of ten."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from golden.lifts import lift
from golden.motions import motion_with
from golden.virtual import lifted, walked
from golden.walks import JUDGED, STAGES, measured, seen_from
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.gait.figures import shipped_errors
from pcnet3d.models.gait.gait import Gait, Stance, Step, least_step, walks
from pcnet3d.models.lab.beds import see
from pcnet3d.models.lab.clips import read_clips
from pcnet3d.models.lab.synthetic import TYPICAL
from pcnet3d.models.place.flights import Airborne, Flight
from pcnet3d.pipeline import H36M17, Z_UP, Pipeline, PoseSequence
from pcnet3d.pipeline.core.conversions import change_frame
from pcnet3d.pipeline.core.frames import PC_CAMERA
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.clean import Clean
from pcnet3d.stages.measures.jumps import jumping, without_leaps
from pcnet3d.stages.place import Place


@pytest.mark.parametrize(("fps", "turn_deg"), [(30, -45), (25, 5), (50, 90), (29.97, -160)])
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


@pytest.mark.parametrize(
    ("speed_mps", "lifted", "gait"),
    [(1.25, True, "walking"), (1.9, True, "walking or running"), (1.9, False, "walking")],
)
def test_lifted_steps_as_quick_as_a_run_s_may_be_one(speed_mps, lifted, gait):
    """A jogger whose flights were not seen, 161 steps a minute, "walked"."""
    walk = walker(seconds=12, speed_mps=speed_mps, turn_deg=5)
    poses = camera_poses(walk, side_camera(walk)) if lifted else walk.poses
    assert nested(measured(poses).measures)["walking"]["gait"] == gait


def test_who_walks_there_and_backwards_again_has_all_steps_and_no_belt(walk):
    there = nested(measured(walk.poses).measures)["walking"]
    film = walk.poses.with_(joints=walk.poses.joints[::-1])
    back = nested(measured(film).measures)["walking"]
    assert back["steps"] == pytest.approx(there["steps"], abs=1)
    assert back["walking_speed"] == pytest.approx(there["walking_speed"], rel=0.05)
    time_s = np.arange(2 * len(walk)) / 30
    joints = np.concatenate([walk.poses.joints, film.joints])
    both = walk.poses.with_(joints=joints, confidence=None, time_s=time_s, frame_index=np.arange(len(time_s)))
    both = nested(measured(both).measures)["walking"]
    assert both["steps"] >= 2 * there["steps"] - 2
    assert "belt_speed" not in both


def test_a_moving_camera_changes_no_steps_but_lengths_are_absent(walk):
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
    assert found["walking"]["lengths_withheld"] == "camera-moves"
    assert found["range_of_motion"] == expected["range_of_motion"]


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
    assert "steps" not in nested(video.measures)["walking"]
    (told,) = (event for event in video.notices if event.code.startswith("images-lacking"))
    assert (told.weight, told.about) == ("warning", "view")
    assert "from 1.13 to 2.17 s" in told.text
    assert told.warns


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
    part = walk.poses.rows(round(30 * (strikes[1] - 0.1)), round(30 * (strikes[4] + 0.25)))
    walking = nested(measured(part).measures)["walking"]
    assert walking["right"]["strides"] + walking["left"]["strides"] == 2
    assert walking["cadence_withheld"] == "few-strides"
    assert "cadence_spm" not in walking
    assert "mean_stance_percent" in walking["right"]


def test_a_stranger_lifters_few_strides_have_no_phases(walk):
    """A woman walked two strides, lifted by a network whose contacts nobody judged: her double support was told as
    37 %, and was 25."""
    strikes = np.sort(np.concatenate(list(walk.heel_strikes_s.values())))
    seen = seen_from(walk, 90.0)
    few = seen.rows(round(30 * (strikes[1] - 0.1)), round(30 * (strikes[4] + 0.25)))
    for poses in (few, seen):
        walking = nested(measured(poses.with_(made_by=MadeBy("estimated", "another"))).measures)["walking"]
        told = poses is seen
        assert ("mean_double_support_percent" in walking) == told
        assert ("mean_stance_percent" in walking["right"]) == told
        assert (walking.get("timing_withheld") == "error-unknown") != told


def test_an_index_of_steps_that_scatter_is_no_surer_than_their_means():
    """Step times of 0.8 and 0.9 s, each within 0.4 s, had an index of -15 within 13 %."""
    errors = shipped_errors()
    usual, scattered = (errors.difference("step_time_s", 2, 2, 0.0, scatter) for scatter in (0.02, 0.3))
    assert usual == errors.difference("step_time_s", 2, 2, 0.0)
    of_a_side = errors.mean("step_time_s", 2, scatter=0.3)
    assert scattered == pytest.approx(np.sqrt(2) * of_a_side, rel=0.1)


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
        error = shipped_errors("walking", source).mean("stance_time_s", strides, style=style)
        assert found["mean_stance_time_error_s"] == pytest.approx(error, rel=0.05)
        assert "mean_stance_error_percent" in found


def test_errors_of_one_side_do_not_depend_on_how_a_camera_s_axes_are_named():
    """How much of a step is depth was read off the camera's third axis, whichever way that points."""
    poses = seen_from(walker(seconds=12, turn_deg=3), 0.0)
    one, other = (
        nested(measured(each).measures)["walking"]["right"]["mean_stance_time_error_s"]
        for each in (poses, change_frame(poses, PC_CAMERA))
    )
    assert one == pytest.approx(other, rel=1e-9)


def test_a_treadmill_by_the_drift_of_the_feet():
    straight = walker(seconds=12, turn_deg=5)
    # The camera goes with the person, or the floor moves.
    on_belt = straight.poses.with_(joints=straight.world - straight.root[:, None] * [1, 1, 0])
    done = measured(on_belt)
    assert "on-a-belt" in [each.code for each in done.said]
    found = nested(done.measures)["walking"]
    assert found["walking_speed"] == pytest.approx(straight.speed_mps, rel=0.05)
    assert found["belt_speed"] == pytest.approx(straight.speed_mps, rel=0.05)
    assert "belt_speed" not in nested(measured(straight.poses).measures)["walking"]
    assert "belt_speed_error" not in found  # which is known of lifted walks only


TIMES = np.arange(0, 6, 1 / 30)
NO_GAIT = Gait({"r": [], "l": []}, [])


def flight(off_s, land_s, clear=0.0, feet=2):
    return Flight(off_s, land_s, 5.8, 0.18, feet, feet, clear)


def run(*later: float) -> Gait:
    lands = [1.0, 1.4, 1.8, 2.15, *(later or (2.95, 3.35, 3.75))]
    feet = {side: [Stance(side, at, at + 0.25) for at in lands[first::2]] for first, side in enumerate("rl")}
    steps = [Step("lr"[i % 2], start, stop) for i, (start, stop) in enumerate(pairwise(lands))]
    return Gait(feet, [steps])


@pytest.mark.parametrize(("joint", "count"), [("l_knee", 0), ("l_wrist", 1)])
def test_a_flight_of_legs_that_are_not_known_is_no_jump(joint, count):
    """A policeman "jumped at least once": a detector had laid his legs on the car behind him for five frames."""
    motion = motion_with({}, TIMES, unknown={joint: (TIMES > 1.8) & (TIMES < 1.95)})
    assert len(jumping(motion, Airborne((flight(1.6, 2.1),)), NO_GAIT)) == count


@pytest.mark.parametrize(("clear", "count"), [(0.1, 0), (0.24, 1)])
def test_a_hop_among_the_steps_of_a_run_is_a_jump_by_how_high_the_feet_get(clear, count):
    """Who hopped in a run, the ankle 0.4 m up, did not jump: a flight of 0.28 s was a stride."""
    hop = Airborne((flight(1.8, 2.05, clear, 1),))
    assert len(jumping(motion_with({}, TIMES), hop, run())) == count


def test_a_leap_is_no_step_of_the_run_that_it_ends():
    """A leap over a hurdle made the fourth step of a run, and its flight of 0.5 s the run's mean."""
    assert run().kind == "running"
    assert [len(walk) for walk in without_leaps(run(), [flight(2.4, 2.9)]).walks] == [3, 2]
    assert without_leaps(run(), []).walks == run().walks


def test_no_foot_lands_in_the_air():
    """A foot reached ahead in a leap, and was the fourth step of a run."""
    grounded = without_leaps(run(2.5), [flight(2.35, 2.85)])
    assert [len(walk) for walk in grounded.walks] == [3]
    stood = [stance.start_s for of in grounded.feet.values() for stance in of]
    assert sorted(stood) == [1.0, 1.4, 1.8, 2.15]


TRUE_STEP_S, TRUE_MPS, TRUE_FLIGHT_S = 0.33, 4.94, 0.15
_90 = 1.645  # standard deviations


def measures_of_truth(clip):
    poses = PoseSequence(clip.joints, H36M17, Z_UP, time_s=np.arange(len(clip)) / clip.fps)
    return nested(measured(poses, STAGES).measures)


def test_durations_of_lifted_squats_and_raises_are_as_uncertain_as_is_stated():
    """One squat and two raises of each arm, from six sides: what a lifter has wrong of a posture it has wrong every
    time."""
    clip = walked(seconds=12)

    def durations(measures):
        raises = measures["arm_raises"]
        return [
            (group["mean_duration_s"], group.get("mean_duration_error_s"))
            for group in (measures["knee_bends"], raises["right"], raises["left"])
        ]

    true = durations(measures_of_truth(clip))
    off = []
    for seed in range(6):
        seen = see(clip, seed)
        poses = lift(seen.keypoints, seen.image_size, seen.focal_px).with_(made_by=JUDGED)
        found = durations(nested(measured(poses, STAGES).measures))
        assert all(0.05 < error < 0.6 * mean for mean, error in found)
        off += [(a - b) / error for (a, error), (b, _) in zip(found, true, strict=True)]
    assert np.mean(np.abs(off) <= _90) >= 0.85


@pytest.mark.data("accad_mocap.npz")
@pytest.mark.parametrize("seed", [0, 1, 6])
def test_a_short_run_has_steps_flight_cadence_and_speed_with_errors(seed):
    """Of 43 frames, from three sides."""
    (clip,) = (clip for clip in read_clips("val") if clip.name == "accad-m1_run")
    take = lifted(clip, see(clip, seed, views=TYPICAL))
    running = nested(Pipeline((Place(), *STAGES))(take).measures)["walking"]
    assert running["gait"] == "running"
    assert running["steps"] >= 2
    for name, true in (
        ("mean_step_time_s", TRUE_STEP_S),
        ("mean_flight_time_s", TRUE_FLIGHT_S),
        ("cadence_spm", 60 / TRUE_STEP_S),
        ("walking_speed", TRUE_MPS),
    ):
        words, _, unit = name.rpartition("_")
        error = running["walking_speed_error" if name == "walking_speed" else f"{words}_error_{unit}"]
        assert abs(running[name] - true) < 2.5 * error, name
        assert error < 0.4 * true, name
