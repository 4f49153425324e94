"""Cleaning before anything is computed: missing rows put back as gaps, spikes removed, short gaps filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import FEET, H36M17
from ..pipeline.core.messages import spans_in_words
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.rotations import is_finite
from ..pipeline.core.take import Take, Told
from ..pipeline.reading.bounds import grid_rows
from ..pipeline.signals.checks import NEAR_S, strays_of
from ..pipeline.signals.filters import BRIDGED_S, holes, monotone_slopes, on_spline, stretches
from ..pipeline.signals.visibility import unseen

_SHORTEST_S = 0.3  # of a span that a notice names
# Name of both, of one, and the joint that stands for it.
_PARTS = (
    ("feet", "foot", "ankle"),
    ("knees", "knee", "knee"),
    ("hips", "hip", "hip"),
    ("shoulders", "shoulder", "shoulder"),
    ("elbows", "elbow", "elbow"),
    ("hands", "hand", "wrist"),
)


@dataclass(frozen=True)
class Clean:
    """The stage. Options as those of `clean`. Keypoints that were not seen, or are outside the image, hide their joints
    unless these are motion capture; the image's size comes from the video or the user."""

    max_gap_s: float = 0.2
    spike: float = 0.5

    name: ClassVar[str] = "clean"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    reads: ClassVar[tuple[str, ...]] = ("image_size",)

    def unit_of(self, before: str, told: Told) -> str:
        """The same."""
        return before

    def __call__(self, take: Take) -> Take:
        poses, counts = clean(
            take.need("poses"), self.max_gap_s, self.spike, take.video.time_s if take.video else None
        )
        notices = [notice("seam", rows=[row], where="here") for row in poses.seams]
        repairs = ("rows_inserted", "spikes_removed", "strays_removed")
        notices += [notice(key.replace("_", "-"), count=counts[key]) for key in repairs if counts[key]]
        if counts["values_filled"]:
            notices.append(notice("gaps-filled", count=counts["values_filled"], max_gap_s=self.max_gap_s))
        notices += _lacking(poses.times)
        body = poses.without_feet
        visible = is_finite(body.joints)
        # As of files without a head.
        absent = [body.layout.joints[i] for i in np.flatnonzero(~visible.any(axis=0))]
        if absent:
            notices.append(notice("joints-absent", joints=" and ".join(absent), count=len(absent)))
        if take.keypoints is not None and poses.layout.is_body and poses.made_by.kind != "measured":
            hidden, out = unseen(take.keypoints, take.image_size, poses.frame_index, poses.times)
            poses = without(poses, hidden)
            notices += not_seen(hidden, out, poses.times)
        return take.with_(poses=poses).saying(*notices)


def _lacking(time_s: np.ndarray) -> list[Notice]:
    """Notices of images that the video itself lacks, so that no frame number is missing. time_s: (T,)."""
    long = holes(time_s, BRIDGED_S)
    short = np.setdiff1d(holes(time_s), long)
    notices = []
    for rows, so in (
        (short, f"filters bridge gaps of up to {BRIDGED_S} s"),
        (long, "walks and repetitions end there"),
    ):
        if len(rows):
            when = f"from {spans_in_words(time_s[np.c_[rows - 1, rows]].tolist())}"
            weight = "warning" if rows is long else None
            notices.append(notice("images-lacking", rows=rows, weight=weight, when=when, so=so))
    return notices


def not_seen(hidden: np.ndarray, out: np.ndarray, times: np.ndarray) -> list[Notice]:
    """Notices of what was not seen and when, for (T, 17) masks of `unseen` and times (T,)."""
    notices = []
    for part, single, joint in _PARTS:
        joints = H36M17.indices((f"r_{joint}", f"l_{joint}"))
        right, left = (_long(mask, times) for mask in hidden[:, joints].T)
        both = _long(right & left, times)  # a short time of both is named for each side
        who = {part: both, f"right {single}": right & ~both, f"left {single}": left & ~both}
        for name, mask in who.items():
            long = _long(mask, times)
            if not long.any():
                continue
            outside = out[long][:, joints].any(axis=1).mean() > 0.5
            begins, ends = stretches(long).T
            spans = np.c_[times[begins], times[ends - 1]].tolist()
            when = "in the whole take" if long.all() else f"from {spans_in_words(spans)}"
            values = {"part": name, "parts": 2 if name == part else 1, "when": when}
            how = "not in the image" if outside else "not visible"
            notices.append(notice("not-seen", rows=begins, how=how, **values))
    return notices


def _long(mask: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(T,) the mask (T,) without spans shorter than _SHORTEST_S."""
    result = np.zeros(len(mask), dtype=bool)
    steps_s = np.diff(times, append=times[-1:])  # the last row ends the take
    steps_s = np.minimum(steps_s, np.median(steps_s))  # rows may be missing after one
    for first, stop in stretches(mask).tolist():
        result[first:stop] = times[stop - 1] + steps_s[stop - 1] - times[first] >= _SHORTEST_S
    return result


def without(poses: PoseSequence, hidden: np.ndarray) -> PoseSequence:
    """The poses without their `hidden` joints (T, 17), which become missing with a confidence of 0; a foot goes with
    its hidden ankle. The history counts them."""
    if not hidden.any():
        return poses
    shown_by = [f"{joint[:2]}ankle" if joint in FEET else joint for joint in poses.layout.joints]
    of_all = hidden[:, H36M17.indices(shown_by)]
    return poses.without(of_all, covariance=poses.covariance).noted("unseen", values=int(hidden.sum()))


def clean(
    poses: PoseSequence, max_gap_s: float = 0.2, spike: float = 0.5, video_time_s: np.ndarray | None = None
) -> tuple[PoseSequence, dict[str, int]]:
    """One row for every video frame, without spikes, with short gaps filled; every repair is counted. Images that the
    video itself lacks get no row: filters bridge a short gap in time (pipeline/signals/filters.py).

    max_gap_s: gaps of a joint up to this long, in seconds, are interpolated (monotone cubic, never across a
        clip boundary, never beyond the first or last sighting); 0 fills none.
    spike: a joint is removed that is off, for a single frame, from the line between its neighbours in time by more than
        this many trunk lengths and by more than three times the distance of the neighbours; 0 removes none. Where
        frames are more than 1/15 s apart the limit grows with the square of the time, because a limb may go and return.
        Frames to which the whole pose leaps for at most 0.2 s are removed too: they show another person.
    video_time_s: (V,) the video's time stamps, for the rows that are put back, if the others have theirs from it.

    Returns the poses, and counts of rows inserted, of spikes and strays removed, and of values filled or left missing.
    The history has these counts too. Raises InputError without time stamps, or when frame numbers jump so far that the
    recording would not fit into memory.
    """
    if max_gap_s < 0 or spike < 0:
        raise InputError(
            "bad-value", f"clean needs max_gap_s and spike of 0 or more, got {max_gap_s} and {spike}."
        )
    strays = strays_of(poses) if spike > 0 else np.zeros(len(poses), dtype=bool)
    poses = poses.with_(
        joints=np.where(strays[:, None, None], np.nan, poses.joints),
        covariance=poses.covariance,
        path=poses.path and replace(poses.path, points=np.where(strays[:, None], np.nan, poses.path.points)),
    )
    poses, inserted = _every_frame(poses, video_time_s)
    trunk = np.linalg.norm(poses.joint("thorax") - poses.joint("pelvis"), axis=-1)
    furthest = 0.0 if np.isnan(trunk).all() else spike * float(np.nanmedian(trunk))

    def repaired(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        spikes = _spikes(points, furthest, poses.times, poses.seams)
        without = np.where(spikes[..., None], np.nan, points)
        return spikes, *_filled(without, poses.times, poses.seams, max_gap_s)

    spikes, filled, count = repaired(poses.joints)
    path, jumps = poses.path, 0
    if path is not None:
        leaps, points, more = repaired(path.points[:, None])
        unknown = np.isnan(path.points).any(-1) | leaps[:, 0]
        covariance = path.covariance
        if covariance is not None:
            covariance = np.where(unknown[:, None, None], np.nan, covariance)
        path = replace(path, points=points[:, 0], covariance=covariance)
        jumps, count = int(leaps.sum()), count + more
    made = np.isnan(poses.joints).any(-1) | spikes
    covariance = poses.covariance  # what was filled in has no stated error
    covariance = (
        None if covariance is None else np.where(made[..., None, None], np.float32(np.nan), covariance)
    )
    counts = {
        "rows_inserted": inserted,
        "spikes_removed": int(spikes.sum()) + jumps,
        "strays_removed": int(strays.sum()),
        "values_filled": count,
        "values_missing": int(np.isnan(filled).any(-1).sum()),
    }
    poses = poses.with_(
        joints=filled,
        path=path,
        covariance=covariance,
        confidence=np.where(made, np.nan, poses.confidence),
    )
    return poses.noted("clean", max_gap_s=max_gap_s, spike=spike, **counts, seams=len(poses.seams)), counts


def _every_frame(poses: PoseSequence, video_time_s: np.ndarray | None) -> tuple[PoseSequence, int]:
    """Rows for the frame numbers between first and last that have none, all NaN; and how many they are."""
    index, times = poses.frame_index, poses.times
    frames = grid_rows(poses)
    if frames == len(poses):
        return poses, 0
    every = np.arange(index[0], index[-1] + 1)
    time_s = np.interp(every, index, times)
    if video_time_s is not None and len(video_time_s) > every[-1] and np.allclose(video_time_s[index], times):
        time_s = video_time_s[every]
    return poses.on_frames(every, time_s), frames - len(poses)


def _spikes(points: np.ndarray, furthest: float, time_s: np.ndarray, seams: tuple[int, ...]) -> np.ndarray:
    """(T, J) True where a point of (T, J, 3) leaves its path for one frame, by more than that of frames near in time;
    0 finds none."""
    joints = points.astype(np.float64)
    spikes = np.zeros(joints.shape[:2], dtype=bool)
    if furthest == 0 or len(joints) < 3:
        return spikes
    off = np.linalg.norm(joints[1:-1] - (joints[2:] + joints[:-2]) / 2, axis=-1)
    apart = np.linalg.norm(joints[2:] - joints[:-2], axis=-1)
    slow = np.maximum((time_s[2:] - time_s[:-2])[:, None] / (2 * NEAR_S), 1.0)
    spikes[1:-1] = (off > furthest * slow**2) & (off > 3 * apart)
    for seam in seams:
        spikes[max(seam - 1, 0) : seam + 1] = False
    return spikes


def _filled(
    joints: np.ndarray, time_s: np.ndarray, seams: tuple[int, ...], max_gap_s: float
) -> tuple[np.ndarray, int]:
    """joints with short gaps interpolated, and how many joint positions that filled."""
    joints = joints.copy()
    count = 0
    if np.isfinite(joints).all():
        return joints, count
    clip = np.searchsorted(np.asarray(seams), np.arange(len(joints)), side="right")
    for joint in range(joints.shape[1]):
        visible = np.flatnonzero(np.isfinite(joints[:, joint]).all(-1))
        if len(visible) < 2 or len(visible) == len(joints):
            continue
        before, after = visible[:-1], visible[1:]
        # A gap of n frames spans n + 1 intervals; its own length is one interval less.
        length_s = (time_s[after] - time_s[before]) * (1 - 1 / (after - before))
        short = (after - before > 1) & (length_s <= max_gap_s + 1e-9) & (clip[before] == clip[after])
        rows = np.concatenate(
            [np.arange(a + 1, b) for a, b in zip(before[short], after[short], strict=True)] or [[]]
        )
        rows = rows.astype(int)
        if len(rows):
            times, path = time_s[visible], joints[visible, joint].astype(np.float64)
            joints[rows, joint] = on_spline(times, path, monotone_slopes(times, path), time_s[rows])
            count += len(rows)
    return joints, count
