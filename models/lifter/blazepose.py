"""Lifters that look at the image: BlazePose's landmark network, which gives world landmarks in metres.

Inputs and outputs as the MediaPipe repository's pose_landmark models have them: (1, 256, 256, 3) RGB 0 to 1 -> 33
landmarks and 6 helpers as (1, 195): x, y, z in crop pixels, logits of visibility and presence; (1, 1) probability that
a person is there; (1, 117) world landmarks. The crop is that of its pose tracking (pose_landmarks_to_roi.pbtxt): a
square around the middle of the hips, 1.25 times as large as the circle around the body, turned until the trunk is
upright; the landmarks are turned back.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...pipeline.errors import InputError
from ...pipeline.files.video_frames import images_ahead
from ...pipeline.frames import CAMERA
from ...pipeline.layouts import BLAZEPOSE33, H36M17, remap
from ...pipeline.pose import PoseSequence
from ...pipeline.rotations import is_finite, rotate
from ...pipeline.running.progress import counted
from ...pipeline.take import Video
from ..common.onnx import OnnxFile
from ..detector.blazepose import is_blazepose
from .crop_rays import from_ray
from .input import checked_size, long_gaps, on_grid, refuse_two_people
from .scaling import filled

_ROOM = 1.25
_SIDE = 256  # of the crop for a network that leaves it open
_PERSON = 0.5  # probability from which the answer counts, as in MediaPipe
_SCORE = 0.2  # keypoints below it do not widen the crop
_COUNT = len(BLAZEPOSE33)
_HELPERS = 6
_HEAD = H36M17.index("head")  # detectors put it between the ears or at the top
_VISIBILITY = 3


@dataclass(frozen=True, eq=False)
class Crops:
    """Where to look, frame by frame. centre (T, 2) and side (T,) in pixels; R_picture_from_crop (T, 2, 2)."""

    centre: np.ndarray
    side: np.ndarray
    R_image_from_crop: np.ndarray

    def cut(self, row: int, image: np.ndarray, side: int) -> np.ndarray:
        """(side, side, 3) float32 in [0, 1] out of an image (H, W, 3) uint8; black beyond it."""
        import cv2

        turn = self.R_image_from_crop[row] * self.side[row] / side
        shift = self.centre[row] - turn @ np.full(2, side / 2)
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        part = cv2.warpAffine(image, np.column_stack([turn, shift]), (side, side), flags=how)
        return part.astype(np.float32) / 255


@dataclass(frozen=True, eq=False)
class ImageLifter:
    """A pipeline.plugins.protocols.Lifter of BlazePose's landmark network; visibility becomes the confidence."""

    network: OnnxFile
    method: str
    kind: str = "blazepose"

    def lift(
        self,
        keypoints: PoseSequence,
        image_size: tuple[int, int] | None,
        focal_px: float | None = None,
        flip: bool = False,
        video: Video | None = None,
    ) -> PoseSequence:
        """Keypoints say where to look. Frames without an image, without any keypoint for more than 15 frames, or
        where the network is not sure of a person, are NaN."""
        if video is None:
            raise InputError(f"The lifter {self.method} looks at the pictures; give the video.")
        size = checked_size(keypoints, image_size, focal_px)
        body = remap(keypoints, H36M17)
        pixels, confidence, rows = on_grid(body)
        refuse_two_people(pixels)
        crops = crops_around(pixels, confidence, rows)
        unseen = long_gaps(np.any(is_finite(pixels), axis=1))[rows]
        world, visibility = self._landmarks(video, keypoints.frame_index, crops, unseen, flip)
        turn = np.tile(np.eye(3), (len(rows), 1, 1))
        turn[:, :2, :2] = crops.R_image_from_crop
        joints, focal = from_ray(rotate(turn, world), crops.centre, size, focal_px)
        landmarks = keypoints.with_(
            joints=joints, confidence=visibility, layout=BLAZEPOSE33, frame=CAMERA.with_(origin="camera")
        )
        poses = remap(landmarks, H36M17)
        pelvis = poses.joints[:, [H36M17.index("pelvis")]]
        return poses.mapped(lambda points: points - pelvis, frame=CAMERA).noted(
            "lift",
            model=self.method,
            kind=self.kind,
            **focal,
            flip=flip,
            frames_without_joints=int(unseen.sum()),
            frames_without_person=int((np.isnan(world).all(axis=(1, 2)) & ~unseen).sum()),
        )

    def _landmarks(
        self, video: Video, frames: np.ndarray, crops: Crops, unseen: np.ndarray, flip: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """World landmarks (T, 33, 3) in the axes of the crop, and their visibility (T, 33); NaN without a person."""
        world = np.full((len(frames), _COUNT, 3), np.nan)
        visibility = np.full((len(frames), _COUNT), np.nan)
        side = self.network.only_input[1] or _SIDE
        with counted("lift", len(frames)) as done:
            for row, image in _wanted(video, frames):
                done(row)
                if unseen[row]:
                    continue
                cropped = crops.cut(row, image, side)
                found, joints, seen = self._look(cropped)
                if flip:
                    other, mirrored, seen_too = self._look(np.ascontiguousarray(cropped[:, ::-1]))
                    mirror = BLAZEPOSE33.mirror
                    joints = (joints + mirrored[mirror] * np.array([-1, 1, 1])) / 2
                    found, seen = (found + other) / 2, (seen + seen_too[mirror]) / 2
                if found >= _PERSON:
                    world[row], visibility[row] = joints, seen
        return world, visibility

    def _look(self, image: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Probability of a person, world landmarks (33, 3), visibility (33,) of a crop (side, side, 3)."""
        by_size = {answer.size: answer for answer in self.network.run(image[None])}
        points = _COUNT + _HELPERS
        logit = by_size[5 * points].reshape(points, 5)[:_COUNT, _VISIBILITY].astype(np.float64)
        world = by_size[3 * points].reshape(points, 3)[:_COUNT].astype(np.float64)
        return float(by_size[1].item()), world, 1 / (1 + np.exp(-logit))


def is_image_network(network: OnnxFile) -> bool:
    """Whether an opened network is BlazePose's with world landmarks."""
    world = 3 * (_COUNT + _HELPERS)
    return is_blazepose(network) and any(shape[1:] == (world,) for shape in network.outputs.values())


def crops_around(pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops:
    """Where the person of H36M17 keypoints (N, 17, 2) and confidence (N, 17) is, at these rows."""
    sure = is_finite(pixels) & ~(confidence < _SCORE)
    sure[:, _HEAD] = False
    points = filled(pixels)
    hips, shoulders = (
        points[:, H36M17.indices((f"l_{part}", f"r_{part}"))].mean(axis=1) for part in ("hip", "shoulder")
    )
    reach = np.where(sure, np.linalg.norm(points - hips[:, None], axis=-1), 0.0).max(axis=1)
    reach = np.where(reach > 0, reach, np.nan)
    frame, seen = np.arange(len(reach)), np.isfinite(reach)
    reach = np.interp(frame, frame[seen], reach[seen]) if seen.any() else np.ones(len(reach))
    right, up = (shoulders - hips)[rows].T * np.array([[1], [-1]])
    lean = np.arctan2(right, up)  # of the trunk, clockwise in the image
    R = np.stack(
        [np.stack([np.cos(lean), -np.sin(lean)], -1), np.stack([np.sin(lean), np.cos(lean)], -1)], axis=-2
    )
    return Crops(hips[rows], 2 * _ROOM * reach[rows], R)


def _wanted(video: Video, frames: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """(row, image) of these frame numbers, in order."""
    row_of = {int(frame): row for row, frame in enumerate(frames)}
    for number, image in images_ahead(video, int(frames[0]), int(frames[-1])):
        if number in row_of:
            yield row_of[number], image
