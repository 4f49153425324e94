"""How well exchanged limbs and overturned depth are found, where it is known:  pcnet3d evaluate --swaps -o DIR

Takes of the test bed get swaps of every kind and length, one about every three seconds: motion capture as it is (the
truth in the camera), its lifts, and noisy 2D keypoints. What pipeline/swaps.py finds is compared with what was put in,
and what it finds in the untouched takes is false. The detector's own swaps are left out of the noise, so that the takes
are right before they are touched.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.frames import CAMERA
from ..pipeline.pose import PoseSequence, package_version
from ..pipeline.progress import counted
from ..pipeline.swaps import Swap, find_swaps, kinds, repair_swaps
from .mocap import Subjects, read_clips
from .noise2d import Noise
from .testbed import LiftedTake, lifted_takes

_SETS: tuple[tuple[str, Subjects], ...] = (("CMU test", "test"), ("HDM05", "hdm05"))
LENGTHS = ((1, 1), (3, 10), (11, 30), (31, 60))
_EVERY = 90  # frames for one swap
_APART = 15  # frames between two, and from the take's ends


@dataclass
class Tally:
    """Counts over takes. put_in, found, and of both: swaps; frames the same. false: swaps found in `seconds` of takes
    that nothing was done to."""

    put_in: int = 0
    hit: int = 0
    frames_put_in: int = 0
    frames_hit: int = 0


@dataclass
class Score:
    """By kind and length (a pair of LENGTHS), and over all: what was found and was not there."""

    cells: dict[tuple[str, tuple[int, int]], Tally] = field(default_factory=dict)
    found: dict[str, int] = field(default_factory=dict)
    right: dict[str, int] = field(default_factory=dict)
    frames_found: int = 0
    frames_right: int = 0
    false: dict[str, int] = field(default_factory=dict)
    false_frames: int = 0
    frames: int = 0
