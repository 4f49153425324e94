"""A rectifier by its name or file, and what one of another package answers, checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...pipeline.core.device import Placement, placement
from ...pipeline.core.errors import InputError
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.plugins.registry import open_model

_ROUNDED = 0.01  # of a rotation in float16


def load_rectifier(name: str | Path) -> Rectifier:
    """A rectifier by name, one of `pcnet3d list models`: "geometric"; "pcnet", the default; "paper", of the published
    size; or another package's. Or the network in an .onnx file.

    InputError naming the nearest ones for an unknown name, and for a file that holds no rectifier.
    """
    opened = open_model("rectifiers", name)
    return _network(opened, placement()) if isinstance(opened, Path) else opened


@lru_cache(maxsize=8)  # several stages ask the same network
def _network(file: Path, where: Placement) -> Rectifier:
    from .onnx import PCNetRectifier

    return PCNetRectifier(file)


@dataclass(frozen=True)
class Checked:
    """A rectifier that raises InputError instead of an answer that is none: other shapes, or not rotations."""

    of: Rectifier

    @property
    def method(self) -> str:
        return self.of.method

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        given: object = self.of.rotation(joints)
        rows = len(joints)
        if isinstance(given, tuple) and [np.shape(each) for each in given] == [(rows, 3, 3), (rows,)]:
            R, error_deg = given
            answered = R[np.isfinite(R).all(axis=(1, 2))].astype(np.float64)
            off = np.abs(answered @ answered.swapaxes(1, 2) - np.eye(3)).max(initial=0.0)
            if off < _ROUNDED and (np.linalg.det(answered) > 0).all():
                return R, error_deg
        raise InputError(
            "plugin-broken",
            f"Expected from the rectifier {self.method} R_camera_from_body ({rows}, 3, 3), rotations or NaN, and "
            f"error_deg ({rows},), got something else: repair its package.",
        )
