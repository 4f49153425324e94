"""A rectifier by its name or file: 3DPCNet in an .onnx file, at run time by numpy and onnxruntime only; the torso's own
axes; and what one of another package answers, checked."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.device import Placement, placement
from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import from_columns, is_finite, unit
from ...pipeline.core.system import cores
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.plugins.registry import open_model
from ..common.onnx import open_onnx

_ROUNDED = 0.01  # of a rotation in float16
CHUNK = 64  # poses answered at a time; fits the caches
_INPUTS = {"joints": (None, 17, 3), "valid": (None, 17)}  # behind a batch of any size
_OUTPUTS = {"R": (3, 3), "error_deg": ()}  # each behind the batch


def load_rectifier(name: str | Path) -> Rectifier:
    """A rectifier by name, one of `pcnet3d list models`: "geometric"; "pcnet", the default; "paper", of the published
    size; or another package's. Or the network in an .onnx file.

    InputError naming the nearest ones for an unknown name, and for a file that holds no rectifier.
    """
    opened = open_model("rectifiers", name)
    return _network(opened, placement()) if isinstance(opened, Path) else opened


@lru_cache(maxsize=8)  # several stages ask the same network
def _network(file: Path, where: Placement) -> Rectifier:
    return PCNetRectifier(file)


class Geometric:
    """The geometric baseline of the paper: the torso's own axes, without gravity. rotation(Q x) = Q rotation(x) for any
    rotation Q; a bent trunk tilts its result."""

    method = "geometric"

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """joints (T, 17, 3) in any right-handed axes -> R_source_from_body (T, 3, 3), error_deg (T,) all NaN.

        A frame without both shoulders and both hips is NaN.
        """
        l_shoulder, r_shoulder, l_hip, r_hip = (
            joints[:, H36M17.index(name)].astype(np.float64)
            for name in ("l_shoulder", "r_shoulder", "l_hip", "r_hip")
        )
        shoulders = l_shoulder - r_shoulder
        trunk = (l_shoulder + r_shoulder) / 2 - (l_hip + r_hip) / 2
        facing = unit(np.cross(shoulders, trunk))
        left = unit(shoulders)
        R_source_from_body = from_columns(-facing, -left, np.cross(facing, left))
        whole = is_finite(facing) & is_finite(left)
        return np.where(whole[:, None, None], R_source_from_body, np.nan), np.full(len(joints), np.nan)


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


class PCNetRectifier:
    """Rectifier from an exported network. method: the name it was trained under, or its file's, "@" and the first 12
    digits of the file's SHA-256. targets: what its rotations are of, a "body" or a data set's own "axes"; a run refuses
    those."""

    def __init__(self, path: str | Path) -> None:
        """path: an .onnx file of these inputs and outputs (docs/python.md). InputError when there is no such file, or
        it is not a rectifier."""
        # Every chunk in one thread: onnxruntime's own threads wait for each other within each layer, which costs more
        # than it gains in layers as small as these, most of all for a single pose or beside other programs.
        opened = open_onnx(path, "a rectifier", threads=1)
        self.session = opened.session
        answers = {name: shape[1:] for name, shape in opened.outputs.items()}
        if opened.inputs != _INPUTS or answers != _OUTPUTS:
            raise InputError(
                "wrong-network",
                f"{path} is not a rectifier: expected, each behind a batch of any size (?), inputs joints (?, 17, 3), "
                f"valid (?, 17); outputs R (?, 3, 3), error_deg (?), got {opened.looks}; export it as docs/python.md "
                "shows.",
            )
        self.targets = opened.stated.get("targets", "body")
        unnamed = "pcnet" if "pcnet3d" in opened.stated else Path(path).name
        self.method = f"{opened.stated.get('name', unnamed)}@{opened.digest}"

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """joints (T, 17, 3) in CAMERA axes, any origin and scale, NaN where missing -> R_camera_from_body (T, 3, 3)
        and error_deg (T,).

        A frame is NaN without a pelvis (its own, or both hips), without both hips and both shoulders to tell left
        from right (one pair is enough), or without a thorax or both shoulders to tell where the trunk points.
        """
        joints, valid, usable = prepare(joints)
        R = np.full((len(joints), 3, 3), np.nan)
        error_deg = np.full(len(joints), np.nan)
        rows = np.flatnonzero(usable)
        parts = [rows[part] for part in blocks(len(rows), CHUNK)]

        def answer(part: np.ndarray) -> None:
            R[part], error_deg[part] = self.session.run(
                ["R", "error_deg"], {"joints": joints[part], "valid": valid[part]}
            )

        if len(parts) > 1:
            with ThreadPoolExecutor(cores()) as pool:
                list(pool.map(answer, parts))
        elif parts:
            answer(parts[0])  # at once: a frame at a time, the pool would be a tenth of its cost
        return R, error_deg


def prepare(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The network's input (T, 17, 3) and (T, 17), float32, and (T,) whether a frame has torso enough."""
    joints = np.array(joints, dtype=np.float32)
    pelvis = H36M17.index("pelvis")
    lost = ~is_finite(joints[:, pelvis])
    joints[lost, pelvis] = joints[lost][:, H36M17.indices(("l_hip", "r_hip"))].mean(axis=1)
    valid = is_finite(joints)
    pair = {part: valid[:, H36M17.indices((f"l_{part}", f"r_{part}"))].all(1) for part in ("hip", "shoulder")}
    usable = (
        valid[:, pelvis]
        & (pair["hip"] | pair["shoulder"])
        & (valid[:, H36M17.index("thorax")] | pair["shoulder"])
    )
    spread = np.ptp(np.nan_to_num(joints - joints[:, [pelvis]]), axis=1).max(axis=-1)
    usable &= spread > 0
    return np.where(valid[..., None], joints, 0), valid.astype(np.float32), usable
