"""Who is who: the same person under the same name from frame to frame, in images or in any plane; which tracks are
of one person who was out of view meanwhile, by place, size and the look of a video's images; and which of several
people of a file is meant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.layouts import LIMBS
from ..core.limits import limit
from ..core.messages import first_few, how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, rotate
from ..core.take import Video
from ..files.detections import FEWEST_FRAMES
from ..files.video_frames import images_at

REACH = limit("tracks.reach")  # body sizes
LARGER = limit("tracks.larger")  # times
MEMORY = limit("tracks.memory")  # frames
PACE = limit("tracks.pace")  # frames
_NEVER = 1e6


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where a person is in a frame. points: (J, 2), finite. weight: (J,) trust in each, 0 for one that is not there.
    box: (4,) left, top, right, bottom around the person."""

    frame: int
    points: np.ndarray
    weight: np.ndarray
    box: np.ndarray


def sighted(frame: int, points: np.ndarray, there: np.ndarray) -> Sighting:
    """A sighting by points (J, 2) alone, of which those count that are there (J,), one at least."""
    box = np.concatenate([points[there].min(axis=0), points[there].max(axis=0)])
    return Sighting(frame, np.where(there[:, None], points, 0.0), there.astype(np.float64), box)


class Tracker:
    """Names people 0, 1, ... in order of appearance.

    Each frame's people are joined to those of the last 30 frames, who are taken to have gone on as they went in the 10
    frames before they were lost; all at once, so that the sum of distances is the least (Hungarian method). The
    distance is that of the joints, weighted by trust in them, over the size of the larger box, and must stay below half
    of it; less the part that the boxes share. People who cross may be exchanged all the same.
    """

    def __init__(self) -> None:
        self._tracks: dict[int, list[Sighting]] = {}  # the last sightings of everybody who may come back
        self._people = 0

    def names(self, people: Sequence[Sighting]) -> list[int]:
        """The name of each person of a frame; frames come in order."""
        if not people:
            return []
        frame = people[0].frame
        self._tracks = {
            name: track for name, track in self._tracks.items() if frame - track[-1].frame <= MEMORY
        }
        # Of equal costs that of whoever was seen last.
        lost = sorted(self._tracks, key=lambda name: -self._tracks[name][-1].frame)
        names = [-1] * len(people)
        if lost:
            cost = np.array([_costs(_expected(self._tracks[name], frame), people) for name in lost])
            for row, column in _pairs(cost):
                if cost[row, column] < _NEVER:
                    names[column] = lost[row]
        for i, sighting in enumerate(people):
            names[i] = self._people if names[i] < 0 else names[i]
            self.knows(names[i], sighting)
        return names

    def knows(self, name: int, sighting: Sighting) -> None:
        """Adds a sighting to that person's track; sightings come in order of time."""
        before = [earlier for earlier in self._tracks.pop(name, []) if sighting.frame - earlier.frame <= PACE]
        self._tracks[name] = [*before, sighting]
        self._people = max(self._people, name + 1)

    def cut(self) -> None:
        """After a cut of the video: everybody who follows is a new person."""
        self._tracks = {}


def steps(points: np.ndarray) -> np.ndarray:
    """(T - 1,) mean distance over the body's size from each row of points (T, J, 2) to the next, 0 where fewer than
    three joints are visible in both: of a person who enters the image only a hand may be visible, and its error would
    be as large as that body."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    size = extent(points)
    both = np.isfinite(apart).sum(axis=1)
    sizes = both * np.fmax(size[1:], size[:-1])
    enough = (sizes > 0) & (both >= limit("tracks.joints"))
    return np.divide(np.nansum(apart, axis=1), sizes, out=np.zeros(len(apart)), where=enough)


def extent(points: np.ndarray) -> np.ndarray:
    """(T,) of the body in the image, corner to corner; NaN of nobody."""
    return np.linalg.norm(np.fmax.reduce(points, axis=1) - np.fmin.reduce(points, axis=1), axis=-1)


def _expected(track: Sequence[Sighting], frame: int) -> Sighting:
    """Where a track's person is expected in `frame`: the last sighting, moved on as its joints moved on average."""
    first, last = track[0], track[-1]
    weight = np.minimum(first.weight, last.weight)
    if first is last or not weight.any():
        return last
    moved = weight @ (last.points - first.points) / weight.sum()
    moved = moved * (frame - last.frame) / (last.frame - first.frame)
    return replace(last, points=last.points + moved, box=last.box + np.tile(moved, 2))


def _pairs(cost: np.ndarray) -> list[tuple[int, int]]:
    """Rows and columns of cost (N, M), each at most once, whose sum is the least."""
    if 1 in cost.shape:  # one person: without an import that takes half a second
        row, column = np.unravel_index(int(cost.argmin()), cost.shape)
        return [(int(row), int(column))]
    from scipy.optimize import linear_sum_assignment

    return list(zip(*linear_sum_assignment(cost), strict=True))


def _costs(sighting: Sighting, people: Sequence[Sighting]) -> list[float]:
    """The cost of each person as the continuation of a track, of which `sighting` is what is expected."""
    weight = np.minimum(sighting.weight, np.array([person.weight for person in people]))
    step = np.linalg.norm(sighting.points - np.array([person.points for person in people]), axis=-1)
    total = weight.sum(axis=1)
    step = np.divide((step * weight).sum(axis=1), total, out=np.full(len(people), np.inf), where=total > 0)
    corners = np.array([sighting.box, *(person.box for person in people)])
    size = np.linalg.norm(corners[:, 2:] - corners[:, :2], axis=1)
    near = step < REACH * np.maximum(size[1:], size[0])
    return [
        float(step[i] / max(size[i + 1], size[0])) - overlap(sighting.box, people[i].box)
        if near[i]
        else _NEVER
        for i in range(len(people))
    ]


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """The part that two boxes (4,) share over what they cover together."""
    (left, top, right, bottom), (left2, top2, right2, bottom2) = a.tolist(), b.tolist()
    width, height = min(right, right2) - max(left, left2), min(bottom, bottom2) - max(top, top2)
    shared = max(width, 0.0) * max(height, 0.0)
    together = (right - left) * (bottom - top) + (right2 - left2) * (bottom2 - top2) - shared
    return shared / together if together > 0 else 0.0


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
            third is not taken and _at_once(third, taken)
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


def _at_once(first: PoseSequence, other: PoseSequence) -> bool:
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


def choose_person(people: tuple[PoseSequence, ...], person: str | None, where: str) -> PoseSequence:
    """The one of that name, or the only one; otherwise InputError.

    people: as an adapter gives them. "longest": the one with the most frames. "largest": the one who takes the most of
    the image, by the mean area of the box around the joints of each frame, in pixels for 2D; 3D poses of a camera
    count as a camera far away would see them, in their own unit, whatever their distance. Of a choice by rank a notice
    says who else is there.
    """
    if person is not None and person not in RANKS:
        # Names of people are often numbers, and callers in Python write them as such.
        named = [poses for poses in people if poses.person == str(person)]
        if not named:
            raise InputError(
                "name-unknown", f"{where} has no person '{person}'; it holds {listed_people(people)}."
            )
        return named[0]
    values = [RANKS[person](poses, where) if person else 0 for poses in people]
    first = [poses for poses, value in zip(people, values, strict=True) if value == max(values)]
    if len(first) == 1:
        return _beside(first[0], people)
    equally = f" who are equally the {person}" if person else ""
    way_out = "by name with --person" if person else "with --person, or 'longest' or 'largest'"
    raise InputError(
        "choose-person",
        f"{where} holds {len(first)} people{equally}: {listed_people(tuple(first))}; choose one {way_out}.",
    )


def choose_detected(people: tuple[PoseSequence, ...], person: str | None, where: str) -> PoseSequence:
    """As choose_person, of people whom a detector of ours found: without a name the one in the most frames, of several
    the largest in the image. Unless a name was given, a notice says who else is there."""
    if person in (None, "longest"):
        chosen = _beside(max(people, key=lambda poses: (len(poses), _area(poses, ""))), people)
    else:
        chosen = choose_person(people, person, where)
    return chosen.saying(*_back_as_another(chosen, people), *_adjoined(chosen, people))


def _beside(chosen: PoseSequence, people: tuple[PoseSequence, ...]) -> PoseSequence:
    """The chosen one, with a notice of the others."""
    others = sorted((other for other in people if other.person != chosen.person), key=len, reverse=True)
    if not others:
        return chosen
    tracks = [f"{other.person} ({_when(other)})" for other in others]
    values = {"others": len(others), "listed": first_few(tracks), "person": chosen.person}
    return chosen.saying(notice("person-chosen", **values))


def _when(poses: PoseSequence) -> str:
    """Such as "frames 5 to 39"."""
    first, last = poses.frame_index[[0, -1]]
    return f"frame {first}" if first == last else f"frames {first} to {last}"


def _back_as_another(chosen: PoseSequence, people: tuple[PoseSequence, ...]) -> list[Notice]:
    """That the chosen one comes back where another is lost who was there meanwhile only: they may be exchanged."""
    frames = chosen.frame_index
    for row in np.flatnonzero(np.diff(frames) > 1):
        gone, back = int(frames[row]), int(frames[row + 1])
        for other in people:
            first, last = int(other.frame_index[0]), int(other.frame_index[-1])
            joints = np.stack([chosen.joints[row], other.joints[-1], chosen.joints[row + 1]])
            sizes, apart = float(steps(joints[::2])[0]), steps(joints)[1]
            visible = sizes > 0 and apart > 0  # `steps` are 0 where fewer than three joints tell
            soon = back - limit("leap-between-people.frames") <= last < back
            if gone < first and soon and visible and apart < limit("leap-between-people.one-place"):
                unseen = f", after {how_many(back - gone - 1, 'frame')} unseen"
                values: dict[str, Any] = {"sizes": sizes, "frame": back, "unseen": unseen}
                return [notice("leap-between-people", weight="suspicious", **values)]
    return []


def _adjoined(chosen: PoseSequence, people: tuple[PoseSequence, ...]) -> list[Notice]:
    """Of each frame that begins one track where the other ends, the chosen or another, where no cut says why."""
    others = (other for other in people if other.person != chosen.person and len(other) >= FEWEST_FRAMES)
    pairs = [pair for other in others for pair in ((chosen, other), (other, chosen))]
    frames = {
        int(later.frame_index[0])
        for first, later in pairs
        if later.scene == first.scene and later.frame_index[0] == first.frame_index[-1] + 1
    }
    return [notice("cut-or-another", frame=frame) for frame in sorted(frames)]


def listed_people(people: tuple[PoseSequence, ...]) -> str:
    """Everybody's name with how many frames they have, for a sentence."""
    return ", ".join(f"{poses.person} ({how_many(len(poses), 'frame')})" for poses in people)


def _area(poses: PoseSequence, where: str) -> float:
    """Mean area of the box around the joints in the plane of the image; -1 for a person without a joint."""
    if poses.frame.family not in ("image", "camera"):
        raise InputError(
            "choose-person",
            f"{where} holds poses in a world's axes ({poses.frame}), so no image shows who is the largest; choose by "
            "name, or 'longest'.",
        )
    R_image_from_file = poses.frame.basis.T[:2]  # right and down
    points = rotate(R_image_from_file, poses.joints)[is_finite(poses.joints).any(axis=1)]
    sides = np.nanmax(points, axis=1) - np.nanmin(points, axis=1)
    return float(np.prod(sides, axis=1).mean()) if len(points) else -1.0


RANKS = {"longest": lambda poses, where: len(poses), "largest": _area}
