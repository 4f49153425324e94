"""RTMPose and its kin: joints of the person in a crop, each coordinate the peak of a row of bins (SimCC).

As MMPose exports them: `simcc_x` (N, J, bins) and `simcc_y` (N, J, bins) for an input (N, 3, H, W), RGB less mean over
deviation, an upright crop 1.25 times the person's box; the bins are a whole number of times finer than the pixels.
The score is the lower of the two peaks (MMPose get_simcc_maximum), cut to [0, 1]. Of 133 joints (COCO-WholeBody) the
body's 17 are kept.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import COCO17, COCO23, HALPE26, Layout
from ..common.onnx import OnnxFile
from .crops import Crop, box_around, fitted
from .protocols import Found

MEAN = np.array([123.675, 116.28, 103.53], dtype=np.float32)
DEVIATION = np.array([58.395, 57.12, 57.375], dtype=np.float32)
_SEEN = 0.3  # score from which a joint belongs into the person's box, MMPose's own threshold for drawing
LAYOUTS = {17: COCO17, 26: HALPE26, 133: COCO23}  # by number of joints, of which the first count


class SimCC:
    """CropNetwork with SimCC outputs."""

    room = 1.25

    def __init__(self, network: OnnxFile) -> None:
        (image,), joints = network.inputs.values(), network.outputs["simcc_x"][1]
        if joints not in LAYOUTS:
            raise InputError(
                "wrong-network",
                f"{network.path}: expected {', '.join(map(str, LAYOUTS))} joints of a person, got {joints}.",
            )
        if image[2] is None or image[3] is None:
            raise InputError(
                "wrong-network",
                f"{network.path}: expected a fixed height and width of the input, got {network.looks}; "
                "export it with its own input size.",
            )
        self._network = network
        self._size = (image[3], image[2])
        self.aspect = image[3] / image[2]
        self.layout: Layout = LAYOUTS[joints]
        self.method = f"simcc@{network.digest}"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        cropped = (crop.cut(image, self._size) - MEAN) / DEVIATION
        bins = dict(
            zip(self._network.outputs, self._network.run(cropped.transpose(2, 0, 1)[None]), strict=True)
        )
        rows = [bins[name][0, : len(self.layout)] for name in ("simcc_x", "simcc_y")]
        shares = np.stack([row.argmax(axis=1) / row.shape[1] for row in rows], axis=1)
        xy = crop.in_image(shares)
        score = np.clip(np.minimum(*(row.max(axis=1) for row in rows)), 0, 1)
        seen = score > _SEEN
        return Found(xy, score, box_around(xy[seen] if seen.any() else xy), float(score.mean()))

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        return fitted(person.box, self.aspect, self.room)
