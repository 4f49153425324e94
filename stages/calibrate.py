"""Calibrating: what the video's images say about the camera, its focal length and which way is up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..models.detector.flow import NEAR_LAGS, SIDE, Flow, flow_notice, flow_of, pairs_of
from ..models.gravity.view import camera_of, static_camera
from ..pipeline.core.camera import TREMBLE, Background, Camera
from ..pipeline.core.errors import InputError
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.take import Take, Told, Video
from ..pipeline.files.camera_file import read_camera
from ..pipeline.files.video_frames import OnePass


@dataclass(frozen=True)
class Calibrate:
    """The stage. camera_file, camera_name: a calibration file, and which of its cameras; the user then gives no focal
    length."""

    camera_file: Path | None = None
    camera_name: str | None = None

    name: ClassVar[str] = "calibrate"
    needs: ClassVar[tuple[str, ...]] = ("video",)
    gives: ClassVar[tuple[str, ...]] = ("camera",)
    reads: ClassVar[tuple[str, ...]] = ("camera", "focal_px")

    def __call__(self, take: Take) -> Take:
        return self.together([take])[0]

    def together(self, takes: Sequence[Take]) -> list[Take]:
        """The people of one video have one camera."""
        told, video = takes[0].told, takes[0].need("video")
        everybody = [poses for take in takes if (poses := take.keypoints or take.poses) is not None]
        spans = [_span(video, poses) for poses in everybody] or [video.span]
        span = min(start for start, _ in spans), max(end for _, end in spans)
        keypoints = [take.keypoints for take in takes if take.keypoints is not None]
        images = OnePass(video)
        doubts = [_belongs(take, images) for take in takes]
        self.check_told(told)
        intrinsics = None
        if self.camera_file is not None:
            intrinsics = read_camera(self.camera_file, self.camera_name, video.size)
        motion = "static" if told.standing else told.camera
        camera = camera_of(video, keypoints, span, told.focal_px, motion, intrinsics, images)
        checked = [
            take.with_(camera=camera).saying(*doubt()) for take, doubt in zip(takes, doubts, strict=True)
        ]
        return [take.saying(*_notices(camera), *_motion(camera.background, told)) for take in checked]

    def of_image(self, name: str, image: np.ndarray) -> Take:
        """A take of that name with the camera that one image (H, W, 3) uint8 RGB shows, and what is said of it."""
        camera = static_camera({0: image}, {})
        return Take(name, camera=camera).saying(*_notices(camera))

    def check_told(self, told: Told) -> None:
        """InputError for two focal lengths, and for a file that is not there, before a run has looked at the video in
        vain."""
        if self.camera_file is not None and told.focal_px is not None:
            raise InputError(
                "option-conflict",
                "Expected a focal length or a camera file, not both; the file has a focal length.",
            )
        if self.camera_file is not None:
            read_camera(self.camera_file, self.camera_name)


def _belongs(take: Take, images: OnePass) -> Callable[[], list[Notice]]:
    """Whether keypoints of a file are of this video; nothing of those that were detected in it, now or before."""
    keypoints, video = take.keypoints, take.video
    digests = {each["role"]: each.get("sha256") for each in take.inputs}
    if keypoints is None or video is None or "keypoints" not in digests:
        return list
    if keypoints.detected_in and keypoints.detected_in == digests.get("video"):
        return list
    near = _flow(video, keypoints, _span(video, keypoints), NEAR_LAGS, images)

    def doubts() -> list[Notice]:
        flow = near()
        if flow is None or flow.how == "":  # perhaps of another part of the video
            first, last = keypoints.frame_index[[0, -1]].tolist()
            whole = 0, len(video.time_s) - 1
            part = _flow(video, keypoints, whole, range(first - whole[1], last + 1), OnePass(video))()
            flow = part if part is not None and part.how else flow
        doubt = flow_notice(flow)
        return [doubt] if doubt else []

    return doubts


def _flow(
    video: Video, keypoints: PoseSequence, span: tuple[int, int], lags: range, images: OnePass
) -> Callable[[], Flow | None]:
    """A function that returns how keypoints move beside images of these frames of the video."""
    pairs = pairs_of(*span, video.fps, video.key_frames)
    grey = images.ask({frame for pair in pairs for frame in pair}, lambda _, image: image, SIDE)
    return lambda: flow_of(grey(), pairs, keypoints, video.size[0], lags)


def _span(video: Video, poses: PoseSequence) -> tuple[int, int]:
    last = len(video.time_s) - 1
    return min(int(poses.frame_index[0]), last), min(int(poses.frame_index[-1]), last)


def _notices(camera: Camera) -> list[Notice]:
    """What of the camera is not as told."""
    if camera.focal_against_px is None:
        return []
    by, fits = "the straight lines of the image", camera.focal_against_px
    return [notice("focal-contradicted", by=by, focal_px=camera.focal_px, fits=fits)]


def _motion(background: Background | None, told: Told) -> list[Notice]:
    """How the camera moves by the background, and whether that is what was told."""
    if background is None:
        return [notice("camera-motion-unknown")]
    values = {"how": background.in_words, "percent_a_second": 100 * background.speed}
    if told.standing and background.moves:
        why = f"it {background.in_words}, for the background moves"
        return [notice("camera-against-told", told="static", found=why, other="moving")]
    if told.moving and background.kind == "still":
        why = "the background stands still"
        return [notice("camera-against-told", told="moving", found=why, other="static")]
    if background.moves:
        return [notice("camera-moves", **values)]
    if background.reach > TREMBLE and not told.moving:
        return [notice("camera-shakes", reach_percent=100 * background.reach)]
    return []
