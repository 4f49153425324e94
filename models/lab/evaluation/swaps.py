"""How well exchanged limbs and overturned depth are found, where they are known:  pcnet3d evaluate swaps -o DIR

Swaps of every kind and length are put into takes of the test bed, one about every three seconds, anywhere: into motion
capture as it is, into its lifts, and into noisy 2D keypoints. What pipeline/signals/swaps.py finds there is compared
with what was put in; what it finds in the untouched takes is false. Then the noise's own swaps, which happen in
profile, where detectors make them and where they show least; and what putting them right is worth to the lift.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....pipeline.core.frames import CAMERA
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

_LENGTHS = ((1, 1), (3, 10), (11, 30), (31, 60))
_EVERY = 90  # frames
_MARGIN = 10  # frames between two swaps, and at the ends of a take
_OVERLAP = 0.5  # intersection over union from which on a swap counts as found
_ROUNDS = 3  # times that a take gets other swaps
_SHARES = {
    "swaps": "{swaps}", "recall": "{recall:.1%}", "precision": "{precision:.1%}", "certain": "{certain:.1%}",
    "precision of these": "{certain_precision:.1%}", "frames: recall": "{frame_recall:.1%}",
    "frames: precision": "{frame_precision:.1%}",
}  # fmt: skip
PAGE = Page(
    "Swaps",
    ". A swap is found when one of the same kind overlaps with it by half of both together; certain ones are repaired. "
    "Frames count once for each kind.",
    [
        Table(
            "Anywhere in the take",
            "anywhere/*",
            ["set"],
            _SHARES
            | {"false a minute, untouched": "{false_per_minute:.2f} in {untouched_minutes:.1f} minutes"},
        ),
        Table(
            "",
            "anywhere/*/by_kind_and_length/*",
            ["set", "kind, frames"],
            {"found / put in": "{1} / {0}"},
            "Recall by kind and length in frames:",
        ),
        Table(
            "The noise's own, in profile",
            "in profile/*",
            ["set"],
            _SHARES
            | {
                "lift without swaps": "{lift[without swaps]}",
                "with": "{lift[with swaps]}",
                "put right": "{lift[put right]}",
            },
            "Keypoints with runs of 8 frames on average, as the lifter was trained on. MPJPE of our lift in mm (p50 / "
            "mean / p95), one scale a take, in the frames with swaps.",
        ),
    ],
)


@dataclass(frozen=True)
class Made:
    """A swap that was put in: rows first_row to last_row, wrong in these ways; one of _LENGTHS."""

    ways: tuple[Kind, ...]
    first_row: int
    last_row: int
    name: str
    length: tuple[int, int] | None = None


@dataclass
class Tally:
    """Counts over takes. swaps: [put in, found] by kind and length. told: [found, of these right]; certain: the same
    of those that are certain, and so repaired. cells: rows times kinds [put in, found, both]. false: by kind, in
    `frames` that nothing was done to."""

    swaps: dict[tuple[str, tuple[int, int] | None], list[int]] = field(default_factory=dict)
    told: list[int] = field(default_factory=lambda: [0, 0])
    certain: list[int] = field(default_factory=lambda: [0, 0])
    cells: list[int] = field(default_factory=lambda: [0, 0, 0])
    false: dict[str, int] = field(default_factory=dict)
    frames: int = 0

    def add(self, rows: int, made: Sequence[Made], found: Sequence[Swap]) -> None:
        spans = [(way.name, one.first_row, one.last_row) for one in made for way in one.ways]
        told = [(swap.kind, swap.first_row, swap.last_row) for swap in found]
        for one in made:
            mine = [(way.name, one.first_row, one.last_row) for way in one.ways]
            count = self.swaps.setdefault((one.name, one.length), [0, 0])
            count[0] += 1
            count[1] += all(any(_same(a, b) for b in told) for a in mine)
        right = [any(_same(a, b) for a in spans) for b in told]
        sure = [swap.certain for swap in found]
        for tally, chosen in ((self.told, [True] * len(found)), (self.certain, sure)):
            tally[0] += sum(chosen)
            tally[1] += sum(a and b for a, b in zip(right, chosen, strict=True))
        truth, said = _cells(rows, spans), _cells(rows, told)
        for i, value in enumerate((len(truth), len(said), len(truth & said))):
            self.cells[i] += value

    def add_untouched(self, rows: int, found: Sequence[Swap]) -> None:
        self.frames += rows
        for swap in found:
            self.false[swap.kind] = self.false.get(swap.kind, 0) + 1

    def figures(self, fps: float = 30.0) -> dict[str, Any]:
        """Shares, NaN where there is nothing to count."""
        put_in, found = (sum(count[i] for count in self.swaps.values()) for i in range(2))
        return {
            "recall": _share(found, put_in),
            "precision": _share(self.told[1], self.told[0]),
            "certain": _share(self.certain[0], self.told[0]),
            "certain_precision": _share(self.certain[1], self.certain[0]),
            "frame_recall": _share(self.cells[2], self.cells[0]),
            "frame_precision": _share(self.cells[2], self.cells[1]),
            "swaps": put_in,
            "false_per_minute": _share(60 * fps * sum(self.false.values()), self.frames),
            "untouched_minutes": self.frames / fps / 60,
            "false": self.false,
            "by_kind_and_length": {
                f"{name}, {length[0]}-{length[1]}" if length else name: count
                for (name, length), count in self.swaps.items()
            },
        }


def tables(question: Question) -> dict[str, Any]:
    """Everything the report says, as nested dicts with Figures."""
    results: dict[str, Any] = {**question.heading(), "anywhere": {}, "in profile": {}}
    for one in question.sets:
        clips = [clip for clip in one.clips() if len(clip) >= MIN_FRAMES]
        tallies, profile = one_set(question, one.label, clips)
        results["anywhere"] |= {f"{one.label}, {kind}": tally.figures() for kind, tally in tallies.items()}
        results["in profile"][one.label] = profile
    return results


def one_set(question: Question, label: str, clips: Sequence[Clip]) -> tuple[dict[str, Tally], dict[str, Any]]:
    """Tallies by input ("motion capture", "lifted", "keypoints"), and figures of the noise's own swaps."""
    tallies = {"motion capture": Tally(), "lifted": Tally(), "keypoints": Tally()}
    own, errors = Tally(), {"without swaps": [], "with swaps": [], "put right": []}
    for number, clip in enumerate(each(clips, f"{label} takes", len(clips))):
        take = see(clip, question.seed, noise=Noise(swap_rate=0.0), views=question.views)
        lifted = question.lift_seen(take)
        clean = lifted.with_(joints=take.truth, frame=CAMERA, confidence=None, history=())
        for name, poses in zip(tallies, (clean, lifted, take.keypoints), strict=True):
            tallies[name].add_untouched(len(poses), find_swaps(poses))
            for turn in range(_ROUNDS):
                wrong, made = put_in(poses, np.random.default_rng([question.seed, number, turn]))
                tallies[name].add(len(poses), made, find_swaps(wrong))
        swapped = see(clip, question.seed, views=question.views)
        for name, values in _profile(question, own, take, swapped, lifted).items():
            errors[name].append(values)
    figures = own.figures()
    figures["lift"] = {name: Figure.of(np.concatenate(values)) for name, values in errors.items()}
    return tallies, figures


def put_in(poses: PoseSequence, rng: np.random.Generator) -> tuple[PoseSequence, list[Made]]:
    """Poses with swaps of random kinds, lengths and places, at most one in each part of about three seconds."""
    ways = kinds(poses.layout, poses.frame.dims == 3)
    legs, arms, *mirrors = ways
    options = {"legs exchanged": [(legs,)], "arms exchanged": [(arms,)], "both exchanged": [(legs, arms)]}
    if mirrors:
        body, *limbs = mirrors
        options |= {"body mirrored": [(body,)], "limb mirrored": [(limb,) for limb in limbs]}
    joints = poses.joints.copy()
    made = []
    parts = np.linspace(0, len(poses), max(len(poses) // _EVERY, 1) + 1).astype(int)
    for start, end in zip(parts[:-1] + _MARGIN, parts[1:] - _MARGIN, strict=True):
        low, high = _LENGTHS[rng.integers(len(_LENGTHS))]
        name = list(options)[rng.integers(len(options))]
        chosen = options[name][rng.integers(len(options[name]))]
        length = int(rng.integers(low, high + 1))
        if length > end - start:
            continue
        first = int(rng.integers(start, end - length + 1))
        rows = slice(first, first + length)
        for way in chosen:
            joints[rows] = way.applied(joints[rows])
        made.append(Made(chosen, first, first + length - 1, name, (low, high)))
    return poses.with_(joints=joints), made


def _profile(
    question: Question, tally: Tally, right: SeenTake, swapped: SeenTake, lifted: PoseSequence
) -> dict[str, np.ndarray]:
    """Adds one take with the noise's own swaps. -> errors of the lift in mm, one scale a take, in the frames that they
    spoil: as if there were none, with them, and as read.swaps=repair leaves them."""
    made = own_swaps(right.keypoints, swapped.keypoints)
    found = find_swaps(swapped.keypoints)
    tally.add(len(lifted), made, found)
    tally.add_untouched(len(lifted), [])
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
        made += [Made((way,), int(a), int(b) - 1, way.name) for a, b in stretches(differs)]
    return made


def _same(a: tuple[str, int, int], b: tuple[str, int, int]) -> bool:
    """Both of one kind, and of rows that overlap enough."""
    common = min(a[2], b[2]) - max(a[1], b[1]) + 1
    return a[0] == b[0] and common >= _OVERLAP * (max(a[2], b[2]) - min(a[1], b[1]) + 1)


def _cells(rows: int, spans: Iterable[tuple[str, int, int]]) -> set[tuple[str, int]]:
    return {(kind, row) for kind, first, last in spans for row in range(first, min(last + 1, rows))}


def _share(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")
