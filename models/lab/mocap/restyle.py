"""Walks that nobody walked: slow, hurried, shuffling and limping ones, made of captured walks.

Gait laboratories call a walk by its phases: both feet on the floor, or one. Here time runs faster or slower within each
phase, so that stance takes as much of a stride as is asked for, and what touches the floor at which moment is carried
along exactly. Feet keep to their own landings and leavings; the body may go with them or on as evenly as it did. Steps
shorten along the walk and feet lift less by a linear map of the floor, under which a foot that lies still lies still,
and thighs and shanks keep their lengths: knees bend as the captured ones did, as far as hips and ankles ask.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.canonical import R_world_from_body
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import rotate, transpose, unit
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.signals.filters import lowpass
from ...common.metrics import relative
from ...gait.contact import SIDES
from ...gait.events import Stance, walks
from ...gait.gait import LEAST_STEP, facing_deg, separation
from .contact import true_contact

_BESIDE_S = 0.4  # of the take before the first landing of a walk and after its last
_FLOOR_SHARE = 5.0  # percentile of an ankle's height that is its floor level
_SINKS = 0.03  # statures by which the pelvis may sink, where hips come too far from feet that stay; else steps shorten
_SHORTENS, _SHORTEST = 0.85, 0.3
_STRAIGHT = 0.9  # of the pelvis's way is between its ends: others are no walk along one line
_BISECTIONS = 40
_STANCE = (0.5, 0.8)  # what styles are drawn from: the mean stance as a share of a stride
_TEMPO, _SLOWER = (0.75, 1.4), 0.3
_UNEVEN = 0.3
_SHORTER, _LOWER = 0.7, 0.8  # at the longest stance
# Styles by name, for judging: each value is drawn evenly between two, others are as captured. Elderly stance is that of
# acted walks of old people, on which the project was judged from outside.
NAMED: dict[str, dict[str, tuple[float, float]]] = {
    "normal": {},
    "elderly": {"stance": (0.72, 0.77), "tempo": (1.0, 1.4), "even": (0, 1), "step": (0.5, 0.8), "lift": (0.4, 0.8)},
    "hurried": {"stance": (0.54, 0.59), "tempo": (0.75, 0.9), "even": (0, 1)},
    "limping": {"stance": (0.60, 0.70), "tempo": (1.0, 1.2), "even": (0, 1), "uneven": (0.15, 0.3)},
    "short-stepped": {"stance": (0.64, 0.72), "even": (0, 1), "step": (0.3, 0.5), "lift": (0.3, 0.6)},
}  # fmt: skip
_LEAST_DOUBLE = 0.04  # of the time: less double support is too little to be stretched

Spells = dict[str, np.ndarray]


@dataclass(frozen=True)
class Style:
    """How a walk is walked instead; the values by themselves change nothing.

    stance: share of a stride, mean of both sides, None as captured. tempo: what stride times are multiplied by. uneven:
    by what share the right foot bears the body alone for longer than captured, and the left one for less. even: 0 the
    body slows with the feet, 1 it goes on evenly from landing to landing. step: share of lengths along the walk, at
    most. lift: share of the ankles' heights over their floor.
    """

    stance: float | None = None
    tempo: float = 1.0
    uneven: float = 0.0
    even: float = 0.0
    step: float = 1.0
    lift: float = 1.0


def walked_pieces(clip: Clip) -> Iterator[tuple[Clip, Spells]]:
    """Each walk of a take with 0.4 s beside it, if it is straight and has double support that can be stretched, and
    when its feet are on the floor, as `true_contact` says it."""
    time_s = np.arange(len(clip)) / clip.fps
    spells = true_contact(clip.joints, time_s)
    feet = {side: [Stance(side, *map(float, spell)) for spell in spells[side]] for side in SIDES}
    joints = clip.joints.astype(np.float64)
    level = lowpass(relative(joints).reshape(len(joints), -1), time_s).reshape(joints.shape)
    R = R_world_from_body(level)
    found = walks(
        feet, separation(rotate(transpose(R), level), time_s), time_s, LEAST_STEP, facing_deg=facing_deg(R)
    )
    for i, walk in enumerate(found):
        rows = slice(
            *np.searchsorted(time_s, (walk[0].start_s - _BESIDE_S, walk[-1].stop_s + _BESIDE_S + 1e-9))
        )
        first, last = time_s[rows][[0, -1]]
        piece = {
            side: np.array(
                [
                    (a if a > first else np.nan, b if b < last else np.nan)
                    for a, b in spells[side]
                    if not b <= first and not a >= last
                ]
            ).reshape(-1, 2)
            - first
            for side in SIDES
        }
        part = replace(clip, name=f"{clip.name}_walk{i}", joints=clip.joints[rows])
        on = _phases(piece, last - first)
        if _is_straight(part) and on.double >= _LEAST_DOUBLE * (last - first):
            yield part, piece


def _is_straight(clip: Clip) -> bool:
    way = clip.joints[:, 0, :2].astype(np.float64)
    steps = np.diff(lowpass(way, np.arange(len(way)) / clip.fps), axis=0)
    return bool(np.linalg.norm(way[-1] - way[0]) >= _STRAIGHT * np.linalg.norm(steps, axis=-1).sum())


@dataclass(frozen=True, eq=False)
class _Phases:
    """knots: (K,) seconds, both ends and every event between. on: (K - 1, 2) bool, right and left on the floor."""

    knots: np.ndarray
    on: np.ndarray

    @property
    def lasts(self) -> np.ndarray:
        return np.diff(self.knots)

    @property
    def double(self) -> float:
        return float(self.lasts[self.on.all(axis=1)].sum())

    @property
    def single(self) -> float:
        return float(self.lasts[self.on[:, 0] != self.on[:, 1]].sum())


def _phases(spells: Spells, stop_s: float) -> _Phases:
    events = np.concatenate([spells[side].ravel() for side in SIDES])
    knots = np.unique([0.0, stop_s, *events[np.isfinite(events)]])
    return _Phases(
        knots, np.stack([on_floor(spells[side], (knots[:-1] + knots[1:]) / 2) for side in SIDES], axis=-1)
    )


def on_floor(spells: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T,) bool: within any of the spells (N, 2) in seconds, whose NaN are the ends of the take."""
    start, stop = np.where(np.isnan(spells), (-np.inf, np.inf), spells).T
    return ((time_s[:, None] >= start) & (time_s[:, None] <= stop)).any(axis=1)


def restyled(clip: Clip, spells: Spells, style: Style) -> tuple[Clip, Spells]:
    """A walk in another style, and when its feet are on the floor. clip, spells: of `walked_pieces`."""
    old_s = np.arange(len(clip)) / clip.fps
    phases = _phases(spells, old_s[-1])
    knots = np.concatenate([[0.0], np.cumsum(phases.lasts * _factors(phases, style))])
    time_s = np.arange(int(knots[-1] * clip.fps + 1e-6) + 1) / clip.fps
    new = {side: np.interp(spells[side], phases.knots, knots) for side in SIDES}

    joints = CubicSpline(old_s, clip.joints.astype(np.float64))
    lands = np.unique([0.0, old_s[-1], *(t for side in SIDES for t in spells[side][:, 0] if np.isfinite(t))])
    evenly = np.interp(knots, np.interp(lands, phases.knots, knots), lands)
    whole = joints(PchipInterpolator(knots, style.even * evenly + (1 - style.even) * phases.knots)(time_s))
    feet = {}
    for side in SIDES:
        own = np.unique([0.0, old_s[-1], *spells[side][np.isfinite(spells[side])]])
        feet[side] = joints(PchipInterpolator(np.interp(own, phases.knots, knots), own)(time_s))
    made = _stepped(clip.joints.astype(np.float64), whole, feet, style)
    return replace(clip, joints=made.astype(np.float32)), new


def _factors(phases: _Phases, style: Style) -> np.ndarray:
    """(K - 1,) what each phase's time is multiplied by."""
    whole = phases.lasts.sum()
    factors = np.ones(len(phases.lasts))
    both, (right, left) = phases.on.all(axis=1), (phases.on & ~phases.on[:, ::-1]).T
    if style.stance is not None:
        bears = phases.single / (2 * (whole - phases.double))  # of a stride, outside double support
        double = (style.stance - bears) / (1 - bears)
        factors = np.where(
            both, double * whole / phases.double, (1 - double) * whole / (whole - phases.double)
        )
    leans = np.where(right, 1 + style.uneven, np.where(left, 1 - style.uneven, 1.0))
    alone = right | left
    kept = (factors * phases.lasts)[alone].sum() / max((leans * factors * phases.lasts)[alone].sum(), 1e-9)
    return style.tempo * factors * np.where(alone, leans * kept, 1.0)


def _stepped(
    captured: np.ndarray, whole: np.ndarray, feet: dict[str, np.ndarray], style: Style
) -> np.ndarray:
    """(T, 17, 3) of the body `whole` whose legs end where the ankles of `feet` are, with shorter steps and lower feet.
    captured: (S, 17, 3) the walk that all of it is of."""
    root = H36M17.index("pelvis")
    pelvis = captured[:, root, :2]
    ahead = np.array([*unit(pelvis[-1] - pelvis[0]), 0.0])
    stature = implied_stature(captured)
    step = style.step
    while True:
        way = whole[:, root]
        made = whole + (_shortened(way, ahead, step) - way)[:, None]
        ankles = {}
        for side in SIDES:
            at = H36M17.index(f"{side}_ankle")
            floor = np.percentile(captured[:, at, 2], _FLOOR_SHARE)
            ankles[side] = _shortened(feet[side][:, at], ahead, step)
            ankles[side][:, 2] = floor + style.lift * (ankles[side][:, 2] - floor)
        rises = _rise(captured, made, ankles, stature)
        if rises >= -_SINKS * stature or step < _SHORTEST:
            break
        step *= _SHORTENS
    made[..., 2] += rises
    for side in SIDES:
        hip, knee, ankle = (H36M17.index(f"{side}_{part}") for part in ("hip", "knee", "ankle"))
        made[:, knee] = _knee(made[:, hip], ankles[side], *(feet[side][:, i] for i in (hip, knee, ankle)))
        made[:, ankle] = ankles[side]
    return made


def _shortened(path: np.ndarray, ahead: np.ndarray, step: float) -> np.ndarray:
    """path (T, 3) with `step` times as far along the unit direction ahead (3,)."""
    return path + (step - 1) * (path * ahead).sum(axis=-1, keepdims=True) * ahead


def _rise(captured: np.ndarray, made: np.ndarray, ankles: dict[str, np.ndarray], stature: float) -> float:
    """By how much the pelvis is raised so that no leg is straighter than the straightest was."""

    def straightest(joints: np.ndarray, feet: dict[str, np.ndarray], up: float) -> float:
        hips = (joints[:, H36M17.index(f"{side}_hip")] + (0, 0, up) for side in SIDES)
        return max(
            float(np.linalg.norm(hip - feet[side], axis=-1).max())
            for side, hip in zip(SIDES, hips, strict=True)
        )

    was = straightest(captured, {side: captured[:, H36M17.index(f"{side}_ankle")] for side in SIDES}, 0.0)
    low, high = -0.2 * stature, 0.1 * stature
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if straightest(made, ankles, middle) < was else (low, middle)
    return low


def _knee(
    hip: np.ndarray, ankle: np.ndarray, old_hip: np.ndarray, old_knee: np.ndarray, old_ankle: np.ndarray
) -> np.ndarray:
    """(T, 3) the knee between a hip and an ankle with the bones' old lengths, bent to where it was."""
    thigh = np.linalg.norm(old_knee - old_hip, axis=-1)
    shank = np.linalg.norm(old_ankle - old_knee, axis=-1)
    leg = ankle - hip
    long = np.minimum(np.linalg.norm(leg, axis=-1), thigh + shank)
    axis = unit(leg)
    aside = (old_knee - old_hip) - ((old_knee - old_hip) * axis).sum(axis=-1, keepdims=True) * axis
    along = (thigh**2 - shank**2 + long**2) / (2 * long)
    bent = np.sqrt(np.maximum(thigh**2 - along**2, 0.0))
    return hip + along[:, None] * axis + bent[:, None] * unit(aside)


def restyled_walks(
    clips: Iterable[Clip], each: int, seed: int, style: str = "drawn"
) -> Iterator[tuple[Clip, Spells]]:
    """Each straight walk of the clips in so many styles, drawn by the seed and the clip's name only, with what is on
    the floor. style: one of NAMED, or "drawn", any."""
    draw = draw_style if style == "drawn" else partial(draw_named, NAMED[style])
    for clip in clips:
        for part, spells in walked_pieces(clip):
            rng = np.random.default_rng([seed, zlib.crc32(part.name.encode())])
            for i in range(each):
                made, kept = restyled(part, spells, draw(rng))
                yield replace(made, name=f"{part.name}_style{i}"), kept


def draw_style(rng: np.random.Generator) -> Style:
    """Stance of 50 to 80 % of a stride; the longer, the slower, the shorter and the lower may the steps be. Half
    limp."""
    stance = rng.uniform(*_STANCE)
    long = (stance - _STANCE[0]) / (_STANCE[1] - _STANCE[0])
    return Style(
        stance=stance,
        tempo=float(np.exp(rng.uniform(*np.log(_TEMPO)) + _SLOWER * (long - 0.5))),
        uneven=rng.choice((0.0, rng.uniform(-_UNEVEN, _UNEVEN))),
        even=rng.uniform(0, 1),
        step=rng.uniform(1 - _SHORTER * long, 1),
        lift=rng.uniform(1 - _LOWER * long, 1),
    )


def draw_named(between: Mapping[str, tuple[float, float]], rng: np.random.Generator) -> Style:
    """A style of NAMED."""
    return Style(**{name: rng.uniform(*ends) for name, ends in between.items()})
