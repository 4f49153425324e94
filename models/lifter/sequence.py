"""Other people's lifters of 2D keypoints as ONNX: MotionBERT, VideoPose3D and networks of their form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import H36M17, remap
from ...pipeline.core.lifted import Lifted, ToLift
from ...pipeline.core.rotations import is_finite, rotate
from ..common.onnx import OnnxFile
from .features import ASSUMED_FOCAL, body_centre, ray_rotation
from .keypoints import checked_size, long_gaps, on_grid, rate_of, refuse_two_people
from .scaling import KINDS, filled
from .seams import blended, slid

_CLIP = 243  # frames that MotionBERT, MixSTE and the largest VideoPose3D are trained on
_LONG = 1024  # more than any public lifter's receptive field
_JOINTS = len(H36M17)


@dataclass(frozen=True)
class Span:
    """How many frames a network sees and answers. window: that it takes at once, None for any number. field: that
    an answer rests on when it answers fewer than it sees; None when it answers every frame."""

    window: int | None
    field: int | None


@dataclass(frozen=True, eq=False)
class SequenceLifter:
    """A pipeline.plugins.protocols.Lifter of a network (1, T, 17, 2 or 3) -> (1, T', 17, 3), H36M17 in CAMERA axes.

    channels: 2 for x and y, 3 with the confidence.
    """

    network: OnnxFile
    method: str
    kind: str
    channels: int
    span: Span

    takes = ()

    @property
    def unit(self) -> str:
        return KINDS[self.kind].unit

    def lift(self, asked: ToLift) -> Lifted:
        """Missing joints are put on a line between where they were seen and have no confidence; an unknown
        confidence counts as 1. Frames in a run of more than half a second without any joint are NaN."""
        kind, keypoints, flip = KINDS[self.kind], asked.keypoints, asked.flip
        size = checked_size(asked)
        pixels, confidence, rows = on_grid(remap(keypoints, kind.layout))
        rate = rate_of(keypoints, rows)
        refuse_two_people(pixels, rate)
        visible = is_finite(pixels)
        confidence = np.where(visible, np.where(np.isnan(confidence), 1.0, confidence), 0.0)
        x = kind.scaled(filled(pixels), confidence, size)
        if self.channels == 3:
            x = np.concatenate([x, confidence[..., None]], axis=-1)
        joints = self._answer(x)
        if flip:
            mirror = kind.layout.mirror
            turned = x[:, mirror] * np.array([-1, 1, 1][: self.channels])
            joints = (joints + self._answer(turned)[:, H36M17.mirror] * np.array([-1, 1, 1])) / 2
        unseen = long_gaps(np.any(visible, axis=1), rate)
        joints = np.where(unseen[:, None, None], np.nan, joints)[rows]
        focal: dict[str, Any] = {"focal_px": None}
        if kind.crop:
            centre = body_centre(remap(keypoints, H36M17).joints.astype(np.float64))
            joints, focal = from_ray(joints, centre, size, asked.focal_px)
        body = remap(keypoints, H36M17)
        return Lifted(
            body.with_(joints=joints, frame=CAMERA.with_(origin="pelvis", unit=kind.unit)),
            model=self.method,
            kind=self.kind,
            focal_known=asked.focal_known,
            **focal,
            flip=flip,
            frames_without_joints=int(unseen[rows].sum()),
            joints_on_a_line=int((~visible[rows] & ~unseen[rows, None]).sum()),
        )

    def _answer(self, x: np.ndarray) -> np.ndarray:
        """(T, 17, 3) relative to the pelvis, to the scaled keypoints (T, 17, channels)."""

        def run(part: np.ndarray) -> np.ndarray:
            joints = answer(self.network, part)
            return joints - joints[:, [H36M17.index("pelvis")]]

        if self.span.field is not None:
            return slid(run, x, self.span.field, self.span.window)
        return blended(run, x, self.span.window or _CLIP, any_length=self.span.window is None)


def from_ray(
    joints: np.ndarray, centre_px: np.ndarray, image_size: np.ndarray, focal_px: float | None
) -> tuple[np.ndarray, dict[str, Any]]:
    """Joints (T, J, 3) of a network that sees the person in a crop, turned from the ray to the person, along which it
    answers, to CAMERA where the focal length is known, else as they are.

    centre_px: (T, 2) pixels where the ray goes. image_size: (2,). The dict has fields of a
    pipeline.core.lifted.Lifted; an unknown focal length is taken for the longer side of the image there.
    """
    focal = ASSUMED_FOCAL * float(image_size.max()) if focal_px is None else focal_px
    rays = (centre_px - image_size / 2) / focal
    bearing = np.degrees(np.arctan(rays[:, 0]))
    if focal_px is not None:
        joints = rotate(ray_rotation(rays), joints)
    return joints, {"focal_px": focal, "bearing_deg": (float(bearing.min()), float(bearing.max()))}


def is_sequence_network(network: OnnxFile) -> bool:
    """Whether an opened network has the shapes of such a lifter."""
    return channels_of(network) is not None and _output(network) is not None


def channels_of(network: OnnxFile) -> int | None:
    """How many numbers a keypoint has for it, 2 or 3; None when it takes no sequence of 17 joints."""
    shape = network.only_input
    return shape[3] if _has_joints(shape, (2, 3)) else None


def answer(network: OnnxFile, x: np.ndarray) -> np.ndarray:
    """(T', 17, 3) to (T, 17, channels)."""
    place = list(network.outputs).index(_output(network) or "")
    return network.run(x[None].astype(network.input_dtype))[place][0].astype(np.float64)


def span_of(network: OnnxFile) -> Span:
    """How many frames it takes and answers: by its shapes, and by trying where they leave it open.
    InputError when neither tells."""
    shape = network.only_input
    tries = (shape[1],) if shape[1] else (_CLIP, _LONG)
    for frames in tries:
        try:
            answers = len(answer(network, np.zeros((frames, _JOINTS, shape[3] or 0))))
        except Exception:  # onnxruntime's errors have no common class but Exception
            continue
        if answers == frames:
            return Span(shape[1], None)
        if 0 < answers < frames:
            return Span(shape[1], frames - answers + 1)
    tried = " or ".join(map(str, tries))
    raise InputError(
        "wrong-network",
        f"Expected {network.path} to lift {tried} frames of keypoints; it cannot, or returns more frames.",
    )


def _has_joints(shape: tuple[int | None, ...], channels: tuple[int, ...]) -> bool:
    return len(shape) == 4 and shape[0] in (1, None) and shape[2] in (_JOINTS, None) and shape[3] in channels


def _output(network: OnnxFile) -> str | None:
    """The name of the output with 3D joints."""
    return next((name for name, shape in network.outputs.items() if _has_joints(shape, (3,))), None)
