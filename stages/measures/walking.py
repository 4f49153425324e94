"""Walking and running: steps, times of the gait cycle, lengths and speed, each with its error, or why they are
withheld."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...models.angle_error.joint_noise import made_by_the_built_in
from ...models.common.motion import Motion
from ...models.gait.figures import (
    FEWEST_OF_A_SIDE,
    OF_LENGTH,
    GaitErrors,
    depth_of_steps,
    length_values,
    over_belt,
    path_error,
    scatter,
    shipped_errors,
    standing,
    times_too_far,
    walked_on,
)
from ...models.gait.gait import SIDES, Gait, Stride, Values, Walk, contact_times, finite, leg_length
from ...pipeline.core.camera import Camera
from ...pipeline.core.figures import FIGURES
from ...pipeline.core.measures import Measure, Remark, Row, withheld, within
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import known_median
from ...pipeline.signals.filters import resample
from .figures import (
    POINTS,
    deviation,
    mean_curve,
    moments,
    observable,
    spread,
    symmetry,
    unknown_deg,
    with_error,
)

_STRIDES = {"walking": 3, "running": 2}  # for a cadence; who runs is out of the image after a second
# Seconds of a lifted step: quicker ones without flights may be of a run whose flights were not seen. Of 64 captured
# walks (train and validation people) none has a mean below 0.45, of 94 runs 79 have one below 0.4.
_QUICK_S = 0.4
_BELT_SHARE = 0.12  # of a belt's speed by the feet's drift: what lifted stances are off (validation subjects)
_LEGS = tuple(f"{side}_{joint}" for side in "rl" for joint in ("hip", "knee", "ankle"))
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
# The names of the catalogue by those of models.gait, which end in a unit.
_NAMED = {figure.key: figure.name for figure in FIGURES.values() if figure.group == "walking"}


def walking(motion: Motion, gait: Gait, walks: Sequence[Walk], why_sides: str = "") -> list[Row]:
    """The group `walking`. walks: of the gait. why_sides: a code of WITHHELD where right and left are not compared."""
    if not motion.rectified.level_ok:
        return [observable(np.zeros(len(motion.times), dtype=bool))]
    judged = observable(motion.has(_LEGS))
    if not walks:
        return [judged]
    path, root_sd, share = motion.filtered.path, 0.0, 0.0
    if path is not None and motion.filtered.measured_root is None:  # it was estimated (stages/place.py)
        axis = motion.rectified.R_source_from_level[2]
        root_sd, share = path_error(path, axis, motion.times, gait.walks)
    lengths, over_floor, share = _lengths(motion, gait, share)
    means = _Means(motion, gait, gait.times | lengths, root_sd, share)
    enough = len(gait.strides) >= _STRIDES[gait.kind]
    of_both = "flight_time_s" if gait.kind == "running" else "double_support_percent"
    phases = (*_PHASES, *[of_both] * (not gait.mixed)) if means.errors or enough else ()
    quick = motion.source.lifted and gait.kind == "walking" and gait.style["step_time_s"] < _QUICK_S
    return [
        judged,
        Remark("gait", "walking or running" if quick or gait.mixed else gait.kind),
        *_counted(walks),
        *over_floor,
        *means.rows(_OF_BOTH),
        means.cadence() if enough else withheld("few-strides", "cadence"),
        *(means.rows((*_TIMES, *phases)) if phases else [withheld("error-unknown", "timing")]),
        *means.symmetries(why_sides),
        *_sides(motion, gait, means, phases),
        *_curves(motion, gait),
    ]


def _counted(walks: Sequence[Walk]) -> list[Row]:
    """How many walks and steps, those of them that only the knees tell, how long they took, and which of their ends
    was not visible."""
    steps = sum(len(walk.every) for walk in walks)
    by_knees = steps - sum(len(walk.steps) for walk in walks)
    cut = [any(walk.cut[end] for walk in walks) for end in (0, 1)]
    lasts_s = sum(walk.every[-1].stop_s - walk.every[0].start_s for walk in walks)
    return [
        Measure("walks", len(walks)),
        Measure("steps", steps, at_least=any(cut) or by_knees > 0),
        *([Measure("steps_by_knees", by_knees)] if by_knees else []),
        Measure("walked", lasts_s),
        *([Remark("not_visible", " and ".join(["start"] * cut[0] + ["end"] * cut[1]))] if any(cut) else []),
    ]


def _sides(motion: Motion, gait: Gait, means: _Means, phases: tuple[str, ...]) -> Iterator[Row]:
    for words, side in SIDES.items():
        strides = [stride for stride in gait.strides if stride.side == side]
        rows: list[Row] = [
            Measure("steps", sum(step.side == side for step in gait.steps)),
            Measure("strides", len(strides)),
            *means.rows(("step_time_s", "stance_time_s", *phases) if phases else (), side),
            *means.rows(("step_length",), side),
            *peaks(motion, strides),
            moments("stride_start", (stride.start_s for stride in strides)),
            moments("stride_stop", (stride.stop_s for stride in strides)),
            moments("landings", contact_times(gait.walks, side)),
            moments("toe_offs", (stride.off_s for stride in strides if np.isfinite(stride.off_s))),
        ]
        yield from within(words, rows, "right" if side == "r" else "left")


def _curves(motion: Motion, gait: Gait) -> list[Row]:
    curves: list[Row] = []
    for name in (f"{side}_{part}" for part in _IN_STRIDES for side in SIDES.values()):
        spans = np.array([(s.start_s, s.stop_s) for s in gait.strides if s.side == name[0]]).reshape(-1, 2)
        curves += mean_curve(motion, name, spans)
    return curves


def peaks(motion: Motion, strides: Sequence[Stride]) -> list[Row]:
    """Of the strides of one side, in order, what gait papers report, each stride with its stated error and then the
    mean, whose error holds what all strides have wrong alike. Degrees (Benedetti et al., Clin Biomech 13(3), 1998: K1,
    K2, K5, H3).

    knee_at_contact: knee flexion at initial contact. knee_loading_peak: its highest in the first half of stance.
    knee_swing_peak: its highest in swing. thigh_trunk_lowest: the thigh's lowest flexion against the trunk in the
    stride, in place of hip extension. A stride in which the angle is missing there has none.
    """
    result: list[Row] = []
    for name, (part, sign, span) in _PEAKS.items() if strides else ():
        angle, of_strides = f"{strides[0].side}_{part}", []
        spans = np.array([span(stride) for stride in strides])
        whole = np.flatnonzero(np.isfinite(spans).all(axis=1))
        begins, ends = spans[whole].T
        at_s = np.linspace(begins, ends, POINTS, axis=-1)
        values, errors = (
            resample(column, motion.times, at_s.ravel(), motion.seams).reshape(at_s.shape)
            for column in (motion.angle(angle), motion.sd(angle))
        )
        for row in np.flatnonzero(np.isfinite(values).all(axis=1)):
            at = int(np.argmax(sign * values[row]))
            of_strides.append((int(whole[row]), float(values[row, at]), float(errors[row, at])))
        by_stride = np.array(of_strides).reshape(-1, 3)
        all_known = bool(np.isfinite(by_stride[:, 2]).all())
        result += [
            Measure(name, value, error if all_known else None, number=number)
            for number, value, error in of_strides
        ]
        result += spread(
            name, by_stride[:, 1], shared=known_median(by_stride[:, 2]) if all_known else unknown_deg(motion)
        )
    return result


_PEAKS = {
    "knee_at_contact": ("knee_flexion", 1, lambda s: (s.start_s, s.start_s)),
    "knee_loading_peak": ("knee_flexion", 1, lambda s: (s.start_s, (s.start_s + s.off_s) / 2)),
    "knee_swing_peak": ("knee_flexion", 1, lambda s: (s.off_s, s.stop_s)),
    "thigh_trunk_lowest": ("thigh_trunk_flexion", -1, lambda s: (s.start_s, s.stop_s)),
}


def errors_of(source: PoseSequence, gait: str) -> GaitErrors:
    """Errors of gait figures from poses of the built-in lifter or of motion capture; none of other lifters, whose
    errors were not measured. gait: Gait.kind."""
    if source.made_by.kind == "measured":
        return shipped_errors(gait, "measured")
    return shipped_errors(gait, "lifted") if made_by_the_built_in(source) else GaitErrors()


def _over_floor(filtered: PoseSequence) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The pelvis (T, 2) in LEVEL, zeros where its path is not known, and the ankles (T, 2) by side relative to it."""
    level = filtered.joints.astype(np.float64)
    ankles = {side: level[:, filtered.layout.index(f"{side}_ankle"), :2] for side in SIDES.values()}
    return np.zeros((len(level), 2)) if filtered.root is None else filtered.root[:, :2], ankles


def focal_doubts(motion: Motion, gait: Gait, camera: Camera | None) -> list[Notice]:
    """That the feet that stand contradict a focal length that the user gives, by which a walk in depth is too long."""
    if camera is None or camera.focal_source != "told" or camera.focal_against_px is not None:
        return []
    if motion.moving_camera or not motion.rectified.level_ok or not made_by_the_built_in(motion.source):
        return []
    feet = standing(*_over_floor(motion.filtered), motion.times, walked_on(gait), motion.seams)
    fits = camera.focal_px / times_too_far(*feet, motion.rectified.R_source_from_level[2, :2])
    by, told = "the feet that stand", camera.focal_px
    return [notice("focal-contradicted", by=by, focal_px=told, fits=fits)] if fits < told else []


def doubts(motion: Motion, gait: Gait) -> list[Notice]:
    """That the errors of the figures are not known; or that stance or step time lies outside those that they were
    fitted on. Empty where both lie within, and without a walk."""
    if not gait.walks or not motion.rectified.level_ok:
        return []
    errors, made_by = errors_of(motion.source, gait.kind), motion.source.made_by
    if not errors:
        by = f" by {made_by.by}" if made_by.by else ""
        reason = f"these poses{by} were not compared with ground truth"
        return [notice("errors-unknown", what="the gait figures", reason=reason)]
    texts = {
        "stance_percent": "a stance of {:.0f} % of the stride",
        "step_time_s": "a step time of {:.2f} s, if the frame rate is right (--fps)",
    }
    beyond = " and ".join(texts[name].format(gait.style[name]) for name in errors.beyond(gait.style))
    return [notice("gait-unlike-any-seen", gait=gait.kind, figures=beyond)] if beyond else []


@dataclass(frozen=True, eq=False)
class _Means:
    """Means of gait figures with their errors. values: of models.gait, by their names there. root_sd: of the pelvis
    path, in the poses' unit, NaN where unknown. share: of lengths and speed, that is wrong in all alike."""

    motion: Motion
    gait: Gait
    values: Values
    root_sd: float
    share: float

    @cached_property
    def errors(self) -> GaitErrors:
        """Those of the poses' source."""
        return errors_of(self.motion.source, self.gait.kind)

    @cached_property
    def leg(self) -> float:
        """Length of a leg, in the poses' unit."""
        return leg_length(self.motion.body)

    @cached_property
    def depth(self) -> float:
        """Of steps, as `depth_of_steps`."""
        source = self.motion.source
        R_camera_from_body = source.frame.basis.T @ self.motion.rectified.R_source_from_body
        return (
            depth_of_steps(R_camera_from_body, self.motion.times, self.gait.walks) if source.lifted else 0.0
        )

    def rows(self, names: Sequence[str], side: str | None = None) -> Iterator[Row]:
        """`mean_<name>` (walking_speed by its own name), its error, and `deviation`, where that is larger than one
        value's error. side: of one side only."""
        for name in names:
            if not len(values := self._finite(name, side)):
                continue
            plain, mean = _NAMED[name], float(values.mean())
            figure = plain if name == "walking_speed" else f"mean_{plain}"
            share = self.share * mean if name in OF_LENGTH else 0.0
            row = with_error(figure, mean, float(np.hypot(self._error(name, side), share)))
            if name in OF_LENGTH and row.bar is not None and row.bar >= mean:
                yield withheld("error-too-large", figure)
                continue
            yield row
            if name != "walking_speed":
                yield from deviation(plain, values, self._single(name))

    def cadence(self) -> Row:
        """Steps a minute by the mean step time."""
        mean = float(self._finite("step_time_s").mean())
        return with_error("cadence", 60 / mean, 60 / mean**2 * self._error("step_time_s"))

    def symmetries(self, why: str) -> list[Row]:
        """Of the sides' step and stance times and step lengths, of two steps of each side or more. why: a code of
        WITHHELD where they are not compared."""
        result: list[Row] = []
        for name in ("step_time_s", "stance_time_s", "step_length"):
            sides = [self._finite(name, side) for side in SIDES.values()]
            if min(map(len, sides)) >= FEWEST_OF_A_SIDE:
                right, left = (float(values.mean()) for values in sides)
                result += symmetry(
                    right, left, self._difference_error(name, *sides), prefix=f"{_NAMED[name]}_"
                )
        return [withheld(why, row.name.removesuffix("_withheld")) for row in result] if why else result

    def _finite(self, name: str, side: str | None = None) -> np.ndarray:
        """The values of both sides, or of one, that are not NaN."""
        of_sides = self.values.get(name, {})
        return finite({each: values for each, values in of_sides.items() if side in (None, each)})

    def _in_unit(self, name: str, own: float) -> float:
        """An error that is stated in lengths of the leg, in the poses' unit."""
        return float(self.leg * own if name in OF_LENGTH else own)

    def _error(self, name: str, side: str | None = None) -> float:
        """Of the mean of both sides or of one; NaN where none is stated."""
        count, spread = len(self._finite(name, side)), scatter(self._finite(name))
        error = self.errors.mean(name, count, self.root_sd / self.leg, self.gait.style, spread)
        if side is not None:
            error = float(np.hypot(error, self.errors.side(name, self.depth)))
        return self._in_unit(name, error)

    def _difference_error(self, name: str, right: np.ndarray, left: np.ndarray) -> float:
        """Of the mean of the right side's values less that of the left's; NaN where none is stated."""
        if name in OF_LENGTH and np.isnan(self.root_sd):
            return float("nan")
        # Of each side about its own mean: what the sides differ by is no scatter.
        off = np.concatenate([side - side.mean() for side in (right, left)])
        spread = scatter(off) * float(np.sqrt((len(off) - 1) / (len(off) - 2))) if len(off) > 2 else np.nan
        error = self.errors.difference(name, len(right), len(left), self.depth, spread)
        return self._in_unit(name, error)

    def _single(self, name: str) -> float:
        """What a spread of values has to exceed to be the person's; NaN where that is not known."""
        error = self.errors.mean(name, 1)
        if self.errors and name in OF_LENGTH and not np.isfinite(error):
            return 0.0  # lengths of measured poses are of the person
        return self._in_unit(name, error)


def _lengths(motion: Motion, gait: Gait, of_path: float) -> tuple[Values, list[Row], float]:
    """Lengths and speed of the walks, what is said of the belt or why there are none, and the share by which they are
    all off alike. of_path: that share by the pelvis path."""
    if motion.moving_camera or motion.filtered.root is None:
        return {}, [withheld("camera-moves" if motion.moving_camera else "place-unknown", "lengths")], 0.0
    root, ankles = _over_floor(motion.filtered)
    path, belt = over_belt(root, ankles, motion.times, gait, motion.seams)
    values = length_values(gait, path, ankles, motion.times, motion.seams)
    if not any(np.isfinite(lengths).any() for lengths in values["step_length"].values()):
        return {}, [withheld("place-unknown", "lengths")], 0.0
    if not belt:
        return values, [], of_path
    share = _BELT_SHARE if made_by_the_built_in(motion.source) else float("nan")
    speed = with_error("belt_speed", belt, share * belt)
    return values, [speed], float(np.hypot(of_path, share))
