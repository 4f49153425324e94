"""Lengths, width and speed of a walk or a run, as gait laboratories report them beside the times (Gait.times).

Definitions: initial contact, toe-off, stance, swing, single and double support as in Perry & Burnfield, Gait Analysis,
2nd ed. 2010, chapter 1; steps, strides, speed and cadence as in Hollman, McDade & Petersen, Gait & Posture 34(1), 2011;
flight, and running as what has flights, as in Novacheck, Gait & Posture 7(1), 1998. A foot's place is its ankle's.

How wrong each may be was fitted on walks and runs with truth, as standard deviations. The error of a mean over N steps
or strides is made of a part that all of them share and one that each has for itself. That of lengths has what the
pelvis path's own error adds. That of times and shares of the stride grows with how far the found stance is from the
usual one, for unusual gaits are found more usual than they are. The mean of N step or stride times is the time between
two landings by N: of these, what each has for itself falls with N and grows with how much the values scatter, as they
do where a landing is found too early or too late. Of gaits unlike all that it was fitted on the error is larger yet. A
difference of the sides has an error of its own: what a lifter puts too near of one leg and too far of the other cancels
in the mean over both and is twice as large in the difference, the more so the more of a step is depth.

gait_error.json was learned on validation subjects, their walks as captured and in drawn styles, each person with the
same weight, so that nine in ten errors lie within 1.645 standard deviations: those of poses by the built-in lifter, and
those of captured ones, of which times and shares are known: 634 lifted and 319 captured walks and runs of six people
of CMU and ACCAD; fitted once, at commit afb266a4. After a new lifter, `pcnet3d lab evaluate errors` says whether they
still hold.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from ...pipeline.core.measures import SD_90
from ...pipeline.core.pose import RootPath
from ...pipeline.core.rotations import unit
from ...pipeline.signals.filters import resample
from .gait import OTHER, Gait, Stance, Step, Values, by_side, strides

_ERROR_FILE = Path(__file__).with_name("gait_error.json")
OF_LENGTH = ("walking_speed", "step_length", "stride_length", "step_width")
# Those that are told of each side, and whose difference of the sides has an error.
OF_SIDES = (
    "step_time_s", "stance_time_s", "stance_percent", "swing_percent", "single_support_percent",
    "double_support_percent", "flight_time_s", "step_length",
)  # fmt: skip
OF_LANDINGS = ("step_time_s", "stride_time_s")  # whose mean is the time between two landings, by their number
FEWEST_OF_A_SIDE = 2  # values, for a difference of the sides
_FLAT = (0.2, 0.6)  # of a stance: the foot lies flat and its ankle moves least
_FLAT_SAMPLES = 7
_WAY_SAMPLES = 25
_LONGEST_S = 0.8  # of a stance, for that: who stops moves the feet later
# Of the speed at which feet go back under the body: with less drift the person gets on over the floor, and the drift is
# the error of the path or the lift.
_CARRIED = 0.7
# The share of feet's ways in depth, and how many feet, that tell how far a walk in depth goes; how many times as far
# as these say is no lift's error. The paths of 19 lifted walks of 10 validation and training people are 1.2 times as
# far, with a standard deviation of 0.2 and at most 1.45; with 2.2 times their focal lengths 13 of 19 are told. Half of
# one makes paths no shorter than some are.
_IN_DEPTH, _FEWEST, _TOO_FAR = 0.7, 3, 1.75


def length_values(
    gait: Gait,
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    seams: Sequence[int] = (),
) -> Values:
    """{"step_length", "walking_speed": {side: (N,)}} of the steps that end when that foot lands, and {"stride_length",
    "step_width": {side: (M,)}} of that foot's strides, walk by walk, in the unit of the places; NaN where one is
    missing. root: (T, 2) the pelvis over the floor or the belt; ankles: (T, 2) by side relative to it.

    A foot's place is the mean over the part of its stance in which it lies flat, so that the noise of single frames
    does not enter. A stride's length is between two places of the same foot, a step's from the other foot's place to
    this one's, both along the way that the pelvis takes midway between them; a stride's width is how far to the side
    the other foot's place between lies from the middle of the two (in a straight walk that of Huxham et al., Gait &
    Posture 23(2), 2006). A step's speed is how far apart the pelvis is at its two landings by the mean time of all
    steps, so that the mean of speeds is distance by time.
    """
    stands = {side: places(root + ankles[side], time_s, gait.feet[side], seams) for side in "rl"}

    def at(side: str, start_s: float) -> np.ndarray:
        return stands[side].get(start_s, np.full(3, np.nan))

    landings = np.array([(step.start_s, step.stop_s) for step in gait.steps]).reshape(-1, 2)
    first, last = resample(root, time_s, landings.T.ravel(), seams).reshape(2, len(landings), -1)
    usual_s = float(np.mean(landings[:, 1] - landings[:, 0])) if len(landings) else float("nan")
    step_lengths, stride_lengths, widths = [], [], []
    for walk in gait.walks:
        ends = [(at(OTHER[step.side], step.start_s), at(step.side, step.stop_s)) for step in walk]
        step_lengths += [moved @ ahead for moved, ahead in _ways(root, time_s, walk, ends, seams)]
        of_walk = strides([walk], gait.feet)
        ends = [(at(s.side, s.start_s), at(s.side, s.stop_s)) for s in of_walk]
        ways = _ways(root, time_s, walk, ends, seams)
        for s, (before, after), (moved, ahead) in zip(of_walk, ends, ways, strict=True):
            aside = (at(OTHER[s.side], s.other_start_s) - (before + after) / 2)[:2] @ (-ahead[1], ahead[0])
            stride_lengths.append(moved @ ahead)
            widths.append(abs(aside))
    speeds = np.linalg.norm(last - first, axis=-1) / usual_s
    of_strides = {"stride_length": stride_lengths, "step_width": widths}
    return by_side(gait.steps, {"walking_speed": speeds, "step_length": step_lengths}) | by_side(
        gait.strides, of_strides
    )


def _ways(
    root: np.ndarray,
    time_s: np.ndarray,
    walk: Sequence[Step],
    ends: Sequence[tuple[np.ndarray, np.ndarray]],
    seams: Sequence[int],
) -> np.ndarray:
    """(N, 2, 2) of N pairs of places (x, y, time) in a walk: from one to the other, and the direction in which the
    pelvis goes midway, by a parabola through its path of three strides about that, as far as the walk goes: a bend is
    followed, swaying and the path's noise are not."""
    before, after = np.moveaxis(np.reshape(ends, (-1, 2, 3)), 1, 0)
    middle, reach = (before[:, 2] + after[:, 2]) / 2, 3 * (walk[-1].stop_s - walk[0].start_s) / len(walk)
    first = np.maximum(middle - reach, walk[0].start_s)
    last = np.minimum(middle + reach, np.maximum(walk[-1].stop_s, after[:, 2]))
    at_s = np.linspace(first, last, _WAY_SAMPLES, axis=1)
    ways, known = np.full((len(at_s), 2, 2), np.nan), np.flatnonzero(np.isfinite(middle))
    paths = resample(root, time_s, at_s[known].ravel(), seams).reshape(-1, _WAY_SAMPLES, 2)
    for i, path in zip(known, paths, strict=True):
        visible = np.isfinite(path).all(axis=1)
        if visible.sum() >= _WAY_SAMPLES / 2:
            ahead = np.polyfit(at_s[i, visible] - middle[i], path[visible], 2)[1]
            ways[i] = (after - before)[i, :2], unit(ahead)
    return ways


def over_belt(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    gait: Gait,
    seams: Sequence[int] = (),
) -> tuple[np.ndarray, float]:
    """((T, 2), belt speed): the pelvis as the belt of a treadmill sees it, and how fast the belt runs, by the drift of
    the feet that stand; the same path and 0 where they stay."""
    velocity = belt_drift(*standing(root, ankles, time_s, walked_on(gait), seams))
    return root - time_s[:, None] * velocity, float(np.linalg.norm(velocity))


def walked_on(gait: Gait) -> dict[str, list[Stance]]:
    """The stances that steps end with, by side."""
    landed = {(step.side, step.stop_s) for step in gait.steps}
    return {side: [s for s in gait.feet[side] if (side, s.start_s) in landed] for side in "rl"}


def standing(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    feet: Mapping[str, Sequence[Stance]],
    seams: Sequence[int] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) the velocities at which feet that lie flat are carried along, and (N, 2) go back under the body, of the
    stances that are seen whole. root, ankles: as of `length_values`."""
    velocities = []
    for side, of_side in feet.items():
        paths = np.hstack([root + ankles[side], ankles[side]])
        spans = np.reshape([(stance.start_s, stance.stop_s) for stance in of_side], (-1, 2))
        at_s = spans[:, :1] + np.array(_FLAT) * (spans[:, 1:] - spans[:, :1])
        at_s = at_s[np.isfinite(at_s).all(axis=1)]
        samples = resample(paths, time_s, at_s.ravel(), seams).reshape(-1, 2, 4)
        velocities += [*(samples[:, 1] - samples[:, 0]) / np.diff(at_s)]
    drifts, backs = np.split(np.reshape(velocities, (-1, 4)), 2, axis=1)
    whole = np.isfinite(drifts).all(axis=1)
    return drifts[whole], backs[whole]


def belt_drift(drifts: np.ndarray, backs: np.ndarray) -> np.ndarray:
    """(2,) the velocity at which feet that stand are carried along, the median of `standing` ones; zeros where most
    stay, drifting back by less than 0.7 of how fast they go back under the body, whichever way it walks. Feet that
    drift ahead are on no belt: their legs were lifted too short."""
    along = ((drifts - _CARRIED * backs) * backs).sum(axis=1)
    return np.median(drifts, axis=0) if len(along) and np.median(along) > 0 else np.zeros(2)


def times_too_far(drifts: np.ndarray, backs: np.ndarray, depth: np.ndarray) -> float:
    """How many times as far as `standing` feet go back under it the pelvis goes along depth (2,), the camera's view
    over the floor, for such feet stay where they are; 1 within what lifts are off, for few feet, and for a walk that is
    not mostly in depth."""
    path, steps = (drifts - backs) @ unit(depth), -backs @ unit(depth)
    in_depth = np.abs(steps).sum() > _IN_DEPTH * np.linalg.norm(backs, axis=1).sum()
    times = (path * steps).sum() / (steps**2).sum() if in_depth and len(steps) >= _FEWEST else 1.0
    return float(times) if times > _TOO_FAR else 1.0


def places(
    path: np.ndarray, time_s: np.ndarray, feet: Sequence[Stance], seams: Sequence[int]
) -> dict[float, np.ndarray]:
    """{initial contact: (D + 1,) the mean of path (T, D) over the part of a stance in which the foot lies flat, and the
    time of that}; a stance that is cut goes on to the take's end."""
    landed = [stance for stance in feet if stance.start_s == stance.start_s and stance.start_s < time_s[-1]]
    if not landed:
        return {}
    start = np.array([stance.start_s for stance in landed])
    stop = np.array([stance.stop_s if stance.stop_s == stance.stop_s else time_s[-1] for stance in landed])
    lasts = np.minimum(stop - start, _LONGEST_S)
    at_s = start[:, None] + np.linspace(*_FLAT, _FLAT_SAMPLES) * lasts[:, None]
    samples = resample(path, time_s, at_s.ravel(), seams).reshape(*at_s.shape, -1)
    means = np.column_stack([samples.mean(axis=1), at_s.mean(axis=1)])
    return {stance.start_s: mean for stance, mean in zip(landed, means, strict=True)}


@dataclass(frozen=True)
class GaitErrors:
    """Of the walks, or of the runs, of one source's poses, each {figure: {part: value}}; without any none is known.
    figures: of means "shared", "each", and "root" of lengths, "apart" of others, of OF_LANDINGS also "scatter" and the
    "usual_scatter"; differences: "shared", "each" and "depth", of right less left; in both "most" values, of more of
    which nothing is surer. seen: "least", "usual" and "most" of OF_STYLE, as they were found in what that was fitted
    on."""

    figures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    differences: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    seen: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether any are known."""
        return bool(self.figures)

    def mean(
        self,
        figure: str,
        count: int,
        root_sd: float = 0.0,
        style: Mapping[str, float] | None = None,
        scatter: float = np.nan,
    ) -> float:
        """Standard deviation of the mean of `count` values of a figure (Gait.times, `length_values`), in its
        unit, lengths and speeds in lengths of a leg; NaN where it is not known. root_sd: of the pelvis path in lengths
        of a leg. style: Gait.style of these values. scatter: of both
        sides' values (`scatter`), the usual one if not known. Where the style is beyond what was seen (`beyond`), all
        of it is larger by that share: a rule, for nothing was fitted there."""
        own = self.figures.get(figure)
        if own is None:
            return float("nan")
        style, fewer = style or {}, min(count, own["most"])
        each = 1 / fewer if figure in OF_LANDINGS else 1 / np.sqrt(fewer)
        parts = [own["shared"], own["each"] * each]
        if figure in OF_LENGTH:
            parts.append(own["root"] * root_sd * each)
        else:
            usual = self.seen["stance_percent"]["usual"]
            parts.append(own["apart"] * abs(style.get("stance_percent", usual) - usual))
        if figure in OF_LANDINGS:
            parts.append(own["scatter"] * (scatter if np.isfinite(scatter) else own["usual_scatter"]) * each)
        beyond = 0.0 if figure in OF_LENGTH else max(self.beyond(style).values(), default=0.0)
        return float(np.sqrt(np.sum(np.square(parts)))) * (1 + beyond)

    def beyond(self, style: Mapping[str, float]) -> dict[str, float]:
        """{figure: how far} of those in a Gait.style that lie outside what was found in the walks and runs that errors
        were fitted on: the distance in half widths of that range."""
        outside_by = {}
        for name, value in style.items():
            least, most = self.seen[name]["least"], self.seen[name]["most"]
            outside = max(least - value, value - most)
            if outside > 0:
                outside_by[name] = 2 * outside / (most - least)
        return outside_by

    def difference(self, figure: str, right: int, left: int, depth: float, scatter: float = np.nan) -> float:
        """Standard deviation of the mean of `right` values of one side less that of `left` values of the other, in the
        figure's unit, of a length in lengths of a leg; NaN where it is not known. figure: of OF_SIDES. depth:
        `depth_of_steps`. scatter: of each side's values about their own mean, of which only what is beyond the usual
        one counts: in 134 lifted validation walks the median bar grows from 22.8 to 23.3 % of a step time."""
        own = self.differences.get(figure)
        if own is None:
            return float("nan")
        pairs = min(1 / (1 / right + 1 / left), own["most"])
        parts = [own["shared"], own["each"] / np.sqrt(pairs), own["depth"] * depth]
        if figure in OF_LANDINGS and np.isfinite(scatter):
            mean = self.figures[figure]
            beyond = np.sqrt(max(scatter**2 - mean["usual_scatter"] ** 2, 0.0))
            parts.append(mean["scatter"] * beyond * np.hypot(1 / right, 1 / left))
        return float(np.sqrt(np.sum(np.square(parts))))

    def side(self, figure: str, depth: float) -> float:
        """Standard deviation that all values of one side share beyond `mean`: half of what a difference of the sides
        has however many steps there are. As those of `difference`."""
        own = self.differences.get(figure)
        return float("nan") if own is None else float(np.hypot(own["shared"], own["depth"] * depth)) / 2


@cache
def shipped_errors(gait: str = "walking", source: Literal["lifted", "measured"] = "lifted") -> GaitErrors:
    """What gait_error.json holds of walks ("walking") or runs ("running") of poses by the built-in lifter, or of
    captured ones."""
    content = json.loads(_ERROR_FILE.read_text(encoding="utf-8"))[source]
    return GaitErrors(*(content[part][gait] for part in ("figures", "differences", "seen")))


def scatter(values: np.ndarray) -> float:
    """Standard deviation of values (N,) among themselves; NaN of fewer than two."""
    return float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def depth_of_steps(
    R_camera_from_body: np.ndarray, time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> float:
    """How much of a step is depth, 0 (seen from the side) to 1: the root mean square over the walks' frames of the
    cosine between where the person faces and the camera's axis. R_camera_from_body: (T, 3, 3), NaN where unknown;
    time_s: (T,). NaN where it is known of no frame."""
    ahead = R_camera_from_body[_inside(time_s, walks), 2, 0]  # BODY's x is back, CAMERA's z is away
    ahead = ahead[np.isfinite(ahead)]
    return float(np.sqrt(np.mean(ahead**2))) if len(ahead) else float("nan")


def path_error(
    path: RootPath, axis: np.ndarray, time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> tuple[float, float]:
    """Of an estimated pelvis path (models/place/path.py) in LEVEL: standard deviation of a place along the horizontal
    axis where it is worst, in the path's unit; and the share of lengths and speeds that may be wrong in all strides
    alike, by the body's size and, as far as the person walks along the camera's axis (3,), by the focal length. 0, 0
    without a place, NaN of a path that states no error. time_s: (T,).
    """
    if path.covariance is None or path.shared is None:
        return float("nan"), float("nan")
    root, covariance, (scale_sd, focal_sd) = path.points, path.covariance, path.shared
    # Of each frame for itself: less what the body's size and the focal length make wrong in all alike.
    depth = (root @ axis)[:, None] * axis
    alike = sum(sd**2 * at[:, :, None] * at[:, None, :] for sd, at in ((scale_sd, root), (focal_sd, depth)))
    own_error = (covariance - alike)[:, :2, :2]
    own_error = own_error[np.isfinite(own_error).all(axis=(1, 2))]
    if not len(own_error) or not walks:
        return 0.0, 0.0
    root_sd = float(np.sqrt(np.median(np.maximum(np.linalg.eigvalsh(own_error)[:, -1], 0.0))))
    velocity = np.gradient(root, time_s, axis=0)[_inside(time_s, walks)]
    velocity = velocity[np.isfinite(velocity).all(axis=1)]
    along = ((velocity @ axis) ** 2).sum() / max((velocity**2).sum(), 1e-12)
    # The bar's end, for a lens that may be twice as long makes more of a speed than its slope says.
    longer = np.sqrt(1 + along * ((1 + SD_90 * focal_sd) ** 2 - 1)) - 1
    return root_sd, float(np.hypot(scale_sd, longer / SD_90))


def _inside(time_s: np.ndarray, walks: Sequence[Sequence[Step]]) -> np.ndarray:
    """(T,) which frames are of a walk."""
    inside = np.zeros(len(time_s), dtype=bool)
    for walk in walks:
        inside |= (time_s >= walk[0].start_s) & (time_s <= walk[-1].stop_s)
    return inside
