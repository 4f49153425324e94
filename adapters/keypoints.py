"""2D keypoints that a run of ours detected (its keypoints.npz): every person, with frame numbers and time stamps."""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import arrays_in
from ..pipeline.files.detections import load_detections

name = "keypoints"
gives = "keypoints"
reads = "keypoints.npz of a pcnet3d run on a video alone"


def sniff(path: Path) -> bool:
    """Whether the file is an archive with the arrays of `pipeline.files.detections`."""
    return arrays_in(path) >= {"frames_seen", "change", "layout"}


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person in IMAGE, in the detector's layout, in order of appearance; what makes them or the images
    doubtful is among their notices. InputError when the file is damaged."""
    detections = load_detections(path)
    return tuple(person.saying(*detections.doubts(person)) for person in detections.people())
