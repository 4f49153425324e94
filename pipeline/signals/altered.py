"""What was done to points after an estimator had found them, by arithmetic: what no recording gives.

Points that lie exactly on lines were filled in, joints that stay at one point are one joint twice, joints whose bones
are shorter in each other's place have exchanged names, equal rows and limbs were copied, a whole body that moves
farther at every so many-th row has lost rows, and points without any noise were smoothed. Points are 2D or 3D, in any
layout.

models/limits.toml says what each limit was chosen by.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from ..core.anthropometry import trunk_length
from ..core.figures import label_of
from ..core.layouts import ARM, COCO17, LEG, LIMBS, TRUNK_CORNERS, Layout
from ..core.limits import limit
from ..core.messages import first_few
from ..core.notices import Notice, Weight, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, norm, rotate
from .checks import empty_rows
from .filters import on_lines, ranked, stretches

_ENOUGH = limit("rows.tell")
_SIDES = ("r", "l")
_ENDS = tuple(f"{side}_{part}" for side in _SIDES for part in ("ankle", "wrist"))
_OF_FEET = ("ankle", "heel", "toe")
_ON_LINE, _BENDS = limit("joints-filled.on-line"), limit("joints-filled.bends")


def altered(points: PoseSequence) -> tuple[np.ndarray, list[Notice]]:
    """(T, J) which joints nobody saw, whatever the file says, and notices of them: they are to be treated as gaps."""
    unseen, notices = np.zeros(points.joints.shape[:2], dtype=bool), []
    for look in (_filled, _coinciding, _misnamed):
        of_look, told = look(points)
        unseen, notices = unseen | of_look, notices + told
    return unseen, notices


def without_altered(points: PoseSequence, unseen: np.ndarray) -> PoseSequence:
    """The points without these joints (T, J)."""
    if not unseen.any():
        return points
    return points.without(unseen).noted("altered", values=int(unseen.sum()))


def alterations(points: PoseSequence) -> list[Notice]:
    """Notices of copies, repeats, rows lost and added, noise and smoothing, which leave no gaps."""
    looks = (_equal_rows, _copied, _rows_lost, _rows_added, _only_noise, _smoothed)
    return [each for look in looks[: None if len(points) >= _ENOUGH else 1] for each in look(points)]


def _filled(points: PoseSequence) -> tuple[np.ndarray, list[Notice]]:
    """Points on straight lines in time, or held where they were, between two that are not: a gap was filled.

    How many points a line needs depends on how often one is on a line by chance, which lines of any length show alike.
    A row that repeats the one before in all joints is a repeated image, and another matter. So is a foot on the
    floor of a world: programs that make motion, or clean it, put the standing foot exactly there.
    """
    joints = points.joints.astype(np.float64)
    unseen = np.zeros(joints.shape[:2], dtype=bool)
    least = limit("joints-filled.points")
    if len(points) < 2 * least:
        return unseen, []
    bend, moved = _bends_and_moves(joints)
    on_line = bend <= _ON_LINE
    lines = [(joint, *line) for joint, rows in enumerate(on_line.T) for line in stretches(rows).tolist()]
    chance = (len(lines) + 1) / (int((bend > _ON_LINE).sum()) + 1)
    few = chance < limit("joints-filled.stands-still")
    by_chance = np.log(limit("joints-filled.by-chance") / unseen.size) / np.log(chance) if few else np.inf
    fewest, usual_bend = max(least, by_chance), limit("joints-filled.usual-bend")
    planted = _planted(points)
    for joint, first, stop in lines:
        if stop - first < fewest or not (bend[[first - 1, stop], joint] > _BENDS).all():
            continue
        if planted[first:stop, joint].all():
            continue
        way = moved[first : stop + 1, joint]
        # A joint that keeps still in whole pixels is on lines too.
        if way.mean() > _ON_LINE or np.nanmedian(bend[:, joint]) > usual_bend:
            unseen[first : stop + (way.max() == 0), joint] = True
    if not unseen.any():
        return unseen, []
    first = int(np.flatnonzero(unseen.any(axis=1))[0])
    values = {"count": int(unseen.sum()), "joints": _listed(points.layout, unseen)}
    return unseen, [notice("joints-filled", rows=[first], **values)]


def _planted(points: PoseSequence) -> np.ndarray:
    """(T, J) where a joint of the feet is as low as in any row, in poses whose path in a world is known."""
    planted = np.zeros(points.joints.shape[:2], dtype=bool)
    feet = points.layout.indices([name for name in points.layout.joints if name.endswith(_OF_FEET)])
    if points.frame.family != "world" or points.frame.origin == "pelvis":
        return planted
    height = rotate(points.frame.basis.T, points.joints[:, feet].astype(np.float64))[..., 2]
    trunk = trunk_length(points.joints, points.layout)
    planted[:, feet] = height - np.fmin.reduce(height) < limit("joints-filled.planted") * trunk
    return planted


def _bends_and_moves(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, J) second differences and (T, J) movements since the row before of joints (T, J, D), in steps of the file's
    numbers, of the axis that has most; NaN at the ends, beside gaps, and about rows that repeat the one before."""
    step = _step_of_numbers(joints)
    bend, moved = np.full(joints.shape[:2], np.nan), np.full(joints.shape[:2], np.nan)
    bend[1:-1] = (np.abs(np.diff(joints, 2, axis=0)) / step).max(axis=-1)
    moved[1:] = (np.abs(np.diff(joints, axis=0)) / step).max(axis=-1)
    repeats = np.flatnonzero(np.nan_to_num(moved).max(axis=1) == 0)
    bend[repeats], bend[np.maximum(repeats - 1, 0)] = np.nan, np.nan
    return bend, moved


def _step_of_numbers(joints: np.ndarray) -> np.ndarray:
    """(D,) the least distance of two different numbers of each axis of joints (T, J, D): to which they were rounded."""
    steps = []
    for axis in np.moveaxis(joints, -1, 0):
        values = np.unique(axis[np.isfinite(axis)])
        precision = 1e-6 * float(np.abs(values).max(initial=0.0)) + 1e-30  # of single precision, and more
        gaps = np.diff(values)
        steps.append(max(float(gaps[gaps > precision].min(initial=np.inf)), precision))
    return np.array([step if np.isfinite(step) else 1.0 for step in steps])


def _coinciding(points: PoseSequence) -> tuple[np.ndarray, list[Notice]]:
    """Joints of limbs, or one of them and the nose, that stay at one point: one of the two was not found. The one that
    is nearer to the trunk stays."""
    unseen, notices = np.zeros(points.joints.shape[:2], dtype=bool), []
    names = [name for name in ("nose", *LIMBS) if name in points.layout and name not in points.derived]
    joints = points.joints[:, points.layout.indices(names)].astype(np.float64)
    step, there, fewest = _step_of_numbers(joints), ~empty_rows(points), limit("joints-coincide.rows")
    for (i, first), (k, second) in combinations(enumerate(names), 2):
        together = (np.abs(joints[:, i] - joints[:, k]) < step).all(axis=-1) & there
        spans = [span for span in stretches(together).tolist() if span[1] - span[0] >= fewest]
        if not spans:
            continue
        rows = np.concatenate([np.arange(*span) for span in spans])
        gone = [name for name in (first, second) if name not in TRUNK_CORNERS and name != "nose"]
        unseen[rows[:, None], points.layout.indices(gone)] = True
        values = {"first": label_of(first), "second": label_of(second), "count": len(rows)}
        notices.append(notice("joints-coincide", rows=[spans[0][0]], **values))
    return unseen, notices


def _misnamed(points: PoseSequence) -> tuple[np.ndarray, list[Notice]]:
    """Two joints of limbs and trunk whose bones would be shorter, over the take, and more alike from frame to frame in
    each other's place: their names are exchanged. Who folds the arms or crosses the legs has shorter ones too, but
    these do not keep their lengths."""
    unseen, notices = np.zeros(points.joints.shape[:2], dtype=bool), list[Notice]()
    names = [name for name in LIMBS if name in points.layout]
    if len(points) < _ENOUGH:
        return unseen, notices
    joints = points.joints[:, points.layout.indices(names)].astype(np.float64)
    length, varies = np.full((2, len(names), len(names)), np.nan)
    for i, k in combinations(range(len(names)), 2):
        apart = norm(joints[:, i] - joints[:, k])
        apart = apart[np.isfinite(apart)]
        if len(apart) >= _ENOUGH:
            length[[i, k], [k, i]], varies[[i, k], [k, i]] = apart.mean(), apart.std()
    upright = points.frame.dims == 3 or _upright(points)
    longer = {
        pair: _longer(names, pair, length, varies)
        for pair in combinations(range(len(names)), 2)
        if upright or names[pair[0]][2:] == names[pair[1]][2:]
    }
    misnamed: set[int] = set()
    for pair in sorted((pair for pair in longer if longer[pair] > 0), key=lambda pair: -longer[pair]):
        if misnamed.isdisjoint(pair):
            misnamed |= {*pair}
            first, second = (label_of(names[joint]) for joint in pair)
            notices.append(notice("joints-exchanged", first=first, second=second))
    lost = [names[joint] for joint in misnamed if names[joint] not in TRUNK_CORNERS]
    unseen[:, points.layout.indices(lost)] = True
    return unseen, notices


def _longer(names: list[str], pair: tuple[int, int], length: np.ndarray, varies: np.ndarray) -> float:
    """By how much the bones of these two joints are longer, in squares, than in each other's place; 0 where the names
    are right, or nothing tells. length, varies: (N, N) mean distances of joints of these names, and their spreads."""
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    bones = [(names.index(a), names.index(b)) for a, b in COCO17.bones if {a, b} <= {*names}]
    bones = [bone for bone in bones if len({*pair} & {*bone}) == 1]
    if not bones:
        return 0.0
    named, exchanged = (
        tuple(np.array(each).T) for each in (bones, [(other.get(a, a), other.get(b, b)) for a, b in bones])
    )
    # Of exchanged legs hips alone would be worse for the thighs: all kinds of bones have to be shorter.
    more = length[named] ** 2 - length[exchanged] ** 2
    kinds = np.array(["-".join(sorted(names[joint][2:] for joint in bone)) for bone in bones])
    shorter, steadier = (
        float(part[named].sum()) / max(float(part[exchanged].sum()), 1e-12) for part in (length, varies)
    )
    sides = names[pair[0]][2:] == names[pair[1]][2:]
    of_any = steadier > limit("joints-exchanged.any-steadier") and shorter > limit(
        "joints-exchanged.any-shorter"
    )
    told = steadier > limit("joints-exchanged.steadier") if sides else of_any
    return float(more.sum()) if told and all(more[kinds == kind].sum() > 0 for kind in kinds) else 0.0


def _upright(points: PoseSequence) -> bool:
    """Whether the trunk is upright in the image most of the time. points: 2D, with TRUNK_CORNERS."""
    if any(name not in points.layout for name in TRUNK_CORNERS):
        return False
    at = points.joints[:, points.layout.indices(TRUNK_CORNERS)].astype(np.float64)
    trunk = at[:, :2].mean(axis=1) - at[:, 2:].mean(axis=1)
    cosine = trunk[:, 1] / np.linalg.norm(trunk, axis=-1)
    tells = np.isfinite(cosine)
    return bool(tells.any() and np.median(cosine[tells]) > limit("joints-exchanged.upright"))


def _copied(points: PoseSequence) -> list[Notice]:
    """A limb that is a copy of the other side's."""
    trunk = trunk_length(points.joints.astype(np.float64), points.layout)
    notices = []
    for limb in (LEG, ARM):
        names = [[f"{side}_{part}" for part in limb] for side in _SIDES]
        if any(name not in points.layout for side in names for name in side):
            continue
        right, left = (points.joints[:, points.layout.indices(side)].astype(np.float64) for side in names)
        right, left = (each[:, 1:] - each[:, :1] for each in (right, left))
        apart = norm(right - left)
        visible = np.isfinite(apart).any(axis=0)
        if (
            visible.any()
            and np.nanpercentile(apart, limit("limbs-copied.rows")) < limit("limbs-copied.same") * trunk
            and np.linalg.norm(np.nanstd(right[:, visible], axis=0), axis=-1).max()
            > limit("limbs-copied.moves") * trunk
        ):
            notices.append(notice("limbs-copied", limb="leg" if limb == LEG else "arm"))
    return notices


def weighed(share: float, limits: tuple[float, float]) -> Weight:
    """How grave a finding about this share of rows is. limits: above the first it is suspicious, above the second
    unusable."""
    return "unusable" if share > limits[1] else "suspicious" if share > limits[0] else "note"


def _equal_rows(points: PoseSequence) -> list[Notice]:
    """Rows that are, digit for digit, the row before, as of images that were held, and many that come again, as of a
    clip in a loop. Failed rows, of zeros or of two joints at most, do not count."""
    usable = np.flatnonzero((is_finite(points.joints).sum(axis=1) > 2) & ~empty_rows(points))
    # What is missing is alike too: one NaN is not another.
    rows = np.nan_to_num(points.joints[usable], nan=np.inf).reshape(len(usable), points.joints[0].size)
    which = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(which, kind="stable")  # rows that are equal lie beside each other, in their order
    equal, apart = np.diff(which[order]) == 0, np.diff(usable[order])
    far = apart > limit("repeats-itself.apart")
    held, again = usable[order][1:][equal & (apart == 1)], int((equal & far).sum())
    notices = []
    if len(held):
        weight = weighed(len(held) / len(points), limit("duplicates.weight"))
        values: dict[str, Any] = {"repeated": len(held), "first": int(held.min())}
        notices.append(notice("duplicates", weight=weight, **values))
    if len(usable) >= _ENOUGH and again >= limit("repeats-itself.rows") * len(usable):
        notices.append(notice("repeats-itself", count=again, rows_read=len(usable)))
    return notices


def _rows_lost(points: PoseSequence) -> list[Notice]:
    """The whole body moves by more than one frame's movement at every so many-th row, or at one: rows were left out,
    and neither numbers nor times tell it."""
    if (np.diff(points.frame_index) != 1).any() or points.seams:
        return []
    rows = points.joints.astype(np.float64)
    if points.frame.dims == 2 and points.confidence is not None:
        rows = np.where((points.confidence < limit("rows-lost.score"))[..., None], np.nan, rows)
    moved = np.diff(rows, axis=0)
    length = np.linalg.norm(np.nan_to_num(moved).reshape(len(moved), -1), axis=1)
    every = _period(length)
    if every and not _held(length, every):
        fps = points.fps if points.time_s is not None else float("nan")
        how = f"at one row in {every}" + (
            f", as at {fps * every / (every + 1):.3g} frames a second" if fps == fps else ""
        )
        return [notice("rows-lost", count=len(moved) // every, how=how)]
    steps_s = 1.0 if points.time_s is None else np.diff(points.time_s)[:, None]
    leaps = _leaps(norm(moved) / steps_s)
    if len(leaps) != 1 or points.frame.dims == 3:
        return []
    return [notice("rows-lost", count=1, how=f"from frame {points.frame_index[leaps[0]]} to the next")]


def _leaps(speed: np.ndarray) -> np.ndarray:
    """(N,) rows from which the joints go on faster, in the median, than around them and than before or after. speed:
    (T, J), NaN where unknown."""
    visible, around = np.isfinite(speed), limit("rows-lost.around")
    if len(speed) < around:
        return np.zeros(0, dtype=int)
    least = limit("rows-lost.still") * np.median(speed[visible]) if visible.any() else 0.0
    every = np.where(visible, speed, np.inf)
    wider = np.pad(every, ((1, 1), (0, 0)), mode="edge")
    beside = np.minimum(wider[:-2], wider[2:])
    usual = [ranked(joint, around, around // 2, "symmetric") for joint in every.T]
    usual = np.maximum(np.stack(usual, axis=-1), beside) + least
    faster = np.where(visible, speed + least, 0.0) / np.maximum(usual, 1e-12)
    leaps = np.flatnonzero(np.median(faster, axis=1) > limit("rows-lost.once"))
    # At an end half of the rows around are not there.
    return leaps[(leaps >= around // 2) & (leaps < len(speed) - around // 2)]


def _rows_added(points: PoseSequence) -> list[Notice]:
    """Nearly all joints of a row lie exactly on lines between those of the rows beside it, in which they bend: a
    program has put it there. Rows that follow one another so are gaps that were filled."""
    limbs = points.layout.indices([name for name in LIMBS if name in points.layout])
    if not limbs:
        return []
    bend = _bends_and_moves(points.joints.astype(np.float64))[0][:, limbs]
    between = (bend <= _ON_LINE).mean(axis=1) >= limit("rows-added.joints")
    bent = (bend > _BENDS).mean(axis=1) >= limit("rows-added.bent")
    added = int((between[1:-1] & bent[:-2] & bent[2:]).sum())
    often = added >= limit("rows-added.often") * len(points)
    return [notice("rows-added", count=added, of=len(points))] if often else []


def _period(length: np.ndarray) -> int:
    """At every how many-th row movements (T,) are longer than those before and after; 0 where at none."""
    long = np.log(np.maximum(length, 1e-9))
    long = long[1:-1] - (long[:-2] + long[2:]) / 2
    longer_at: dict[int, float] = {}
    shortest, longest = limit("rows-lost.periods")
    for every in range(shortest, longest + 1):
        for first in range(every):
            these, others = long[first::every], np.delete(long, np.s_[first::every])
            if len(these) < limit("rows-lost.rows"):
                continue
            longer = float(np.median(these) - np.median(others))
            above = (these > np.percentile(others, limit("rows-lost.others"))).mean()
            if above >= limit("rows-lost.share") and longer > limit("rows-lost.longer"):
                longer_at[every] = max(longer, longer_at.get(every, 0.0))
    good = limit("rows-lost.best-period") * max(longer_at.values(), default=0)
    return min((every for every, longer in longer_at.items() if longer > good), default=0)


def _held(length: np.ndarray, every: int) -> bool:
    """Whether hardly anything moves between these rows: they repeat, as of a slowed video, and none is lost."""
    first = max(range(every), key=lambda first: float(np.median(length[first::every])))
    between = np.delete(length, np.s_[first::every])
    return bool(np.median(between) * limit("rows-lost.held") < np.median(length[first::every]))


def _only_noise(points: PoseSequence) -> list[Notice]:
    """Hands and feet jump at random from row to row."""
    paths = _ends(points)
    if paths is None or points.made_by.kind == "measured":
        return []
    moved = paths - paths.mean(axis=0)
    square = float((moved**2).mean())
    moves = limit("only-noise.moves-in-image" if points.frame.dims == 2 else "only-noise.moves-in-space")
    if square < moves**2:
        return []
    alike = 1 - (np.diff(paths, axis=0) ** 2).mean() / 2 / square
    return [notice("only-noise")] if alike < limit("only-noise.alike") else []


def _smoothed(points: PoseSequence) -> list[Notice]:
    """Keypoints of hands and feet without the noise of any detector."""
    paths = _ends(points) if points.frame.dims == 2 else None
    if paths is None:
        return []
    usual, fourth = (
        float(np.median(norm(np.diff(paths, order, axis=0).reshape(len(paths) - order, -1, 2))))
        for order in (3, 4)
    )
    uncut = fourth > limit("keypoints-smooth.uncut") * usual
    if not 0 < usual < limit("keypoints-smooth.trembles-uncut" if uncut else "keypoints-smooth.trembles"):
        return []
    return [notice("keypoints-smooth", trembles_percent=100 * usual)]


def _ends(points: PoseSequence) -> np.ndarray | None:
    """(T, N) paths of hands and feet about the middle of the hips, in trunks, gaps filled; None where too little is
    seen. Rows that repeat the one before are left out."""
    names = (*_ENDS, "l_hip", "r_hip")
    if any(name not in points.layout for name in names):
        return None
    joints = points.joints.astype(np.float64)
    if points.frame.dims == 2 and points.confidence is not None:
        joints = np.where((points.confidence <= 0)[..., None], np.nan, joints)
    size = max(float(np.nan_to_num(trunk_length(points.joints, points.layout))), 1e-12)
    ends, hips = (joints[:, points.layout.indices(part)] for part in (_ENDS, names[4:]))
    paths = ((ends - hips.mean(axis=1, keepdims=True)) / size).reshape(len(ends), -1)
    goes_on = np.ones(len(paths), dtype=bool)
    goes_on[1:] = (np.diff(paths, axis=0) != 0).any(axis=1)
    paths = paths[goes_on]
    whole = [on_lines(path, np.arange(len(path))) for path in paths.T if np.isfinite(path).mean() > 0.5]
    return np.stack(whole, axis=-1) if whole and len(paths) >= _ENOUGH else None


def _listed(layout: Layout, unseen: np.ndarray) -> str:
    """Joints by how many rows of unseen (T, J) are theirs, the most first."""
    counts = {name: int(rows.sum()) for name, rows in zip(layout.joints, unseen.T, strict=True) if rows.any()}
    names = sorted(counts, key=lambda name: -counts[name])
    return first_few(map(label_of, names), most=3)
