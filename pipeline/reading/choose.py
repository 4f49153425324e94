"""Which of several people of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.layouts import LIMBS
from ..core.messages import how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, rotate
from ..files.detections import FEWEST_FRAMES, listed
from ..signals.reprojection import FEWEST
from ..signals.visibility import certain
from .tracker import steps

# How far a lift is from its own keypoints in the image (`_apart`), and how much further everybody else must be. Lifts
# of real takes by MotionBERT, MHFormer and BlazePose are 0.045 to 0.16 off their own keypoints or another detector's,
# 0.18 to 0.6 off the same person's a third of a second later, and 0.44 to 0.66 off another person's.
_ALIKE, _BY_FAR = (0.04, 0.25), 1.5
# Frames, and of the body's size from one to the next: looser ones took 12 of 444 sound takes for exchanged.
_AT_ONCE, _ONE_PLACE = 3, 0.15
_ENOUGH_FRAMES = 10  # medians of three frames were up to 0.8 off where a person turned


def choose_person(people: tuple[PoseSequence, ...], person: str | None, where: str) -> PoseSequence:
    """The one of that name, or the only one; otherwise InputError.

    people: as an adapter gives them. "longest": the one with the most frames. "largest": the one who takes the most of
    the image, by the mean area of the box around the joints of each frame, in pixels for 2D; 3D poses of a camera
    count as a camera far away would see them, in their own unit, whatever their distance. Of a choice by rank a notice
    says who else is there.
    """
    everybody, rank = people, person if person in RANKS else None
    if rank is not None:
        values = [RANKS[rank](poses, where) for poses in people]
        people = tuple(poses for poses, value in zip(people, values, strict=True) if value == max(values))
        person = None
    if person is None and len(people) == 1:
        return _beside(people[0], everybody)
    names: dict[str, Any] = {poses.person: poses for poses in people}
    listed = _listed(people)
    if rank is not None:
        raise InputError(
            "choose-person",
            f"{where} holds {len(people)} people who are equally the {rank}: {listed}; choose one by name with "
            "--person.",
        )
    if person is None:
        raise InputError(
            "choose-person",
            f"{where} holds {len(people)} people: {listed}; choose one with --person, or 'longest' or 'largest'.",
        )
    person = str(person)  # names of people are often numbers, and callers in Python write them as such
    if person not in names:
        raise InputError("name-unknown", f"{where} has no person '{person}'; it holds {listed}.")
    return names[person]


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
    tracks = [
        f"{other.person} (frames {other.frame_index[0]} to {other.frame_index[-1]})" for other in others
    ]
    values = {"others": len(others), "listed": listed(tracks), "person": chosen.person}
    return chosen.saying(notice("person-chosen", **values))


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
            if gone < first and back - _AT_ONCE <= last < back and visible and apart < _ONE_PLACE:
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


def same_person(
    poses: PoseSequence, tracks: tuple[PoseSequence, ...], names: tuple[str, str]
) -> PoseSequence:
    """The 2D track that shows the person of 3D poses, by how the limbs lie in the image. InputError unless one does by
    far, and for poses in a world, which do not tell what an image shows.

    poses: H36M17, of a camera in CAMERA. tracks: in IMAGE, by the same frame numbers. names: of the file of each, for
    errors. The step that is noted says how far apart the two are (`_apart`).
    """
    of_camera = poses.frame.family == "camera"
    apart = [_apart(poses, certain(track, None)) if of_camera else np.inf for track in tracks]
    best, *others = np.argsort(apart).tolist()
    least, most = _ALIKE
    if apart[best] > most or any(apart[other] < _BY_FAR * max(apart[best], least) for other in others):
        raise InputError(
            "choose-person",
            f"The people of {names[0]} and {names[1]} have separate numbers, and the limbs do not show which track "
            f"is person '{poses.person}': the second holds {_listed(tracks)}; choose it with --set "
            "read.keypoints_person=NAME, or leave --keypoints out.",
        )
    return tracks[best].noted("same person", poses=poses.person, apart=round(float(apart[best]), 3))


def _apart(poses: PoseSequence, track: PoseSequence) -> float:
    """Median over the frames that both have of how far hips to wrists are off in the image plane; infinite for too few
    frames."""
    _, rows, track_rows = np.intersect1d(
        poses.frame_index, track.frame_index, assume_unique=True, return_indices=True
    )
    limbs = [joint for joint in LIMBS if joint in track.layout]
    body = poses.joints[rows][:, poses.layout.indices(limbs), :2].astype(np.float64)
    image = track.joints[track_rows][:, track.layout.indices(limbs)].astype(np.float64)
    off = _off_in_image(body, image)
    return float(np.nanmedian(off)) if np.isfinite(off).sum() >= _ENOUGH_FRAMES else np.inf


def _off_in_image(body: np.ndarray, image: np.ndarray) -> np.ndarray:
    """(N,) how far points body (N, J, 2) are from those of the image, over the spread of these, when each row's are
    moved and scaled onto them: 0 for the same pose, 1 for none; NaN where fewer than FEWEST are in both."""
    both = (is_finite(body) & is_finite(image))[..., None]
    enough = both.sum(axis=(1, 2)) >= FEWEST
    off = np.full(len(both), np.nan)
    both = both[enough]
    body, image = (
        np.where(both, points - np.nanmean(np.where(both, points, np.nan), axis=1, keepdims=True), 0)
        for points in (body[enough], image[enough])
    )
    spreads = np.linalg.norm(body, axis=(1, 2)) * np.linalg.norm(image, axis=(1, 2))
    alike = np.divide((body * image).sum(axis=(1, 2)), spreads, out=np.zeros(len(body)), where=spreads > 0)
    off[enough] = np.sqrt(1 - np.clip(alike, 0, 1) ** 2)
    return off


def _listed(people: tuple[PoseSequence, ...]) -> str:
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
