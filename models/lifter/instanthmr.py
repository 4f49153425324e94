"""InstantHMR: 70 keypoints of Meta's Momentum Human Rig in metres, and where the body is.

As its repository runs it (instanthmr/inference.py): inputs `image` (N, 3, 224, 224), RGB normalised as ImageNet's, the
square around the person's box, 1.2 times its longer side; and `cliff_cond` (N, 3), where the box is: its middle in -1
to 1 of the image's width and height, and its longer side over the image's longer side. Outputs by name, of which
`joints_3d` (N, 70, 3), metres about the body, and `cam_trans` (N, 3), metres from the camera, are used, both in axes of
a camera whose focal length is the image's diagonal.

A network with `cliff_focal` true in its metadata, as newer exports have it, wants angles instead: of the middle of the
box to the optical axis, and the longer side over the focal length, that of the camera or 1.05 times the diagonal.
Exports without `joints_3d` leave the joints to Meta's body model, and are refused.

With a known focal length the body is turned from the ray that the network took to the true one and put on the true ray
through its pixel, at a distance that grows with the focal length; without it nobody can tell how far away it is, and
`cam_trans` is not used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import MHR70, Layout
from ...pipeline.core.rotations import rotate, transpose
from ..common import download
from ..common.onnx import OnnxFile
from .features import ray_rotation
from .images import Crops, Seen, View, upright_crops

_BOX, _ROOM = 1.2, 1.2  # person over joints, as in its own benchmark (bbox_from_points); crop over person
_SIDE = 224
_MEAN = 255 * np.array([0.485, 0.456, 0.406], dtype=np.float32)
_DEVIATION = 255 * np.array([0.229, 0.224, 0.225], dtype=np.float32)
_DIAGONALS = 1.05  # of the image, for an unknown focal length of a network that wants angles
_INPUTS = {"image", "cliff_cond"}
_JOINTS, _PLACE = "joints_3d", "cam_trans"
_HANDS = ("thumb", "index", "middle", "ring", "pinky")
_BODY = [i for i, joint in enumerate(MHR70.joints) if not any(finger in joint for finger in _HANDS)]
_LAYOUT = Layout("MHR70 without fingers", tuple(MHR70.joints[i] for i in _BODY))
_HIPS = _LAYOUT.indices(("l_hip", "r_hip"))


@dataclass(frozen=True, eq=False)
class InstantHMR:
    """An ImageNetwork. Its points are the joints and, last, where the body is."""

    network: OnnxFile
    kind = "instanthmr"
    licence = download.INSTANTHMR.licence
    layout = _LAYOUT
    unit = "m"
    mirror = np.append(_LAYOUT.mirror, len(_LAYOUT))
    enough = 0.0  # it never says that there is nobody

    @property
    def size(self) -> tuple[int, int]:
        side = self.network.inputs["image"][2] or _SIDE
        return side, side

    @property
    def _wants_angles(self) -> bool:
        stated = self.network.session.get_modelmeta().custom_metadata_map
        return stated.get("cliff_focal", "").lower() == "true"

    def crops(self, pixels: np.ndarray, confidence: np.ndarray, rows: np.ndarray) -> Crops:
        """As ImageNetwork says."""
        return upright_crops(pixels, confidence, rows, _BOX * _ROOM, 1.0)

    def conditions(self, crops: Crops, view: View) -> np.ndarray:
        """(T, 3), where each box is."""
        middle, side = crops.centre - view.image_size / 2, crops.size[:, :1] / _ROOM
        if self._wants_angles:
            focal = self._own_focal(view)
            return np.concatenate([np.arctan(middle / focal), side / focal], axis=1)
        return np.concatenate([2 * middle / view.image_size, side / view.image_size.max()], axis=1)

    def look(self, crop: np.ndarray, condition: np.ndarray) -> Seen:
        """As ImageNetwork says."""
        network = self.network
        image = ((crop - _MEAN) / _DEVIATION).transpose(2, 0, 1)
        given = {"image": image, "cliff_cond": condition}
        answers = network.run(*(given[name][None].astype(network.input_dtype) for name in network.inputs))
        named = dict(zip(network.outputs, answers, strict=True))
        points = np.concatenate([named[_JOINTS][0, _BODY], named[_PLACE]]).astype(np.float64)
        return Seen(points, np.full(len(self.layout), np.nan))

    def bodies(
        self, points: np.ndarray, crops: Crops, view: View
    ) -> tuple[np.ndarray, np.ndarray | None, dict[str, Any]]:
        """As ImageNetwork says; where they are is known where the focal length is."""
        joints, place = points[:, :-1], points[:, -1]
        own = self._own_focal(view)
        said: dict[str, Any] = {"focal_px": own, "own_camera": True}
        if view.focal_px is None:
            return joints, None, said
        middle = view.straight(crops.centre) - view.image_size / 2
        R_own, R_true = (ray_rotation(middle / focal) for focal in (own, view.focal_px))
        hips = place + joints[:, _HIPS].mean(axis=1)
        away = hips[:, 2:] * view.focal_px / own
        # The network knows neither the lens nor the principal point: its camera filmed the hips at this pixel.
        filmed = hips[:, :2] / hips[:, 2:] * own + view.image_size / 2
        across = (view.straight(filmed) - view.image_size / 2) / view.focal_px
        root = np.concatenate([across * away, away], axis=1)
        return rotate(R_true @ transpose(R_own), joints), root, said | {"focal_px": view.focal_px}

    def _own_focal(self, view: View) -> float:
        """Of the camera in whose axes the network answers, in pixels."""
        diagonal = float(np.linalg.norm(view.image_size))
        return (view.focal_px or _DIAGONALS * diagonal) if self._wants_angles else diagonal


def is_instanthmr(network: OnnxFile) -> bool:
    """Whether an opened network has InstantHMR's inputs and outputs; InputError for one that lacks the joints."""
    inputs, outputs = network.inputs, network.outputs
    if set(inputs) != _INPUTS or _PLACE not in outputs:
        return False
    if outputs.get(_JOINTS, ())[1:] != (len(MHR70), 3) or outputs[_PLACE][1:] != (3,):
        raise InputError(
            "wrong-network",
            f"{network.path} has InstantHMR's inputs, but no joints_3d (1, 70, 3) beside cam_trans (1, 3): "
            f"{network.looks}; give the instanthmr.onnx that its authors publish.",
        )
    return len(inputs["image"]) == 4 and inputs["image"][1] == 3 and inputs["cliff_cond"][1:] == (3,)
