"""How well exchanged limbs are found, where they are known:  pcnet3d evaluate swaps -o DIR

The swaps that the test bed's noise makes in 2D keypoints: in profile, where detectors make them and where they show
least. What pipeline/signals/swaps.py finds is compared with them; and what putting them right is worth to the lift.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....pipeline.core.pose import PoseSequence
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ....pipeline.signals.filters import stretches
from ....pipeline.signals.swap_repair import repair_swaps, settled
from ....pipeline.signals.swaps import Kind, Swap, find_swaps, kinds
from ...common.metrics import Figure, joint_error
from ..synthetic.keypoint_noise import Noise
from .sets import Question
from .tables import Page, Table
from .take_answers import joints_of
from .testbed import MIN_FRAMES, SeenTake, see

_OVERLAP = 0.5  # intersection over union from which on a swap counts as found
PAGE = Page(
    "Swaps",
    ". A swap is found when one of the same kind overlaps with it by half of both together; certain ones are repaired. "
    "Frames count once for each kind.",
    [
        Table(
            "In profile",
            "in profile/*",
            ["set"],
            {
                "swaps": "{swaps}", "recall": "{recall:.1%}", "precision": "{precision:.1%}",
                "certain": "{certain:.1%}", "precision of these": "{certain_precision:.1%}",
                "frames: recall": "{frame_recall:.1%}", "frames: precision": "{frame_precision:.1%}",
                "lift without swaps": "{lift[without swaps]}", "with": "{lift[with swaps]}",
                "put right": "{lift[put right]}",
            },
            "Keypoints with runs of 8 frames on average, as the lifter was trained on. MPJPE of our lift in mm (p50 / "
            "mean / p95), one scale a take, in the frames with swaps.",
        ),
    ],
)  # fmt: skip


@dataclass(frozen=True)
class Made:
    """A swap that was made: rows first_row to last_row, wrong in this way."""

    way: Kind
    first_row: int
    last_row: int


@dataclass
class Tally:
    """Counts over takes. swaps: [made, of these found]. told: [found, of these right]; certain: the same of those that
    are certain, and so repaired. cells: rows times kinds [made, found, both]."""

    swaps: list[int] = field(default_factory=lambda: [0, 0])
    told: list[int] = field(default_factory=lambda: [0, 0])
    certain: list[int] = field(default_factory=lambda: [0, 0])
    cells: list[int] = field(default_factory=lambda: [0, 0, 0])

    def add(self, rows: int, made: Sequence[Made], found: Sequence[Swap]) -> None:
        spans = [(one.way.name, one.first_row, one.last_row) for one in made]
        told = [(swap.kind, swap.first_row, swap.last_row) for swap in found]
        self.swaps[0] += len(spans)
        self.swaps[1] += sum(any(_same(a, b) for b in told) for a in spans)
        right = [any(_same(a, b) for a in spans) for b in told]
        sure = [swap.certain for swap in found]
        for tally, chosen in ((self.told, [True] * len(found)), (self.certain, sure)):
            tally[0] += sum(chosen)
            tally[1] += sum(a and b for a, b in zip(right, chosen, strict=True))
        truth, said = _cells(rows, spans), _cells(rows, told)
        for i, value in enumerate((len(truth), len(said), len(truth & said))):
            self.cells[i] += value

    def figures(self) -> dict[str, Any]:
        """Shares, NaN where there is nothing to count."""
        return {
            "recall": _share(self.swaps[1], self.swaps[0]),
            "precision": _share(self.told[1], self.told[0]),
            "certain": _share(self.certain[0], self.told[0]),
            "certain_precision": _share(self.certain[1], self.certain[0]),
            "frame_recall": _share(self.cells[2], self.cells[0]),
            "frame_precision": _share(self.cells[2], self.cells[1]),
            "swaps": self.swaps[0],
        }


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says: {"in profile": {set: one_set's}}."""
    sets = {
        one.label: one_set(question, one.label, [clip for clip in one.clips() if len(clip) >= MIN_FRAMES])
        for one in question.sets
    }
    return {**question.heading(), "in profile": sets}


def one_set(question: Question, label: str, clips: Sequence[Clip]) -> dict[str, Any]:
    """Figures of the noise's own swaps, and {"lift": {case: Figure}}, errors of the lift."""
    tally, errors = Tally(), {"without swaps": [], "with swaps": [], "put right": []}
    for clip in each(clips, f"{label} takes", len(clips)):
        take = see(clip, question.seed, noise=Noise(swap_rate=0.0), views=question.views)
        swapped = see(clip, question.seed, views=question.views)
        for name, values in _profile(question, tally, take, swapped, question.lift_seen(take)).items():
            errors[name].append(values)
    lift = {name: Figure.of(np.concatenate(values)) for name, values in errors.items()}
    return {**tally.figures(), "lift": lift}


def _profile(
    question: Question, tally: Tally, right: SeenTake, swapped: SeenTake, lifted: PoseSequence
) -> dict[str, np.ndarray]:
    """Adds one take with the noise's own swaps. -> errors of the lift in mm, one scale a take, in the frames that they
    spoil: as if there were none, with them, and as read.swaps=repair leaves them."""
    made = own_swaps(right.keypoints, swapped.keypoints)
    found = find_swaps(swapped.keypoints)
    tally.add(len(lifted), made, found)
    spoilt = np.zeros(len(lifted), dtype=bool)
    for one in made:
        spoilt[one.first_row : one.last_row + 1] = True
    lifts = {"without swaps": lifted}
    for name, keypoints in (
        ("with swaps", swapped.keypoints),
        ("put right", repair_swaps(swapped.keypoints, settled(swapped.keypoints, found)[0])),
    ):
        lifts[name] = question.lift(keypoints, right.image_size)
    return {
        name: 1000 * joint_error(joints_of(poses, right.truth), right.truth)[spoilt]
        for name, poses in lifts.items()
    }


def own_swaps(right: PoseSequence, swapped: PoseSequence) -> list[Made]:
    """What the noise exchanged: where the same keypoints with and without swaps differ."""
    made = []
    for way in kinds(right.layout, False):
        joints = way.pairs.ravel()
        a, b = (np.nan_to_num(poses.joints[:, joints]) for poses in (right, swapped))
        differs = (a != b).any(axis=(1, 2))
        made += [Made(way, int(a), int(b) - 1) for a, b in stretches(differs)]
    return made


def _same(a: tuple[str, int, int], b: tuple[str, int, int]) -> bool:
    """Both of one kind, and of rows that overlap enough."""
    common = min(a[2], b[2]) - max(a[1], b[1]) + 1
    return a[0] == b[0] and common >= _OVERLAP * (max(a[2], b[2]) - min(a[1], b[1]) + 1)


def _cells(rows: int, spans: Iterable[tuple[str, int, int]]) -> set[tuple[str, int]]:
    return {(kind, row) for kind, first, last in spans for row in range(first, min(last + 1, rows))}


def _share(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")
