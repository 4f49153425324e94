"""The models that come with the package, registered by name in pyproject.toml as those of any other package are."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .lifter import SHIPPED
from .rectifier.geometric import Geometric


@dataclass(frozen=True)
class Shipped:
    """A model (pipeline.plugins.protocols.Model). about: one line. open: the object, or the path of its weights.
    files: of its weights, if it has some; the first is the network that results name."""

    about: str
    open: Callable[[], Any]
    files: tuple[Path, ...] = ()

    @property
    def digests(self) -> dict[str, str]:
        """The first 12 digits of the SHA-256 of each file, as every summary has them, by the file's name."""
        return {file.name: hashlib.sha256(file.read_bytes()).hexdigest()[:12] for file in self.files}

    @property
    def what(self) -> str:
        """One line; of weights also their size and digest."""
        if not self.files:
            return self.about
        digest = next(iter(self.digests.values()))
        return f"{self.about} ({self.files[0].stat().st_size / 1e6:.1f} MB, {digest})"


def _weights(about: str, name: str) -> Shipped:
    file = Path(__file__).parent / "rectifier" / name
    return Shipped(about, lambda: file, (file,))


def _own_lifter() -> Any:
    from .lifter.builtin import OwnLifter

    return OwnLifter()


GEOMETRIC = Shipped("the torso's own axes, the paper's baseline", Geometric)
PCNET = _weights("default rectifier, trained on motion capture; models/rectifier/card.md", "pcnet.onnx")
PAPER = _weights("the paper's network at its full size, in int8; slower", "paper.onnx")
LIFTER = Shipped("2D keypoints to 3D, used without --poses; models/lifter/card.md", _own_lifter, (SHIPPED,))
