"""A take's walks and runs: how likely each foot is on the floor, stances, steps and strides out of that, which contacts
follow each other as steps of one walk, and the times of these.

A foot on the floor moves back under the body as evenly as the body moves ahead, low and straight. A small network
recognises that in a window of 1.6 s of both legs, in BODY axes and leg lengths. It uses no scale, no place in the room,
no heading and no frame rate, so it also works on a treadmill, with a moving camera, and for a lifter without a place.

contact.json was learned once, by the lab at commit b7136e6e, on 1,567,156 frames of feet of 24
people (CMU's and ACCAD's train subjects), lifted and as captured, their straight walks also in 6 drawn styles;
models/lab/evaluation/gait.py has the rule by which a foot was in contact.

Initial contact and toe-off bound the stance of a foot, and toe-off and the next initial contact its swing (Perry &
Burnfield, Gait Analysis, 2nd ed. 2010, chapter 1). A step is from the initial contact of one foot to that of the other,
a stride from one foot's to its next (Hollman, McDade & Petersen, Gait & Posture 34(1), 2011).

Steps go on before and behind a walk where they cannot be seen: those of somebody who comes towards the camera, or goes
away from it, are depth, and shrink in the image. The knees keep their rhythm.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cache, cached_property
from itertools import groupby, pairwise
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...pipeline.core.blocks import blocks
from ...pipeline.core.frames import Frame
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import known_median, norm, transpose
from ...pipeline.signals.filters import peaks, resample, runs
from ..common.motion import Motion

_CONTACT_FILE = Path(__file__).with_name("contact.json")
SIDES = {"right": "r", "left": "l"}
OTHER = {"r": "l", "l": "r"}
_AHEAD_S = (0.033, 0.067, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8)  # of the window, and as far back
_OFFSETS_S = np.array([-s for s in reversed(_AHEAD_S)] + [0.0, *_AHEAD_S])
# To either side: within a stride the length of a lifted leg varies, averaged over two it does not.
_UNIT_S = 1.5
_VALUES = 9  # of a moment: three joints
_MIRROR = np.array([1.0, -1.0, 1.0])  # BODY's y is right
ON_FLOOR = 0.6  # probability from which stances are as long as the true ones (validation subjects)
_SHORTEST_S = 0.1  # a contact or a swing; a sprinter's stance
_STEP_S = (0.2, 1.5)  # shorter or longer is no step of one walk
FEWEST = 3  # steps of a walk
FEWEST_FLYING = 2  # steps of a run: in standing, turning and sitting down nobody leaps from foot to foot
_TURNS_DEG = 30.0  # in one step
_NEAREST = 5  # landings that tell how the pelvis swings there; two that see a turn are outvoted
# Times farther apart sideways than in front: feet of a straddle or a jumping jack, not of a step.
_SIDEWAYS = 2.0
_RUN_STEP_S = 0.6  # a step of a run, at most: of the slowest jogs 0.45
# Seconds of double support, and of the strides, from which a run has walked steps too: 19 of 26 lifted takes of which
# most steps are walked, none of 84 runs (validation people).
_BOTH_S, _SOME = 0.03, 0.2
# Of the time of a walk each foot is on the floor, mean of those that contacts were learned from.
_USUAL_SHARE = 0.62
_ITERATIONS = 30
_BESIDE_S = 0.3  # of a walk before its first landing and after its last, walked alike
LEAST_STEP = 0.25  # lengths of a leg: by how much the ankles' separation changes from step to step at least
Values = dict[str, dict[str, np.ndarray]]  # {figure: {"r", "l": (N,) of that side's steps or strides}}
OF_STYLE = ("stance_percent", "step_time_s")  # by which a gait is like those that were seen or not
_USUAL = 0.12  # lengths of a leg: the separation's deviation by the built-in lifter, median of lifted validation takes
NOISE = 2.0 * float(np.sqrt(2))  # standard deviations of a frame's value: twice that of a difference of two
# Of the line of sight, within which a person faces the camera or turns the back to it: a step there shows at most
# sin 40 = 64 % of its length.
_SIGHT_DEG = 40.0
_OFF = 0.3  # of a step's time, by which a swing may come too early or too late
# Of the usual swing of a walk: by so much a knee bends at least, and at most, in one that goes on; less is a step to a
# stop. By so much it is bent more than the other one: who crouches bends both.
_SWINGS, _MORE = (0.65, 1.5), 0.3
_LEAST_DEG = 3.0  # of a peak: a lifted knee's noise from frame to frame


@cache
def _network() -> dict[str, np.ndarray]:
    """One hidden layer: `centre`, `scale` (F,) of the features; weights and biases `hidden` (F, H), `hidden_bias` (H,),
    `out` (H,), `out_bias` ()."""
    content = json.loads(_CONTACT_FILE.read_text(encoding="utf-8"))
    return {
        name: np.array(content[name])
        for name in ("centre", "scale", "hidden", "hidden_bias", "out", "out_bias")
    }


def contacts(body: np.ndarray, time_s: np.ndarray, seams: tuple[int, ...] = ()) -> dict[str, np.ndarray]:
    """{"r", "l": (T,) probability that this foot is on the floor}; NaN where a leg is missing.

    body: (T, 17, 3) H36M17 in BODY axes, relative to the pelvis, in any unit, through the usual 6 Hz low-pass; time_s:
    (T,). Nothing is taken across a gap or the row of a seam.
    """
    net = _network()
    result = {side: np.full(len(body), np.nan) for side in "rl"}
    for side in result:
        for rows, features in windows(body, time_s, side, seams):
            layer = np.tanh((features - net["centre"]) / net["scale"] @ net["hidden"] + net["hidden_bias"])
            result[side][rows] = 1 / (1 + np.exp(-(layer @ net["out"] + net["out_bias"])))
    return result


def windows(
    body: np.ndarray, time_s: np.ndarray, side: str, seams: tuple[int, ...] = ()
) -> Iterator[tuple[slice, np.ndarray]]:
    """(N, F) features of one foot in rows that have them, some minutes at a time, for they are 2 KB a frame: both
    ankles and its knee over the window in lengths of a leg, mirrored for the left foot; beyond the ends of an unbroken
    piece its last values are repeated. body, time_s, seams: as those of `contacts`."""
    names = (f"{side}_ankle", f"{OTHER[side]}_ankle", f"{side}_knee")
    mirror = 1 if side == "r" else _MIRROR
    legs = np.concatenate(
        [body[:, H36M17.index(name)].astype(np.float64) * mirror for name in names], axis=-1
    )
    legs /= leg_lengths(body, time_s, seams)[:, None]
    for piece in runs(np.asarray(np.isfinite(legs).all(axis=1)), time_s, seams):
        for part in blocks(piece.stop - piece.start):
            rows = slice(piece.start + part.start, piece.start + part.stop)
            at_s = time_s[rows, None] + _OFFSETS_S
            columns = [np.interp(at_s, time_s[piece], legs[piece, i]) for i in range(_VALUES)]
            yield rows, np.stack(columns, axis=-1).reshape(len(at_s), -1)


def leg_length(joints: np.ndarray) -> float:
    """The median length of thigh and shank together, mean of both legs, in the unit of joints (T, 17, 3); NaN where no
    frame has both legs."""
    return known_median(_legs(joints))


def leg_lengths(joints: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(T,) the same around each moment: the median of the frames within 1.5 s between the same seams, interpolated
    where none of them has both legs. The unit of some estimators grows as the person comes nearer. joints: as of
    `leg_length`; time_s: (T,). NaN between seams where no frame has both legs."""
    both = _legs(joints)
    result = np.full(len(both), np.nan)
    for start, stop in pairwise([0, *seams, len(both)]):
        rows = start + np.flatnonzero(np.isfinite(both[start:stop]))
        if not len(rows):
            continue
        visible_s, length = time_s[rows], both[rows]
        count = int(np.ceil(np.ptp(visible_s) / _UNIT_S))
        step_s = np.ptp(visible_s) / max(count, 1)
        # Only the points of an even grid that lie beside rows: a gap in the times may last for years.
        beside = np.unique(np.floor((visible_s - visible_s[0]) / max(step_s, 1e-9))[:, None] + [-1, 0, 1, 2])
        at_s = visible_s[0] + step_s * beside[(beside >= 0) & (beside <= count)]
        spans = np.searchsorted(visible_s, [at_s - _UNIT_S, at_s + _UNIT_S], side="right")
        filled = spans[0] < spans[1]
        medians = [np.median(length[slice(*span)]) for span in spans.T[filled]]
        result[start:stop] = np.interp(time_s[start:stop], at_s[filled], medians)
    return result


def _legs(joints: np.ndarray) -> np.ndarray:
    """(T,) the length of thigh and shank together, mean of both legs."""
    bones = [(f"{side}_{a}", f"{side}_{b}") for side in "rl" for a, b in pairwise(("hip", "knee", "ankle"))]
    lengths = [norm(joints[:, H36M17.index(b)] - joints[:, H36M17.index(a)]) for a, b in bones]
    return np.sum(lengths, axis=0) / 2


@dataclass(frozen=True)
class Stance:
    """One foot on the floor. side: "r" or "l". start_s: initial contact, stop_s: toe-off; NaN where a gap or an end of
    the take hides it."""

    side: str
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class Step:
    """From one foot's initial contact to the other's. side: the foot that lands at stop_s."""

    side: str
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class Stride:
    """From one foot's initial contact, start_s, to its next, stop_s. off_s: its toe-off between; other_off_s and
    other_start_s: the other foot's toe-off after start_s (before it in a run), and its initial contact. NaN where
    unseen."""

    side: str
    start_s: float
    stop_s: float
    off_s: float
    other_off_s: float
    other_start_s: float


def stances(
    probability: Mapping[str, np.ndarray], time_s: np.ndarray, seams: Sequence[int] = ()
) -> dict[str, list[Stance]]:
    """{side: stances in order} of probabilities (T,) by side at time_s (T,): where they pass 0.6, between rows.
    Contacts and swings of less than a tenth of a second count as none."""
    found: dict[str, list[Stance]] = {side: [] for side in probability}
    for side, values in probability.items():
        for piece in runs(np.isfinite(values), time_s, seams):
            p, t = values[piece], time_s[piece]
            rows = np.flatnonzero(np.diff(p > ON_FLOOR))
            turns = t[rows] + (t[rows + 1] - t[rows]) * (ON_FLOOR - p[rows]) / (p[rows + 1] - p[rows])
            while len(turns) > 1 and (lasts_s := np.diff(turns)).min() < _SHORTEST_S:
                turns = np.delete(turns, lasts_s.argmin() + np.arange(2))
            # The first turn is an initial contact, unless the foot stands already.
            edges = [*[np.nan] * bool(p[0] > ON_FLOOR), *turns.tolist()]
            edges += [np.nan] * (len(edges) % 2)
            found[side] += [Stance(side, *edge) for edge in zip(edges[::2], edges[1::2], strict=True)]
    return found


def strides(walks: Sequence[Sequence[Step]], feet: Mapping[str, Sequence[Stance]]) -> list[Stride]:
    """Of every two steps in a row, walk by walk, with the toe-offs that lie in them."""
    made = []
    offs = {side: np.sort([stance.stop_s for stance in stands]) for side, stands in feet.items()}
    for walk in walks:
        for first, second in pairwise(walk):
            side, other = second.side, first.side
            # The other foot's stance before it lands at first.stop_s ends about when this foot lands.
            made.append(
                Stride(
                    side,
                    first.start_s,
                    second.stop_s,
                    _off(offs[side], first.start_s, second.stop_s),
                    _off(offs[other], first.start_s - (first.stop_s - first.start_s), first.stop_s),
                    first.stop_s,
                )
            )
    return made


def _off(offs: np.ndarray, after_s: float, before_s: float) -> float:
    """The last of toe-offs (N,), which increase, between; NaN where there is none."""
    last = int(np.searchsorted(offs, before_s)) - 1
    return float(offs[last]) if last >= 0 and offs[last] > after_s else float("nan")


def contact_times(walks: Sequence[Sequence[Step]], side: str) -> list[float]:
    """Seconds at which one foot lands: a step begins with an initial contact of the other foot and ends with one."""
    return sorted({at_s for walk in walks for foot, at_s in _landings(walk) if foot == side})


def walks(
    feet: Mapping[str, Sequence[Stance]],
    between: np.ndarray,
    time_s: np.ndarray,
    least: float,
    seams: Sequence[int] = (),
    facing_deg: np.ndarray | None = None,
) -> list[list[Step]]:
    """Walks of at least three steps in order, runs of two: the feet land in turn, 0.2 to 1.5 s after one another, and
    each passes the other. Standing, turning and the steps to a stop and from it are no part of a walk.

    feet: stances by side. between: (T, 2) how far the right ankle is in front of the left one and to its right, in
    lengths of a leg. least: by how much the first of that changes from landing to landing at least. Where the feet land
    twice as far apart sideways as in front (a jumping jack), a walk ends; so it does at a gap. facing_deg: (T,) where
    the person faces, in any still axes; a step in which that turns by 30 degrees or more ends a walk too, where what
    swings to and fro from step to step, as pelvises do, is no turn.
    """
    lands = sorted(
        (stance.start_s, stance.side)
        for side in feet.values()
        for stance in side
        if stance.start_s == stance.start_s
    )
    at = np.array([start for start, _ in lands])
    ahead, aside = resample(between, time_s, at, seams).T if len(at) else (np.zeros(0), np.zeros(0))
    straddles = np.abs(aside) > _SIDEWAYS * np.abs(ahead)
    pieces = runs(np.asarray(np.isfinite(between).all(axis=1)), time_s, seams)
    broken = _broken(pieces, time_s, at)
    turned = np.zeros(len(broken)) if facing_deg is None else _turned(facing_deg, time_s, lands, seams)
    parts: list[list[Step]] = []
    walk: list[Step] = []
    turn = 0.0  # which way the last step changed what is ahead: right foot forward is positive
    for i, ((start, side), (stop, other)) in enumerate(pairwise(lands)):
        change = float(ahead[i + 1] - ahead[i])
        is_step = (
            side != other
            and _STEP_S[0] <= stop - start <= _STEP_S[1]
            and abs(change) >= least
            and not (straddles[i] or straddles[i + 1] or broken[i] or turned[i] >= _TURNS_DEG)
        )
        if not is_step or (walk and change * turn > 0):
            parts.append(walk)
            walk = []
        if is_step:
            walk.append(Step(other, start, stop))
            turn = change
    ends = [float(time_s[piece.stop - 1]) for piece in pieces]
    moving = [part for walk in [*parts, walk] for part in _between_stops(walk, feet, ends)]
    return [walk for walk in moving if len(walk) >= (FEWEST_FLYING if _flies(walk, feet) else FEWEST)]


def _flies(walk: Sequence[Step], feet: Mapping[str, Sequence[Stance]]) -> bool:
    """Whether at each initial contact the other foot is off the floor."""
    if not walk:
        return False
    return not any(
        not stance.start_s >= at_s and not stance.stop_s < at_s
        for side, at_s in _landings(walk)
        for stance in feet[OTHER[side]]
    )


def _landings(walk: Sequence[Step]) -> list[tuple[str, float]]:
    """Side and time of each foot that lands: one more than steps."""
    return [(OTHER[walk[0].side], walk[0].start_s), *((step.side, step.stop_s) for step in walk)]


def _between_stops(
    walk: list[Step], feet: Mapping[str, Sequence[Stance]], ends_s: Sequence[float]
) -> list[list[Step]]:
    """A walk in parts, without the steps to and from a foot that stays for more than a stride: there the person stops.
    ends_s: the end of each piece in which the feet are visible; a foot whose toe-off is not seen stays until then.

    The stride is the last before the foot lands or the first after the other has landed, whichever is longer. A person
    who stops on both feet leaves the one behind on the floor as long: the stop is where most of a foot's stay passes
    before the other lands.
    """
    if len(walk) < 2:
        return [walk]
    sides, at_s = zip(*_landings(walk), strict=True)
    stops = []
    for i, side in enumerate(sides):
        leaves = next(stance.stop_s for stance in feet[side] if stance.start_s == at_s[i])
        if np.isnan(leaves):
            leaves = min((end for end in ends_s if end >= at_s[i]), default=at_s[i])
        stays = leaves - at_s[i]
        waits = at_s[i + 1] - at_s[i] if i < len(walk) else np.inf
        beside = [at_s[stop] - at_s[stop - 2] for stop in (i, i + 3) if 2 <= stop <= len(walk)]
        stops.append(bool(beside) and stays > max(beside) and 2 * waits > stays)
    parts = groupby(zip(walk, pairwise(stops), strict=True), key=lambda step_stops: any(step_stops[1]))
    return [[step for step, _ in part] for stopped, part in parts if not stopped]


def _turned(
    facing_deg: np.ndarray, time_s: np.ndarray, lands: Sequence[tuple[float, str]], seams: Sequence[int]
) -> np.ndarray:
    """(N - 1,) degrees by which the person turns from landing to landing (time and side), but for what swings."""
    if not lands:
        return np.zeros(0)
    at_s, sides = map(np.array, zip(*lands, strict=True))
    angle = np.radians(facing_deg)
    x, y = resample(np.stack([np.cos(angle), np.sin(angle)], axis=-1), time_s, at_s, seams).T
    finite, facing = np.isfinite(x), np.full(len(at_s), np.nan)
    facing[finite] = np.degrees(np.unwrap(np.arctan2(y[finite], x[finite])))  # no jumps by a whole turn
    ends = np.flatnonzero((np.diff(at_s) > _STEP_S[1]) | (sides[1:] == sides[:-1])) + 1
    swing = np.concatenate([_swing(of_walk) for of_walk in np.split(facing, ends)])
    return np.abs(np.diff(facing - swing))


def _swing(facing_deg: np.ndarray) -> np.ndarray:
    """What of facing_deg (N,) at landings, of one foot and the other in turn, is of the foot that lands: half of by how
    much it differs from the mean of the landings before and after, in the median of the nearest five, for one foot, and
    less that for the other; who walks backwards swings the other way. Landings about which the person turns tell
    nothing of it; the other foot's before and after are apart there."""
    foot = (-1.0) ** np.arange(len(facing_deg))
    before, after = facing_deg[:-2], facing_deg[2:]
    differs = foot[1:-1] * (facing_deg[1:-1] - (before + after) / 2)
    tells = np.flatnonzero(np.isfinite(differs) & (np.abs(after - before) < _TURNS_DEG))
    if not len(tells):
        return np.zeros(len(facing_deg))
    medians = np.median(sliding_window_view(differs[tells], min(_NEAREST, len(tells))), axis=1)
    nearest = np.searchsorted((tells[1:] + tells[:-1]) / 2 + 1, np.arange(len(facing_deg)))
    return foot * medians[np.clip(nearest - _NEAREST // 2, 0, len(medians) - 1)] / 2


def _broken(pieces: Sequence[slice], time_s: np.ndarray, at_s: np.ndarray) -> np.ndarray:
    """(N - 1,) whether the rows from one landing at_s (N,) to the next are not all of one of the pieces."""
    piece_of = np.full(len(time_s) + 1, -1)  # the last one of landings before and behind all rows
    for number, rows in enumerate(pieces):
        piece_of[rows] = number
    first = np.searchsorted(time_s, at_s[:-1])
    last = np.searchsorted(time_s, at_s[1:], side="right") - 1
    return (first > last) | (piece_of[first] < 0) | (piece_of[first] != piece_of[last])


@dataclass(frozen=True, eq=False)
class Gait:
    """feet: stances by side "r" and "l", in walks and elsewhere. walks: of three steps or more, in order."""

    feet: dict[str, list[Stance]]
    walks: list[list[Step]]

    @cached_property
    def steps(self) -> list[Step]:
        """Of all walks, in order."""
        return [step for walk in self.walks for step in walk]

    @cached_property
    def kind(self) -> str:
        """ "running" where most strides have flights and steps are as quick as people run, else "walking"; "none"
        without a walk."""
        if not self.walks:
            return "none"
        return "running" if self.flies and _step_s(self.steps) <= _RUN_STEP_S else "walking"

    @cached_property
    def flies(self) -> bool:
        """Whether most strides have flights."""
        flights_s = finite(self.times["flight_time_s"])
        return bool(len(flights_s) and np.median(flights_s) > 0)

    @cached_property
    def mixed(self) -> bool:
        """Whether a run has walked steps too: in some strides two feet are clearly on the floor."""
        if self.kind != "running":
            return False
        return bool((finite(self.times["flight_time_s"]) < -_BOTH_S).mean() >= _SOME)

    @cached_property
    def strides(self) -> list[Stride]:
        """Of all walks, in order."""
        return strides(self.walks, self.feet)

    @cached_property
    def times(self) -> Values:
        """Of steps and strides, NaN where an event is not seen.

        step_time_s, stride_time_s, stance_time_s, swing_time_s; stance_percent, swing_percent, single_support_percent
        and double_support_percent of the stride: the other foot's swing, when only this one bears the body, in a run
        the stance; and both supports together, negative where the feet leave before the other lands (a run).
        flight_time_s, of one flight, by the stride's two or the one that is seen, negative in a walk.
        """
        events = np.array([astuple(stride)[1:] for stride in self.strides], dtype=np.float64).reshape(-1, 5)
        start, stop, off, other_off, other_start = events.T
        stride, stance, swing = stop - start, off - start, stop - off
        # From this foot's initial contact to the other's toe-off, and from the other's initial contact to this one's
        # toe-off: support by both where positive, flight where negative.
        first, last = other_off - start, off - other_start
        single = np.minimum(other_start, off) - np.maximum(other_off, start)
        # Each, or the one that is seen.
        one, other = np.where(np.isfinite(first), first, last), np.where(np.isfinite(last), last, first)
        of_strides = {
            "stride_time_s": stride,
            "stance_time_s": stance,
            "swing_time_s": swing,
            "stance_percent": 100 * stance / stride,
            "swing_percent": 100 * swing / stride,
            "single_support_percent": 100 * single / stride,
            "double_support_percent": 100 * (first + last) / stride,
            "flight_time_s": -(one + other) / 2,
        }
        of_steps = {"step_time_s": [step.stop_s - step.start_s for step in self.steps]}
        return by_side(self.steps, of_steps) | by_side(self.strides, of_strides)

    @cached_property
    def style(self) -> dict[str, float]:
        """{figure of OF_STYLE: mean over both sides' values}; those that are seen."""
        seen = {name: finite(self.times[name]) for name in OF_STYLE}
        return {name: float(values.mean()) for name, values in seen.items() if len(values)}


def by_side(events: Sequence[Step | Stride], figures: Mapping[str, Sequence[float] | np.ndarray]) -> Values:
    """Figures (N,) of these steps or strides, in order, apart by the foot."""
    sides = np.array([event.side for event in events], dtype=str)
    return {
        name: {side: np.asarray(values, dtype=np.float64)[sides == side] for side in "rl"}
        for name, values in figures.items()
    }


def finite(values: Mapping[str, np.ndarray]) -> np.ndarray:
    """(N,) the values of a figure's sides that are not NaN."""
    every = np.concatenate([np.empty(0), *values.values()])
    return every[np.isfinite(every)]


def as_walked(
    probability: Mapping[str, np.ndarray], time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> dict[str, np.ndarray]:
    """The probabilities (T,) of contacts by side for those who walk like that: the network was taught how long feet
    usually stand, and doubtful frames lean towards it. How long they do in a walk is the share under which its
    probabilities agree with themselves (expectation maximisation: Saerens, Latinne & Decaestecker, Neural Computation
    14(1), 2002)."""
    result = {side: values.copy() for side, values in probability.items()}
    for walk in walks:
        first, last = walk[0].start_s, walk[-1].stop_s
        inside = np.concatenate(
            [values[(time_s >= first) & (time_s <= last)] for values in probability.values()]
        )
        inside = inside[np.isfinite(inside)]
        share = _USUAL_SHARE
        for _ in range(_ITERATIONS):
            share = float(_with_share(inside, share).mean())
        rows = (time_s >= first - _BESIDE_S) & (time_s <= last + _BESIDE_S)
        for side, values in probability.items():
            result[side][rows] = _with_share(values[rows], share)
    return result


def _with_share(probability: np.ndarray, share: float) -> np.ndarray:
    on, off = probability * share / _USUAL_SHARE, (1 - probability) * (1 - share) / (1 - _USUAL_SHARE)
    return on / (on + off)


def slow_flights(feet: dict[str, list[Stance]], walk: list[Step]) -> bool:
    """Whether steps with flights follow each other more slowly than anybody runs."""
    return Gait(feet, [walk]).flies and _step_s(walk) > _RUN_STEP_S


def _step_s(steps: Sequence[Step]) -> float:
    return float(np.median([step.stop_s - step.start_s for step in steps]))


def separation(body: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(T, 2) how far the right ankle is in front of the left one and to its right, in lengths of a leg. body: (T, 17,
    3) in BODY axes; time_s: (T,)."""
    between = body[:, H36M17.index("r_ankle"), :2] - body[:, H36M17.index("l_ankle"), :2]
    return between * (-1, 1) / leg_lengths(body, time_s, seams)[:, None]  # BODY's x is back, its y is right


def facing_deg(R_level_from_body: np.ndarray) -> np.ndarray:
    """(T,) where the person faces about LEVEL's z, by rotations (T, 3, 3)."""
    return np.degrees(np.arctan2(-R_level_from_body[:, 1, 0], -R_level_from_body[:, 0, 0]))


def gait_of(motion: Motion) -> Gait:
    """A take's stances and walks, with steps beyond the noise that the columns state (`least_step`). Where the camera
    moves, turns of the person are not told from the camera's and end no walk."""
    rectified, time_s, seams, facing = motion.rectified, motion.times, motion.seams, None
    if not motion.moving_camera:
        facing = facing_deg(transpose(rectified.R_source_from_level) @ rectified.R_source_from_body)
    least = least_step(motion.columns, motion.unjudged)
    apart = separation(motion.body, time_s, seams)

    def found_by(probability: Mapping[str, np.ndarray]) -> Gait:
        feet = stances(probability, time_s, seams)
        steps_in_turn = walks(feet, apart, time_s, least, seams, facing)
        # Slow steps with flights are leaps, or stances were missed.
        return Gait(feet, [walk for walk in steps_in_turn if not slow_flights(feet, walk)])

    probability = contacts(motion.body, time_s, seams)
    gait = found_by(probability)
    if gait.kind != "walking":
        return gait
    again = found_by(as_walked(probability, time_s, gait.walks))
    return again if again.walks else gait


@dataclass(frozen=True)
class Walk:
    """A walk or a run. steps: those whose feet were seen, in order; every: with those before and behind that the knees'
    rhythm tells where steps cannot be seen (`faded_steps`). cut: whether its start, and its end, were not visible, so
    that there may be more."""

    steps: tuple[Step, ...]
    every: tuple[Step, ...]
    cut: tuple[bool, bool]


def walks_of(motion: Motion, gait: Gait) -> list[Walk]:
    """The walks of a gait, in order. Who stops stays for more than a stride, as in `walks`: where an end of the take
    or a gap lies nearer, that was not visible."""
    apart = separation(motion.body, motion.times, motion.seams)[:, 0]
    knees = {side: motion.angle(f"{side}_knee_flexion") for side in SIDES.values()}
    visible = np.isfinite(apart) | np.isfinite([*knees.values()]).all(axis=0)
    ends_s = [
        (float(motion.times[rows.start]), float(motion.times[rows.stop - 1]))
        for rows in runs(visible, motion.times, motion.seams)
    ]
    hidden = along_sight(motion.rectified.R_source_from_body, motion.source.frame) | np.isnan(apart)
    swings = {side: swings_of(x, motion.times, motion.seams) for side, x in knees.items()}
    walks = []
    for i, steps in enumerate(gait.walks):
        stride_s = 2 * float(np.mean([step.stop_s - step.start_s for step in steps]))
        before, behind = [], []
        if gait.kind == "walking":
            before, behind = faded_steps(steps, knees, swings, motion.times, hidden)
            since_s = walks[-1].every[-1].stop_s if walks else -np.inf
            until_s = gait.walks[i + 1][0].start_s if i + 1 < len(gait.walks) else np.inf
            before = [step for step in before if step.start_s >= since_s]
            behind = [step for step in behind if step.stop_s <= until_s]
        every = (*before, *steps, *behind)
        first_s, last_s = every[0].start_s, every[-1].stop_s
        starts = any(0 <= first_s - start_s < stride_s for start_s, _ in ends_s)
        stops = any(0 <= stop_s - last_s < stride_s for _, stop_s in ends_s)
        walks.append(Walk(tuple(steps), every, (starts, stops)))
    return walks


def along_sight(R_source_from_body: np.ndarray, source: Frame) -> np.ndarray:
    """(T,) in which frames a person faces the camera or turns the back to it; none where the source is no camera.
    R_source_from_body: (T, 3, 3)."""
    if source.family != "camera":
        return np.zeros(len(R_source_from_body), dtype=bool)
    ahead = -R_source_from_body[:, :, 0] @ source.basis[:, 2]  # BODY's x is back, CAMERA's z is away
    return np.nan_to_num(np.abs(ahead)) > np.cos(np.radians(_SIGHT_DEG))


def faded_steps(
    walk: Sequence[Step],
    knees: Mapping[str, np.ndarray],
    swings: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    hidden: np.ndarray,
) -> tuple[list[Step], list[Step]]:
    """Steps before a walk and behind it, in order, by the swings of the knees, which keep the walk's rhythm.

    knees: {"r", "l": (T,)} degrees of flexion at time_s (T,), NaN where not known; swings: `swings_of` each. hidden:
    (T,) in which frames steps cannot be seen, along the line of sight or without the ankles. Of 71 landings that this
    adds to 103 lifted walks of validation people, were all their frames hidden, 65 are within 0.25 s of one of that
    foot, and most within 0.05 s.
    """
    step_s = float(np.median([step.stop_s - step.start_s for step in walk]))
    knee_peaks = []  # how long before the foot lands its knee is bent most in each step, and by how much
    for step in walk:
        at_s, height = swings[step.side].T
        inside = slice(np.searchsorted(at_s, step.start_s, side="right"), np.searchsorted(at_s, step.stop_s))
        if len(at_s[inside]):
            most = inside.start + int(height[inside].argmax())
            knee_peaks.append((step.stop_s - at_s[most], height[most]))
    if not knee_peaks:
        return [], []
    lag_s, usual = np.median(knee_peaks, axis=0)

    def lands(side: str, near_s: float) -> float | None:
        """When the foot of a side lands about then, after its knee has swung where steps cannot be seen."""
        off_s = np.abs(swings[side][:, 0] + lag_s - near_s)
        near = np.flatnonzero(off_s <= _OFF * step_s)
        for at_s, height in swings[side][near[np.argsort(off_s[near], kind="stable")]]:
            rows = np.searchsorted(time_s, [at_s, at_s + lag_s])
            if rows[1] >= len(time_s):
                return None
            bent, other = knees[side][rows[0]], knees[OTHER[side]][rows[0]]
            alone = not bent - other < _MORE * usual  # or the other is not known
            fits = alone and _SWINGS[0] * usual <= height <= _SWINGS[1] * usual
            if fits and hidden[rows[0]]:
                return at_s + lag_s
        return None

    behind, before = [walk[-1]], [walk[0]]
    while (at_s := lands(OTHER[behind[-1].side], behind[-1].stop_s + step_s)) is not None:
        behind.append(Step(OTHER[behind[-1].side], behind[-1].stop_s, at_s))
    while (at_s := lands(before[0].side, before[0].start_s - step_s)) is not None:
        before.insert(0, Step(OTHER[before[0].side], at_s, before[0].start_s))
    return before[:-1], behind[1:]


def swings_of(knee: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 2) when a knee's flexion (T,) is largest, each time, in order, and how large it is."""
    pieces = runs(np.isfinite(knee), time_s, seams)
    tops = [piece.start + row for piece in pieces for row in peaks(knee[piece], _LEAST_DEG)]
    return np.stack([time_s[tops], knee[tops]], axis=-1) if tops else np.zeros((0, 2))


def least_step(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """By how much the ankles' separation changes from landing to landing at least, in lengths of a leg: beyond its
    median standard deviation by those that the columns (T,) state for thighs and shanks in degrees. Both bones are half
    of a leg, and the four errors are taken for independent. Where none is stated it is 0, or, for a lifter whose errors
    were not measured (unjudged), that of the built-in lifter's angles."""
    usual = _USUAL if unjudged else 0.0
    parts = [
        0.5 * np.cos(np.radians(columns[f"{name}_deg"])) * np.radians(columns[f"{name}_sd_deg"])
        for name in (f"{side}_{bone}_sagittal" for side in "rl" for bone in ("thigh", "shank"))
        if f"{name}_deg" in columns and f"{name}_sd_deg" in columns
    ]
    sd = np.sqrt(np.sum(np.square(parts), axis=0)) if len(parts) == 4 else np.zeros(0)
    return max(LEAST_STEP, NOISE * float(np.nan_to_num(known_median(sd), nan=usual)))
