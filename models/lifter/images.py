"""Lifters that look at the images: a network is shown the person in a crop of each frame, and answers in 3D."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.intrinsics import undistorted
from ...pipeline.core.layouts import H36M17, Layout, remap
from ...pipeline.core.lifted import Lifted, ToLift
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate
from ...pipeline.core.take import Video
from ...pipeline.files.video_frames import images_ahead
from ...pipeline.running.interrupt import Keeper, interruptible
from ...pipeline.running.progress import counted
from ..common.onnx import reason_of
from .answers import Answers, load_answers
from .input import checked_size, long_gaps, on_grid, rate_of, refuse_two_people
from .scaling import filled

SEEN = 0.2  # keypoints below this score do not widen a crop
_MIRRORED = np.array([-1, 1, 1])


@dataclass(frozen=True, eq=False)
class Crops:
    """Where to look, frame by frame. centre (T, 2) and size (T, 2), width and height, in pixels; R_image_from_crop
    (T, 2, 2). Pixels as OpenCV's and MMPose's affine crops count them."""

    centre: np.ndarray
    size: np.ndarray
    R_image_from_crop: np.ndarray

    def cut(self, row: int, image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """(size[1], size[0], 3) float32 of 0 to 255 out of an image (H, W, 3) uint8; black beyond it."""
        import cv2

        turn = self.R_image_from_crop[row] * (self.size[row] / size)
        shift = self.centre[row] - rotate(self.R_image_from_crop[row], self.size[[row]] / 2)[0]
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpAffine(image, np.column_stack([turn, shift]), size, flags=how).astype(np.float32)

    def pixels(self, places: np.ndarray) -> np.ndarray:
        """(T, N, 2) pixels of the image, of places in the crop, which reaches from -1 to 1."""
        return rotate(self.R_image_from_crop, places * self.size[:, None] / 2) + self.centre[:, None]


@dataclass(frozen=True, eq=False)
class View:
    """The camera that filmed the crops. image_size: (2,) pixels. focal_px: None where it is unknown. straight: pixels
    (..., 2) as a camera without distortion has them."""

    image_size: np.ndarray
    focal_px: float | None
    straight: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Seen:
    """A network's answer to one crop. points: (N, 3), whose first coordinate changes its sign in a mirrored crop.
    confidence: (J,) in [0, 1], NaN where unknown. sure: in [0, 1], that there is a person."""

    points: np.ndarray
    confidence: np.ndarray
    sure: float = 1.0


class ImageNetwork(Protocol):
    """A network that answers a crop in 3D.

    kind: one of `load.load_lifter`. licence: that its publishers state. layout: of the joints. unit: of the bodies.
    size: width and height of the crop. mirror: (N,) the points' order in a mirrored crop. enough: how sure it has to be
    of a person.
    crops(pixels, confidence, rows): where to look, by H36M17 keypoints (F, 17, 2) of evenly spaced frames and their
        confidence (F, 17), at these rows.
    conditions(crops, view): (T, C) numbers that the network is told beside each crop; the first one changes its sign
        in a mirrored image.
    look(crop, condition): what it sees in a crop (H, W, 3) of 0 to 255.
    bodies(points, crops, view): joints (T, J, 3) in CAMERA axes from any origin; (T, 3) the pelvis from the camera's
        centre in the same unit, where the network knows it; and fields of a pipeline.core.lifted.Lifted.
    """

    @property
    def kind(self) -> str: ...
    @property
    def licence(self) -> str: ...
    @property
    def layout(self) -> Layout: ...
    @property
    def unit(self) -> str: ...
    @property
    def mirror(self) -> np.ndarray: ...
    @property
    def enough(self) -> float: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def crops(self, pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops: ...
    def conditions(self, crops: Crops, view: View) -> np.ndarray: ...
    def look(self, crop: np.ndarray, condition: np.ndarray) -> Seen: ...
    def bodies(
        self, points: np.ndarray, crops: Crops, view: View
    ) -> tuple[np.ndarray, np.ndarray | None, dict[str, Any]]: ...


@dataclass(frozen=True, eq=False)
class ImageLifter:
    """A pipeline.plugins.protocols.Lifter of such a network."""

    network: ImageNetwork
    method: str

    takes = ("images",)

    @property
    def unit(self) -> str:
        return self.network.unit

    def lift(self, asked: ToLift) -> Lifted:
        """Keypoints say where to look. Frames without an image, without any keypoint for more than half a second, or
        where the network is not sure of a person, are NaN.

        The checkpoint is written about every minute and at the end, which Ctrl-C brings forward as KeyboardInterrupt.
        Answers to other keypoints, by another network or with another `flip` count for nothing. InputError for
        keypoints that cannot be lifted, and when the network fails.
        """
        if asked.video is None:
            raise InputError("needs-input", f"The lifter {self.method} looks at the images; give the video.")
        before = None if asked.resume is None else load_answers(asked.resume)
        keypoints, intrinsics = asked.keypoints, asked.intrinsics
        size = checked_size(asked)
        pixels, confidence, rows = on_grid(remap(keypoints, H36M17))
        rate = rate_of(keypoints, rows)
        refuse_two_people(pixels, rate)
        straight = partial(undistorted, intrinsics=intrinsics) if intrinsics is not None else np.asarray
        view = View(size, asked.focal_px, straight)
        crops = self.network.crops(pixels, confidence, rows)
        unseen = long_gaps(np.any(is_finite(pixels), axis=1), rate)[rows]
        source = self._source(keypoints, view, asked.flip)
        answers = Answers.none(len(rows), len(self.network.mirror), len(self.network.layout), source)
        if before is not None and before.source == source:
            answers = before
        answers = self._looked(answers, asked, asked.video, crops, view, unseen)
        joints, root, said = self.network.bodies(answers.points.astype(np.float64), crops, view)
        landmarks = keypoints.with_(
            joints=joints,
            confidence=answers.confidence,
            layout=self.network.layout,
            frame=CAMERA.with_(origin="camera", unit=self.network.unit),
        )
        poses = remap(landmarks, H36M17)
        pelvis = poses.joints[:, [H36M17.index("pelvis")]]
        sure = answers.sure >= self.network.enough
        nothing = np.isnan(answers.points).all(axis=(1, 2))
        return Lifted(
            poses.mapped(
                lambda points: points - pelvis, frame=CAMERA.with_(unit=self.network.unit), root=root
            ),
            model=self.method,
            kind=self.network.kind,
            licence=self.network.licence,
            focal_known=asked.focal_known,
            **said,
            flip=asked.flip,
            frames_without_joints=int(unseen.sum()),
            frames_without_person=int((~sure & np.isfinite(answers.sure)).sum()),
            frames_without_numbers=int((sure & nothing).sum()),
        )

    def _source(self, keypoints: PoseSequence, view: View, flip: bool) -> str:
        """What the answers rest on, beside the video."""
        digest = hashlib.sha256(keypoints.joints.tobytes() + keypoints.confidence.tobytes())
        digest.update(keypoints.frame_index.tobytes())
        return f"{self.method} {digest.hexdigest()} {view.image_size.tolist()} {view.focal_px} {flip}"

    def _looked(
        self, answers: Answers, asked: ToLift, video: Video, crops: Crops, view: View, unseen: np.ndarray
    ) -> Answers:
        """The answers with those to all frames that were not looked at yet."""
        frames, checkpoint = asked.keypoints.frame_index, asked.checkpoint
        keep = (lambda answers: None) if checkpoint is None else partial(Answers.save, path=checkpoint)
        conditions = self.network.conditions(crops, view)
        points, confidence, sure = (
            array.copy() for array in (answers.points, answers.confidence, answers.sure)
        )
        looked = answers.looked
        now = lambda: Answers(points, confidence, sure, looked, answers.source)  # noqa: E731
        kept = Keeper(lambda: keep(now()))
        with interruptible() as stop_asked, counted("lift", len(frames)) as done:
            for row, image in _wanted(video, frames, looked):
                if not unseen[row]:
                    try:
                        seen = self._seen(
                            crops.cut(row, image, self.network.size), conditions[row], asked.flip
                        )
                    except Exception as error:  # onnxruntime's errors have no common class but Exception
                        looked = row
                        keep(now())
                        raise InputError(
                            "wrong-network",
                            f"The lifter {self.method} failed at video frame {frames[row]}: {reason_of(error)}; give "
                            "another --lifter, or another --device.",
                        ) from None
                    sure[row] = seen.sure
                    if seen.sure >= self.network.enough:
                        points[row] = np.where(is_finite(seen.points)[:, None], seen.points, np.nan)
                        confidence[row] = np.clip(seen.confidence, 0, 1)
                looked = row + 1
                done(looked)
                kept()
                if stop_asked():
                    keep(now())
                    raise KeyboardInterrupt
        keep(now())
        return now()

    def _seen(self, crop: np.ndarray, condition: np.ndarray, flip: bool) -> Seen:
        seen = self.network.look(crop, condition)
        if not flip:
            return seen
        turned = condition.copy()
        turned[:1] *= -1
        other = self.network.look(np.ascontiguousarray(crop[:, ::-1]), turned)
        return Seen(
            (seen.points + other.points[self.network.mirror] * _MIRRORED) / 2,
            (seen.confidence + other.confidence[self.network.layout.mirror]) / 2,
            (seen.sure + other.sure) / 2,
        )


def upright_crops(
    pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray, room: float, aspect: float
) -> Crops:
    """Upright crops around the boxes of H36M17 keypoints (F, 17, 2) with confidence (F, 17), `room` times as large and
    then as wide or high as the aspect, width over height, asks for."""
    sure = is_finite(pixels) & ~(confidence < SEEN)
    sure |= ~sure.any(axis=1, keepdims=True)  # then where the joints are between other frames
    points = filled(pixels)
    low, high = (np.where(sure[..., None], points, fill) for fill in (np.inf, -np.inf))
    low, high = low.min(axis=1)[rows], high.max(axis=1)[rows]
    width, height = room * np.maximum(high - low, 2).T
    size = np.stack([np.maximum(width, height * aspect), np.maximum(height, width / aspect)], axis=-1)
    return Crops((low + high) / 2, size, np.tile(np.eye(2), (len(rows), 1, 1)))


def _wanted(video: Video, frames: np.ndarray, first: int) -> Iterator[tuple[int, np.ndarray]]:
    """(row, image) of these frame numbers from row `first` on, in order."""
    row_of = {int(frame): row for row, frame in enumerate(frames) if row >= first}
    if not row_of:
        return
    for number, image in images_ahead(video, int(frames[first]), int(frames[-1])):
        if number in row_of:
            yield row_of[number], image
