"""Contacts, steps and gait figures where the truth is known:  pcnet3d evaluate --gait -o DIR

Lifted takes of people nobody was trained on, one gravity per take, in metres by the true scale, against the contacts of
the motion capture (models/gait/truth.py) and the same figures by them. The pelvis path is the true one, and the true
one with an error of 3 % of its depth, as one camera sees it.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.layouts import H36M17
from ...pipeline.motion.signals import lowpass
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.rotations import rotate, transpose
from ...pipeline.running.progress import each
from ..common.metrics import SD_90, Figure, relative
from ..common.spread import stated_spread
from ..gait.contact import SIDES, contacts, leg_length
from ..gait.errors import OF_LENGTH, mean_error
from ..gait.events import ON_FLOOR, Stance, stances
from ..gait.gait import Gait, Values, facing_deg, find_gait, length_values, time_values
from ..gait.truth import true_contact
from ..gravity import Seen, level_static, why_not
from .sets import EvaluationSet, evaluation_sets, heading
from .take_answers import joints_of
from .testbed import LiftedTake

ROOT_SHARES = (0.0, 0.03)  # of the depth: standard deviation of the pelvis path along the ray
_ROOT_S = 0.25  # how long an error of the path lasts: standard deviation of the Gaussian that smooths it
_SAME_S = 0.25  # an event that is found farther off is another one
_FIGURES = (
    "step_time_s", "stride_time_s", "stance_time_s", "swing_time_s", "stance_percent", "swing_percent",
    "single_support_percent", "double_support_percent", "flight_time_s", *OF_LENGTH,
)  # fmt: skip


@dataclass(frozen=True)
class Mean:
    """A take's mean of one figure, found and true, of `count` values that were found; lengths in metres. gait: what was
    found, "walking" or "running". leg: length of a leg in metres. root_sd: of the pelvis path, metres."""

    found: float
    true: float
    count: int
    gait: str
    leg: float
    root_sd: float

    def sd(self, name: str) -> float:
        """The stated standard deviation, in the figure's unit."""
        if name not in OF_LENGTH:
            return mean_error(self.gait, name, self.count)
        return self.leg * mean_error(self.gait, name, self.count, self.root_sd / self.leg)


@dataclass(frozen=True, eq=False)
class JudgedGait:
    """One take. kind: "walking", "running" or "none", by its true contacts. steps: (found, true). frames: (N, 2) bool,
    on the floor as found and in truth. events: {"initial contact", "toe-off": (errors in s (K,), found, true)}. means:
    {root share: {figure: Mean}} of the steps and strides that both have."""

    kind: str
    steps: tuple[int, int]
    frames: np.ndarray
    events: dict[str, tuple[np.ndarray, int, int]]
    means: dict[float, dict[str, Mean]] = field(default_factory=dict)


def gait_tables(
    rectifier: Rectifier,
    lifter: str | Path = "pcnet3d",
    seed: int = 0,
    flip: bool = False,
    sets: Sequence[EvaluationSet] | None = None,
) -> dict[str, Any]:
    """Everything the report says: {"sets": {set: {kind: one_kind's}}}."""
    sets = sets or evaluation_sets()
    results: dict[str, Any] = {**heading(lifter, seed, flip, sets), "rectifier": rectifier.method, "sets": {}}
    for one in sets:
        found = judged_takes(rectifier, one.label, one.takes(seed, lifter, flip), len(one.clips()), seed)
        kinds = {kind: [take for take in found if take.kind == kind] for kind in ("walking", "running")}
        results["sets"][one.label] = {
            **{kind: one_kind(takes) for kind, takes in kinds.items() if takes},
            "false steps": sum(take.steps[0] for take in found if take.kind == "none"),
        }
    return results


def judged_takes(
    rectifier: Rectifier, label: str, takes: Iterable[LiftedTake], total: int, seed: int
) -> list[JudgedGait]:
    """Of all takes that can be levelled and have no gap."""
    found = (judge(rectifier, take, seed) for take in each(takes, f"{label} takes", total))
    return [one for one in found if one is not None]


def judge(rectifier: Rectifier, take: LiftedTake, seed: int) -> JudgedGait | None:
    """A take beside its truth; None where it cannot be levelled or joints are missing. seed: of the path's errors."""
    seen, time_s = take.seen, take.seen.keypoints.times
    joints = joints_of(take.lifted, seen.truth)
    if not np.isfinite(joints).all():
        return None
    level = level_static(Seen(joints, *rectifier.rotation(joints), time_s, spread=stated_spread(take.lifted)))
    if why_not(level, joints):
        return None
    smooth = _smooth(joints, time_s)
    body = rotate(transpose(level.R_camera_from_body), smooth)
    facing = facing_deg(level.R_camera_from_level.T @ level.R_camera_from_body)
    probability = contacts(body, time_s)
    found = find_gait(body, time_s, feet=stances(probability, time_s), facing_deg=facing)

    world = rotate(seen.R_camera_from_world.T, seen.joints_camera)
    spells = true_contact(world, time_s)
    feet = {side: [Stance(side, *map(float, spell)) for spell in spells[side]] for side in SIDES}
    true_smooth = _smooth(seen.truth, time_s)
    R_world_from_body = seen.R_camera_from_world.T @ seen.R_camera_from_body
    true = find_gait(
        rotate(transpose(seen.R_camera_from_body), true_smooth),
        time_s,
        feet=feet,
        facing_deg=facing_deg(R_world_from_body),
    )
    frames = [
        np.stack([probability[side] > ON_FLOOR, _inside(feet[side], time_s)], axis=-1) for side in SIDES
    ]
    events = {
        "initial contact": _events(found, true, "start_s"),
        "toe-off": _events(found, true, "stop_s"),
    }
    steps = (len(found.steps), len(true.steps))
    judged = JudgedGait(true.kind, steps, np.concatenate(frames), events)
    same = _of_both(found, true)
    if same is None:
        return judged
    path = seen.joints_camera[:, H36M17.index("pelvis")]
    rng = np.random.default_rng([seed, zlib.crc32(seen.clip.encode()), 2])
    for share in ROOT_SHARES:
        root = rotate(level.R_camera_from_level.T, noisy_path(path, rng, share, seen.keypoints.fps)[None])[0]
        ankles = rotate(level.R_camera_from_level.T, smooth)
        values = {**time_values(same[0]), **_lengths(same[0], root, ankles, time_s)}
        truth = rotate(seen.R_camera_from_world.T, true_smooth)
        true_values = {**time_values(same[1]), **_lengths(same[1], world[:, 0], truth, time_s)}
        sd = share * float(np.median(np.linalg.norm(path, axis=-1)))
        judged.means[share] = _means(values, true_values, same[0].kind, leg_length(smooth), sd)
    return judged


def noisy_path(path: np.ndarray, rng: np.random.Generator, share: float, fps: float) -> np.ndarray:
    """(T, 3) a path from the camera (T, 3) with an error along the ray, of a standard deviation of that share of the
    distance, which changes within about a second as that of a smoothed path does."""
    from scipy.ndimage import gaussian_filter1d

    width = _ROOT_S * fps
    margin = int(4 * width) + 1
    noise = gaussian_filter1d(rng.standard_normal(len(path) + 2 * margin), width)[margin:-margin]
    noise *= np.sqrt(2 * np.sqrt(np.pi) * width)  # standard deviation 1
    return path * (1 + share * noise[:, None])


def _smooth(joints: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return lowpass(joints.reshape(len(joints), -1), time_s).reshape(joints.shape)


def _lengths(gait: Gait, root: np.ndarray, level: np.ndarray, time_s: np.ndarray) -> Values:
    level = relative(level)
    ankles = {side: level[:, H36M17.index(f"{side}_ankle"), :2] for side in SIDES}
    return length_values(gait, root[:, :2], ankles, time_s)


def _inside(feet: Sequence[Stance], time_s: np.ndarray) -> np.ndarray:
    inside = np.zeros(len(time_s), dtype=bool)
    for stance in feet:
        inside |= ~((time_s < stance.start_s) | (time_s > stance.stop_s))
    return inside


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

    def common(gait: Gait, other: Gait) -> list[list[Any]]:
        ends = [(step.side, step.stop_s) for step in other.steps]
        walks = []
        for walk in gait.walks:
            kept: list[Any] = []
            for step in walk:
                if any(side == step.side and abs(stop - step.stop_s) < _SAME_S for side, stop in ends):
                    kept.append(step)
                elif len(kept) < 3:
                    kept = []
                else:
                    break
            if len(kept) >= 3:
                walks.append(kept)
        return walks

    pair = Gait(found.feet, common(found, true)), Gait(true.feet, common(true, found))
    return pair if pair[0].walks and len(pair[0].steps) == len(pair[1].steps) else None


def _both(values: Values, name: str) -> np.ndarray:
    return np.concatenate([values[name][side] for side in SIDES])


def _means(found: Values, true: Values, gait: str, leg: float, root_sd: float) -> dict[str, Mean]:
    result = {}
    for name in _FIGURES:
        a, b = (values[np.isfinite(values)] for values in (_both(found, name), _both(true, name)))
        if len(a) and len(b):
            result[name] = Mean(float(a.mean()), float(b.mean()), len(a), gait, leg, root_sd)
    return result


def one_kind(takes: Sequence[JudgedGait]) -> dict[str, Any]:
    """Of takes of one kind: steps, contact frames, events and figures."""
    frames = np.concatenate([take.frames for take in takes])
    both = (frames[:, 0] & frames[:, 1]).sum()
    result: dict[str, Any] = {
        "takes": len(takes),
        "steps": [sum(take.steps[i] for take in takes) for i in (0, 1)],
        "contact": {
            "precision": float(both / frames[:, 0].sum()),
            "recall": float(both / frames[:, 1].sum()),
        },
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
    for share in ROOT_SHARES:
        for name in _FIGURES:
            means = [take.means[share][name] for take in takes if name in take.means.get(share, {})]
            if means and (share == ROOT_SHARES[0] or name in OF_LENGTH):
                label = f"{name}, path with {100 * share:g} % of depth" if name in OF_LENGTH else name
                result["figures"][label] = _figure(name, means)
    return result


def _figure(name: str, means: Sequence[Mean]) -> dict[str, Any]:
    error = np.array([mean.found - mean.true for mean in means])
    true = np.array([mean.true for mean in means])
    inside = np.array([abs(mean.found - mean.true) <= SD_90 * mean.sd(name) for mean in means])
    return {
        "takes": len(means),
        "true": float(np.median(true)),
        "bias": float(np.median(error)),
        "error": Figure.of(np.abs(error)),
        "error_percent": Figure.of(100 * np.abs(error / true)),
        "inside": float(inside.mean()),
    }


def as_markdown(results: dict[str, Any]) -> str:
    """The report as a page of tables."""
    lines = [
        "# Gait",
        "",
        f"pcnet3d {results['pcnet3d']}, lifter {results['lifter']}, rectifier {results['rectifier']}, seed "
        f"{results['seed']}, flip {'on' if results['flip'] else 'off'}; one camera a take, {results['bed']} views. "
        "Errors are p50 / mean / p95 of their size: events over events, figures over takes (of a take's mean, of the "
        "steps that both have). Inside: share of takes whose true mean lies within 1.645 stated standard deviations.",
    ]
    for label, kinds in results["sets"].items():
        for kind, table in kinds.items():
            if not isinstance(table, dict):
                continue
            found, true = table["steps"]
            contact = table["contact"]
            lines += [
                "",
                f"## {label}, {kind}",
                "",
                f"{table['takes']} takes; {found} steps found, {true} true. Frames on the floor: precision "
                f"{contact['precision']:.3f}, recall {contact['recall']:.3f}.",
                "",
                "| event | precision | recall | bias, ms | error, ms |",
                "| --- | --- | --- | --- | --- |",
                *(
                    f"| {name} | {row['precision']:.2f} | {row['recall']:.2f} | {row['bias_ms']:.0f} | "
                    f"{row['error_ms']:.0f} |"
                    for name, row in table["events"].items()
                ),
                "",
                "| figure | takes | true | bias | error | error, % | inside, % |",
                "| --- | --- | --- | --- | --- | --- | --- |",
                *(
                    f"| {name} | {row['takes']} | {row['true']:.3f} | {row['bias']:.3f} | {row['error']:.3f} | "
                    f"{row['error_percent']:.1f} | {100 * row['inside']:.0f} |"
                    for name, row in table["figures"].items()
                ),
            ]
        lines += ["", f"Steps found in takes of {label} without a walk: {kinds['false steps']}."]
    return "\n".join(lines) + "\n"
