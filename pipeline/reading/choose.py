"""Which of several people of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.messages import first_few, how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, rotate
from ..files.detections import FEWEST_FRAMES
from .tracks import steps


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
