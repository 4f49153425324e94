"""Left and right exchanged, or depth turned over, for some rows of a take: found by continuity.

An estimator that takes the left leg for the right one makes both legs leap there and back; one that takes a limb's
depth for its opposite makes it leap through the plane of the image. Both only change the sign of vectors: from one
limb to the other, or from a limb's root to its joints along the view. In which way a row is wrong is a hidden state,
and the likeliest states (Viterbi 1967) are those in which these vectors move on steadily. A vector is expected where
its velocity takes it, unless that is a leap; the distance from there over its usual one is judged by the Cauchy
distribution, whose tails let a real jerk or a bad point pass. Every change of state has its price. Anatomy
(checks.handedness_cues) and the rhythm of a walk (alternation.py) tip the scale where continuity leaves it open, and
never alone. How probable a state is over all sequences (forward-backward) tells what is certain: that limbs changed
places is often clear when it is not on which side of the change they are wrong, least of all of a long run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..core.anthropometry import trunk_length
from ..core.blocks import blocks
from ..core.frames import CAMERA
from ..core.layouts import Layout
from ..core.pose import PoseSequence
from .alternation import alternation
from .checks import handedness_cues, without_made_nose
from .filters import stretches
from .hidden_states import SHARPNESS, decoded

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


@dataclass(frozen=True)
class Swap:
    """Rows first_row to last_row, both included, that are wrong in one way.

    kind: the name of one of `kinds`. evidence: log-likelihood that continuity gains when they are put right.
    probability: that these rows are the wrong ones, the median over them; of a long exchange no more than anatomy and
    rhythm say. change: that right and wrong change places at each of their ends inside the clip, whichever is which.
    """

    kind: str
    first_row: int
    last_row: int
    evidence: float
    probability: float = 1.0
    change: float = 1.0

    @property
    def certain(self) -> bool:
        """Whether the odds that these rows are wrong are ten to one or better: others are told and left as they are."""
        return self.probability >= _CERTAIN

    @property
    def one_sided(self) -> bool:
        """Whether something changed for certain, but not which side of the change is wrong."""
        return not self.certain and self.change >= _CERTAIN

    def __len__(self) -> int:
        return self.last_row - self.first_row + 1


@dataclass(frozen=True, eq=False)
class Kind:
    """One way to be wrong, which is also its own repair: vectors between joints change their sign.

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
    """Runs of rows in which limbs are exchanged or, in 3D, mirrored in depth, in the order in which to repair them:
    first certain ones, then those that are more likely than not, last joints that leap (`_leapt`).

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
    return tuple(found)


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
    odds = -SHARPNESS * np.take_along_axis(cost, path[:, None], axis=1)  # logarithms, by anatomy and rhythm
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
