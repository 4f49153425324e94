"""Walking and running: steps, times of the gait cycle, lengths and speed, each with its error, or why they cannot be
had."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...models.angle_error.joint_noise import made_by_the_built_in
from ...models.gait.contact import leg_length
from ...models.gait.errors import (
    FEWEST_OF_A_SIDE,
    OF_LENGTH,
    GaitErrors,
    depth_of_steps,
    path_error,
    scatter,
    shipped_errors,
    style_of,
)
from ...models.gait.events import Step, contact_times
from ...models.gait.gait import (
    Gait,
    Values,
    backward_steps,
    length_values,
    over_belt,
    separation,
    time_values,
)
from ...models.gait.of_take import SIDES, unjudged
from ...models.place.airborne import no_place
from ...pipeline.core.measures import SD_90, Curve, Curves, Measure, Remark, Row, within
from ...pipeline.core.messages import how_many, spans_in_words
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, transpose
from ...pipeline.signals.filters import BRIDGED_S, breaks, holes, runs
from ...pipeline.signals.flights import Flight
from .figures import basis, deviation, moments, symmetry, with_error
from .jumps import goes_on
from .strides import peaks
from .unseen_steps import HIDES_S, cut_walk, passings, uncountable

FEWEST = 10  # frames
_STRIDES = {"walking": 3, "running": 2}  # for a cadence; who runs is out of the image after a second
# Seconds of a lifted step: quicker ones without flights may be of a run whose flights were not seen. Of 64 captured
# walks (train and validation people) none has a mean below 0.45, of 94 runs 79 have one below 0.4.
_QUICK_S = 0.4
# Times that the legs pass each other, from which it is no rest: a walk whose feet's contacts are not seen, perhaps.
_PASSES = 4
# Lengths of a leg by which the pelvis moves over the floor, from which the person does not stay in place: who lies down
# or gets up moves it by up to 1.4.
_TRAVELS = 1.5
_BELT_SHARE = 0.12  # of a belt's speed by the feet's drift: what lifted stances are off (validation subjects)
_IN_STRIDES = (
    "thigh_trunk_flexion",
    "knee_flexion",
    "ankle_dorsiflexion",
    "shoulder_flexion",
    "elbow_flexion",
)
_PHASES = ("stance_percent", "swing_percent", "single_support_percent")
_OF_BOTH = ("walking_speed", "step_length", "stride_length", "step_width")
_TIMES = ("step_time_s", "stride_time_s", "stance_time_s", "swing_time_s")
# The name without a unit, and the unit, of each figure of models.gait.gait.
_NAMED = {
    **{
        f"{name}_s": (name, "s")
        for name in ("step_time", "stride_time", "stance_time", "swing_time", "flight_time")
    },
    **{
        f"{name}_percent": (name, "percent")
        for name in ("stance", "swing", "single_support", "double_support")
    },
    **{name: (name, "length") for name in ("step_length", "stride_length", "step_width")},
    "walking_speed": ("walking_speed", "speed"),
}


def walking(
    body: np.ndarray,
    gait: Gait,
    columns: Mapping[str, np.ndarray],
    curves: Callable[[str, np.ndarray], Curve | None],
    filtered: PoseSequence,
    rectified: Rectified,
    source: PoseSequence,
    belt_speed: float | None = None,
    jumped: Sequence[Flight] = (),
) -> list[Row]:
    """The group `walking` (stages/measures/stage.py). body: joints in BODY axes. curves: of an angle over spans (N, 2).
    source: the poses that were rectified. belt_speed: a treadmill's, where it is told, in the unit of the poses a
    second. jumped: what ends a walk. `count_reason`: why there may be more steps."""
    apart = separation(body, filtered.times, breaks(filtered))[:, 0]
    if not rectified.level_ok:
        return [Remark("reason", f"the take is not levelled: {rectified.level_reason}")]
    if np.isfinite(apart).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have both legs"), *basis(apart)]
    if not gait.walks:
        if why := uncountable(apart, columns, filtered, rectified, source.frame):
            return [Remark("reason", "; ".join(why)), *basis(apart)]
        hidden, passed_s = _hidden(apart, filtered.times), passings(apart, filtered.times)
        if len(passed_s) >= _PASSES:
            hidden = f"; but the legs pass each other {len(passed_s)} times{hidden}"
        elif rectified.camera != "moving" and cut_walk(passed_s, apart, filtered, leg_length(body)):
            hidden = f"; but the first or last steps that are seen may be part of a walk{hidden}"
        elif travels := _travels(body, filtered, rectified, jumped):
            hidden = f"; but {travels}{hidden}"
        hides = [Remark("reason", f"no three steps in a row, nor two of a run{hidden}")] if hidden else []
        return [Measure("steps", 0), *hides, *basis(apart)]
    lifted, errors = source.lifted, errors_of(source)
    unknown = float("nan") if unjudged(filtered, rectified) else 0.0  # errors of angles that state none
    root_sd, share = _path_error(filtered, rectified, gait.walks)
    R_camera_from_body = source.frame.basis.T @ rectified.R_source_from_body
    depth = depth_of_steps(R_camera_from_body, filtered.times, gait.walks) if lifted else 0.0
    values = time_values(gait)
    said = _Means(gait.kind, errors, leg_length(body), root_sd, depth, style_of(values))
    both = "flight_time_s" if gait.kind == "running" else "double_support_percent"
    phases = (*_PHASES, *[both] * (not gait.mixed))
    timed: tuple[Sequence[str], Sequence[str]] = ("step_time_s", "stance_time_s", *phases), (*_TIMES, *phases)
    fewest, why_untimed = _STRIDES[gait.kind], list[Row]()
    if errors is None and len(gait.strides) < fewest:  # nobody knows how far single ones of them are off
        timed = (), ()
        why_untimed = [Remark("timing_reason", f"fewer than {fewest} strides, whose errors are not known")]
    lengths, over_floor, belt_share = _lengths(
        gait, filtered, rectified, belt_speed, _BELT_SHARE if lifted and errors else float("nan")
    )
    share = float(np.hypot(share, belt_share))
    quick = lifted and gait.kind == "walking" and said.style["step_time_s"] < _QUICK_S
    strides = gait.strides
    spans = {
        side: np.array([(s.start_s, s.stop_s) for s in strides if s.side == side]).reshape(-1, 2)
        for side in SIDES.values()
    }
    cycles = [curves(f"{side}_{part}", spans[side]) for part in _IN_STRIDES for side in SIDES.values()]

    def of_side(side: str) -> list[Row]:
        return [
            Measure("steps", sum(step.side == side for step in gait.steps)),
            Measure("strides", len(spans[side])),
            *said(values, timed[0], side),
            *said(lengths, ("step_length",), side, share),
            *peaks(
                columns, filtered.times, [s for s in strides if s.side == side], breaks(filtered), unknown
            ),
            moments("stride_start", spans[side][:, 0]),
            moments("stride_stop", spans[side][:, 1]),
            moments("landings", contact_times(gait.walks, side)),
            moments("toe_offs", (s.off_s for s in strides if s.side == side and np.isfinite(s.off_s))),
        ]

    seen = runs(np.isfinite(apart), filtered.times, breaks(filtered))
    more = [why] if (why := goes_on(gait, seen, filtered.times, jumped)) else []
    if (beside := _passes_beside(gait, apart, filtered.times)) >= _PASSES:
        more.append(f"outside what was counted the legs pass each other {beside} times")
    back = backward_steps(gait, apart, filtered.times)
    landed = len(gait.steps) + len(gait.walks)
    counted = f"{how_many(len(gait.steps), 'step')} between {how_many(landed, 'landing')}" + (
        f" in {len(gait.walks)} walks" if len(gait.walks) > 1 else ""
    )
    return [
        Remark("gait", "walking or running" if quick or gait.mixed else gait.kind),
        Measure("walks", len(gait.walks)),
        Measure("steps", len(gait.steps)),
        *([Measure("backward_steps", back)] if back else []),
        Remark("counted", counted),
        *([Remark("count_reason", "; ".join(more))] if more else []),
        *over_floor,
        *said(lengths, _OF_BOTH, share=share),
        _cadence(said, values, len(strides), fewest),
        *said(values, timed[1]),
        *why_untimed,
        *_symmetries(said, {**values, **lengths}),
        *basis(apart),
        *within("right", of_side("r"), "right"),
        *within("left", of_side("l"), "left"),
        Curves(tuple(curve for curve in cycles if curve)),
    ]


def errors_of(source: PoseSequence) -> GaitErrors | None:
    """Errors of gait figures from poses of the built-in lifter or of motion capture; None for other lifters, whose
    errors were not measured."""
    if source.made_by.kind == "measured":
        return shipped_errors("measured")
    return shipped_errors("lifted") if made_by_the_built_in(source) else None


def doubts(gait: Gait, source: PoseSequence) -> list[Notice]:
    """That the errors of the figures are not known; or that stance or step time lies outside those that they were
    fitted on. Empty where both lie within, and without a walk."""
    if not gait.walks:
        return []
    errors = errors_of(source)
    if errors is None:
        by = f" by {source.made_by.by}" if source.made_by.by else ""
        return [notice("gait-errors-unknown", by=by)]
    style = style_of(time_values(gait))
    told = {"stance_percent": "a stance of {:.0f} % of the stride", "step_time_s": "a step time of {:.2f} s"}
    beyond = " and ".join(told[name].format(style[name]) for name in errors.beyond(gait.kind, style))
    return [notice("gait-unlike-any-seen", gait=gait.kind, figures=beyond)] if beyond else []


def _passes_beside(gait: Gait, apart: np.ndarray, time_s: np.ndarray) -> int:
    """How many of those are of no walk. apart: (T,) at time_s (T,)."""
    inside = [(time_s >= walk[0].start_s) & (time_s <= walk[-1].stop_s) for walk in gait.walks]
    return len(passings(apart, time_s)) - sum(len(passings(apart[rows], time_s[rows])) for rows in inside)


def _travels(body: np.ndarray, filtered: PoseSequence, rectified: Rectified, jumped: Sequence[Flight]) -> str:
    """That the pelvis moves over the floor, between jumps, by more than where somebody stands, and than its error; ""
    where it does not, or its path or the error of that are not known."""
    if rectified.camera == "moving" or filtered.root is None or not len(filtered):
        return ""
    times, leg = filtered.times, leg_length(body)
    sd, share = _path_error(filtered, rectified, [[Step("r", float(times[0]), float(times[-1]))]])
    flown = np.ravel([(flight.off_s, flight.land_s) for flight in jumped])
    piece = np.searchsorted(flown, times)  # odd: in the air
    known = is_finite(filtered.root)
    places = [filtered.root[known & (piece == each), :2] for each in np.unique(piece[known]) if each % 2 == 0]
    far = max((float(np.linalg.norm(np.ptp(of, axis=0))) for of in places), default=0.0)
    # What all of the path shares makes it longer or shorter, but never none.
    if not (far > _TRAVELS * leg and far > SD_90 * np.sqrt(2) * sd * (1 + SD_90 * share)):
        return ""
    how = "in steps that were not found, perhaps to the side"
    return f"the person moves over the floor by {far / leg:.2g} leg lengths {how}"


def _hidden(apart: np.ndarray, time_s: np.ndarray) -> str:
    """What gaps of the separation (T,) at time_s (T,) have to do with it; "" where there are none between frames that
    have it, nor any before and after in which somebody may walk."""
    seen = np.flatnonzero(np.isfinite(apart))
    missing = int(seen[-1] - seen[0] + 1 - len(seen))
    words = (
        f"; the legs are hidden in {how_many(missing, 'frame')} between, where a walk ends" if missing else ""
    )
    ends = [(float(time_s[0]), float(time_s[seen[0]])), (float(time_s[seen[-1]]), float(time_s[-1]))]
    if ends := [(start, stop) for start, stop in ends if stop - start >= HIDES_S]:
        words += f"; the legs are not seen from {spans_in_words(ends)}"
    rows = holes(time_s, BRIDGED_S)
    rows = rows[(seen[0] < rows) & (rows <= seen[-1])]
    if len(rows):
        lacking = spans_in_words(time_s[np.c_[rows - 1, rows]].tolist())
        words += f"; there is no image from {lacking}, where a walk ends"
    return words


@dataclass(frozen=True)
class _Means:
    """Means of gait figures with their errors. gait: "walking" or "running". errors: those of the poses' source; None
    states none. leg: length of a leg, root_sd: of the pelvis path, in the poses' unit, NaN where unknown. depth:
    errors.depth_of_steps. style: errors.style_of the values."""

    gait: str
    errors: GaitErrors | None
    leg: float
    root_sd: float
    depth: float
    style: dict[str, float]

    def error(self, name: str, count: int, both: np.ndarray, of_side: bool = False) -> float:
        """Of the mean of `count` values, of both sides or of one; NaN where none is stated. both: (N,) both sides'."""
        if self.errors is None:
            return float("nan")
        own = self.errors.mean(self.gait, name, count, self.root_sd / self.leg, self.style, scatter(both))
        own = np.hypot(own, self.errors.side(self.gait, name, self.depth)) if of_side else own
        return float(self.leg * own if name in OF_LENGTH else own)

    def difference_error(self, name: str, right: np.ndarray, left: np.ndarray) -> float:
        """Of the mean of the right side's values less that of the left's; NaN where none is stated."""
        if self.errors is None or (name in OF_LENGTH and np.isnan(self.root_sd)):
            return float("nan")
        # Of each side about its own mean: what the sides differ by is no scatter.
        off = np.concatenate([side - side.mean() for side in (right, left)])
        spread = scatter(off) * float(np.sqrt((len(off) - 1) / (len(off) - 2))) if len(off) > 2 else np.nan
        own = self.errors.difference(self.gait, name, len(right), len(left), self.depth, spread)
        return float(self.leg * own if name in OF_LENGTH else own)

    def single(self, name: str) -> float:
        """What a spread of values has to exceed to be the person's; NaN where that is not known."""
        if self.errors is None:
            return float("nan")
        own = self.errors.mean(self.gait, name, 1)
        if name not in OF_LENGTH:
            return own
        return self.leg * own if np.isfinite(own) else 0.0  # lengths of measured poses are of the person

    def __call__(
        self, values: Values, names: Sequence[str], side: str | None = None, share: float = 0.0
    ) -> list[Row]:
        """`mean_<name>` (walking_speed by its own name), its error, and `deviation`, where that is larger than one
        value's error. side: of one side only. share: of the mean, what may be wrong
        in all values alike."""
        result: list[Row] = []
        for name in names:
            if name not in values:
                continue
            both = _both(values, name)
            found = _finite(values[name][side]) if side else both
            if not len(found):
                continue
            plain, unit = _NAMED[name]
            mean = float(found.mean())
            error = float(np.hypot(self.error(name, len(found), both, side is not None), share * mean))
            if name == "walking_speed":
                result.append(with_error(plain, unit, mean, error))
                continue
            result.append(with_error(f"mean_{plain}", unit, mean, error))
            result += deviation(plain, unit, found, self.single(name))
        return result


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _both(values: Values, name: str) -> np.ndarray:
    return _finite(np.concatenate([values[name][side] for side in SIDES.values()]))


def _symmetries(said: _Means, values: Values) -> list[Row]:
    """Symmetry indices of the sides' step and stance times and step lengths, of two steps of each side or more."""
    result: list[Row] = []
    for name in ("step_time_s", "stance_time_s", "step_length"):
        sides = [_finite(values[name][side]) if name in values else np.empty(0) for side in SIDES.values()]
        if min(map(len, sides)) >= FEWEST_OF_A_SIDE:
            right, left = (found.mean() for found in sides)
            error = said.difference_error(name, *sides)
            result += symmetry(float(right), float(left), error, of=f"{_NAMED[name][0]}_")
    return result


def _cadence(said: _Means, values: Values, strides: int, fewest: int) -> Row:
    """Steps a minute by the mean step time."""
    if strides < fewest:
        return Remark("cadence_reason", f"fewer than {fewest} strides")
    step_time = _both(values, "step_time_s")
    mean = float(step_time.mean())
    return with_error(
        "cadence", "spm", 60 / mean, 60 / mean**2 * said.error("step_time_s", len(step_time), step_time)
    )


def _path_error(
    filtered: PoseSequence, rectified: Rectified, walks: Sequence[Sequence[Step]]
) -> tuple[float, float]:
    """models.gait.errors.path_error of a path that was estimated (stages/place.py); NaN of one whose estimator states
    no error; 0, 0 for others."""
    covariance, shared = filtered.root_covariance, filtered.root_shared
    if filtered.root is None or filtered.measured_root is not None:
        return 0.0, 0.0
    if covariance is None or shared is None:
        return float("nan"), float("nan")
    axis = rectified.R_source_from_level[2]
    return path_error(filtered.root, covariance, axis, *shared, filtered.times, walks)


def _lengths(
    gait: Gait, filtered: PoseSequence, rectified: Rectified, belt_speed: float | None, belt_share: float
) -> tuple[Values, list[Row], float]:
    """Lengths and speed of the walks, what is said of the belt or why there are none, and the share of the belt's speed
    by which that is off. belt_share: this share where the speed is not told; NaN where unknown."""
    if rectified.camera == "moving" or (filtered.root is None and belt_speed is None):
        return {}, [Remark("lengths_reason", no_place(rectified))], 0.0
    level, seams = filtered.joints.astype(np.float64), breaks(filtered)
    ankles = {side: level[:, filtered.layout.index(f"{side}_ankle"), :2] for side in SIDES.values()}
    root = np.zeros((len(level), 2)) if filtered.root is None else filtered.root[:, :2]
    R_level_from_body = transpose(rectified.R_source_from_level) @ rectified.R_source_from_body
    ahead = np.nanmean(-R_level_from_body[:, :2, 0], axis=0)
    ahead = ahead / np.linalg.norm(ahead)
    path, belt = over_belt(root, ankles, filtered.times, gait, ahead, belt_speed, seams)
    values = length_values(gait, path, ankles, filtered.times, seams)
    if not len(_both(values, "step_length")):
        return {}, [Remark("lengths_reason", "the person's place is missing in every stride")], 0.0
    if not belt:
        return values, [], 0.0
    told = belt_speed is not None
    share = 0.0 if told else belt_share
    speed = with_error("belt_speed", "speed", belt, share * belt or float("nan"))
    how = Remark(
        "belt", "its speed was given" if told else "its speed is that at which the standing foot drifts back"
    )
    return values, [speed, how], share
