"""Which tracks are of one person who was out of view meanwhile: by place and size, and by the look of the images where
there is a video."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from ..core.layouts import LIMBS
from ..core.limits import limit
from ..core.messages import first_few
from ..core.notices import notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..core.take import Video
from ..files.video_frames import images_at
from .tracker import LARGER, PACE, REACH, extent

_TRUNK = ("l_shoulder", "r_shoulder", "l_hip", "r_hip")
_RANGES = (0, 180, 0, 256, 0, 256)  # of hue, saturation and brightness in OpenCV


def rejoined(tracks: Sequence[PoseSequence], video: Video) -> tuple[PoseSequence, ...]:
    """Tracks that are numbered by a video's frames, those of one person as one."""
    timed = [track.with_(time_s=video.time_s[track.frame_index]) for track in tracks]
    return joined(tracks, first_names(timed, video))


def first_names(tracks: Sequence[PoseSequence], video: Video) -> dict[str, str]:
    """{name of each track: the name of its person's first one}. tracks: in IMAGE with times, in order of appearance.

    Two are of one person where they may be (`may_be`), look alike, and neither may as well be a third who is there
    beside the other.
    """
    names = {track.person: track.person for track in tracks}
    pairs = [pair for pair in combinations(tracks, 2) if may_be(*pair, video.size)]
    looks = {
        track.person: _look(track, video)
        for track in {track.person: track for pair in pairs for track in pair}.values()
    }
    most = limit("joined-again.alike")
    pairs = [pair for pair in pairs if _apart(*(looks[track.person] for track in pair)) <= most]
    either = [*pairs, *(pair[::-1] for pair in pairs)]
    for track, other in pairs:
        if not any(
            third is not taken and _beside(third, taken)
            for mine, taken in ((track, other), (other, track))
            for also, third in either
            if also is mine
        ):
            first, later = sorted((names[track.person], names[other.person]), key=list(names).index)
            names = {name: first if now == later else now for name, now in names.items()}
    return names


def joined(tracks: Sequence[PoseSequence], names: dict[str, str]) -> tuple[PoseSequence, ...]:
    """The tracks with those of one person as one, by `first_names`; a notice says so of each that is joined."""
    people = []
    for name in dict.fromkeys(names.values()):
        first, *later = (track for track in tracks if names[track.person] == name)
        if later:
            order = np.argsort(np.concatenate([track.frame_index for track in (first, *later)]))
            rows = {
                field: np.concatenate([getattr(track, field) for track in (first, *later)])[order]
                for field in ("joints", "confidence", "frame_index", "time_s")
                if first.time_s is not None or field != "time_s"
            }
            again = [track.person for track in later]
            first = first.with_(**rows).noted("join tracks", again=again)
            first = first.saying(notice("joined-again", person=name, again=first_few(again)))
        people.append(first)
    return tuple(people)


def may_be(first: PoseSequence, other: PoseSequence, size: tuple[int, int]) -> bool:
    """Whether two tracks with times may be of one person: never in one image, in one scene, and wherever one goes on
    for the other, as large, by all but the arms, which may be up, and within reach of one who had not gone out of the
    image. size: the image's width and height."""
    frames = np.concatenate([first.frame_index, other.frame_index])
    order = np.argsort(frames, kind="stable")
    if first.scene != other.scene or (np.diff(frames[order]) <= 0).any():
        return False
    points = np.concatenate([first.joints, other.joints])[order]
    there = np.flatnonzero(is_finite(points).any(axis=1))
    points, order = points[there], order[there]
    time_s = np.concatenate([first.times, other.times])[order]
    ends = np.flatnonzero(np.diff(order >= len(first)))
    goes_on = ends + 1
    corners = np.stack([np.nanmin(points, axis=1), np.nanmax(points, axis=1)], axis=1)
    trunk_legs = [
        joint for joint in LIMBS if joint in first.layout and not joint.endswith(("elbow", "wrist"))
    ]
    body, middle = extent(points[:, first.layout.indices(trunk_legs)]), corners.mean(axis=1)
    larger, smaller = (choice(body[ends], body[goes_on]) for choice in (np.maximum, np.minimum))
    away_s = time_s[goes_on] - time_s[ends]
    way = np.linalg.norm(middle[goes_on] - middle[ends], axis=1)
    size_px = np.maximum(*(extent(corners)[at] for at in (ends, goes_on)))
    near = way <= (REACH + limit("joined-again.fastest") * away_s) * size_px
    before = np.maximum(ends - PACE, np.concatenate([[0], goes_on[:-1]]))
    went_s = np.maximum(time_s[ends] - time_s[before], 1e-9)
    gone_to = middle[ends] + (middle[ends] - middle[before]) * (away_s / went_s)[:, None]
    left = (corners[ends, 0] <= 0) & (gone_to < 0) | (corners[ends, 1] >= size) & (gone_to > size)
    return bool(((larger <= LARGER * smaller) & near & ~left.any(axis=1)).all())


def _beside(first: PoseSequence, other: PoseSequence) -> bool:
    """Whether one track begins before the other ends, and the other way round."""
    return bool(
        first.frame_index[0] <= other.frame_index[-1] and other.frame_index[0] <= first.frame_index[-1]
    )


def _look(track: PoseSequence, video: Video) -> np.ndarray | None:
    """Shares of the trunk's pixels in bins of hue, saturation and brightness, (128,), over a few images; None where
    none shows it."""
    import cv2

    if not all(joint in track.layout for joint in _TRUNK):
        return None
    trunk = track.joints[:, track.layout.indices(_TRUNK)]
    rows = np.flatnonzero(is_finite(trunk).all(axis=1))
    rows = rows[np.linspace(0, len(rows) - 1, min(limit("joined-again.images"), len(rows))).astype(int)]
    images = images_at(video, track.frame_index[rows].tolist())
    looks = []
    for row in rows:
        image = images.get(int(track.frame_index[row]))
        if image is None:
            continue
        low, high = np.floor(trunk[row].min(axis=0)).astype(int), np.ceil(trunk[row].max(axis=0)).astype(int)
        part = image[max(low[1], 0) : max(high[1], 0), max(low[0], 0) : max(high[0], 0)]
        if part.size:
            colours = cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGB2HSV)
            looks.append(
                cv2.calcHist([colours], [0, 1, 2], None, limit("joined-again.bins"), _RANGES).ravel()
                / colours[..., 0].size
            )
    return np.mean(looks, axis=0) if looks else None


def _apart(look: np.ndarray | None, other: np.ndarray | None) -> float:
    """Hellinger distance, 0 to 1; infinite where a look is not known."""
    if look is None or other is None:
        return float("inf")
    return float(np.sqrt(max(1 - np.sqrt(look * other).sum(), 0.0)))
