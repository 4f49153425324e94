"""Jumps before a camera and in LEVEL: the fall is known, so are heights, times and metres; who stays on the floor never
flies, and a take that is shown k times too slowly falls at 9.81 / k^2; the rise of lifted jumps."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from golden.jumps import STATURE_M, standing, toe_jump
from golden.jumps import jumping as falling
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.gait.clock import clock_doubts
from pcnet3d.models.lab.beds import Configuration, EvaluationSet, finished
from pcnet3d.models.place.flights import LIFTED, BodyPath, airborne, flown, lifted_rise
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, LEVEL, PoseSequence, Take
from pcnet3d.pipeline.core.camera import Background, Camera
from pcnet3d.pipeline.core.measures import SD_90, nested
from pcnet3d.pipeline.core.pose import MadeBy, RootPath
from pcnet3d.pipeline.core.take import Told
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.place import Place
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.scale import Scale
from pcnet3d.stages.trajectories import Trajectories

G = 9.81
HIGH_M = 0.3
PUSH_M = 0.055 * STATURE_M  # by which ankles rise before the toes leave
AT_M = (0.0, 5.0, 0.9)  # of the pelvis, from under the camera
SIZE, FOCAL_PX = (1280, 720), 1000.0
PITCH = np.radians(8.0)
# Camera's x, y, z in a world that it looks at along y, from 1.3 m above the floor and 5 m away.
R_CAMERA_FROM_WORLD = np.array(
    [[1, 0, 0], [0, -np.sin(PITCH), -np.cos(PITCH)], [0, np.cos(PITCH), -np.sin(PITCH)]]
)
LIFTER = MadeBy("estimated", shipped_noise().lifter, in_run=True)


def rises(time_s: np.ndarray, apexes_s: tuple[float, ...], high_m: float = HIGH_M) -> np.ndarray:
    """(T,) how high the body is over where it stands: the heels rise at the speed of the take-off, then it falls."""
    fast = np.sqrt(2 * G * high_m)
    ways = [np.abs(time_s - apex_s) for apex_s in apexes_s]
    air = [PUSH_M + high_m - G / 2 * way**2 for way in ways]
    heels = [PUSH_M - fast * (way - fast / G) for way in ways]
    return np.max(
        [np.where(a > PUSH_M, a, np.clip(h, 0, PUSH_M)) for a, h in zip(air, heels, strict=True)], axis=0
    )


def jumping(apexes_s=(1.5, 3.0), fps=30.0, high_m=HIGH_M) -> tuple[np.ndarray, np.ndarray]:
    """((T, 17, 3) in the world, (T,) seconds)."""
    time_s = np.arange(0, max(apexes_s) + 1.5, 1 / fps)
    world = standing() + np.tile(AT_M, (len(time_s), 1, 1))
    world[..., 2] += rises(time_s, apexes_s, high_m)[:, None]
    return world, time_s


def filmed(world: np.ndarray, time_s: np.ndarray, noise_px: float = 0.0, unit: float = 1.0, **told) -> Take:
    """A take of a lifter without error before a camera that stands still, of which `told` is told; rectified."""
    points = (world - [0.0, 0.0, 1.3]) @ R_CAMERA_FROM_WORLD.T
    pixels = points[..., :2] / points[..., 2:] * FOCAL_PX + np.array(SIZE) / 2
    pixels = pixels + np.random.default_rng(5).normal(0, noise_px, pixels.shape)
    keypoints = PoseSequence(
        pixels, H36M17, IMAGE, np.full(pixels.shape[:2], 0.9), time_s, np.arange(len(time_s))
    )
    frame = CAMERA.with_(origin="pelvis", unit="m" if unit == 1.0 else "arbitrary")
    lifted = unit * (points - points[:, :1])
    poses = PoseSequence(lifted, H36M17, frame, None, time_s, np.arange(len(time_s)), made_by=LIFTER)
    up = R_CAMERA_FROM_WORLD[:, 2]
    said = {"camera": "static", **told}
    if said["camera"] != "moving":
        said["gravity"] = tuple((-up).tolist())
    camera = Camera(SIZE, FOCAL_PX, 10.0, "told")
    return Rectify()(
        Place()(Take("take", keypoints=keypoints, camera=camera, poses=poses, told=Told(**said)))
    )


def run(take: Take) -> Take:
    return Measures()(Angles()(Trajectories()(Scale()(take))))


def told_jumps(take: Take) -> dict:
    return nested(run(take).measures)["jumps"]


@pytest.fixture(scope="module")
def twice() -> Take:
    """Two jumps, filmed."""
    return filmed(*jumping())


def without(take: Take, *which) -> Take:
    """With these rows and joints of LEVEL missing."""
    joints = np.array(take.rectified.level.joints)
    joints[which] = np.nan
    return take.with_(rectified=replace(take.rectified, level=take.rectified.level.with_(joints=joints)))


def of_an_unknown_camera(take: Take) -> Take:
    """The same before a camera of which nothing was told, nor seen in the images."""
    return take.with_(told=replace(take.told, camera=None, gravity=None))


@pytest.mark.parametrize(
    ("fps", "noise_px", "high_m"),
    [(30.0, 0.0, 0.15), (30.0, 3.0, 0.45), (60.0, 3.0, 0.15), (60.0, 0.0, 0.45)],
)
def test_a_known_fall_has_its_height_and_time(fps, noise_px, high_m):
    found = airborne(filmed(*jumping(fps=fps, high_m=high_m), noise_px))
    assert (len(found.flights), found.cut) == (2, False)
    time_s = 2 * np.sqrt(2 * high_m / G)
    assert np.ptp(found.ankle) > high_m / STATURE_M
    for flight, apex_s in zip(found.flights, (1.5, 3.0), strict=True):
        assert (flight.off_s + flight.land_s) / 2 == pytest.approx(apex_s, abs=0.02)
        assert G / 8 * (flight.land_s - flight.off_s) ** 2 == pytest.approx(high_m, abs=0.035)
        assert flight.land_s - flight.off_s == pytest.approx(time_s, abs=0.05)
        assert (flight.off_feet, flight.land_feet) == (2, 2)


@pytest.mark.parametrize(
    ("fps", "deep_rad", "high_m"), [(30.0, 0.5, 0.2), (30.0, 0.9, 0.45), (60.0, 0.9, 0.3), (60.0, 0.5, 0.45)]
)
def test_who_pushes_off_from_the_toes_flies_when_these_leave_the_floor(fps, deep_rad, high_m):
    """From a squat, and when the heels left, somebody who jumped 19 cm seemed to fly up to 28 cm high."""
    jump = toe_jump(high_m, deep_rad, fps=fps)
    take = filmed(jump.world + np.array([0.0, AT_M[1], 0.0]), jump.time_s, 1.0)
    (flight,) = airborne(take).flights
    assert flight.off_s == pytest.approx(jump.off_s, abs=0.8 / 30)
    assert flight.land_s == pytest.approx(jump.land_s, abs=0.8 / 30)
    told = told_jumps(take)
    by_time, rise = told["height_by_flight_time_cm"][0], 100 * told["jump_height"][0]
    errors = told["height_by_flight_time_error_cm"][0], 100 * told["jump_height_error"][0]
    assert abs(by_time - rise) <= SD_90 * np.hypot(*errors)
    assert by_time == pytest.approx(100 * high_m, abs=SD_90 * errors[0])
    assert rise == pytest.approx(100 * high_m, abs=SD_90 * errors[1])


@pytest.mark.parametrize(
    ("fps", "begins_s"),
    [(25.0, 0.0), (25.0, 0.02), *((fps, s) for fps in (30.0, 60.0) for s in (0.0, 0.01, 0.02))],
)
def test_a_brief_fall_is_one_at_any_rate_and_phase(fps, begins_s):
    """At 30 frames a second, the time from the first to the last frame in the air, such falls were too brief; at 60 the
    height of what was left of them, too low."""
    found = airborne(filmed(*jumping((1.5 + begins_s, 3.01 + begins_s), fps, high_m=0.08)))
    assert len(found.flights) == 2


@pytest.mark.data("accad_mocap.npz")
def test_nobody_is_highest_before_the_feet_leave():
    """In a skip one foot was said to leave 35 ms after the highest point, which was a flight of 70 ms."""
    how = Configuration(seed=22, image=True, bed="typical", fps=60.0)
    sets = [EvaluationSet("val", "val")]
    (skip,) = finished(how, sets, lambda clip: clip.name == "accad-m1_bvh-a15-skiptostand-take-001")
    assert all(one.land_s - one.off_s > 0.1 for one in airborne(skip.take).flights)


def test_no_depth_and_no_size_is_needed(twice):
    """The smooth path of the pelvis has no fall in it; the body on its rays has."""
    far = twice.with_(
        camera=Camera(SIZE, 0.7 * FOCAL_PX, 300.0, "prior"),
        poses=twice.poses.with_(path=None),
    )
    times = [
        [flight.land_s - flight.off_s for flight in airborne(one).flights]
        for one in (twice, Rectify()(Place()(far.with_(rectified=None))))
    ]
    np.testing.assert_allclose(times[0], times[1], atol=0.04)


def squats(fps=30.0) -> tuple[np.ndarray, np.ndarray]:
    time_s = np.arange(0, 8, 1 / fps)
    world = standing() + np.tile(AT_M, (len(time_s), 1, 1))
    lower = 0.2 * (1 - np.cos(np.pi * time_s))
    feet = H36M17.indices(("r_ankle", "l_ankle"))
    others = [i for i in range(17) if i not in feet]
    world[:, others, 2] -= lower[:, None]
    return world, time_s


def tiptoes() -> tuple[np.ndarray, np.ndarray]:
    world, time_s = jumping((1.5,))
    world[..., 2] += (
        0.05 * STATURE_M * np.exp(-(((time_s - 1.5) / 0.3) ** 4))[:, None] - rises(time_s, (1.5,))[:, None]
    )
    return world, time_s


def kick() -> tuple[np.ndarray, np.ndarray]:
    world, time_s = jumping((1.5,))
    world[..., 2] -= rises(time_s, (1.5,))[:, None]
    world[:, H36M17.index("r_ankle"), 2] += 0.6 * np.exp(-(((time_s - 1.5) / 0.2) ** 2))
    return world, time_s


def treadmill() -> tuple[np.ndarray, np.ndarray]:
    walk = walker(seconds=6.0)
    world = walk.world.astype(np.float64).copy()
    world[..., :2] -= walk.root[:, None, :2] - np.array([0.0, 5.0])
    return world, walk.time_s


@pytest.mark.parametrize("still", [squats, tiptoes, kick, treadmill])
@pytest.mark.parametrize("noise_px", [0.0, 4.0])
def test_who_stays_on_the_floor_does_not_fly(still, noise_px):
    take = filmed(*still(), noise_px)
    found = airborne(take)
    assert (found.flights, found.cut) == ((), False)


@pytest.mark.parametrize("seen", ["fall", "rise"])
def test_a_jump_that_an_end_of_the_take_cuts_makes_the_others_the_least(seen):
    """A man fell in the first frames of a take, landed and jumped again."""
    world, time_s = jumping((1.5, 4.0))
    rows = time_s >= 1.5 if seen == "fall" else time_s <= 4.0
    jumps = told_jumps(filmed(world[rows], time_s[rows]))
    assert (jumps["count"], jumps["count_at_least"]) == (1, True)


def test_where_nothing_flies_nothing_is_counted(twice):
    for take, percent in ((filmed(*squats()), 100.0), (filmed(*squats(), camera="moving"), 0.0)):
        assert told_jumps(take) == {"observable_percent": percent}
    assert airborne(twice.with_(keypoints=None)).observable is False
    assert len(airborne(of_an_unknown_camera(twice)).flights) == 2


def test_a_jump_before_a_camera_that_may_move_has_no_error(twice):
    """A height of 6 cm was "within 3" of a jump of 10 cm before a camera of which nobody knows."""
    known, unknown = told_jumps(twice), told_jumps(of_an_unknown_camera(twice))
    assert (known["count"], "height_by_flight_time_error_cm" in known) == (2, True)
    assert unknown["count"] == 2
    assert not [name for name in unknown if "error" in name]
    shakes = of_an_unknown_camera(twice)
    shakes = shakes.with_(camera=replace(shakes.camera, background=Background("hand-held", 0.1, 0.03)))
    shaken = told_jumps(shakes)
    errors = [name for name in known if "error" in name and name != "count"]
    assert all(np.max(shaken[name]) > np.max(known[name]) for name in errors)


def test_a_fall_of_another_pace_is_none():
    world, time_s = jumping()
    found = airborne(filmed(world, 2 * time_s))
    assert found.flights == ()


def test_rebounds_have_the_time_on_the_floor_between():
    apexes_s = (1.5, 2.4, 6.0)  # in the air for 0.49 s each
    take = filmed(*jumping(apexes_s), noise_px=2.0, stature_m=STATURE_M)
    jumps = told_jumps(take)
    assert jumps["count"] == 3
    assert jumps["contact_time_s"] == [None, pytest.approx(0.9 - 0.495, abs=0.06)]  # before the second jump
    assert jumps["height_by_flight_time_cm"] == pytest.approx([30, 30, 30], abs=4)
    assert jumps["jump_height"] == pytest.approx([0.3, 0.3, 0.3], abs=0.06)
    assert jumps["take_off_feet"] == [2, 2, 2]
    for figure in ("flight_time_error_s", "height_by_flight_time_error_cm", "jump_height_error"):
        assert min(jumps[figure]) > 0


def test_jumps_are_the_least_where_some_are_not_seen():
    take = filmed(*jumping((1.5, 4.0)))
    jumps = told_jumps(without(take, (take.poses.times > 4.0) & (take.poses.times < 4.8)))
    assert (jumps["count"], jumps["count_at_least"]) == (1, True)
    assert jumps["observable_percent"] < 90


def falls(poses: PoseSequence) -> list[float]:
    return [flight.fall for flight in flown(poses).flights]


@pytest.mark.parametrize("slowed", [1, 4, 8])
@pytest.mark.parametrize("unit", [1.0, 300.0])
def test_a_ballistic_path_falls_with_the_square_of_the_pace(slowed, unit):
    poses = falling(slowed)
    found = falls(poses.with_(joints=poses.joints * unit, path=RootPath(poses.root * unit)))
    np.testing.assert_allclose(found, 9.81 / STATURE_M / slowed**2, rtol=0.06)
    assert len(found) == 2


def test_what_is_not_well_seen_says_nothing():
    assert not len(falls(falling(4, noise_m=0.1)))
    assert not len(falls(falling().with_(path=None)))
    assert not len(falls(falling(fps=8)))  # too few frames in the air
    walk = walker(seconds=6.0)
    poses = PoseSequence(
        walk.world - walk.root[:, None], H36M17, LEVEL, time_s=walk.time_s, path=RootPath(walk.root)
    )
    assert not len(falls(poses))
    gap = falling(4).joints.copy()
    gap[::7] = np.nan
    assert not len(falls(falling(4).with_(joints=gap)))


def test_a_flight_whose_beginning_or_end_was_not_seen_is_none():
    poses = falling()
    first, second = flown(poses).flights
    for seen_from_s, seen_to_s in (
        (first.off_s - 0.1, first.off_s + 0.06),
        (first.land_s - 0.06, first.land_s + 0.1),
    ):
        joints = poses.joints.copy()
        lost = (poses.times >= seen_from_s) & (poses.times <= seen_to_s)
        joints[lost, H36M17.index("r_ankle")] = np.nan
        (found,) = flown(poses.with_(joints=joints)).flights
        assert found.off_s == pytest.approx(second.off_s, abs=0.01)
        assert np.isfinite([found.off_s, found.land_s, found.rise]).all()


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "fewest"),
    [
        ("cmu_mocap", 0.155),
        pytest.param("hdm05_subset", 0.14, marks=pytest.mark.data("hdm05_subset.npz")),
        pytest.param("accad_mocap", 0.044, marks=pytest.mark.data("accad_mocap.npz")),
    ],
)
def test_real_people_fall_in_real_time(data, name, fewest):
    found = np.load(data / f"{name}.npz")
    joints, root, start = found["joints"], found["root"], found["clip_start"]
    flying = 0
    for a, b in pairwise(start):
        poses = PoseSequence(
            joints[a:b], H36M17, LEVEL, time_s=np.arange(b - a) / 30, path=RootPath(root[a:b])
        )
        assert clock_doubts(poses) == []
        flying += len(falls(poses)) > 0
    assert flying >= fewest * (len(start) - 1)


# --- rises of lifted jumps: a countermovement, a known fall, a landing on toes

FALL = 9.81 / 1.7  # statures / s2
TOES = 0.054  # statures by which standing on the toes lifts the ankles
# Statures: the body over the ankles, ankles over the floor, how far the knees give.
LEGS, ANKLE, DEEP = 0.5, 0.04, 0.2
APEX_S = 2.0


def jump(high: float, fps: float = 60.0, box: float = 0.0) -> dict:
    """Arguments of a jump so high, in statures: the body sinks, speeds up evenly, flies and lands likewise. box: how
    much higher it lands."""
    time_s = np.arange(0, 4, 1 / fps)
    up_s, down_s = np.sqrt(2 * high / FALL), np.sqrt(2 * (high - box) / FALL)
    leaves = LEGS + ANKLE + TOES
    push_s = 2 * (DEEP + TOES) / (FALL * up_s)
    way = time_s - APEX_S
    centre = leaves + high - FALL / 2 * way**2
    stretch = [np.clip((s - abs(way)) / push_s + 1, 0, 1) for s in (up_s, down_s)]  # 1 in the air
    lowest, floor = leaves - DEEP - TOES, np.where(way < 0, 0.0, box)
    pushing = lowest + (DEEP + TOES) * np.where(way < 0, *stretch) ** 2 + floor
    resting = abs(way) > np.where(way < 0, up_s, down_s) + push_s
    air = (-up_s < way) & (way < down_s)
    centre = np.where(air, centre, np.where(resting, LEGS + ANKLE + floor, pushing))
    toes = np.where(resting, 0.0, np.clip(centre - floor - LEGS - ANKLE, 0, TOES))
    ankle = np.where(air, centre - LEGS, ANKLE + floor + toes)
    rows = np.flatnonzero(air)
    path = BodyPath(time_s, centre[:, None] * [0, 0, 1], np.stack([ankle, ankle], axis=-1), LIFTED)
    return {
        "path": path, "line": np.where(air, -1.0, 9.0), "rows": slice(rows[0], rows[-1] + 1),
        "off_s": APEX_S - up_s, "apex_s": APEX_S, "fall": FALL,
    }  # fmt: skip


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
@pytest.mark.parametrize("high", [0.06, 0.12, 0.25])
def test_a_known_jump_has_its_rise(high, fps):
    assert lifted_rise(**jump(high, fps)) == pytest.approx(high, abs=0.015)


def test_when_the_feet_leave_hardly_matters():
    """At the take-off 20 ms are 0.02 statures of the path."""
    one = jump(0.12)
    rises = [lifted_rise(**{**one, "off_s": one["off_s"] + late_s}) for late_s in (-0.02, 0.0, 0.02)]
    assert np.ptp(rises) < 0.004


def test_where_the_take_off_was_not_seen_heights_alone_tell():
    """The row before the take-off is in each line of 0.4 s from before it to the highest point."""
    one = jump(0.06)
    path = replace(one["path"], centre=one["path"].centre.copy())
    path.centre[one["rows"].start - 1] = np.nan
    seen, unseen = lifted_rise(**one), lifted_rise(**{**one, "path": path})
    assert seen != unseen
    assert unseen == pytest.approx(0.06, abs=0.005)


def test_onto_a_box_the_rise_is_over_the_floor_that_the_feet_leave():
    assert lifted_rise(**jump(0.3, box=0.2)) == pytest.approx(0.3, abs=0.025)
