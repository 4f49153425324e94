"""How well exchanged limbs are found, where they are known:  pcnet3d lab evaluate swaps -o DIR

The swaps that the test bed's noise makes in 2D keypoints: in profile, where detectors make them and where they show
least. What pipeline/signals/swaps.py finds is compared with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....pipeline.core.pose import PoseSequence
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ....pipeline.signals.filters import stretches
from ....pipeline.signals.swaps import Swap, find_swaps, kinds
from ..synthetic.keypoint_noise import Noise
from .sets import Question
from .tables import Page, Table
from .testbed import MIN_FRAMES, see

_OVERLAP = 0.5  # intersection over union from which on a swap counts as found
PAGE = Page(
    "Swaps",
    ". A swap is found when one of the same kind overlaps with it by half of both together; certain ones may "
    "be masked.",
    [
        Table(
            "In profile",
            "in profile/*",
            ["set"],
            {
                "swaps": "{swaps}", "recall": "{recall:.1%}", "precision": "{precision:.1%}",
                "certain": "{certain:.1%}", "precision of these": "{certain_precision:.1%}",
            },
            "Keypoints with runs of 8 frames on average, as the lifter was trained on.",
        ),
    ],
)  # fmt: skip


@dataclass
class Tally:
    """Over takes. made: of the swaps that were made, whether each was found; told: of those that were found, whether
    each was made; certain: the same of those that are certain."""

    made: list[bool] = field(default_factory=list)
    told: list[bool] = field(default_factory=list)
    certain: list[bool] = field(default_factory=list)

    def add(self, made: Sequence[Swap], found: Sequence[Swap]) -> None:
        right = [any(_same(a, b) for a in made) for b in found]
        self.made += [any(_same(a, b) for b in found) for a in made]
        self.told += right
        self.certain += [of for of, swap in zip(right, found, strict=True) if swap.certain]

    def figures(self) -> dict[str, Any]:
        """Shares, NaN where there is nothing to count."""
        return {
            "recall": _share(self.made),
            "precision": _share(self.told),
            "certain": len(self.certain) / len(self.told) if self.told else float("nan"),
            "certain_precision": _share(self.certain),
            "swaps": len(self.made),
        }


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says: {"in profile": {set: one_set's}}."""
    sets = {
        one.label: one_set(question, one.label, [clip for clip in one.clips() if len(clip) >= MIN_FRAMES])
        for one in question.sets
    }
    heading = {key: said for key, said in question.heading().items() if key != "lifter"}  # nothing is lifted
    return {**heading, "in profile": sets}


def one_set(question: Question, label: str, clips: Sequence[Clip]) -> dict[str, Any]:
    """Figures of the noise's own swaps."""
    tally = Tally()
    for clip in each(clips, f"{label} takes", len(clips)):
        right = see(clip, question.seed, noise=Noise(swap_rate=0.0), views=question.views).keypoints
        swapped = see(clip, question.seed, views=question.views).keypoints
        tally.add(own_swaps(right, swapped), find_swaps(swapped))
    return tally.figures()


def own_swaps(right: PoseSequence, swapped: PoseSequence) -> list[Swap]:
    """What the noise exchanged: where the same keypoints with and without swaps differ."""
    made = []
    for way in kinds(right.layout, False):
        joints = way.pairs.ravel()
        a, b = (np.nan_to_num(poses.joints[:, joints]) for poses in (right, swapped))
        differs = (a != b).any(axis=(1, 2))
        made += [Swap(way.name, int(a), int(b) - 1, np.inf) for a, b in stretches(differs)]
    return made


def _same(a: Swap, b: Swap) -> bool:
    """Both of one kind, and of rows that overlap enough."""
    common = min(a.last_row, b.last_row) - max(a.first_row, b.first_row) + 1
    both = max(a.last_row, b.last_row) - min(a.first_row, b.first_row) + 1
    return a.kind == b.kind and common >= _OVERLAP * both


def _share(of: Sequence[bool]) -> float:
    return sum(of) / len(of) if of else float("nan")
