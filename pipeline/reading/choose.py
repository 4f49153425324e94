"""Which of several people of a file."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..messages import how_many
from ..pose import PoseSequence
from ..rotations import is_finite, rotate


def choose_person(people: tuple[PoseSequence, ...], person: str | None, where: str) -> PoseSequence:
    """The one of that name, or the only one; otherwise InputError.

    people: as an adapter gives them. "longest": the one with the most frames. "largest": the one who takes the most of
    the image, by the mean area of the box around the joints of each frame, in pixels for 2D; 3D poses of a camera
    count as a camera far away would see them, in their own unit, whatever their distance.
    """
    if person in RANKS:
        ranks = [RANKS[person](poses, where) for poses in people]
        people = tuple(poses for poses, rank in zip(people, ranks, strict=True) if rank == max(ranks))
        person = None
    if person is None and len(people) == 1:
        return people[0]
    names = {poses.person: poses for poses in people}
    listed = ", ".join(f"{name} ({how_many(len(poses), 'frame')})" for name, poses in names.items())
    if person is None:
        raise InputError(
            f"{where} holds {len(people)} people: {listed}; choose one with --person, or 'longest' or 'largest'."
        )
    if person not in names:
        raise InputError(f"{where} has no person '{person}'; it holds {listed}.")
    return names[person]


def _area(poses: PoseSequence, where: str) -> float:
    """Mean area of the box around the joints in the plane of the image; -1 for a person without a joint."""
    if poses.frame.family not in ("image", "camera"):
        raise InputError(
            f"{where} holds poses in a world's axes ({poses.frame}), so nobody is the largest in a picture; choose by "
            "name, or 'longest'."
        )
    image = poses.frame.basis.T[:2]  # right and down, from the file's axes
    seen = rotate(image, poses.joints)[is_finite(poses.joints).any(axis=1)]
    sides = np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)
    return float(np.prod(sides, axis=1).mean()) if len(seen) else -1.0


RANKS = {"longest": lambda poses, where: len(poses), "largest": _area}
