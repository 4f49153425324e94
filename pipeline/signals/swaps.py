"""Limbs that are wrong for some rows of a take: left and right exchanged, or both on one.

An estimator that takes the left leg for the right one makes both legs leap there and back, which changes the sign of
the vectors from one limb to the other. Whether a row is wrong is a hidden state, and the likeliest states (Viterbi
1967) are those in which these vectors move on steadily. A vector is expected where its velocity takes it, unless that
is a leap; the distance from there over its usual one is judged by the Cauchy distribution, whose tails let a real jerk
or a bad point pass. Every change of state has its price, and anatomy (checks.handedness_cues) tips the scale where
continuity leaves it open.

That limbs changed places is often clear when it is not on which side of the change they are wrong, least of all of a
long run. Nothing is put right: frames are told, and their angles withheld.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from ..core.anthropometry import trunk_length
from ..core.blocks import blocks
from ..core.frames import CAMERA
from ..core.layouts import ARM, LEG, TRUNK_CORNERS, Layout
from ..core.limits import limit
from ..core.messages import first_few
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import norm
from .checks import handedness_cues, without_made_nose
from .filters import breaks, stretches

# What goes with a limb's end: exchanged ankles take heels and toes along.
_WITH_END = {"ankle": ("big_toe", "small_toe", "heel", "foot_index"), "wrist": ("pinky", "index", "thumb")}
# Of a pair that is exchanged by itself, the joints that show it: the two knees lie apart in much the same direction as
# the two ankles, elbows as wrists.
_BESIDE = {"knee": "ankle", "ankle": "knee", "elbow": "wrist", "wrist": "elbow"}
_LOOKED_AT = 1024  # rows whose states are compared at once
_MOST_RANGES = 8  # named of one kind
How = Literal["limbs", "alone", "on one"]
# Of each way to be wrong, what is exchanged or on one: limb, and its joints from the trunk outwards.
_WAYS: dict[How, dict[str, tuple[str, tuple[str, ...]]]] = {
    "limbs": {"legs exchanged": ("leg", LEG), "arms exchanged": ("arm", ARM)},
    "alone": {
        "knees exchanged": ("leg", ("knee",)),
        "ankles exchanged": ("leg", ("ankle",)),
        "elbows exchanged": ("arm", ("elbow",)),
        "wrists exchanged": ("arm", ("wrist",)),
    },
    "on one": {"legs both on one": ("leg", LEG[1:]), "arms both on one": ("arm", ARM[1:])},
}
_LIMBS = {name: limb for ways in _WAYS.values() for name, (limb, _) in ways.items()}


@dataclass(frozen=True)
class Swap:
    """Rows first_row to last_row, both included, that are wrong in one way.

    kind: the name of one of `kinds`. evidence: log-likelihood that continuity gains when they are turned back. certain:
    whether it is these rows that are wrong; of others only that something changes at their ends.
    """

    kind: str
    first_row: int
    last_row: int
    evidence: float
    certain: bool = True


@dataclass(frozen=True, eq=False)
class Kind:
    """One way to be wrong: of pairs (M, 2) of joints of a limb, "leg" or "arm", which change places, or are both where
    one is. price: log-likelihood that each end of a run must gain."""

    name: str
    pairs: np.ndarray
    limb: str
    price: float

    def vectors(self, joints: np.ndarray) -> np.ndarray:
        """(T, M, D) what changes its sign. joints: (T, J, D)."""
        return joints[:, self.pairs[:, 0]] - joints[:, self.pairs[:, 1]]

    def applied(self, joints: np.ndarray) -> np.ndarray:
        """joints (T, J, D), or their confidences (T, J), in which every row is turned from right to wrong, or back."""
        turned = joints.copy()
        turned[:, self.pairs] = joints[:, self.pairs[:, ::-1]]
        return turned


def kinds(layout: Layout, how: How = "limbs") -> tuple[Kind, ...]:
    """The ways to be wrong, by pairs of joints that the layout has. how: "limbs", legs or arms exchanged; "alone",
    knees, ankles, elbows or wrists exchanged alone; "on one", both legs, or arms, where one is, in all their joints but
    hips and shoulders. Heels and toes go with the ankles, fingers with the wrists."""
    ways, price = [], limit("swaps.price-alone") if how == "alone" else limit("swaps.price")
    for name, (limb, parts) in _WAYS[how].items():
        every = [each for part in parts for each in (part, *_WITH_END.get(part, ())) if f"l_{each}" in layout]
        pairs = [layout.indices((f"l_{each}", f"r_{each}")) for each in every]
        if how != "alone" or f"l_{parts[0]}" in layout:
            ways.append(Kind(name, np.array(pairs, dtype=int).reshape(-1, 2), limb, price))
    return tuple(ways)


def find_swaps(poses: PoseSequence) -> tuple[Swap, ...]:
    """Runs of rows in which limbs, or one pair of their joints, are exchanged, or both on one, clip by clip and by
    their rows.

    poses: 2D keypoints of any layout, or H36M17; a layout without hips or shoulders has no swaps. Clips between seams,
    missing frames and empty rows are judged one by one; NaN joints are ignored. A swap as long as its clip has no ends
    and is not found: checks.chirality finds it.
    """
    if any(joint not in poses.layout for joint in TRUNK_CORNERS):
        return ()
    poses = without_made_nose(poses.without_feet)
    joints = poses.joints.astype(np.float64)
    frames = poses.frame_index / limit("swaps.rate")
    times = frames if poses.time_s is None else poses.time_s.astype(np.float64)
    layout = poses.layout
    ways = {way.name: way for how in _WAYS for way in kinds(layout, how)}
    # Of a lift of wrong keypoints depth may be as it was.
    axes = 2 if poses.frame.axes == CAMERA.axes else poses.frame.dims
    swaps: list[Swap] = []
    for first, last in _clips(poses):
        clip, seconds = joints[first:last], times[first:last]
        image, size = clip[..., :axes], float(np.nan_to_num(trunk_length(clip, layout)))
        of_clip = _limbs(clip, seconds, layout, size)
        for swap in (
            *_alone(image, seconds, layout, size),
            *_leapt(image, seconds, layout, size),
            *_collapsed(image, seconds, layout, size),
        ):
            if not any(_touch(swap, other, ways) for other in of_clip):
                of_clip.append(swap)
        swaps += [
            replace(swap, first_row=swap.first_row + first, last_row=swap.last_row + first)
            for swap in sorted(of_clip, key=lambda swap: swap.first_row)
        ]
    return tuple(swaps)


def _touch(swap: Swap, other: Swap, ways: Mapping[str, Kind]) -> bool:
    """Whether two swaps of one limb share rows or are next to each other, but for joints that one has and the other
    has not."""
    beside = swap.first_row - 1 <= other.last_row and other.first_row <= swap.last_row + 1
    return beside and bool(np.isin(ways[swap.kind].pairs, ways[other.kind].pairs).any())


def _clips(poses: PoseSequence) -> list[tuple[int, int]]:
    """[first, last) of the stretches without a clip boundary, a missing frame or an empty row."""
    empty = np.flatnonzero(np.isnan(poses.joints).all(axis=(1, 2)))
    edges = sorted({0, len(poses), *breaks(poses), *empty.tolist(), *(empty + 1).tolist()})
    return [(a, b) for a, b in pairwise(edges) if b - a >= 3]


def _limbs(clip: np.ndarray, times: np.ndarray, layout: Layout, size: float) -> list[Swap]:
    """Limbs exchanged in one clip (T, J, D). size: of the trunk."""
    ways, states = kinds(layout), np.array([[0, 0], [1, 0], [0, 1], [1, 1]])

    def turned(part: np.ndarray, state: np.ndarray) -> np.ndarray:
        for k in np.flatnonzero(state):
            part = ways[k].applied(part)
        return part

    # How much a row looks like a body with its left and right as they are then; 0 where unknown.
    anatomy = [
        np.nansum(handedness_cues(np.stack([turned(clip[rows], state) for state in states]), layout), axis=-1)
        for rows in blocks(len(clip), _LOOKED_AT)
    ]
    return _runs(clip, times, [ways], states, np.concatenate([part.T for part in anatomy])[None], size)


def _alone(image: np.ndarray, times: np.ndarray, layout: Layout, size: float) -> list[Swap]:
    """Pairs of joints that are exchanged alone."""
    ways, cues = kinds(layout, "alone") if size else (), []
    for way in ways:
        beside = _BESIDE[way.name.removesuffix("s exchanged")]
        other = layout.indices([f"{side}_{beside}" for side in "lr"])
        apart = way.vectors(image)[:, 0] * (image[:, other[0]] - image[:, other[1]])
        cues.append(np.clip(np.nan_to_num(apart.sum(axis=-1)) / (limit("swaps.same-way") * size**2), -1, 1))
    if not cues:
        return []
    anatomy = np.stack([cues, np.negative(cues)], axis=-1)
    return _runs(image, times, [(way,) for way in ways], np.array([[0], [1]]), anatomy, size)


def _runs(
    clip: np.ndarray,
    times: np.ndarray,
    limbs: Sequence[tuple[Kind, ...]],
    states: np.ndarray,
    anatomy: np.ndarray,
    size: float,
) -> list[Swap]:
    """Of L limbs, or pairs of them, that are judged each by itself, and have K ways of one price each: the runs of each
    way in the likeliest states (S, K) of each row. anatomy: (L, T, S), how much the row looks like a body in each
    state."""
    price = limbs[0][0].price
    vectors, floor = [[way.vectors(clip) for way in ways] for ways in limbs], limit("swaps.nearest") * size
    continuity = np.array([[_continuity(way, times, floor) for way in ways] for ways in vectors])
    continuity = np.moveaxis(continuity, 2, 1)
    seconds = np.gradient(times)[:, None]
    cost = seconds * limit("swaps.anatomy") * (anatomy[..., :1] - anatomy)
    wrong = seconds * limit("swaps.per-second") * states.any(axis=1)
    paths = likeliest(continuity, cost + wrong, states, price)
    odds = -np.take_along_axis(cost, paths[..., None], axis=2)  # logarithms, by anatomy
    runs, certain = [], np.log(limit("swaps.certain"))
    for limb, k in np.ndindex(len(limbs), states.shape[1]):
        on = np.concatenate([[0], states[paths[limb], k], [0, 0, 0]])
        spans = np.flatnonzero(np.diff(on)).reshape(-1, 2)
        beside = np.diff(np.concatenate([[0], spans.ravel(), [len(clip)]]))[::2]  # rows that are right
        for i, (first, end) in enumerate(spans):
            rows = np.arange(max(first, 2), min(end + 2, len(clip)))
            before, mid, now = on[rows - 1], on[rows], on[rows + 1]
            evidence = -float(continuity[limb, rows, k, before ^ mid, mid ^ now].sum())
            if evidence < price:
                continue
            # That it is short says nothing of a run as long as a turn, or longer than what is beside it.
            fewest = min((count for count in beside[i : i + 2] if count), default=0)
            open_side = seconds[first:end].sum() > limit("swaps.turn") or end - first > fewest
            sure = odds[limb, first:end].sum() if open_side else evidence - price
            name = limbs[limb][k].name
            runs.append(Swap(name, int(first), int(end - 1), evidence, bool(sure >= certain)))
    return runs


def _leapt(image: np.ndarray, times: np.ndarray, layout: Layout, size: float) -> list[Swap]:
    """Where two joints of one name leap, each to where the other one was: the rows from there to where they cross,
    before or after it, whichever is sooner. Which of these are wrong nothing says."""
    swaps: list[Swap] = []
    step_s = float(np.median(np.diff(times)))
    for way in kinds(layout) if size else ():
        ends = image[:, way.pairs[1:]] / size
        apart, middle = ends[:, :, 0] - ends[:, :, 1], ends.mean(axis=2)
        steps = norm(np.diff(apart, axis=0)).T / step_s
        most = limit("swap-leaps.usual")
        fast = [
            np.percentile(step[np.isfinite(step)], most) if np.isfinite(step).any() else np.inf
            for step in steps
        ]
        least = np.maximum(limit("swap-leaps.speed"), limit("swap-leaps.faster") * np.array(fast))
        wrong = np.zeros(len(image), dtype=bool)
        for rows in range(1, min(max(round(limit("swap-leaps.within") / step_s), 1), len(image) - 1) + 1):
            old, new = apart[:-rows], apart[rows:]
            lengths = norm(np.stack([old, new]))
            leap = norm(new - old)
            over = leap > least * (times[rows:] - times[:-rows])[:, None]
            over &= norm(middle[rows:] - middle[:-rows]) < limit("swap-leaps.in-place") * leap
            alike = limit("swap-leaps.alike") * lengths.max(axis=0)
            over &= lengths.min(axis=0) > np.maximum(limit("swap-leaps.apart"), alike)
            over &= (old * new).sum(axis=-1) < limit("swap-leaps.opposite") * lengths.prod(axis=0)
            for row, joint in np.argwhere(over):
                axis, end = new[row, joint] - old[row, joint], row + rows
                along = apart[:, joint] @ axis / (axis @ axis)
                before, after = _until_crossed(-along[row::-1]), _until_crossed(along[end:])
                # Where the clip ends before they cross nothing says that it would have been soon.
                sooner = (before > row, before) < (after >= len(image) - end, after)
                wrong[slice(row + 1 - before, end) if sooner else slice(row + 1, end + after)] = True
        spans = stretches(wrong).tolist()
        swaps += [Swap(way.name, first, end - 1, 0.0, certain=False) for first, end in spans]
    return swaps


def _until_crossed(along: np.ndarray) -> int:
    """How many of the first rows (T,) have the limbs apart, by the median of three."""
    around = np.pad(along, 1, mode="edge")
    apart = np.median([around[:-2], along, around[2:]], axis=0) > limit("swap-leaps.crossed")
    return int(np.argmin(np.append(apart, False)))


def _collapsed(image: np.ndarray, times: np.ndarray, layout: Layout, size: float) -> list[Swap]:
    """Where both legs, or arms, lie on one, in which case the other was not found. Limbs that are side by side, as of
    who stands or squats seen from the side, come there and part without a leap."""
    swaps: list[Swap] = []
    for way in kinds(layout, "on one") if size else ():
        ends = image[:, way.pairs[:2]] / size
        apart = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1)
        together = (apart < limit("both-on-one.near")).all(axis=1)
        for first, end in stretches(together).tolist():
            lasts = times[end - 1] - times[first] >= limit("both-on-one.passing")
            if lasts and (
                _parts(apart[end - 2 :], times[end - 2 :])
                or _parts(apart[first + 1 :: -1], -times[first + 1 :: -1])
            ):
                swaps.append(Swap(way.name, first, end - 1, 0.0))
    return swaps


def _parts(apart: np.ndarray, times: np.ndarray) -> bool:
    """Whether limbs, whose joints are so far apart (T, M), are together in the first two rows and then, in one step,
    farther apart than any limb gets in that time, and stay so: who throws or kicks needs more steps."""
    if len(apart) < 5:
        return False
    steps = np.abs(np.diff(apart[:5], axis=0))
    leap = np.median(apart[2:5], axis=0) - apart[1]
    far = leap > max(limit("both-on-one.far"), limit("both-on-one.speed") * (times[2] - times[1]))
    at_once = steps[1] > limit("both-on-one.one-step") * np.maximum(steps[0], steps[2])
    return bool((far & at_once).any())


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
        trust = 1 / (1 + (move**2).sum(axis=-1) / (limit("swaps.leap") * usual_step) ** 2)
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
    length = norm(vectors)
    visible = np.isfinite(length).any(axis=0)
    median = np.full(length.shape[1], np.inf)
    middle = np.median if np.isfinite(length).all() else np.nanmedian  # which takes many times as long
    median[visible] = np.maximum(middle(length[:, visible], axis=0), floor)
    return np.where(median > 0, median, np.inf)


def likeliest(continuity: np.ndarray, cost: np.ndarray, states: np.ndarray, price: float) -> np.ndarray:
    """(L, T) index of each row's state in the likeliest sequence (Viterbi), of L limbs each by itself. continuity: (L,
    T, K, 2, 2) of each way; cost: (L, T, S), 0 in state 0, in which nothing is wrong; states: (S, K); price: of each
    change.

    The hidden state is that of two rows, because a row is expected from the two before it.
    """
    limbs, rows, count = cost.shape
    changed = states[:, None] ^ states
    change = price * np.asarray(changed.any(axis=-1))
    # Which of a way's four costs applies to three rows in a row, (4 K, S, S, S).
    pick = np.moveaxis(np.eye(4)[2 * changed[:, :, None] + changed], (-2, -1), (0, 1))
    pick = pick.reshape(-1, count**3)
    steps = continuity.reshape(limbs, rows, -1)
    total = change[0][:, None] + change + cost[:, 0, :, None] + cost[:, 1, None]
    come_from = np.zeros((rows, limbs, count, count), dtype=np.uint8)
    for block in blocks(rows, _LOOKED_AT):
        own = (steps[:, block] @ pick).reshape(limbs, -1, count, count, count)
        own += change + cost[:, block, None, None]
        for t in range(max(block.start, 2), min(block.stop, rows)):
            every = total[..., None] + own[:, t - block.start]
            come_from[t] = every.argmin(axis=1)
            total = every.min(axis=1)
    total = total + change[0]  # or the part behind a change would be wrong more cheaply
    paths = np.zeros((limbs, rows), dtype=int)
    for path, ends, come in zip(paths, total, np.moveaxis(come_from, 1, 0), strict=True):
        path[-2:] = np.unravel_index(int(ends.argmin()), change.shape)
        for t in range(rows - 1, 1, -1):
            path[t - 2] = come[t, path[t - 1], path[t]]
    return paths


def as_frames(poses: PoseSequence, swaps: Iterable[Swap]) -> list[dict[str, Any]]:
    """Plain values, with the video's frame numbers beside the rows."""
    return [
        {
            **asdict(swap),
            "evidence": round(swap.evidence, 1),
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
    """Each kind with its frames, such as "legs exchanged in frames 17-21 from 0.57 s, 53 at 1.77 s"; "" without."""
    ranges: dict[str, list[str]] = {}
    for swap in sorted(swaps, key=lambda swap: swap.first_row):
        first, last = poses.frame_index[[swap.first_row, swap.last_row]].tolist()
        span = f"{first}" if first == last else f"{first}-{last}"
        if poses.time_s is not None:
            span += f" {'at' if first == last else 'from'} {poses.time_s[swap.first_row]:.2f} s"
        ranges.setdefault(swap.kind, []).append(span)
    return "; ".join(
        f"{kind} in {'frames' if len(spans) > 1 or '-' in spans[0] else 'frame'} {first_few(spans, _MOST_RANGES)}"
        for kind, spans in ranges.items()
    )


def notices_of(poses: PoseSequence, swaps: Sequence[Swap], what: str) -> list[Notice]:
    """Notices of swaps in poses or keypoints, as `what` calls them."""
    certain, doubtful = ([swap for swap in swaps if swap.certain == sure] for sure in (True, False))
    notices = []
    if certain:
        wrong = int(wrong_rows(poses, swaps).sum())
        values = {"swaps": described(poses, certain), "wrong": wrong, "of": len(poses)}
        notices.append(notice("swaps-found", what=what, **values))
    if doubtful:
        notices.append(notice("swaps-doubtful", what=what, doubt=described(poses, doubtful)))
    return notices


def swaps_of_take(
    poses: PoseSequence | None, keypoints: PoseSequence | None
) -> tuple[list[Notice], tuple[Swap, ...] | None]:
    """Notices of swaps in a take's keypoints and poses, which have each limb that is wrong with its first and last
    frame ("exchanged"): angles are withheld there. And the swaps of the poses."""
    notices: list[Notice] = []
    if keypoints is not None:
        swaps, notices = _told(keypoints, "keypoints")
        frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
        # A lift of exchanged keypoints is wrong in all its joints.
        if poses is not None and (wrong := int(np.isin(poses.frame_index, frames).sum())):
            notices.append(notice("swapped-keypoints", wrong=wrong))
    if poses is None:
        return notices, None
    swaps, of_poses = _told(poses, "poses")
    return [*notices, *of_poses], swaps


def _told(poses: PoseSequence, what: str) -> tuple[tuple[Swap, ...], list[Notice]]:
    swaps = find_swaps(poses)
    exchanged = [
        (_LIMBS[swap.kind], *poses.frame_index[[swap.first_row, swap.last_row]].tolist()) for swap in swaps
    ]
    told = notices_of(poses, swaps, what)
    return swaps, [replace(each, values={**each.values, "exchanged": exchanged}) for each in told]
