"""Calibrating: what the video's images say about the camera, its focal length and which way is up."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from ..models.gravity.view import Boxes, moving_camera, static_camera
from ..pipeline.camera import Camera, pitch_roll_deg
from ..pipeline.camera_file import read_camera
from ..pipeline.errors import InputError
from ..pipeline.intrinsics import Intrinsics, undistorted
from ..pipeline.pictures import pictures, pictures_at, shown_size
from ..pipeline.pose import PoseSequence
from ..pipeline.progress import counted
from ..pipeline.rotations import known
from ..pipeline.take import Event, Take, Video
from ._image_lines import ideal

_LOOKS = 3  # images of a camera that stands still
_EVERY = 10  # video frames between the images of one that moves
_REACH = 0.09  # of a person's longer side about the bones: flesh, clothes, hair, hands
_BOXES = 6  # along a bone


@dataclass(frozen=True)
class Calibrate:
    """The stage. focal_px: the focal length in pixels, if known; camera_file, camera_name: or a calibration file, and
    which of its cameras. camera: "static" for one that stands still during the
    take, "moving" for one that pans or is carried."""

    focal_px: float | None = None
    camera_file: Path | None = None
    camera_name: str | None = None
    camera: Literal["static", "moving"] = "static"

    name: ClassVar[str] = "calibrate"
    needs: ClassVar[tuple[str, ...]] = ("video",)
    gives: ClassVar[tuple[str, ...]] = ("camera",)

    def __call__(self, take: Take) -> Take:
        assert take.video is not None
        poses = take.keypoints or take.poses
        found = self._found(take.video, take.keypoints, _span(take.video, poses))
        return take.with_(camera=found).saying(*_events(found, self.camera))

    def together(self, takes: Sequence[Take]) -> list[Take]:
        """Several people of one video have one camera."""
        first = takes[0]
        assert first.video is not None
        everybody = [poses for take in takes if (poses := take.keypoints or take.poses) is not None]
        spans = [_span(first.video, poses) for poses in everybody] or [(0, len(first.video.time_s) - 1)]
        span = min(start for start, _ in spans), max(end for _, end in spans)
        keypoints = [take.keypoints for take in takes if take.keypoints is not None]
        found = self._found(first.video, keypoints, span)
        return [take.with_(camera=found).saying(*_events(found, self.camera)) for take in takes]

    def _found(
        self, video: Video, people: PoseSequence | Sequence[PoseSequence] | None, span: tuple[int, int]
    ) -> Camera:
        intrinsics = None
        if self.camera_file is not None:
            if self.focal_px is not None:
                raise InputError(
                    "Expected a focal length or a camera file, not both; the file has a focal length."
                )
            intrinsics = read_camera(self.camera_file, self.camera_name, shown_size(video))
        return calibrate(video, people, span, self.focal_px, self.camera, intrinsics)


def calibrate(
    video: Video,
    people: PoseSequence | Sequence[PoseSequence] | None = None,
    span: tuple[int, int] | None = None,
    focal_px: float | None = None,
    camera: Literal["static", "moving"] = "static",
    intrinsics: Intrinsics | None = None,
) -> Camera:
    """A video's camera by its images. people: their 2D keypoints, whose boxes are not looked at. span: first and last
    frame of the take, else of the video. focal_px: where it is known; intrinsics: of a calibrated camera. InputError
    for a video that cannot be decoded."""
    first, last = span or (0, len(video.time_s) - 1)
    if camera == "static":
        wanted = np.linspace(first, last, 2 * _LOOKS + 1).round().astype(int)[1::2]
    else:
        wanted = np.arange(first, last + 1, _EVERY)
    frames = sorted({int(frame) for frame in wanted})
    everybody = [people] if isinstance(people, PoseSequence) else list(people or ())
    size = shown_size(video)
    if intrinsics is not None:
        focal_px = intrinsics.pinhole_focal_px
        everybody = [poses.with_(joints=undistorted(poses.joints, intrinsics)) for poses in everybody]
    boxes = _boxes(everybody, frames)
    seen = ((frame, ideal(image, intrinsics)) for frame, image in _images(video, frames, camera))
    if camera == "static" and (images := dict(seen)):
        found = static_camera(images, boxes, focal_px, video.focal_px)
    else:
        found = moving_camera(seen, size, boxes, focal_px, video.focal_px)
    return replace(found, intrinsics=intrinsics)


def _images(video: Video, frames: Sequence[int], camera: str) -> Iterable[tuple[int, np.ndarray]]:
    return pictures_at(video, frames).items() if camera == "static" else _every(video, frames)


def _every(video: Video, frames: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
    """These frames of a video and their images, in one pass."""
    wanted = set(frames)
    with counted("calibrate", len(frames)) as tell:
        done = 0
        for number, image in pictures(video, frames[0]):
            if number > frames[-1]:
                break
            if number in wanted:
                yield number, image
                done += 1
                tell(done)


def _span(video: Video, poses: PoseSequence | None) -> tuple[int, int]:
    last = len(video.time_s) - 1
    if poses is None:
        return 0, last
    return min(int(poses.frame_index[0]), last), min(int(poses.frame_index[-1]), last)


def _boxes(people: Sequence[PoseSequence], frames: Sequence[int]) -> Boxes:
    """Boxes along everybody's limbs in these frames, from the nearest row that has joints; a box about the whole of a
    person whose arms are out would hide half of the room."""
    boxes: dict[int, list[np.ndarray]] = {frame: [] for frame in frames}
    for poses in people:
        rows = np.flatnonzero(known(poses.joints).any(axis=1))
        for frame in frames if len(rows) else ():
            joints = poses.joints[rows[np.abs(poses.frame_index[rows] - frame).argmin()]]
            seen = joints[known(joints)]
            reach = _REACH * float((seen.max(axis=0) - seen.min(axis=0)).max())
            lines = [joints[poses.layout.indices(bone)] for bone in poses.layout.bones]
            along = np.linspace(0, 1, _BOXES)[:, None]
            points = np.concatenate([seen, *(a + along * (b - a) for a, b in lines)])
            points = points[known(points)]
            boxes[frame].append(np.concatenate([points - reach, points + reach], axis=-1))
    return {frame: np.concatenate([np.zeros((0, 4)), *found]) for frame, found in boxes.items()}


def _events(found: Camera, camera: str) -> tuple[Event, ...]:
    """What was found, in words."""
    if not found.looks:
        return (Event("note", f"The image does not tell which way is up: {found.reason}."),)
    if camera == "moving":
        return (
            Event("note", f"The image tells which way is up in {len(found.looks)} of the frames looked at."),
        )
    look = found.looks[0]
    pitch, roll = pitch_roll_deg(look.up)
    focal = f"the focal length is {found.focal_px:.0f} pixels, within {1.6 * found.focal_sd_px:.0f}"
    return (
        Event(
            "note",
            f"By the straight lines of the image the camera's pitch is {pitch:.1f} and its roll {roll:.1f} degrees, "
            f"within {1.5 * look.error_deg:.1f}" + (f"; {focal}." if found.focal_source == "lines" else "."),
        ),
    )
