"""How well exchanged limbs are found, where they are known:  pcnet3d lab evaluate swaps -o DIR

The swaps that the test bed's noise makes in 2D keypoints: in profile, where detectors make them and where they show
least; limbs drawn on the other side's where they are apart; and takes without either, of which nothing may be told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....pipeline.core.anthropometry import trunk_length
from ....pipeline.core.pose import PoseSequence
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ....pipeline.signals.filters import stretches
from ....pipeline.signals.swaps import Swap, find_swaps, kinds, limbs_on_one
from ..synthetic.keypoint_noise import Noise
from .sets import Question
from .tables import Page, Table
from .testbed import MIN_FRAMES, see

# Limbs are drawn on one where they are this far apart, in trunk lengths, for so many rows, and off it by this.
_APART, _SHORTEST, _LONGEST, _OFF = 0.5, 6, 20, 0.02
_OVERLAP = 0.5  # intersection over union from which on a swap counts as found
PAGE = Page(
    "Swaps",
    ". A swap is found when one of the same kind overlaps with it by half of both together; certain ones may "
    "be masked. Alarms are takes without any of which something is told.",
    [
        Table(
            "In profile",
            "in profile/*",
            ["set"],
            {
                "swaps": "{swaps}", "recall": "{recall:.1%}", "precision": "{precision:.1%}",
                "certain": "{certain:.1%}", "precision of these": "{certain_precision:.1%}",
                "on one": "{on_one}", "recall of these": "{on_one_recall:.1%}",
                "takes": "{takes}", "alarms": "{alarms:.1%}",
            },
            "Keypoints with runs of 8 frames on average, as the lifter was trained on.",
        ),
    ],
)  # fmt: skip


@dataclass
class Tally:
    """Over takes. made: of the swaps that were made, whether each was found; told: of those that were found, whether
    each was made; certain: the same of those that are certain; on_one: of limbs drawn on the other side's, whether it
    was found; sound: of takes without any, whether something was told."""

    made: list[bool] = field(default_factory=list)
    told: list[bool] = field(default_factory=list)
    certain: list[bool] = field(default_factory=list)
    on_one: list[bool] = field(default_factory=list)
    sound: list[bool] = field(default_factory=list)

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
            "on_one": len(self.on_one),
            "on_one_recall": _share(self.on_one),
            "takes": len(self.sound),
            "alarms": _share(self.sound),
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
    """Figures of the noise's own swaps, of limbs on one, and of neither."""
    tally, rng = Tally(), np.random.default_rng(question.seed)
    for clip in each(clips, f"{label} takes", len(clips)):
        right = see(clip, question.seed, noise=Noise(swap_rate=0.0), views=question.views).keypoints
        swapped = see(clip, question.seed, views=question.views).keypoints
        tally.add(own_swaps(right, swapped), find_swaps(swapped))
        tally.sound.append(bool(find_swaps(right)))
        for limb in ("leg", "arm"):
            wrong, made = drawn_on_one(right, limb, rng)
            found = find_swaps(wrong) if made else ()
            tally.on_one += [any(_same(each, swap) for swap in found) for each in made]
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


def drawn_on_one(right: PoseSequence, limb: str, rng: np.random.Generator) -> tuple[PoseSequence, list[Swap]]:
    """Keypoints with both legs, or arms, on one of them in some of the times in which they are clearly apart."""
    (way,) = (way for way in limbs_on_one(right.layout) if way.limb == limb)
    joints, trunk = right.joints.astype(np.float64), float(trunk_length(right.joints, right.layout))
    apart = np.linalg.norm(joints[:, way.pairs[:, 0]] - joints[:, way.pairs[:, 1]], axis=-1)
    made = []
    for start, stop in stretches(np.nan_to_num(apart).max(axis=1) > _APART * trunk).tolist():
        length = int(rng.integers(_SHORTEST, _LONGEST + 1))
        first = (start + stop - length) // 2
        if first < start or rng.random() < 0.5:
            continue
        rows, (to, of) = slice(first, first + length), rng.permutation(way.pairs.T)
        joints[rows, to] = joints[rows, of] + rng.normal(0, _OFF * trunk, (length, len(to), 2))
        made.append(Swap(way.name, first, first + length - 1, np.inf))
    return right.with_(joints=joints), made


def _same(a: Swap, b: Swap) -> bool:
    """Both of one kind, and of rows that overlap enough."""
    common = min(a.last_row, b.last_row) - max(a.first_row, b.first_row) + 1
    both = max(a.last_row, b.last_row) - min(a.first_row, b.first_row) + 1
    return a.kind == b.kind and common >= _OVERLAP * both


def _share(of: Sequence[bool]) -> float:
    return sum(of) / len(of) if of else float("nan")
