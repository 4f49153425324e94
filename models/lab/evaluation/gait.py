"""Contacts, steps and gait figures where the truth is known:  pcnet3d lab evaluate gait -o DIR

Lifted takes of people nobody was trained on, one gravity per take, in metres by the true scale, against the contacts of
the motion capture (models/lab/mocap/contact.py) and the same figures by them. Lengths and speed are judged with the
true pelvis path, and with the one that models/place finds from the keypoints: of a body of the right stature, with the
focal length known, and lifted anew, with the usual one assumed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.plugins.protocols import Rectifier
from ...common.metrics import SD_90, Figure, relative
from ...common.spread import stated_spread
from ...gait.contact import SIDES, leg_length
from ...gait.errors import (
    FEWEST_OF_A_SIDE,
    OF_LENGTH,
    OF_SIDES,
    depth_of_steps,
    path_error,
    scatter,
    shipped_errors,
    style_of,
)
from ...gait.events import Stance, Step
from ...gait.gait import Gait, Values, facing_deg, find_gait, length_values, time_values
from ...gravity import Seen, level_static, why_not
from ...place.path import SCALE_SD, pelvis_path
from ..mocap.contact import true_contact
from .runs import Question
from .testbed import LiftedTake, SeenTake, filtered, joints_of

FIGURES = (
    "step_time_s", "stride_time_s", "stance_time_s", "swing_time_s", "stance_percent", "swing_percent",
    "single_support_percent", "double_support_percent", "flight_time_s", *OF_LENGTH,
)  # fmt: skip


SIDES_APART = ", right less left"  # behind the name of a figure


@dataclass(frozen=True)
class Judged:
    """A take's mean of one figure, found and true, or that of the right side's steps less the left's; lengths in
    metres. size: what an error is a share of: the true mean, of both sides. counts: values that were found, of right
    and left apart for a difference. gait: what was found, "walking" or "running". leg: length of a leg in metres.

    Of a mean: scatter, the standard deviation of these values; style, gait.errors.style_of what was found; root_sd and
    share, stated of the pelvis path, in metres, and of all strides alike (gait.errors.path_error). Of a difference:
    depth, gait.errors.depth_of_steps."""

    found: float
    true: float
    size: float
    counts: tuple[int, ...]
    gait: str
    leg: float
    scatter: float = np.nan
    style: Mapping[str, float] = field(default_factory=dict)
    root_sd: float = 0.0
    share: float = 0.0
    depth: float = np.nan

    def sd(self, name: str) -> float:
        """The stated standard deviation, in the figure's unit."""
        errors = shipped_errors()
        count, *of_other_side = self.counts
        if of_other_side:
            own = errors.difference(self.gait, name, count, of_other_side[0], self.depth)
        else:
            own = errors.mean(self.gait, name, count, self.root_sd / self.leg, self.style, self.scatter)
        return float(np.hypot(self.leg * own, self.share * self.found)) if name in OF_LENGTH else own


def figures_of(
    found: Values, true: Values, gait: str, leg: float, depth: float, *path_errors: float
) -> dict[str, Judged]:
    """{figure: Judged} of those of FIGURES that were found and are true; and of those that both sides have enough
    values of, the difference of the sides. path_errors: Judged.root_sd and share."""
    result, style = {}, style_of(found)
    for name in FIGURES:
        sides = [of[name][side][np.isfinite(of[name][side])] for of in (found, true) for side in SIDES]
        a, b = np.concatenate(sides[:2]), np.concatenate(sides[2:])
        if len(a) and len(b):
            mean, of = float(b.mean()), (len(a),)
            result[name] = Judged(float(a.mean()), mean, mean, of, gait, leg, scatter(a), style, *path_errors)
        if name in OF_SIDES and min(map(len, sides)) >= FEWEST_OF_A_SIDE:
            right, left, true_right, true_left = (float(values.mean()) for values in sides)
            size, of = (true_right + true_left) / 2, (len(sides[0]), len(sides[1]))
            off = right - left, true_right - true_left
            result[name + SIDES_APART] = Judged(*off, size, of, gait, leg, depth=depth)
    return result


def figure_of(name: str, means: Sequence[Judged]) -> dict[str, Any]:
    """Of many takes: how many, the median truth and error, the size of errors and the share within the stated ones."""
    size = np.array([mean.size for mean in means])
    error = np.array([mean.found - mean.true for mean in means])
    sd = np.array([mean.sd(name) for mean in means])
    return {
        "takes": len(means),
        "true": float(np.median([mean.true for mean in means])),
        "bias": float(np.median(error)),
        "error": Figure.of(np.abs(error)),
        "error_percent": Figure.of(100 * np.abs(error / size)),
        "inside": float((np.abs(error) <= SD_90 * sd).mean()),
    }


TRUE, KNOWN, ASSUMED = "true path", "focal known", "focal assumed"
PATHS = (TRUE, KNOWN, ASSUMED)
_UNEVEN = 2.5  # captured validation walks and runs come to 2.4, one of skips to 2.7, a man who hops to 3.4
_SAME_S = 0.25  # an event that is found farther off is another one
ABOUT = (
    "One camera a take. Errors are p50 / mean / p95 of their size: events over events, figures over takes (of a "
    "take's mean, of the steps that both have). steps: found, true. inside: takes whose true mean lies within 1.645 "
    "stated standard deviations. false steps: found in takes without a walk."
)


@dataclass(frozen=True, eq=False)
class JudgedGait:
    """One take of a person. kind: "walking", "running" or "none", by its true contacts. steps: (found, true). events:
    {"initial contact", "toe-off": (errors in s (K,), found, true)}. figures: {path: {figure: Judged}} of the steps and
    strides that both have."""

    person: str
    kind: str
    steps: tuple[int, int]
    events: dict[str, tuple[np.ndarray, int, int]]
    figures: dict[str, dict[str, Judged]] = field(default_factory=dict)


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says: {"sets": {set: {kind: one_kind's, "false steps": their number}}}."""
    (rectifier,) = question.rectifiers
    results: dict[str, Any] = {**question.heading(), "rectifier": rectifier.method, "sets": {}}
    for one in question.sets:
        both = (judge_both(question, take) for take in question.takes(one, focal_known=True))
        found = [judged for judged in both if judged is not None]
        kinds = {kind: [take for take in found if take.kind == kind] for kind in ("walking", "running")}
        results["sets"][one.label] = {
            **{kind: one_kind(takes) for kind, takes in kinds.items() if takes},
            "false steps": sum(take.steps[0] for take in found if take.kind == "none"),
        }
    return results


def judge_both(question: Question, take: LiftedTake) -> JudgedGait | None:
    """As judge, by the first rectifier, of a take whose lift knew the focal length, with the means of a lift with the
    assumed one beside."""
    (rectifier,) = question.rectifiers
    known = judge(rectifier, take, KNOWN)
    if known is None or not known.figures:
        return known
    again = question.lift_seen(take.seen, _camera_of(take.seen, ASSUMED).focal_px)
    guessed = judge(rectifier, LiftedTake(again, take.seen), ASSUMED)
    if guessed is None:
        return known
    return replace(known, figures={**guessed.figures, **known.figures})


def judge(rectifier: Rectifier, take: LiftedTake, path: str | None = KNOWN) -> JudgedGait | None:
    """A take beside its truth; None where it cannot be levelled or joints are missing. path: what is known of the focal
    length, KNOWN or ASSUMED; None places nobody."""
    seen, time_s = take.seen, take.seen.keypoints.times
    joints = joints_of(take.lifted, seen.truth)
    if not np.isfinite(joints).all():
        return None
    level = level_static(Seen(joints, *rectifier.rotation(joints), time_s, spread=stated_spread(take.lifted)))
    if why_not(level):
        return None
    smooth = filtered(joints, time_s)
    body = rotate(transpose(level.R_camera_from_body), smooth)
    facing = facing_deg(level.R_camera_from_level.T @ level.R_camera_from_body)
    found = find_gait(body, time_s, facing_deg=facing)

    true_smooth, true = filtered(seen.truth, time_s), true_gait(seen)
    events = {"initial contact": _events(found, true, "start_s"), "toe-off": _events(found, true, "stop_s")}
    steps = (len(found.steps), len(true.steps))
    judged = JudgedGait(seen.subject, true.kind, steps, events)
    same = _of_both(found, true)
    if same is None:
        return judged
    R_level_from_camera = level.R_camera_from_level.T
    true_places = rotate(seen.R_camera_from_world.T, true_smooth)
    true_values = step_values(same[1], seen.world[:, H36M17.index("pelvis")], true_places, time_s)

    depth = depth_of_steps(level.R_camera_from_body, time_s, same[0].walks)

    def keep(path: str, root: np.ndarray, places: np.ndarray, *errors: float) -> None:
        values = step_values(same[0], root, places, time_s)
        about = values, true_values, same[0].kind, leg_length(places), depth
        judged.figures[path] = figures_of(*about, *errors)

    true_root = rotate(R_level_from_camera, seen.joints_camera[:, H36M17.index("pelvis")][None])[0]
    keep(TRUE, true_root, rotate(R_level_from_camera, smooth))

    if path is None:
        return judged
    # In metres as `--stature` would bring them there.
    factor = implied_stature(seen.truth) / implied_stature(take.lifted.joints)
    sized = take.lifted.moved(factor * np.eye(3))
    placed = pelvis_path(sized, seen.keypoints, _camera_of(seen, path))
    if placed is None:
        return judged
    root = rotate(R_level_from_camera, placed.root[None])[0]
    places = rotate(R_level_from_camera, smooth * (implied_stature(sized.joints) / implied_stature(joints)))
    covariance = R_level_from_camera @ placed.covariance @ R_level_from_camera.T
    errors = path_error(
        root, covariance, R_level_from_camera[:, 2], SCALE_SD, placed.focal_sd, time_s, same[0].walks
    )
    keep(path, root, places, *errors)
    return judged


def true_gait(seen: SeenTake) -> Gait:
    """By the captured joints, before a static camera. Skips and hops are no walk: the longest step of a walk takes at
    most _UNEVEN times as long as its shortest."""
    time_s, R_world_from_camera = seen.keypoints.times, seen.R_camera_from_world.T
    spells = true_contact(seen.world, time_s)
    feet = {side: [Stance(side, *map(float, spell)) for spell in spells[side]] for side in SIDES}
    body = rotate(transpose(seen.R_camera_from_body), filtered(seen.truth, time_s))
    facing = facing_deg(R_world_from_camera @ seen.R_camera_from_body)
    gait = find_gait(body, time_s, feet=feet, facing_deg=facing)
    return Gait(gait.feet, [walk for walk in gait.walks if _even(walk)])


def _even(walk: Sequence[Step]) -> bool:
    times = [step.stop_s - step.start_s for step in walk]
    return max(times) <= _UNEVEN * min(times)


def step_values(gait: Gait, root: np.ndarray, level: np.ndarray, time_s: np.ndarray) -> Values:
    """Times and lengths of a gait's steps: root (T, 3) the pelvis's place, level (T, 17, 3) joints, z up."""
    level = relative(level)
    ankles = {side: level[:, H36M17.index(f"{side}_ankle"), :2] for side in SIDES}
    return {**time_values(gait), **length_values(gait, root[:, :2], ankles, time_s)}


def _events(found: Gait, true: Gait, what: str) -> tuple[np.ndarray, int, int]:
    """Errors of the events that have one of the same foot within a quarter of a second, and how many there are: of the
    whole take, walks or not."""
    errors, counts = [], [0, 0]
    for side in SIDES:
        a, b = (
            np.array([time for stance in gait.feet[side] if np.isfinite(time := getattr(stance, what))])
            for gait in (found, true)
        )
        counts = [counts[0] + len(a), counts[1] + len(b)]
        if len(a) and len(b):
            off = a[:, None] - b
            pairs = [(i, int(np.abs(off[i]).argmin())) for i in range(len(a))]
            errors += [
                off[i, k] for i, k in pairs if np.abs(off[:, k]).argmin() == i and abs(off[i, k]) < _SAME_S
            ]
    return np.array(errors), counts[0], counts[1]


def _of_both(found: Gait, true: Gait) -> tuple[Gait, Gait] | None:
    """Both with the walks' steps that the other has too, so that means are over the same part of the take; None where
    they share no walk."""

    fewest = 2 if true.kind == "running" else 3

    def common(gait: Gait, other: Gait) -> list[list[Any]]:
        ends = [(step.side, step.stop_s) for step in other.steps]
        walks = []
        for walk in gait.walks:
            kept: list[Any] = []
            for step in walk:
                if any(side == step.side and abs(stop - step.stop_s) < _SAME_S for side, stop in ends):
                    kept.append(step)
                elif len(kept) < fewest:
                    kept = []
                else:
                    break
            if len(kept) >= fewest:
                walks.append(kept)
        return walks

    pair = Gait(found.feet, common(found, true)), Gait(true.feet, common(true, found))
    return pair if pair[0].walks and len(pair[0].steps) == len(pair[1].steps) else None


def one_kind(takes: Sequence[JudgedGait]) -> dict[str, Any]:
    """Of takes of one kind: steps, events and figures."""
    result: dict[str, Any] = {
        "takes": len(takes),
        "steps": [sum(take.steps[i] for take in takes) for i in (0, 1)],
        "events": {},
        "figures": {},
    }
    for event in takes[0].events:
        errors, found, true = zip(*(take.events[event] for take in takes), strict=True)
        error = np.concatenate(errors)
        result["events"][event] = {
            "precision": len(error) / max(sum(found), 1),
            "recall": len(error) / max(sum(true), 1),
            "bias_ms": float(1000 * np.median(error)),
            "error_ms": Figure.of(1000 * np.abs(error)),
        }
    for path in PATHS:
        for label in dict.fromkeys(label for take in takes for label in take.figures.get(path, {})):
            name = label.removesuffix(SIDES_APART)
            if path == TRUE or name in OF_LENGTH:
                of = [take.figures[path][label] for take in takes if label in take.figures.get(path, {})]
                key = f"{label}, {path}" if name in OF_LENGTH else label
                result["figures"][key] = figure_of(name, of)
    return result


def _camera_of(seen: SeenTake, case: str) -> Camera:
    """The take's camera as it is known: by its focal length, or, ASSUMED, by what is usual."""
    width, height = seen.image_size
    focal_px, spread = seen.focal_px, 0.0
    if case == ASSUMED:
        focal_px, spread = PRIOR_FOCAL * max(width, height), PRIOR_FOCAL_SPREAD
    return Camera((width, height), focal_px, focal_px * spread, "told")
