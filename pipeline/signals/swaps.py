"""Left and right exchanged, or depth turned over, for some rows of a take: found, told and masked.

An estimator that takes the left leg for the right one makes both legs leap there and back; one that takes a limb's
depth for its opposite makes it leap through the plane of the image. Both only change the sign of vectors: from one
limb to the other, or from a limb's root to its joints along the view. In which way a row is wrong is a hidden state,
and the likeliest states (Viterbi 1967) are those in which these vectors move on steadily. A vector is expected where
its velocity takes it, unless that is a leap; the distance from there over its usual one is judged by the Cauchy
distribution, whose tails let a real jerk or a bad point pass. Every change of state has its price. Anatomy
(checks.handedness_cues) and the rhythm of a walk tip the scale where continuity leaves it open, and never alone. How
probable a state is over all sequences (forward-backward) tells what is certain: that limbs changed places is often
clear when it is not on which side of the change they are wrong, least of all of a long run. Nothing is put right: what
is certain may be masked.

The rhythm: the vector from one side of a walker's legs, or arms, to the other swings to and fro once a stride. Its
square is the same when the two are exchanged and swings once a step; half the phase of that is the phase of the stride.
So a row shows whether its sides are as the rest of the walk has them, also where a crossing is too blurred to follow.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.anthropometry import trunk_length
from ..core.blocks import blocks
from ..core.frames import CAMERA
from ..core.layouts import Layout
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Swaps, Take
from .checks import handedness_cues, without_made_nose
from .filters import stretches

_LEG = ("hip", "knee", "ankle", "big_toe", "small_toe", "heel", "foot_index")
_ARM = ("shoulder", "elbow", "wrist", "pinky", "index", "thumb")
_TRUNK = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")
# Log-likelihood that each end of a run must gain to be believed, also where the clip ends before it does. Depth is an
# estimator's guess, and noisy.
_PRICE, _DEPTH_PRICE = 3.0, 5.0
_PER_SECOND = 0.5  # what wrong rows cost: of two halves of a take the shorter one is wrong
_ANATOMY = 2.0  # a second, for each cue that says the opposite
# A second, for a walker's sides that are widest apart and the wrong way round. Four times an anatomical cue: those are
# noisy in every frame. With 16 swaps that are there were taken for the rhythm of a run (val subjects).
_GAIT = 8.0
_CERTAIN = 10 / 11  # odds of ten to one
# Who turns passes edge-on, where sides change places in an image and nothing leaps. A run that lasts as long as a turn
# may be right, and what is beside it wrong.
_TURN_S = 0.35
# Rows beside a run, by which it is seen whether each of its own is turned, and the share of them that have to be.
_BESIDE, _MOST = 3, 0.75
_FLOOR = 0.01  # trunk lengths: joints are never expected more precisely
_LEAP = 4.0  # times the usual step from row to row: a velocity beyond is not trusted to go on
# Two joints of one name leap to each other's places: within so many seconds, by so many trunk lengths a second, and so
# many times faster than in nine of ten steps of the take. They are apart by so many trunk lengths, before as far as
# after but for this share, and opposite by this cosine; what lies midway moves less than this share of the leap. Sound
# validation takes, runners among them, reach 1.9 times, a boxer 2.6; real exchanges 2.2 to 35, most of them above 3.
_LEAP_S, _LEAP_SPEED, _FASTER = 0.1, 15.0, 3.0
_APART, _ALIKE, _OPPOSITE, _IN_PLACE = 0.4, 0.6, -0.8, 0.25
_CROSSED = 0.1  # of the leap: from there on they cross
_LOOKED_AT = 1024  # rows whose anatomy in all states is taken at once
_PASSES = 3  # for runs that overlap
# Of 280 right turns on CMU and ACCAD val subjects 3 stretch bones by more, of 130 wrong ones 3 of 4.
_STRETCH = 1.1
_BONES = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
_MOST_RANGES = 8  # named of one kind
# The rhythm of a walk.
_STEPS_HZ = np.geomspace(0.7, 4.0, 60)  # of steps of 0.25 to 1.4 s
_LEAST_ROWS = 4  # in a step: its square would not be seen to swing
_DEPTH = 0.5  # of the square's swing over its mean: 1 when the sides change places wholly, less when one stays ahead
_WINDOW = 4.0  # standard deviations after which a Gaussian window ends
_NOTHING = 1e-12  # of the largest mean: rounding, where nothing was seen
_AT_ONCE = 2**16  # rows times rates whose rhythm is taken at once; fits the caches
_FEWEST = 3.0  # steps in a walk, as in models/gait/events.py
# Agreement: the share of a walk's rows that fit, less that of those that do not. It is about 1 when people walk, below
# 0.5 when they hop or bow, which swings the square without alternating (CMU and ACCAD val subjects: few between).
_AGREED = 0.7
# Vectors are weighed as if hardly independent; with twice the log-likelihood, the runs that are called 50 to 80 %
# probable are right in about half of the cases, the others in 99 of 100 (CMU and ACCAD val subjects).
_SHARPNESS = 2.0
_ROWS = 48  # whose costs are made at once: so few that BLAS shares them among no threads, which would wait


@dataclass(frozen=True)
class Swap:
    """Rows first_row to last_row, both included, that are wrong in one way.

    kind: the name of one of `kinds`. evidence: log-likelihood that continuity gains when they are turned back.
    probability: that these rows are the wrong ones, the median over them; of a long exchange no more than anatomy and
    rhythm say. change: that right and wrong change places at each of their ends inside the clip, whichever is which.
    against: what speaks against it, as clauses: all swaps of its kind turned back would make the take worse.
    """

    kind: str
    first_row: int
    last_row: int
    evidence: float
    probability: float = 1.0
    change: float = 1.0
    against: tuple[str, ...] = ()

    @property
    def certain(self) -> bool:
        """Whether the odds that these rows are wrong are ten to one or better, and nothing speaks against it: others
        are told and left as they are."""
        return self.probability >= _CERTAIN and not self.against

    @property
    def one_sided(self) -> bool:
        """Whether something changed for certain, but not which side of the change is wrong."""
        return self.probability < _CERTAIN <= self.change

    def __len__(self) -> int:
        return self.last_row - self.first_row + 1


@dataclass(frozen=True, eq=False)
class Kind:
    """One way to be wrong, which is also the way back: vectors between joints change their sign.

    pairs: (M, 2) joints. exchanged: the two of a pair change places; otherwise the first one's depth is mirrored
    through the second one. limb: "leg" or "arm", "" of the whole body.
    """

    name: str
    pairs: np.ndarray
    exchanged: bool
    limb: str = ""

    def vectors(self, joints: np.ndarray) -> np.ndarray:
        """(T, M, D or 1) what changes its sign. joints: (T, J, D) in IMAGE, or CAMERA for depth."""
        between = joints[:, self.pairs[:, 0]] - joints[:, self.pairs[:, 1]]
        return between if self.exchanged else between[..., 2:]

    def applied(self, joints: np.ndarray) -> np.ndarray:
        """joints, or their confidences (T, J), in which every row is turned from right to wrong, or back."""
        first, second = self.pairs.T
        out = joints.copy()
        if self.exchanged:
            out[:, first], out[:, second] = joints[:, second], joints[:, first]
        elif joints.ndim == 3:
            out[:, first, 2] = 2 * joints[:, second, 2] - joints[:, first, 2]
        return out


def has_depth(poses: PoseSequence) -> bool:
    """Whether the last axis is the distance from a camera: CAMERA axes and no others."""
    return poses.frame.axes == CAMERA.axes


def kinds(layout: Layout, depth: bool) -> tuple[Kind, ...]:
    """Exchanged legs or arms; with depth (H36M17 in CAMERA axes) also the whole body mirrored in depth through the
    pelvis, or a limb through its hip or shoulder."""
    limbs = {
        (side, limb): [layout.index(f"{side}_{part}") for part in parts if f"{side}_{part}" in layout]
        for limb, parts in (("leg", _LEG), ("arm", _ARM))
        for side in "lr"
    }
    found = []
    for limb in ("leg", "arm"):
        pairs = np.array(list(zip(limbs["l", limb], limbs["r", limb], strict=True)))
        found.append(Kind(f"{limb}s exchanged", pairs, True, limb))
    if depth:
        pelvis = layout.index("pelvis")
        body = [(joint, pelvis) for joint in range(len(layout)) if joint != pelvis]
        found.append(Kind("body mirrored in depth", np.array(body), False))
        for (side, limb), (root, *rest) in limbs.items():
            pairs = np.array([(joint, root) for joint in rest])
            found.append(Kind(f"{side}_{limb} mirrored in depth", pairs, False, limb))
    return tuple(found)


def find_swaps(poses: PoseSequence) -> tuple[Swap, ...]:
    """Runs of rows in which limbs are exchanged or, in 3D, mirrored in depth: of each clip first probable ones, in the
    order in which they would be turned back, then those that are more likely than not, last joints that leap
    (`_leapt`).

    poses: 2D keypoints of any layout, or H36M17; a layout without hips or shoulders has no swaps. Depth is judged in
    CAMERA axes only. Clips between seams, missing frames and empty rows are judged one by one; NaN joints are ignored.
    A swap as long as its clip has no ends and is not found: checks.chirality finds it. A depth mirror
    needs both ends.
    """
    if any(joint not in poses.layout for joint in _TRUNK):
        return ()
    ways = kinds(poses.layout, has_depth(poses))
    joints = without_made_nose(poses).joints.astype(np.float64)
    found: list[Swap] = []
    for first, last in _clips(poses):
        clip = joints[first:last]
        times = assumed_times(poses)[first:last]
        runs: list[tuple[int, Swap]] = []
        told: list[tuple[int, Swap]] = []
        for _ in range(_PASSES):
            runs = _runs(clip, times, ways, poses.layout)
            certain = [run for run in runs if run[1].certain]
            if not certain:
                break
            clip = clip.copy()
            for k, swap in certain:
                rows = slice(swap.first_row, swap.last_row + 1)
                clip[rows] = ways[k].applied(clip[rows])
            told += certain
        told += [run for run in runs if not run[1].certain]
        told += [run for run in _leapt(clip, times, poses) if not any(_touch(run, other) for other in told)]
        found += [
            replace(swap, first_row=swap.first_row + first, last_row=swap.last_row + first)
            for _, swap in told
        ]
    return _weighed(poses, tuple(found))


def _touch(one: tuple[int, Swap], other: tuple[int, Swap]) -> bool:
    """Whether two swaps of one kind share rows or are next to each other."""
    (k, swap), (other_k, before) = one, other
    return k == other_k and swap.first_row - 1 <= before.last_row and before.first_row <= swap.last_row + 1


def assumed_times(poses: PoseSequence) -> np.ndarray:
    """(T,) seconds; at 30 frames a second where the rate is unknown: little depends on it here."""
    return poses.frame_index / 30.0 if poses.time_s is None else poses.time_s.astype(np.float64)


def _clips(poses: PoseSequence) -> list[tuple[int, int]]:
    """[first, last) of the stretches without a clip boundary, a missing frame or an empty row."""
    step = np.diff(poses.frame_index)
    breaks = np.flatnonzero(step > np.median(step)) + 1 if len(step) else np.zeros(0, dtype=int)
    empty = np.flatnonzero(np.isnan(poses.joints).all(axis=(1, 2)))
    edges = np.unique(np.concatenate([[0], poses.seams, breaks, empty, empty + 1, [len(poses)]]).astype(int))
    return [(int(a), int(b)) for a, b in pairwise(edges) if b - a >= 3]


def _runs(
    clip: np.ndarray, times: np.ndarray, ways: tuple[Kind, ...], layout: Layout
) -> list[tuple[int, Swap]]:
    """(index of the kind, the swap) in one clip (T, J, D), by their rows."""
    floor = _FLOOR * float(np.nan_to_num(trunk_length(clip, layout)))
    states = _states(len(ways))
    vectors = [way.vectors(clip) for way in ways]
    continuity = np.stack([_continuity(one, times, floor) for one in vectors], axis=1)
    gait = np.zeros((len(clip), len(ways)))
    for k in (k for k, way in enumerate(ways) if way.exchanged):
        gait[:, k] = alternation(vectors[k], times)
    parts = (clip[rows] for rows in blocks(len(clip), _LOOKED_AT))
    anatomy = np.concatenate(
        [_anatomy(np.stack([_turned(part, state, ways) for state in states]), layout).T for part in parts]
    )
    seconds = np.gradient(times)[:, None]
    cost = seconds * (_ANATOMY * (anatomy[:, :1] - anatomy) + _GAIT * gait @ states.T)
    path, likely, changed = decoded(
        continuity, cost + seconds * _PER_SECOND * states.any(axis=1), states, _prices(states)
    )
    odds = -_SHARPNESS * np.take_along_axis(cost, path[:, None], axis=1)  # logarithms, by anatomy and rhythm
    wrong = states[path]
    runs = []
    for k in range(len(ways)):
        on = np.concatenate([[0], wrong[:, k], [0, 0, 0]])
        spans = np.flatnonzero(np.diff(on)).reshape(-1, 2)
        beside = np.diff(np.concatenate([[0], spans.ravel(), [len(clip)]]))[::2]  # rows that are right
        for i, (first, end) in enumerate(spans):
            rows = np.arange(max(first, 2), min(end + 2, len(clip)))
            before, mid, now = on[rows - 1], on[rows], on[rows + 1]
            evidence = -float(continuity[rows, k, before ^ mid, mid ^ now].sum())
            # One end alone is what a cut between two shots looks like; for limbs that are exchanged, anatomy helps.
            ended = first > 0 and end < len(clip)
            if evidence >= _PRICE if ways[k].exchanged else evidence >= _DEPTH_PRICE and ended:
                # An end may be a row off and be no less certain, unless that is the run's other end.
                off = int(end - first > 2)
                inner = (row for row in (first, end) if 0 < row < len(clip))
                ends = [changed[row - off : row + off + 1, k].sum() for row in inner]
                probability = float(np.median(likely[first:end, k]))
                # That it is short says nothing of a run as long as a turn, or longer than what is beside it.
                fewest = min((count for count in beside[i : i + 2] if count), default=0)
                if ways[k].exchanged and (seconds[first:end].sum() > _TURN_S or end - first > fewest):
                    probability = min(probability, float(1 / (1 + np.exp(-odds[first:end].sum()))))
                elif ways[k].exchanged and (share := _turned_share(vectors[k], first, end)) < _MOST:
                    probability = min(probability, share)
                change = float(min(*ends, 1.0))
                runs.append((k, Swap(ways[k].name, int(first), int(end - 1), evidence, probability, change)))
    return sorted(runs, key=lambda run: run[1].first_row)


def _leapt(clip: np.ndarray, times: np.ndarray, poses: PoseSequence) -> list[tuple[int, Swap]]:
    """(index of the kind, the swap) where two joints of one name leap, each to where the other one was: the rows from
    there to where they cross, before or after it, whichever is sooner. Which of these are wrong nothing says."""
    found: list[tuple[int, Swap]] = []
    size = float(np.nan_to_num(trunk_length(clip, poses.layout)))
    step_s = float(np.median(np.diff(times)))
    for k, way in enumerate(kinds(poses.layout, depth=False) if size else ()):
        # A lift of exchanged keypoints exchanges what is in the image; depth may stay as it was.
        ends = clip[:, way.pairs[1:], : 2 if has_depth(poses) else None] / size
        apart, middle = ends[:, :, 0] - ends[:, :, 1], ends.mean(axis=2)
        steps = np.linalg.norm(np.diff(apart, axis=0), axis=-1).T / step_s
        fast = [np.percentile(of[np.isfinite(of)], 90) if np.isfinite(of).any() else np.inf for of in steps]
        least = np.maximum(_LEAP_SPEED, _FASTER * np.array(fast))
        wrong = np.zeros(len(clip), dtype=bool)
        for rows in range(1, min(max(round(_LEAP_S / step_s), 1), len(clip) - 1) + 1):
            old, new = apart[:-rows], apart[rows:]
            lengths = np.linalg.norm([old, new], axis=-1)
            leap = np.linalg.norm(new - old, axis=-1)
            over = leap > least * (times[rows:] - times[:-rows])[:, None]
            over &= np.linalg.norm(middle[rows:] - middle[:-rows], axis=-1) < _IN_PLACE * leap
            over &= lengths.min(axis=0) > np.maximum(_APART, _ALIKE * lengths.max(axis=0))
            over &= (old * new).sum(axis=-1) < _OPPOSITE * lengths.prod(axis=0)
            for row, joint in np.argwhere(over):
                axis, end = new[row, joint] - old[row, joint], row + rows
                along = apart[:, joint] @ axis / (axis @ axis)
                before, after = _until_crossed(-along[row::-1]), _until_crossed(along[end:])
                wrong[slice(row + 1 - before, end) if before < after else slice(row + 1, end + after)] = True
        found += [(k, Swap(way.name, int(first), int(end - 1), 0.0, 0.5)) for first, end in stretches(wrong)]
    return found


def _until_crossed(along: np.ndarray) -> int:
    """How many of the first rows (T,) have the limbs apart, by the median of three."""
    around = np.pad(along, 1, mode="edge")
    apart = np.median([around[:-2], along, around[2:]], axis=0) > _CROSSED
    return int(np.argmin(np.append(apart, False)))


def _turned_share(vectors: np.ndarray, first: int, end: int) -> float:
    """Of rows first to end - 1, those whose vectors (T, M, D), where there are any, are nearer to the way from just
    before to just after once they are turned; 1 where one of these is not there, for limbs swing."""
    if first == 0 or end == len(vectors):
        return 1.0
    before, after = (
        np.nansum(beside, axis=0)
        for beside in (vectors[max(first - _BESIDE, 0) : first], vectors[end : end + _BESIDE])
    )
    share = np.linspace(0, 1, end - first + 2)[1:-1, None, None]
    way = (1 - share) * before + share * after
    known = np.isfinite(vectors[first:end]).any(axis=(1, 2))
    turned = np.nansum(vectors[first:end] * way, axis=(1, 2)) < 0
    return float(turned[known].mean()) if known.any() else 1.0


def _states(ways: int) -> np.ndarray:
    """(S, K) 0 or 1: the ways in which a row may be wrong at once: in none, in one, or in the first two, which are
    the exchanges of legs and of arms."""
    both = np.zeros(ways, dtype=int)
    both[:2] = 1
    return np.concatenate([np.zeros((1, ways), dtype=int), np.eye(ways, dtype=int), both[None]])


def _turned(clip: np.ndarray, state: np.ndarray, ways: tuple[Kind, ...]) -> np.ndarray:
    for k in np.flatnonzero(state):
        clip = ways[k].applied(clip)
    return clip


def _continuity(vectors: np.ndarray, times: np.ndarray, floor: float) -> np.ndarray:
    """(T, 2, 2): what row t costs more than as it is when it has become right or wrong since row t-1 (last axis), and
    row t-1 since row t-2.

    vectors: (T, M, D). Vectors that are expected next to each other are no independent witnesses: their sum counts
    over the root of their number.
    """
    cost = np.zeros((len(vectors), 2, 2))
    step = np.diff(times)
    ratio = (step[1:] / step[:-1])[:, None, None]
    old, mid, new = vectors[:-2], vectors[1:-1], vectors[2:]
    usual_step = _median_norm(mid - old, floor)
    square = {}
    for before, now in np.ndindex(2, 2):
        middle = (-1) ** before * mid
        move = middle - old
        trust = 1 / (1 + (move**2).sum(axis=-1) / (_LEAP * usual_step) ** 2)
        expected = middle + ratio * trust[..., None] * move
        square[before, now] = (((-1) ** (before + now) * new - expected) ** 2).sum(axis=-1)
    usual = _median_norm(np.sqrt(square[0, 0])[..., None], floor) ** 2
    for change in ((0, 1), (1, 0), (1, 1)):
        more = np.log1p(square[change] / usual) - np.log1p(square[0, 0] / usual)
        cost[2:, *change] = np.nansum(more, axis=-1) / np.sqrt(len(usual))
    return cost


def _median_norm(vectors: np.ndarray, floor: float) -> np.ndarray:
    """(M,) median length of vectors (T, M, D) over time, at least `floor`; infinite where all are missing, and where it
    is 0 and so is the floor: without a trunk in sight, what keeps still has no size to judge it by."""
    length = np.linalg.norm(vectors, axis=-1)
    seen = np.isfinite(length).any(axis=0)
    median = np.full(length.shape[1], np.inf)
    middle = np.median if np.isfinite(length).all() else np.nanmedian  # which takes many times as long
    median[seen] = np.maximum(middle(length[:, seen], axis=0), floor)
    return np.where(median > 0, median, np.inf)


def _anatomy(joints: np.ndarray, layout: Layout) -> np.ndarray:
    """(...,) how much joints (..., J, D) look like a body with its left and right and its depth as they are; 0 where
    unknown."""
    return np.nansum(handedness_cues(joints, layout), axis=-1)


def _prices(states: np.ndarray) -> np.ndarray:
    """(S, S) what it costs to go from one state to another. states: (S, K)."""
    changed = states[:, None] ^ states
    changes = np.asarray(changed.any(axis=-1))
    wrong, deep = (np.asarray(part.any(axis=1)) for part in (states, states[:, 2:]))
    price = np.where(deep | deep[:, None], _DEPTH_PRICE, _PRICE) * changes
    # Overturned depth shares its evidence with every other way, and it must not count for both.
    price[changes & (deep | deep[:, None]) & wrong & wrong[:, None]] = np.inf
    return price


def alternation(vectors: np.ndarray, times: np.ndarray, agreed: float = _AGREED) -> np.ndarray:
    """(T,) how well each row's sides fit the rhythm, from 1 (widest apart, as the rhythm has them) by 0 (crossing, or
    no walk) to -1 (widest apart, and exchanged).

    vectors: (T, M, D) from joints of one side to those of the other, NaN where missing. times: (T,) s, about evenly
    spaced. agreed: the least agreement for a walk. A rhythm does not tell which side is the left: in each walk most
    rows are taken for right.
    """
    fits = np.zeros(len(times))
    flat = np.nan_to_num(vectors.astype(np.float64)).reshape(len(times), -1)
    # Along the direction in which they are longest.
    swing = flat @ np.linalg.svd(flat, full_matrices=False)[2][0]
    frame_s = float(np.median(np.diff(times)))
    step_s = 1 / _STEPS_HZ
    rates = _STEPS_HZ[(step_s >= _LEAST_ROWS * frame_s) & (step_s <= np.ptp(times) / _FEWEST)]
    if not len(rates) or not swing.any():
        return fits
    together = max(_AT_ONCE // len(times), 1)  # rates
    parts = (rates[first : first + together] for first in range(0, len(rates), together))
    swung = [np.abs(_rhythm(swing**2, times, part, frame_s)[1]).sum(axis=1) for part in parts]
    hz = float(rates[np.argmax(np.concatenate(swung))])
    mean, turn = (found[0] for found in _rhythm(swing**2, times, np.array([hz]), frame_s))
    phase = np.pi * hz * times + np.unwrap(np.angle(turn)) / 2
    known = mean > _NOTHING * mean.max()
    fits[known] = np.cos(phase[known]) * swing[known] / np.sqrt(2 * mean[known])
    fits = np.clip(fits, -1, 1)
    walking = known & (2 * np.abs(turn) >= _DEPTH * mean)
    walks = np.zeros(len(times))
    for first, end in stretches(walking):
        walk = fits[first:end]
        agreement = float((walk * np.abs(walk)).sum() / (walk**2).sum())
        if times[end - 1] - times[first] >= _FEWEST / hz and abs(agreement) >= agreed:
            walks[first:end] = np.sign(agreement)
    return walks * fits


def _rhythm(
    square: np.ndarray, times: np.ndarray, hz: np.ndarray, frame_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N, T) mean of the square (T,) about each row, and the complex amplitude (N, T) with which it swings at about
    each of the rates hz (N,), within a Gaussian window of a step's length as standard deviation."""
    rows = len(square)
    width = 1 / (hz[:, None] * frame_s)
    reach = int(_WINDOW * width.max()) + 1
    # With zeros enough that the ends do not meet, and of small factors, of which the transform is quick.
    least = max(rows, reach + 1) + reach
    eighth = max(2 ** (int(np.ceil(np.log2(least))) - 3), 1)
    size = -(-least // eighth) * eighth
    lag = np.arange(reach + 1)
    half = np.where(lag <= _WINDOW * width + 0.5, np.exp(-0.5 * (lag / width) ** 2), 0.0)
    window = np.zeros((len(hz), size))
    window[:, : reach + 1], window[:, -reach:] = half, half[:, :0:-1]
    gain = np.fft.rfft(window).real  # the window is even

    def smooth(x: np.ndarray) -> np.ndarray:
        return np.fft.irfft(np.fft.rfft(x, size) * gain, size)[:, :rows]

    weight = smooth(np.ones(rows))
    mean = smooth(square) / weight
    swing = (square - mean) * np.exp(-2j * np.pi * hz[:, None] * times)
    return mean, (smooth(swing.real) + 1j * smooth(swing.imag)) / weight


def decoded(
    continuity: np.ndarray, cost: np.ndarray, states: np.ndarray, price: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T,) index of each row's state in the likeliest sequence (Viterbi); over all sequences (forward-backward, Baum et
    al. 1970) (T, K) how probable each row is wrong in each way, and (T, K) how probable that has changed since the row
    before; both 0 where the likeliest sequence has nothing wrong, and so asks for neither. continuity: (T, K, 2, 2) of
    each way; cost: (T, S), 0 in state 0, in which nothing is wrong; states: (S, K); price: (S, S) of going from one to
    another, infinite where that cannot be.

    The hidden state is that of two rows, because a row is expected from the two before it.
    """
    rows, count = cost.shape
    changed = states[:, None] ^ states
    # Three rows in a row, (3, N) states, and which of a way's four costs applies to them, (4 K, N).
    allowed = np.isfinite(price)
    triples = np.nonzero(allowed[:, :, None] & allowed)
    first_two, last_two = changed[triples[:2]], changed[triples[1:]]
    pick = np.eye(4)[2 * first_two + last_two].reshape(len(triples[0]), -1).T
    prices = price[triples[1:]]
    steps = continuity.reshape(rows, -1)

    def costs(first: int, end: int) -> np.ndarray:
        """(end - first, S, S, S) of rows whose states, with the two before them, are these."""
        found = np.full((end - first, count, count, count), np.inf)
        found[:, *triples] = steps[first:end] @ pick + prices + cost[first:end, triples[2]]
        return found

    def cheapest(first: int, end: int, total: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        """Costs (S, S) of the cheapest sequences up to each row before `end`, beginning with `total`, those up to row
        first - 1; and the rows' own costs."""
        totals, own = [total], costs(first, end)
        for step in own:
            totals.append(np.minimum.reduce(totals[-1][:, :, None] + step))
        return totals, own

    def reached(first: int, end: int, share: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        """As `cheapest`, probabilities over all sequences up to each row, and the rows' own weights."""
        shares, own = [share], _weights(costs(first, end))
        for step in own:
            both = np.add.reduce(shares[-1][:, :, None] * step)
            shares.append(both / both.sum())
        return shares, own

    # Of all rows only each part's beginning is kept; what lies between is made again on the way back.
    parts = [(first, min(first + _ROWS, rows)) for first in range(2, rows, _ROWS)]
    totals = [price[0][:, None] + price + cost[0][:, None] + cost[1]]
    for part in parts:
        totals.append(cheapest(*part, totals[-1])[0][-1])
    ending = np.broadcast_to(price[0], price.shape)  # or the part behind a change would be wrong more cheaply
    path = np.zeros(rows, dtype=int)
    path[-2:] = np.unravel_index(int((totals[-1] + ending).argmin()), price.shape)
    likely, turned = np.zeros((rows, states.shape[1])), np.zeros((rows, states.shape[1]))
    # What is right throughout costs nothing, and nothing costs less.
    if not path.any() and totals[-1][0, 0] == 0:
        return path, likely, turned
    for (first, end), total in zip(reversed(parts), totals[-2::-1], strict=True):
        before, own = cheapest(first, end, total)
        for t in range(end - 1, first - 1, -1):
            i, j = path[t - 1 : t + 1]
            path[t - 2] = (before[t - first][:, i] + own[t - first][:, i, j]).argmin()
    if not path.any():
        return path, likely, turned
    shares = [_weights(totals[0])]
    for part in parts:
        shares.append(reached(*part, shares[-1])[0][-1])
    backward = _weights(ending)
    for (first, end), share in zip(reversed(parts), shares[-2::-1], strict=True):
        forward, own = reached(first, end, share)
        behind = [backward]
        for step in own[::-1]:
            both = np.einsum("ijk,jk->ij", step, behind[-1])
            behind.append(both / both.sum())
        backward = behind.pop()
        likely[first:end], turned[first:end], _ = _judged(forward[1:], behind[::-1], states, changed)
    likely[1:2], turned[1:2], likely[:1] = _judged([shares[0]], [backward], states, changed)
    return path, likely, turned


def _judged(
    forward: list[np.ndarray], backward: list[np.ndarray], states: np.ndarray, changed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of rows with these probabilities (S, S) each, (N, K) how probable they are wrong, (N, K) how probable that has
    changed since the row before, and (N, K) how probable the row before is wrong."""
    both = np.array(forward) * np.array(backward)
    both /= both.sum(axis=(1, 2), keepdims=True)
    return both.sum(axis=1) @ states, np.tensordot(both, changed), both.sum(axis=2) @ states


def _weights(cost: np.ndarray) -> np.ndarray:
    """Probabilities of these costs (S, S), or of each row's (N, S, S, S), up to a factor of each."""
    least = cost.min(axis=(-3, -2, -1)[-min(cost.ndim, 3) :], keepdims=True)
    return np.exp(_SHARPNESS * (least - cost))


def _weighed(poses: PoseSequence, swaps: tuple[Swap, ...]) -> tuple[Swap, ...]:
    """The swaps, those of a kind with what speaks against them where turning all of them back makes the take worse.

    At the ends of these rows joints and the lengths of bones leap less when what is turned back was wrong.
    """
    ways, against = _ways(poses), dict[str, tuple[str, ...]]()
    for kind in dict.fromkeys(swap.kind for swap in swaps if swap.certain):
        joints = poses.joints.copy()
        for swap in swaps:
            if swap.kind == kind and swap.certain:
                rows = slice(swap.first_row, swap.last_row + 1)
                joints[rows] = ways[kind].applied(joints[rows])
        turned = poses.with_(joints=joints)
        against[kind] = worsened(poses, turned)
        poses = poses if against[kind] else turned
    return tuple(
        replace(swap, against=against[swap.kind]) if swap.certain and against[swap.kind] else swap
        for swap in swaps
    )


def worsened(before: PoseSequence, after: PoseSequence) -> tuple[str, ...]:
    """What is worse after than before, as clauses; () if nothing. before, after: the same take, but that joints have
    changed places or depth in some rows."""
    worse = []
    old, new = _at_ends(before.joints, after.joints)
    if new > old:
        worse.append("joints would leap farther")
    old, new = _at_ends(_lengths(before)[..., None], _lengths(after)[..., None])
    if new > _STRETCH * old:
        worse.append("bones would change their lengths more")
    legs = kinds(before.layout, False)[0]
    old = alternation(legs.vectors(before.joints), assumed_times(before)).sum()
    new = alternation(legs.vectors(after.joints), assumed_times(after), agreed=0).sum()
    if new < old / 2:
        worse.append("the legs would not alternate as they do in a walk")
    return tuple(worse)


def _at_ends(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Of values (T, N, D) from row to row, the change where it is not the same in both, summed."""
    old, new = (np.nan_to_num(np.linalg.norm(np.diff(x, axis=0), axis=-1)) for x in (before, after))
    steps = ~np.isclose(old.sum(axis=1), new.sum(axis=1), rtol=1e-6, atol=0)
    return float(old[steps].sum()), float(new[steps].sum())


def _lengths(poses: PoseSequence) -> np.ndarray:
    """(T, B) of limb bones."""
    ends = [(f"{side}_{a}", f"{side}_{b}") for side in "lr" for a, b in _BONES]
    bones = [poses.layout.indices(bone) for bone in ends if all(joint in poses.layout for joint in bone)]
    bones = np.array(bones, dtype=int).reshape(-1, 2)
    return np.linalg.norm(poses.joints[:, bones[:, 0]] - poses.joints[:, bones[:, 1]], axis=-1)


def mask_swaps(poses: PoseSequence, swaps: Iterable[Swap]) -> PoseSequence:
    """A copy in which the joints of certain swaps, exchanged or mirrored, are missing; the history lists them."""
    ways = _ways(poses)
    joints = poses.joints.copy()
    feet = None if poses.feet is None else poses.feet.copy()
    certain = [swap for swap in swaps if swap.certain]
    for swap in certain:
        way, rows = ways[swap.kind], slice(swap.first_row, swap.last_row + 1)
        joints[rows, way.pairs if way.exchanged else way.pairs[:, 0]] = np.nan
        if feet is not None and way.limb != "arm":
            feet[rows] = np.nan
    return poses.with_(joints=joints, feet=feet).noted("swaps", masked=as_frames(poses, certain))


def _ways(poses: PoseSequence) -> dict[str, Kind]:
    """The ways to be wrong by their names."""
    return {way.name: way for way in kinds(poses.layout, has_depth(poses))}


def as_frames(poses: PoseSequence, swaps: Iterable[Swap]) -> list[dict[str, Any]]:
    """Plain values, with the video's frame numbers beside the rows."""
    return [
        {
            **asdict(swap),
            "evidence": round(swap.evidence, 1),
            "probability": round(swap.probability, 2),
            "change": round(swap.change, 2),
            "first_frame": int(poses.frame_index[swap.first_row]),
            "last_frame": int(poses.frame_index[swap.last_row]),
        }
        for swap in swaps
    ]


def wrong_rows(poses: PoseSequence, swaps: Iterable[Swap]) -> np.ndarray:
    """(T,) True in rows of those that are certain."""
    wrong = np.zeros(len(poses), dtype=bool)
    for swap in swaps:
        wrong[swap.first_row : swap.last_row + 1] |= swap.certain
    return wrong


def described(poses: PoseSequence, swaps: Iterable[Swap]) -> str:
    """Each kind with its frames, such as "legs exchanged in frames 17-21 from 0.57 s, 53 at 1.77 s"; "" without.
    Improbable ones come after, with what is unclear."""
    beside = ", or in those beside them (which is unclear)"
    ranges: dict[tuple[str, str], list[str]] = {}
    frames = [int(frame) for frame in poses.frame_index]
    for swap in sorted(swaps, key=lambda swap: (swap.probability < _CERTAIN, swap.one_sided, swap.first_row)):
        first, last = frames[swap.first_row], frames[swap.last_row]
        span = f"{first}" if first == last else f"{first}-{last}"
        if poses.time_s is not None:
            span += f" {'at' if first == last else 'from'} {poses.time_s[swap.first_row]:.2f} s"
        perhaps = "perhaps " if swap.probability < _CERTAIN and not swap.one_sided else ""
        what = f"{perhaps}{swap.kind} in frames"
        ranges.setdefault((what, beside if swap.one_sided else ""), []).append(span)
    said = []
    for (what, or_where), spans in ranges.items():
        single = len(spans) == 1 and "-" not in spans[0]
        more = ", ..." if len(spans) > _MOST_RANGES else ""
        said.append(
            f"{what.removesuffix('s') if single else what} {', '.join(spans[:_MOST_RANGES])}{more}{or_where}"
        )
    return "; ".join(said)


def doubts(poses: PoseSequence, swaps: Iterable[Swap]) -> tuple[str, ...]:
    """What to say of those that are not certain: improbable ones, and all of a kind that something speaks against."""
    swaps = tuple(swaps)
    improbable = [swap for swap in swaps if not (swap.certain or swap.against)]
    said = [f"{described(poses, improbable)}; this is uncertain"] if improbable else []
    for kind in dict.fromkeys(swap.kind for swap in swaps if swap.against):
        group = [swap for swap in swaps if swap.kind == kind and swap.against]
        against = " and ".join(group[0].against)
        said.append(f"{described(poses, group)}, but the other way round {against}")
    return tuple(said)


def treated(
    poses: PoseSequence | None, keypoints: PoseSequence | None, how: Swaps
) -> tuple[PoseSequence | None, PoseSequence | None, tuple[Notice, ...], tuple[Swap, ...] | None]:
    """Poses and keypoints of a take after their swaps were told or masked, what to say of it, and what find_swaps finds
    in the poses that are returned: None where they were changed, and it has to be asked again.

    A lift of exchanged keypoints is wrong in all its joints. So poses that came beside such keypoints are missing in
    those frames, unless swaps are only told.
    """
    notices: list[Notice] = []
    found = None
    if keypoints is not None:
        keypoints, swaps, said = _treated(keypoints, "keypoints", how)
        notices += said
        frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
        if poses is not None and len(frames):
            poses, beside = _beside(poses, frames, how)
            notices.append(beside)
    if poses is not None:
        poses, found, said = _treated(poses, "poses", how)
        notices += said
        if how != "report" and any(swap.certain for swap in found):
            found = None
    return poses, keypoints, tuple(notices), found


def _treated(
    poses: PoseSequence, what: str, how: Swaps
) -> tuple[PoseSequence, tuple[Swap, ...], list[Notice]]:
    """Poses after treatment, the swaps that were found, and what to say."""
    swaps = find_swaps(poses)
    certain = tuple(swap for swap in swaps if swap.certain)
    ways = _ways(poses) if swaps else {}
    left = [swap for swap in swaps if how == "report" or not swap.certain]
    exchanged = [
        (ways[swap.kind].limb, *poses.frame_index[[swap.first_row, swap.last_row]].tolist())
        for swap in left
        if ways[swap.kind].exchanged
    ]
    values: dict[str, Any] = {"what": what, "exchanged": exchanged}
    notices = [notice("swaps-doubtful", doubt=doubt, **values) for doubt in doubts(poses, swaps)]
    if certain:
        wrong = int(wrong_rows(poses, swaps).sum())
        values |= {"swaps": described(poses, certain), "wrong": wrong, "of": len(poses)}
        notices.insert(0, notice("swaps-found" if how == "report" else "swaps-masked", **values))
    if how == "report":
        poses = poses.noted("swaps", found=as_frames(poses, swaps)) if swaps else poses
    elif certain:
        poses = mask_swaps(poses, certain)
    return poses, swaps, notices


def in_doubt(take: Take) -> dict[str, np.ndarray]:
    """{"leg" or "arm": (T,) bool} in which rows of the poses these limbs may be exchanged: what `treated` has left of
    theirs, and of the keypoints if this run has lifted them."""
    poses = take.need("poses")
    doubt: dict[str, np.ndarray] = {}
    of = ("poses", "keypoints") if poses.made_by.in_run else ("poses",)
    for limb, first, last in left_exchanged(take.said, of):
        rows = (first <= poses.frame_index) & (poses.frame_index <= last)
        doubt[limb] = doubt.get(limb, False) | rows
    return doubt


def left_exchanged(
    said: Iterable[Notice], of: Collection[str] = ("poses", "keypoints")
) -> list[tuple[str, int, int]]:
    """("leg" or "arm", the first frame, the last) of limbs that may be exchanged, and were left so."""
    told = (each.values for each in said if each.code in ("swaps-found", "swaps-doubtful"))
    return [span for values in told if values.get("what") in of for span in values.get("exchanged", ())]


def _beside(poses: PoseSequence, frames: np.ndarray, how: Swaps) -> tuple[PoseSequence, Notice]:
    """Poses whose keypoints are exchanged in these frames."""
    wrong = np.isin(poses.frame_index, frames)
    if how == "report":
        return poses, notice("swapped-keypoints", wrong=int(wrong.sum()))
    masked = poses.mapped(lambda points: np.where(wrong[:, None, None], np.nan, points))
    count = int(wrong.sum())
    return masked.noted("swaps", rows_masked=count), notice("masked-with-keypoints", wrong=count)
