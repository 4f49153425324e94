"""What an adapter, a stage and a rectifier must look like. A module may be an adapter: it has the attributes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from .take import Take


class Adapter(Protocol):
    """Reads one upstream format.

    name: the entry point's name.
    gives: "poses" (3D), "keypoints" (2D), "video" or "imu".
    reads: one line for `pcnet3d list adapters`.
    sniff(path): whether the content looks like this format; cheap, and never raises.
    read(path, **options): a tuple of PoseSequence, one a person (or of Video, or of Imu), in the source's own layout
        and a frame that says its axes; InputError when the file is not what it should be.
    """

    name: str
    gives: str
    reads: str

    def sniff(self, path: Path) -> bool: ...
    def read(self, path: Path) -> tuple[Any, ...]: ...


class Stage(Protocol):
    """One step of a pipeline: a callable whose constructor arguments are its options.

    needs, gives: names of Take fields that must be filled before, and that are filled after.
    """

    @property
    def name(self) -> str: ...
    @property
    def needs(self) -> tuple[str, ...]: ...
    @property
    def gives(self) -> tuple[str, ...]: ...
    def __call__(self, take: Take) -> Take: ...


@runtime_checkable
class SharedStage(Stage, Protocol):
    """A stage that has more to say about several people of one recording than about each alone.

    together(takes): their takes, in the order given; what it does to one take it does to each.
    """

    def together(self, takes: Sequence[Take]) -> Sequence[Take]: ...


class Rectifier(Protocol):
    """Gives every frame its rotation.

    rotation(joints): joints (T, 17, 3), H36M17 in CAMERA axes, pelvis at the origin, any scale, NaN where
        missing -> R_camera_from_body (T, 3, 3) and error_deg (T,), NaN where it cannot tell.
    method: how results name it, "geometric" or "pcnet@<hash>".
    """

    @property
    def method(self) -> str: ...
    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...
