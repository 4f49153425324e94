"""The models that come with the package, registered by name in pyproject.toml as those of any other package are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..pipeline.files.digest import sha256
from .lifter import SHIPPED
from .rectifier.load import Geometric


@dataclass(frozen=True)
class Shipped:
    """A model (pipeline.plugins.protocols.Model). about: one line. open: the object, or the path of its weights.
    file: of its weights, if it has some."""

    about: str
    open: Callable[[], Any]
    file: Path | None = None

    @property
    def what(self) -> str:
        """One line; of weights also their size and the first digits of their SHA-256."""
        if self.file is None:
            return self.about
        return f"{self.about} ({self.file.stat().st_size / 1e6:.1f} MB, {sha256(self.file)[:12]})"


def _weights(about: str, name: str) -> Shipped:
    file = Path(__file__).parent / "rectifier" / name
    return Shipped(about, lambda: file, file)


def _own_lifter() -> Any:
    from .lifter.builtin import OwnLifter

    return OwnLifter()


GEOMETRIC = Shipped("the torso's own axes, the paper's baseline", Geometric)
PCNET = _weights("default rectifier, trained on motion capture; models/rectifier/card.md", "pcnet.onnx")
PAPER = _weights("the paper's network at its full size, in int8; slower", "paper.onnx")
LIFTER = Shipped("2D keypoints to 3D, used without --poses; models/lifter/card.md", _own_lifter, SHIPPED)
