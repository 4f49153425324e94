"""Flights of a take, by the pelvis path where it was measured, else by keypoints and the lifted body before a camera
that stands still: how high people jump, and by how fast they fall whether the take runs at real time.

In flight nothing but gravity pulls, so the body's centre of mass falls at 9.81 m/s2 and drifts evenly, whatever the
limbs do; shown k times too slowly it falls at 9.81 / k^2.

Lifted ankles and bodies are off by 2 to 3 cm, and a take-off found 20 ms too late would make the rise 4 cm too small.
So the rise of lifted poses is a weighted mean of two figures that hardly depend on that moment: how much higher the
body gets than it is on stretched legs with the heels off the floor, and the height from which it would fall to be as
fast as it goes up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.camera import Camera
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import PoseSequence, Rectified, RootPath
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import on_lines, ranked, rate, stretches
from ...pipeline.signals.reprojection import FEWEST, JOINTS, keypoint_rays

_FEWEST = 10  # frames
_LEVEL = 0.5  # least share of the view that is horizontal: steeper, heights are depths
_NEAREST = 0.1  # statures before the camera
_ROBUST = 0.03  # statures off the usual height at which a joint's say is halved
_ROUNDS = 5  # of weighing joints

# Segment masses as shares of the body's, with the centre of mass at a share of the way from the first joint to the
# second: Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, table 4.1 (after Dempster). Feet go
# with the ankles.
SEGMENTS = (
    ("pelvis", "thorax", 0.578, 0.66),
    *(
        (f"{side}_{start}", f"{side}_{end}", mass, share)
        for side in "rl"
        for start, end, mass, share in (
            ("shoulder", "elbow", 0.028, 0.436),
            ("elbow", "wrist", 0.022, 0.682),
            ("hip", "knee", 0.100, 0.433),
            ("knee", "ankle", 0.0465, 0.433),
            ("knee", "ankle", 0.0145, 1.0),
        )
    ),
)
# Joints that a frame of a flight needs.
NEEDED = tuple(dict.fromkeys(joint for start, end, _, _ in SEGMENTS for joint in (start, end)))
SCALE_SD = 0.04  # of lifted heights, what the flights of a take share of their error, as a share
_FALL_S = 0.03  # over a lifted flight's duration: the share of its fall that is error, besides SCALE_SD
_FLOOR_S = 1.0  # to either side of a lifted flight, where its floor is looked for
_UP = 0.07  # statures by which both ankles are above their floor in the air; standing on the toes lifts them by 0.05
_FLOOR = 20  # per cent of the time in which an ankle that stands is lower
_TRIMMED = 0.1  # of the frames at either end, in which a foot may still push
GRAVITY = 9.81  # m / s2
_PEOPLE_M = (1.0, 2.2)  # statures of those who jump
_OVER_FEET = 0.2  # statures from the feet to the centre of mass; who hops on the hands does not jump
_BEFORE_S = 0.3  # before the feet leave the floor: where it is
# Which leaves the floor so long before the other, or lands after it, has no part in the jump.
_ONE_FOOT_S = 0.12
# Statures over where they stand by which lifted ankles are higher when the toes leave the floor, the heels being up
# already, and when they meet it, on feet that are less stretched: by which 68 lifted flights of train and validation
# people begin and end as captured, in the median. Knees tell it no better, and rise by as much as they were bent: with
# a share of them somebody who jumped from a squat seemed to fly up to 80 ms longer, and 40 % higher.
_LIFTS = {-1: 0.062, 1: 0.042}
# Rises of lifted jumps.
_STANDS_S = 1.0  # before and after a flight: where the floor is
# Statures: floors before and after a flight that differ by less count as one; a path may be off by half of that.
_STAIRS = 0.15
_STRETCH_S = 0.1  # around the take-off: in which the legs are stretched most
_STRETCHED = 90  # per cent of that time in which the centre of mass is nearer to the ankles
# Statures by which the lower ankle is higher at the take-off than it mostly is on the floor: median of 57 captured
# jumps of train people, of which nine in ten are within 0.009.
_HEEL = 0.054
_SPEED_S = 0.2  # to either side of a moment: over which its speed is taken
_FASTEST_BEFORE_S = 0.15  # the take-off: from when on the body may be fastest
# The rise by speed in statures: _LEAST and _BY_FALL times the height of a free fall that ends with that speed, a line
# through 67 captured jumps of train people, which are off it by 2.4 cm (standard deviation).
_LEAST, _BY_FALL = 0.018, 1.80
# Weight of the rise by speed in the mean, from the errors in lifted jumps of train people: by speed 3.5 cm, by heights
# 2.8.
_SHARE = 0.3


@dataclass(frozen=True)
class Rule:
    """What a path shows of a flight. since_s, until_s: the lower ankle passes _UP so long after the feet have left the
    floor, and before they land. fewest: frames in the air; least_s: seconds. noise: of the parabola's height, off: in
    statures, what the path may be off it. middle: of the flight's duration, how far from its middle the highest point
    may be. drift: of the fall, how far sideways the path may bend. high: statures, the parabola's height at least; 0
    where the fall is judged, for then least_s says it. lifted: whether the toes leave the floor and meet it by _LIFTS,
    which is looked for _FLOOR_S around and not in the whole take, the fall is one of gravity (_FALL_S), and the rise is
    that of `lifted_rise`."""

    since_s: float
    until_s: float
    noise: float
    off: float
    middle: float
    drift: float = np.inf
    fewest: int = 4
    least_s: float = 0.0
    high: float = 0.02
    lifted: bool = False


# Times are medians of 88 captured flights, and of their lifts through cameras (train and validation subjects).
MEASURED = Rule(since_s=0.008, until_s=0.03, noise=0.04, off=np.inf, middle=0.15, drift=0.25, fewest=6)
LIFTED = Rule(
    since_s=0.0, until_s=0.0, noise=np.inf, off=0.015, middle=0.25, least_s=0.17, high=0.0, lifted=True
)


@dataclass(frozen=True)
class Flight:
    """off_s, land_s: when the feet leave the floor and meet it, by the lower ankle. fall: how fast the centre of mass
    falls, in statures / s2. rise: statures, by how much it rises after the feet have left. off_feet, land_feet: on how
    many feet the person takes off and lands. clear: statures, how high the lower ankle gets over its floor."""

    off_s: float
    land_s: float
    fall: float
    rise: float
    off_feet: int
    land_feet: int
    clear: float = 0.0


@dataclass(frozen=True, eq=False)
class Airborne:
    """A take's flights, in order. observable: (T,) in which frames the body and its place are known well enough for
    one; False where flights are not looked for at all. cut: whether an end of the take, a clip boundary or a gap hides
    how both ankles left the floor or meet it again. shake: statures, by how much a camera that shakes moves the person
    in the image; NaN where it may go elsewhere. ankle: (T,) statures, how high the lower ankle is in each frame by
    itself; None where that is not known."""

    flights: tuple[Flight, ...] = ()
    observable: np.ndarray | bool = False
    cut: bool = False
    shake: float = 0.0
    ankle: np.ndarray | None = None


def airborne(take: Take) -> Airborne:
    """The flights of a rectified take. InputError without poses, or where nothing has rectified them."""
    poses, rectified, level = take.need("poses"), take.need("rectified"), take.need("rectified").level
    if level.root is None or not rectified.level_ok:
        return Airborne()
    body = is_finite(level.joints[:, level.layout.indices(NEEDED)]).all(axis=1)
    if (body & is_finite(level.root)).sum() < _FEWEST:
        return Airborne()
    if level.measured_root is not None:
        return flown(level)
    if take.keypoints is None or take.camera is None or rectified.in_world:
        return Airborne()
    rays, trust = keypoint_rays(poses, take.keypoints, take.camera)
    height = own_height(level, rectified, rays, trust)
    if height is None:
        return Airborne()
    root = np.column_stack([level.root[:, :2], height])
    level = level.with_(joints=_bridged(level.joints, level.times), path=RootPath(root))
    stature_m = implied_stature(level.joints) if level.frame.unit == "m" else None
    return replace(flown(level, LIFTED, stature_m), shake=_shake(take, take.camera, poses))


def flown(level: PoseSequence, rule: Rule = MEASURED, stature_m: float | None = None) -> Airborne:
    """The flights of H36M17 in axes whose z is up, relative to the pelvis, unfiltered, in any unit; none without a
    root, which says how high the person is, and where nobody flies: in flight both ankles are off the floor, and the
    centre of mass rises and falls in a parabola, within noise.

    level: with a measured root; with rule LIFTED lifted joints, whose root has each frame's own height (`own_height`).
    stature_m: the person's, where the poses are in metres; a lifted fall is one of gravity within its error, of any
    person's stature where it is not known. A flight's rise is half of the fall times the square of the time that it
    takes (Linthorne, Am J Phys 69(11), 2001); of lifted poses a mean of two, which is nearer to the captured rise.
    """
    stature = implied_stature(level.joints) if len(level) else np.nan
    if level.root is None or not stature > 0:
        return Airborne()
    joints = level.joints[:, level.layout.indices(NEEDED)]
    world = (level.joints + level.root[:, None]).astype(np.float64) / stature
    ankles = world[:, H36M17.indices(("r_ankle", "l_ankle")), 2]
    path = BodyPath(level.times, _centre_of_mass(world), ankles, rule)
    spells = list(_spells(path, level.seams))
    fitted = (_flight(path, rows, line, stature_m) for rows, line, whole in spells if whole)
    return Airborne(
        tuple(flight for flight in fitted if flight is not None),
        observable=is_finite(joints).all(axis=1) & is_finite(level.root),
        cut=not all(whole for _, _, whole in spells),
        ankle=path.lowest,
    )


def _shake(take: Take, camera: Camera, poses: PoseSequence) -> float:
    """As Airborne has it. poses: in CAMERA axes, placed."""
    if take.stands or poses.root is None:
        return 0.0 if take.stands else np.nan
    shakes = camera.background is not None and camera.background.kind == "hand-held" and not take.told.moving
    distance = float(np.nanmedian(np.linalg.norm(poses.root, axis=1))) / implied_stature(poses.joints)
    return camera.shake_rad * distance if shakes else np.nan


def _bridged(joints: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Joints (T, 17, 3) relative to the pelvis; those that hardly weigh on the centre of mass are on a line where they
    were not seen. Ankles, whose floor counts, stay missing."""
    filled = joints.copy()
    for name in NEEDED:
        if not name.endswith("ankle"):
            joint = H36M17.index(name)
            filled[:, joint] = on_lines(filled[:, joint], time_s)
    return filled


def own_height(
    level: PoseSequence, rectified: Rectified, rays: np.ndarray, trust: np.ndarray
) -> np.ndarray | None:
    """(T,) the height of the pelvis over the camera in each frame by itself, in LEVEL; NaN where too few joints tell.
    None where the camera looks down or up steeply.

    level: lifted, with the smooth path of `pelvis_path`, whose horizontal distance from the camera is kept; a fall is
    no longer in its height. rays (T, 17, 2), trust (T, 17): of keypoint_rays. At that distance each joint's ray says
    how high the body is; joints are weighed by how far they are off their usual answer (Cauchy).
    """
    assert level.root is not None
    R = rectified.R_source_from_level
    ahead = R[2, :2]  # the camera's z axis over the floor
    if R.ndim != 2 or np.linalg.norm(ahead) < _LEVEL:
        return None
    ahead = ahead / np.linalg.norm(ahead)
    stature = implied_stature(level.joints)
    use = H36M17.indices(JOINTS)
    height = np.empty(len(level))
    for rows in blocks(len(level)):
        body, lines = (each[rows, use].astype(np.float64) for each in (level.joints, rays))
        lines = rotate(transpose(R), np.concatenate([lines, np.ones((*lines.shape[:2], 1))], axis=-1))
        distance = (body[..., :2] + level.root[rows, None, :2]) @ ahead
        reach = lines[..., :2] @ ahead
        with np.errstate(invalid="ignore", divide="ignore"):
            heights = lines[..., 2] / reach * distance - body[..., 2]
        usable = np.isfinite(heights) & (reach > 0) & (distance > _NEAREST * stature) & (trust[rows, use] > 0)
        enough = usable.sum(axis=1) >= FEWEST
        heights, says = np.where(usable, heights, np.nan), np.where(usable, trust[rows, use], 0.0)
        own = np.full(len(heights), np.nan)
        own[enough] = np.nanmedian(heights[enough], axis=1)
        for _ in range(_ROUNDS):
            off = np.where(usable, heights - own[:, None], 0.0)
            weights = says / (1 + (off / (_ROBUST * stature)) ** 2)
            own[enough] += (weights * off).sum(axis=1)[enough] / weights.sum(axis=1)[enough]
        height[rows] = own
    return height


def _centre_of_mass(world: np.ndarray) -> np.ndarray:
    """(T, 3) of joints (T, 17, 3)."""
    mass = sum(share for _, _, share, _ in SEGMENTS)
    parts = [
        share / mass * ((1 - along) * world[:, H36M17.index(a)] + along * world[:, H36M17.index(b)])
        for a, b, share, along in SEGMENTS
    ]
    return np.sum(parts, axis=0)


@dataclass(frozen=True)
class BodyPath:
    """time_s (T,); in statures the centre of mass (T, 3), and the heights of the ankles (T, 2)."""

    time_s: np.ndarray
    centre: np.ndarray
    ankles: np.ndarray
    rule: Rule

    @property
    def lowest(self) -> np.ndarray:
        """(T,) the height of the lower ankle."""
        return self.ankles.min(axis=1)


def _flight(path: BodyPath, rows: slice, line: np.ndarray, stature_m: float | None) -> Flight | None:
    """The flight in rows in which both ankles are above a line (T,); None where the body does not fall freely."""
    rule, time_s = path.rule, path.time_s
    ends, parabola = [rows.start, rows.stop - 1], _fall(path.centre[rows], time_s[rows], rule)
    if parabola is None or (path.centre[ends, 2] - path.lowest[ends] < _OVER_FEET).any():
        return None
    fall, apex_s = parabola
    if rule.lifted:  # that of gravity within 2.6 standard deviations
        slack = 2.6 * np.hypot(_FALL_S / np.ptp(time_s[rows]), SCALE_SD)
        least, most = _PEOPLE_M if stature_m is None else (stature_m, stature_m)
        if not GRAVITY / most * (1 - slack) < fall < GRAVITY / least * (1 + slack):
            return None
    edges = ((rows.start, -1), (rows.stop - 1, 1))
    highest = path.ankles.max(axis=1) - line
    feet = [1 if _apart_s(highest, time_s, *edge) > _ONE_FOOT_S else 2 for edge in edges]
    off_s, land_s = (_edge(path, line, rows, way, on) for (_, way), on in zip(edges, feet, strict=True))
    if not off_s < apex_s < land_s:
        return None
    off_s, land_s = off_s - rule.since_s, land_s + rule.until_s
    rise = fall * (apex_s - off_s) ** 2 / 2
    if rule.lifted:
        free = fall if stature_m is None else GRAVITY / stature_m
        rise = lifted_rise(path, line, rows, off_s, apex_s, free)
    clear = float((path.lowest - line)[rows].max()) + _UP
    return Flight(off_s, land_s, fall, rise, *feet, clear=clear)


def _edge(path: BodyPath, line: np.ndarray, rows: slice, way: int, feet: int) -> float:
    """When the body leaves the floor before (way -1) or meets it after (1) rows in which the lower ankle is above the
    line, on so many feet; NaN where that was not seen."""
    row, time_s = rows.start if way < 0 else rows.stop - 1, path.time_s
    at_s, height, level = float(time_s[row]), path.lowest, float(line[row])
    if path.rule.lifted:
        height = path.ankles.mean(axis=1) if feet == 2 else path.lowest
        beside = np.abs(time_s - at_s - way * _BEFORE_S / 2) < _BEFORE_S / 2
        level = float(np.nanpercentile(height[beside], _FLOOR)) + _LIFTS[way]
        row = (rows.start + rows.stop) // 2
        while 0 < row < len(height) - 1 and height[row] > level:
            row += way
        row -= way
    if not height[row] > level >= height[row + way] or abs(time_s[row] - at_s) > _BEFORE_S / 2:
        return float("nan")
    first = min(row, row + way)
    share = (level - height[first]) / (height[first + 1] - height[first])
    return float(time_s[first] + share * (time_s[first + 1] - time_s[first]))


def _apart_s(height: np.ndarray, time_s: np.ndarray, row: int, way: int) -> float:
    """How long before (way -1) or after (1) a row a height has been above 0."""
    last = row
    while 0 < last < len(height) - 1 and height[last + way] > 0:
        last += way
    return float(abs(time_s[last] - time_s[row]))


def _spells(path: BodyPath, seams: tuple[int, ...]) -> Iterator[tuple[slice, np.ndarray, bool]]:
    """Rows in which the lower ankle is well above the floor for as long as in a flight, the line (T,) that it is above,
    and whether the lows before and after them were seen."""
    height, time_s, rule = path.lowest, path.time_s, path.rule
    for start, stop in pairwise([0, *seams, len(height)]):
        piece, times = height[start:stop], time_s[start:stop]
        if not np.isfinite(piece).any():
            continue
        line = np.full(len(height), np.nan)
        # What the height is for a fifth of the time around, or of the whole time.
        floor = np.percentile(piece[np.isfinite(piece)], _FLOOR)
        if rule.lifted and len(piece) > 1:
            width = 2 * round(_FLOOR_S * rate(times)) + 1
            floor = ranked(on_lines(piece, times), width, int(width * _FLOOR / 100), "edge")
        line[start:stop] = floor + _UP
        for a, b in stretches(piece > line[start:stop]):
            rows = slice(start + a, start + b)
            whole = a > 0 and b < len(piece) and bool(np.isfinite(piece[[a - 1, b]]).all())
            # With half of a frame to either side, in which the ankle passes its line.
            lasts_s = np.gradient(time_s)[rows].sum()
            if not whole or (b - a >= rule.fewest and lasts_s >= rule.least_s):
                yield rows, line, whole


def _fall(centre: np.ndarray, time_s: np.ndarray, rule: Rule) -> tuple[float, float] | None:
    """How fast a path (N, 3) falls in a parabola, statures / s2, and when that is highest; None where it is none."""
    ends = int(_TRIMMED * len(centre))
    inner = slice(ends, len(centre) - ends)
    middle_s = float(time_s[inner].mean())
    centre, time_s = centre[inner], time_s[inner] - middle_s
    if not np.isfinite(centre).all():
        return None
    design = np.vander(time_s, 3)
    weights = np.linalg.lstsq(design, centre, rcond=None)[0]
    (*drift, bend), speed = 2 * weights[0], weights[1, 2]
    duration = np.ptp(time_s)
    height = -bend * duration**2 / 8
    off = np.sqrt(((centre - design @ weights) ** 2).mean(axis=0))[2]
    fits = height > rule.high and off < min(rule.noise * height, rule.off)
    falls = np.hypot(*drift) < rule.drift * -bend and abs(speed / bend) < rule.middle * duration
    if not (fits and falls):
        return None
    return -float(bend), middle_s - float(speed / bend)


def lifted_rise(
    path: BodyPath, line: np.ndarray, rows: slice, off_s: float, apex_s: float, fall: float
) -> float:
    """By how many statures the centre of mass rises after the feet have left the floor, at off_s.

    line: (T,) above which the lower ankle is in the flight, which has `rows` and is highest at apex_s, and not in some
    rows before and after it; NaN in rows of another clip. fall: of gravity, statures / s2.
    """
    time_s, ankle = path.time_s, path.lowest
    stands, centre = ankle <= line, np.where(np.isfinite(line), path.centre[:, 2], np.nan)
    visible = np.isfinite(centre[rows])
    way_s = (time_s[rows] - apex_s)[visible]
    drift, level = np.polyfit(way_s, centre[rows][visible] + fall / 2 * way_s**2, 1)
    highest = level + drift**2 / (2 * fall)
    sooner, later = np.flatnonzero(stands[: rows.start]), rows.stop + np.flatnonzero(stands[rows.stop :])
    before = float(np.median(ankle[sooner[time_s[sooner] >= time_s[sooner[-1]] - _STANDS_S]]))
    after = float(np.median(ankle[later[time_s[later] <= time_s[later[0]] + _STANDS_S]]))
    floor = (before + after) / 2 if abs(after - before) < _STAIRS else before
    push = np.abs(time_s - off_s) <= _STRETCH_S
    stretched = float(np.nanpercentile((centre - ankle)[push], _STRETCHED))
    by_height = highest - floor - stretched - _HEEL
    speed = _steepest(time_s, centre, off_s - _FASTEST_BEFORE_S, apex_s)
    if np.isnan(speed):
        return max(by_height, 0.0)
    by_speed = _LEAST + _BY_FALL * speed**2 / (2 * fall)
    return max((1 - _SHARE) * by_height + _SHARE * by_speed, 0.0)


def _steepest(time_s: np.ndarray, height: np.ndarray, since_s: float, until_s: float) -> float:
    """The largest speed upward, a second, of lines through a height _SPEED_S to either side of moments of that time;
    NaN where some of it is missing."""
    reach = round(_SPEED_S * rate(time_s))
    speeds = [
        np.polyfit(time_s[i - reach : i + reach + 1], height[i - reach : i + reach + 1], 1)[0]
        for i in np.flatnonzero((time_s >= since_s) & (time_s <= until_s))
        if i >= reach and i + reach < len(height) and np.isfinite(height[i - reach : i + reach + 1]).all()
    ]
    return max(speeds, default=float("nan"))
