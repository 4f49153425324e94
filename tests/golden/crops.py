"""A person before a camera, as lifters that look at crops are shown them."""

from typing import Any

import numpy as np

from golden.lifters import MARKER_COLOURS
from pcnet3d.models import load_lifter
from pcnet3d.pipeline import IMAGE, PoseSequence, remap
from pcnet3d.pipeline.core.layouts import COCO17, COCO23, MHR70
from pcnet3d.pipeline.core.lifted import ToLift
from pcnet3d.pipeline.plugins.protocols import Lifter

SIZE = (1280, 960)
FOCAL = 1500.0


def placed(joints: np.ndarray, x: float, y: float, z: float) -> np.ndarray:
    return joints + np.array([x, y, z])


def projected(joints: np.ndarray) -> np.ndarray:
    return joints[..., :2] / joints[..., 2:] * FOCAL + np.array(SIZE) / 2


def shown(pixels: np.ndarray, hidden: tuple[str, ...] = ()) -> np.ndarray:
    """An image with a disc for each of COCO23's joints (23, 2), in its colour."""
    import cv2

    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    for name, colour, (x, y) in zip(COCO23.joints, MARKER_COLOURS.tolist(), pixels.tolist(), strict=True):
        if name not in hidden:
            cv2.circle(image, (round(16 * x), round(16 * y)), 16 * 5, colour, -1, shift=4)
    return image


def keypoints_of(pixels: np.ndarray) -> PoseSequence:
    """Of COCO23's joints (T, 23, 2), those of COCO17."""
    return PoseSequence(pixels[:, : len(COCO17)], COCO17, IMAGE, frame_index=np.arange(len(pixels)))


def box_of(pixels: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle (2,) from the image's, and longer side, of the box around the joints of the first frame."""
    joints = remap(keypoints_of(pixels)).joints[0].astype(float)
    low, high = joints.min(axis=0), joints.max(axis=0)
    return (low + high) / 2 - np.array(SIZE) / 2, (high - low).max()


def mhr(body: np.ndarray) -> np.ndarray:
    """(70, 3) the body (23, 3) as InstantHMR's keypoints; what it lacks is at its nose."""
    neck = body[COCO23.indices(("l_shoulder", "r_shoulder"))].mean(axis=0)
    own = dict(zip(COCO23.joints, body, strict=True)) | {"neck": neck}
    return np.array([own.get(name, own["nose"]) for name in MHR70.joints])


def lifted_by(network: str | Lifter, keypoints: PoseSequence, *asked: Any, **more: Any) -> PoseSequence:
    """What a lifter or the network in a file makes of the keypoints, with its history."""
    lifter = load_lifter(network) if isinstance(network, str) else network
    return lifter.lift(ToLift(keypoints, *asked, **more)).noted()
