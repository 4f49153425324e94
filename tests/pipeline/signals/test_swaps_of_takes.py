"""Limbs of the test bed's validation people: put wrong, found, and nothing said of 300 sound takes."""

import numpy as np
import pytest

from pcnet3d.models.lab.beds import BEDS, MIN_FRAMES, see
from pcnet3d.models.lab.clips import read_clips
from pcnet3d.models.lab.synthetic import Noise
from pcnet3d.pipeline import PoseSequence
from pcnet3d.pipeline.core.anthropometry import trunk_length
from pcnet3d.pipeline.signals.filters import stretches
from pcnet3d.pipeline.signals.swaps import Kind, Swap, find_swaps, kinds

pytestmark = pytest.mark.data("cmu_mocap.npz", "accad_mocap.npz", "tennis_mocap.npz")


@pytest.fixture(scope="module")
def sound(data) -> list[PoseSequence]:
    """300 takes with a detector's noise and misses, and no exchanges."""
    clips = [clip for clip in read_clips("val", data) if len(clip) >= MIN_FRAMES]
    seen = (see(clip, 0, noise=Noise(swap_rate=0.0), views=BEDS[bed]) for bed in BEDS for clip in clips)
    return [take.keypoints for take in seen][:300]


def put_in(right: PoseSequence, way: Kind, rng: np.random.Generator) -> tuple[PoseSequence, list[Swap]]:
    """Keypoints in which this is wrong for 6 to 20 rows, in half of the times in which right and left are more than
    half a trunk apart."""
    joints, trunk = right.joints.astype(np.float64), float(trunk_length(right.joints, right.layout))
    apart = np.linalg.norm(joints[:, way.pairs[:, 0]] - joints[:, way.pairs[:, 1]], axis=-1)
    made = []
    for start, stop in stretches(np.nan_to_num(apart).max(axis=1) > 0.5 * trunk).tolist():
        length = int(rng.integers(6, 21))
        first = (start + stop - length) // 2
        if first < start or rng.random() < 0.5:
            continue
        rows, (to, of) = slice(first, first + length), rng.permutation(way.pairs.T)
        if way.name.endswith("exchanged"):
            joints[rows] = way.applied(joints[rows])
        else:
            joints[rows, to] = joints[rows, of] + rng.normal(0, 0.02 * trunk, (length, len(to), 2))
        made.append(Swap(way.name, first, first + length - 1, np.inf))
    return right.with_(joints=joints), made


def same(made: Swap, found: Swap) -> bool:
    """Of one kind, and of rows that overlap by half of both together."""
    common = min(made.last_row, found.last_row) - max(made.first_row, found.first_row) + 1
    both = max(made.last_row, found.last_row) - min(made.first_row, found.first_row) + 1
    return made.kind == found.kind and common >= both / 2


def test_nothing_is_said_of_sound_takes(sound):
    alarms = [find_swaps(take) for take in sound]
    assert sum(map(bool, alarms)) <= 0.01 * len(sound)


@pytest.mark.parametrize(
    ("how", "least"),
    [("limbs", 0.85), ("alone", 0.9), ("on one", 0.9)],
)
def test_most_of_what_is_put_in_is_found(sound, how, least):
    rng, hits = np.random.default_rng(0), []
    for take in sound[::5]:
        for way in kinds(take.layout, how):
            wrong, made = put_in(take, way, rng)
            found = find_swaps(wrong) if made else ()
            hits += [any(same(each, swap) for swap in found) for each in made]
    assert len(hits) > 100
    assert np.mean(hits) > least
