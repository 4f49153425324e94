"""Keypoints as public lifters want them: the kinds of networks by what they were trained to see (formats.md 2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.layouts import COCO17, H36M17, Layout
from ...pipeline.signals.filters import on_lines

Scaling = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Kind:
    """What a network that lifts sequences of 2D keypoints expects and gives.

    about: in words. scaled(pixels (T, J, 2), confidence (T, J), image_size (2,)) -> (T, J, 2), zero in the middle,
        so that negating x mirrors it. layout: of its input; the output is H36M17 always. crop: it sees the person
        alone and answers along the ray. unit: of its answer.
    """

    about: str
    scaled: Scaling
    layout: Layout
    crop: bool
    unit: str


def crop_scaled(pixels: np.ndarray, confidence: np.ndarray, image_size: np.ndarray) -> np.ndarray:
    """One square around all joints of all frames becomes [-1, 1]; joints of no confidence do not widen it.
    (T, J, 2) pixels, (T, J), (2,) to (T, J, 2), as Kind.scaled says.

    MotionBERT, lib/utils/utils_data.py, crop_scale with scale 1, by infer_wild.py without --pixel.
    """
    visible = pixels[confidence > 0]
    low, high = visible.min(axis=0), visible.max(axis=0)
    side = max(float((high - low).max()), 1e-6)
    return np.clip((pixels - (low + high) / 2) / (side / 2), -1, 1)


def pixel_scaled(pixels: np.ndarray, confidence: np.ndarray, image_size: np.ndarray) -> np.ndarray:
    """The image's shorter side becomes [-1, 1], (T, J, 2): MotionBERT's infer_wild.py --pixel."""
    return (pixels - image_size / 2) / (image_size.min() / 2)


def screen_scaled(pixels: np.ndarray, confidence: np.ndarray, image_size: np.ndarray) -> np.ndarray:
    """The image's width becomes [-1, 1] and y keeps the aspect, (T, J, 2): VideoPose3D's
    normalize_screen_coordinates."""
    return (pixels - image_size / 2) / (image_size[0] / 2)


KINDS = {
    "motionbert": Kind("MotionBERT, scaled to the person's crop", crop_scaled, H36M17, True, "arbitrary"),
    "motionbert-pixel": Kind(
        "MotionBERT as with --pixel, scaled by the image's shorter side", pixel_scaled, H36M17, False, "arbitrary"
    ),
    "videopose3d": Kind(
        "VideoPose3D, MixSTE and others on Human3.6M's joints, scaled by the image's width",
        screen_scaled, H36M17, False, "m",
    ),
    "videopose3d-coco": Kind(
        "VideoPose3D on COCO's joints, as for its videos in the wild", screen_scaled, COCO17, False, "m"
    ),
}  # fmt: skip


def filled(pixels: np.ndarray) -> np.ndarray:
    """Pixels (T, J, 2) with missing joints on a line from when they were last seen to when they are seen again.

    A joint that is never seen lies in the middle of the others.
    """
    out = pixels.astype(np.float64)
    frame = np.arange(len(out))
    for values in np.moveaxis(out.reshape(len(out), -1), -1, 0):  # a view: one coordinate of one joint
        values[:] = on_lines(values, frame)
    return np.where(np.isnan(out), np.nanmean(out, axis=1, keepdims=True), out)
