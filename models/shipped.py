"""What comes with the package, for `pcnet3d list models`."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Shipped:
    """name: what the option of its kind takes. kind: "rectifier" or "lifter". file: of its weights, if it has some."""

    name: str
    kind: str
    about: str
    file: str | None = None

    @property
    def what(self) -> str:
        """One line; of weights also their size and the first 12 digits of their SHA-256, as every summary has them."""
        if self.file is None:
            return self.about
        content = (Path(__file__).parent / self.file).read_bytes()
        return f"{self.about} ({len(content) / 1e6:.1f} MB, {hashlib.sha256(content).hexdigest()[:12]})"


GEOMETRIC = Shipped("geometric", "rectifier", "the torso's own axes, the paper's baseline")
PCNET = Shipped(
    "pcnet",
    "rectifier",
    "default rectifier, trained on motion capture; models/rectifier/card.md",
    "rectifier/pcnet.onnx",
)
PAPER = Shipped(
    "paper",
    "rectifier",
    "the paper's network at its full size, in int8; steadier on real clips, slower",
    "rectifier/paper.onnx",
)
LIFTER = Shipped(
    "pcnet3d",
    "lifter",
    "2D keypoints to 3D, used without --poses; models/lifter/card.md",
    "lifter/lifter.onnx",
)
