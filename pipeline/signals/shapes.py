"""Poses and keypoints that no recording gives: copied limbs, loops, noise alone, movement without any quick part; and
poses that keypoints of the same frames contradict.

Rates of false alarms are of 148 lifts of the test bed's validation takes and five files of lifters (tests/accidents).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core.anthropometry import implied_stature, trunk_length
from ..core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera
from ..core.layouts import H36M17
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from .reprojection import LIMBS, Residuals, residuals

_ENOUGH = 30  # rows
_LIMBS = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
_ENDS = ("r_ankle", "l_ankle", "r_wrist", "l_wrist")
_SAME = 0.01  # of a trunk: distance, in nine rows of ten, between a limb and the other side's; lifts have 0.09 and more
_MOVES = 0.05  # of a trunk, that both move at least
_AGAIN = 0.3  # of the rows that another row, not beside it, repeats to the digit; no recording has any
_QUICK_HZ = 6.0
# Of the movement of hands and feet faster than this, as a share of all, and along an axis in lengths of a trunk: lifts
# have 0.0105 and 0.0012 at least, smoothed ones 0.005 and 0.0003.
_QUICK = (0.006, 0.00043)
_COMPUTED = 1e-4  # share of quick movement below which motion was computed, not recorded: nothing smoothed it
_NOISE = 0.5  # autocorrelation from row to row; lifts have 0.95 and more, noise has 0
# The same of keypoints. Quick movement, share and size: 298 sound takes have 0.039 and 0.0094 at least, takes with the
# noise of good detectors 0.029 and 0.0056, smoothed ones 0.065 and 0.0027 at most, and nine in ten exact projections
# less too. Autocorrelation where they move by at least so many trunks: 0.66 and more; of shuffled rows 0.23 and less.
_KEYPOINTS_QUICK = (0.1, 0.003)
_KEYPOINTS_NOISE, _KEYPOINTS_MOVE = 0.4, 0.1
# Rigid limbs whose joints' movements about their means were made smaller: by which factor, and how much less lengths
# vary without it. Of 80 sound lifts none varies by less than 0.87 times at any factor below 1.
_SHRUNK, _RIGID = np.arange(0.1, 1.01, 0.05), 0.5
_MOST_ROWS = 5_000  # that tell it
_ROWS = 600  # that are compared with keypoints
_LAGS = range(-8, 9)
# How many times as far as the poses the keypoints move, where both move alike: at most 1.2 of 300 sound takes.
_FARTHER, _MOVE_ALIKE = 1.4, 0.8
# Of statures: how far poses are off their own keypoints. 142 lifts of noisy keypoints have 0.012 to 0.062.
_OFF = 0.065
# Times as far off as at another shift of two rows and more; one of 142 lifts has 1.056, others 1.02.
_LATE = 1.06
# Rows that were lost: at a regular row movements are longer than the mean of those beside them by this logarithm, and
# in so large a share longer than three in four others. Of 140 noisy takes none has more than 0.26; where every fifth
# row is lost it is 0.37 to 1.0.
_LONGER, _ABOVE, _FEWEST_OWN = 0.3, 0.8, 6
_HELD = 12.0  # times as long as those between: more than ten rows are lost at once nowhere
# Once: times the mean movement of so many rows before and after, in their direction; none of 298 noisy takes of
# keypoints. A lift moves less evenly: four of 300 once by over 4 times; chosen on these.
_LEAP, _ALONG, _BESIDE, _FEW_LEAPS = 4.0, 0.55, {2: 3, 3: 1}, {2: 2, 3: 1}
_FARTHEST = {2: _LEAP, 3: 5.5}
_SEEN = 0.3  # score of a keypoint that was seen


def shape_findings(poses: PoseSequence) -> list[Notice]:
    """Of 3D poses (T, 17, 3), H36M17 relative to the pelvis."""
    return [*copied(poses), *repeated(poses), *_movement(poses), *_shrunk(poses)]


def copied(points: PoseSequence) -> list[Notice]:
    """A notice where a limb is a copy of the other side's. points: 2D or 3D, any layout with the limbs."""
    if len(points) < _ENOUGH:
        return []
    at = points.joints.astype(np.float64)
    trunk = trunk_length(at, points.layout)
    found = []
    for limb in _LIMBS:
        if not all(f"{side}_{part}" in points.layout for side in "rl" for part in limb):
            continue
        right, left = (at[:, points.layout.indices([f"{side}_{part}" for part in limb])] for side in "rl")
        right, left = (each[:, 1:] - each[:, :1] for each in (right, left))
        apart = np.linalg.norm(right - left, axis=-1)
        known = np.isfinite(apart).any(axis=0)
        if (
            known.any()
            and np.nanpercentile(apart, 90) < _SAME * trunk
            and np.linalg.norm(np.nanstd(right[:, known], axis=0), axis=-1).max() > _MOVES * trunk
        ):
            found.append(notice("limbs-copied", limb="leg" if "hip" in limb else "arm"))
    return found


def repeated(points: PoseSequence) -> list[Notice]:
    """A notice where many rows come again, as of a clip in a loop. points: as those of `copied`."""
    rows = points.joints[np.asarray(is_finite(points.joints)).mean(axis=1) > 0.5]
    if len(rows) < _ENOUGH:
        return []
    _, which = np.unique(rows.reshape(len(rows), -1), axis=0, return_inverse=True)
    which = which.ravel()
    first = np.full(which.max() + 1, -1)
    again = 0
    for row, number in enumerate(which):
        again += first[number] >= 0 and row - first[number] > 5
        first[number] = row
    if again < _AGAIN * len(rows):
        return []
    return [notice("repeats-itself", count=int(again), rows_read=len(rows))]


def _shrunk(poses: PoseSequence) -> list[Notice]:
    """A notice where limbs keep their lengths only if the joints moved farther about their means than they do."""
    joints = poses.joints[:: len(poses) // _MOST_ROWS + 1].astype(np.float64)
    starts, ends = (
        H36M17.indices([f"{side}_{limb[i + end]}" for limb in _LIMBS for i in (0, 1) for side in "rl"])
        for end in (0, 1)
    )
    limbs = joints[:, ends] - joints[:, starts]
    limbs = limbs[np.isfinite(limbs).all(axis=(1, 2))]
    if len(limbs) < _ENOUGH:
        return []
    usual = limbs.mean(axis=0)
    moved = limbs - usual
    swing = (moved**2).sum(axis=(0, 2)) / np.maximum((limbs**2).sum(axis=(0, 2)), 1e-12)
    varies = []
    for factor in _SHRUNK:
        length = np.linalg.norm(usual + moved / factor, axis=-1)
        spread = length.std(axis=0) / np.maximum(length.mean(axis=0), 1e-12)
        varies.append(np.sqrt((swing * spread**2).sum()))
    best = int(np.argmin(varies))
    if varies[best] >= _RIGID * varies[-1]:
        return []
    return [notice("movement-shrunk", times=float(1 / _SHRUNK[best]))]


def _movement(poses: PoseSequence) -> list[Notice]:
    """Of lifts alone: captured joints of people who stand are smoother."""
    if len(poses) < 2 * _ENOUGH or poses.made_by.kind == "measured" or not np.isfinite(fps := _rate(poses)):
        return []
    ends = poses.joints[:, H36M17.indices(_ENDS)].astype(np.float64) / max(
        trunk_length(poses.joints, H36M17), 1e-12
    )
    ends = ends[np.isfinite(ends).all(axis=(1, 2))]
    # Frozen rows are told elsewhere.
    moves_on = np.ones(len(ends), dtype=bool)
    moves_on[:-1] = (np.diff(ends, axis=0) != 0).any(axis=(1, 2))
    ends = ends[moves_on]
    if len(ends) < _ENOUGH or (moves := _moves(ends.reshape(len(ends), -1), fps)).size < 1e-5:
        return []
    if moves.alike < _NOISE:
        return [notice("only-noise")]
    if fps < 3 * _QUICK_HZ or not _COMPUTED < moves.quick_share < _QUICK[0] or moves.quick_size > _QUICK[1]:
        return []
    return [notice("no-quick-movement", hertz=_QUICK_HZ, share_percent=100 * moves.quick_share)]


def keypoints_movement(keypoints: PoseSequence) -> list[Notice]:
    """A notice where keypoints (T, J, 2) of any layout with hands, feet and trunk jump at random from row to row, or
    have less quick movement than detectors leave."""
    names = (*_ENDS, "l_hip", "r_hip")
    fps = _rate(keypoints)
    if (
        len(keypoints) < _ENOUGH
        or not np.isfinite(fps)
        or any(name not in keypoints.layout for name in names)
    ):
        return []
    seen = keypoints.joints.astype(np.float64)
    if keypoints.confidence is not None:
        seen = np.where((keypoints.confidence <= 0)[..., None], np.nan, seen)
    ends, hips = (seen[:, keypoints.layout.indices(part)] for part in (names[:4], names[4:]))
    size = max(trunk_length(keypoints.joints, keypoints.layout), 1e-12)
    paths = ((ends - hips.mean(axis=1, keepdims=True)) / size).reshape(len(ends), -1).T
    known = [np.isfinite(path) for path in paths]
    rows = np.arange(len(ends))
    whole = [
        np.interp(rows, rows[there], path[there])
        for path, there in zip(paths, known, strict=True)
        if there.mean() > 0.5
    ]
    if not whole:
        return []
    moves = _moves(np.stack(whole, axis=-1), fps)
    if moves.alike < _KEYPOINTS_NOISE and moves.size > _KEYPOINTS_MOVE:
        return [notice("only-noise")]
    share, size = _KEYPOINTS_QUICK
    if fps < 3 * _QUICK_HZ or not _COMPUTED < moves.quick_share < share or moves.quick_size > size:
        return []
    return [notice("keypoints-smooth", hertz=_QUICK_HZ, share_percent=100 * moves.quick_share)]


class _Moves(NamedTuple):
    """size: of paths about their mean, root mean square; quick_size, quick_share: of what is quicker than _QUICK_HZ;
    alike: autocorrelation from row to row."""

    size: float
    quick_size: float
    quick_share: float
    alike: float


def _moves(paths: np.ndarray, fps: float) -> _Moves:
    """Of paths (T, N) without gaps."""
    moved = paths - paths.mean(axis=0)
    square = max(float((moved**2).mean()), 1e-20)
    power = np.abs(np.fft.rfft(moved * np.hanning(len(moved))[:, None], axis=0)) ** 2
    quick = float(power[np.fft.rfftfreq(len(moved), 1 / fps) > _QUICK_HZ].sum())
    return _Moves(
        float(np.sqrt(square)),
        float(np.sqrt(quick / paths.shape[1])) / len(moved),
        float(np.sqrt(quick / max(float(power.sum()), 1e-20))),
        float(1 - (np.diff(paths, axis=0) ** 2).mean() / 2 / square),
    )


def _rate(poses: PoseSequence) -> float:
    return poses.fps if poses.time_s is not None and len(poses) > 1 else float("nan")


def keypoints_unlike(
    poses: PoseSequence, keypoints: PoseSequence, image_size: tuple[int, int], focal_px: float | None
) -> list[Notice]:
    """A notice where poses in CAMERA axes do not fall onto the keypoints of their frames, or do better at another
    shift. InputError for poses in other axes or without times."""
    focal = focal_px or PRIOR_FOCAL * max(image_size)
    camera = Camera(image_size, focal, focal * PRIOR_FOCAL_SPREAD, "told" if focal_px else "prior")
    poses = poses.rows(0, min(len(poses), _ROWS))
    off: dict[int, float] = {}
    times = 1.0
    first = max(-_LAGS.start, 0)
    shifted = keypoints.with_(frame_index=keypoints.frame_index + first)
    for lag in _LAGS:
        at = poses.with_(frame_index=poses.frame_index + first + lag)
        found = residuals(at, shifted, camera)
        whole = found.whole()
        if lag == 0:
            times = _farther(poses, found)
        if np.isfinite(whole).sum() >= _ENOUGH:
            off[lag] = float(np.nanmedian(whole))
    if 0 not in off:
        return []
    best = min(off, key=lambda lag: (off[lag], abs(lag)))
    values: dict[str, Any] = {"off_percent": 100 * off[0]}
    if abs(best) > 1 and off[0] > _LATE * off[best]:
        way = "later" if best > 0 else "earlier"
        return [
            notice(
                "keypoints-not-of-poses",
                **values,
                how=f"; {abs(best)} frames {way} they fit within {100 * off[best]:.1f} %",
            )
        ]
    if times > _FARTHER:
        how = f"; the keypoints move {times:.1f} times as far"
        return [notice("keypoints-not-of-poses", **values, how=how)]
    if off[0] > _OFF:
        return [notice("keypoints-not-of-poses", **values, how="")]
    return []


def _farther(poses: PoseSequence, off: Residuals) -> float:
    """How many times as far as the poses' limbs their keypoints move; NaN where these do not move alike."""
    limbs = H36M17.indices([name for limb in LIMBS.values() for name in limb[1:]])
    moved = (poses.joints[:, limbs, :2] / implied_stature(poses.joints)).astype(np.float64)
    seen = moved - off.statures[:, limbs]
    moved = np.where(np.isfinite(seen), moved, np.nan)
    known = np.isfinite(moved).any(axis=(0, 2))  # a limb may be outside the image all the time
    moved, seen = (each[:, known] - np.nanmean(each[:, known], axis=0) for each in (moved, seen))
    both, own, others = (float(np.nansum(each)) for each in (moved * seen, moved**2, seen**2))
    return both / own if both > _MOVE_ALIKE * np.sqrt(own * others) > 0 else float("nan")


def rows_lost(points: PoseSequence) -> list[Notice]:
    """A notice where the whole body moves by more than one frame's movement at every so many-th row, or once by that of
    several and on as before: rows were left out, and neither numbers nor times tell it. points: as of `copied`."""
    known = (np.diff(points.frame_index) == 1).all() and not points.seams
    rows = points.joints.astype(np.float64)
    if points.frame.dims == 2 and points.confidence is not None:
        rows = np.where((points.confidence < _SEEN)[..., None], np.nan, rows)
    if not known or len(rows) < _ENOUGH:
        return []
    moved = np.diff(rows.reshape(len(rows), -1), axis=0)
    moved = np.where(np.isfinite(moved), moved, 0.0)
    length = np.linalg.norm(moved, axis=1)
    if every := _period(length):
        if _held(length, every):
            return []
        fps = points.fps if points.time_s is not None else float("nan")
        how = f"at every {every}th row" + (
            f", as at {fps * every / (every + 1):.3g} frames a second" if fps == fps else ""
        )
        return [notice("rows-lost", count=len(moved) // every, how=how)]
    way = np.cumsum(np.concatenate([np.zeros_like(moved[:1]), moved]), axis=0)
    reach = _BESIDE[points.frame.dims]
    at = np.arange(reach, len(moved) - reach)
    beside = (way[at] - way[at - reach] + way[at + reach + 1] - way[at + 1]) / (2 * reach)
    alike = (moved[at] * beside).sum(axis=1)
    square = np.maximum((beside**2).sum(axis=1), 1e-12)
    usual = np.sqrt(square)
    cosine = alike / np.maximum(usual * length[at], 1e-12)
    found = np.flatnonzero((alike / square > _LEAP) & (cosine > _ALONG) & (usual > np.median(length) / 2))
    if not 0 < len(found) <= _FEW_LEAPS[points.frame.dims]:
        return []
    farthest = float((alike / square)[found].max())
    if farthest < _FARTHEST[points.frame.dims]:
        return []
    how = f"as far as in {farthest:.0f} frames at row {int(at[found[0]]) + 1}"
    return [notice("rows-lost", count=len(found), how=how)]


def _held(length: np.ndarray, every: int) -> bool:
    """Whether hardly anything moves between these rows: they repeat, as of a slowed video, and none is lost."""
    first = max(range(every), key=lambda first: float(np.median(length[first::every])))
    between = np.delete(length, np.s_[first::every])
    return bool(np.median(between) * _HELD < np.median(length[first::every]))


def _period(length: np.ndarray) -> int:
    """At every how many-th row movements (T,) are longer than those before and after; 0 where at none."""
    long = np.log(np.maximum(length, 1e-9))
    long = long[1:-1] - (long[:-2] + long[2:]) / 2
    found: dict[int, float] = {}
    for every in range(2, 11):
        for first in range(every):
            own, others = long[first::every], np.delete(long, np.s_[first::every])
            if len(own) < _FEWEST_OWN:
                continue
            longer = float(np.median(own) - np.median(others))
            if (own > np.percentile(others, 75)).mean() >= _ABOVE and longer > _LONGER:
                found[every] = max(longer, found.get(every, 0.0))
    return min((every for every in found if found[every] > 0.8 * max(found.values())), default=0)
