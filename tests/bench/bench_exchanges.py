"""How often a track that goes on with somebody else is told apart, and a track of one person split.

    python tests/bench/bench_exchanges.py

Validation people before typical cameras, at 30 frames a second; the other person appears 0.1 to 0.5 body sizes away, up
to e^0.5 times as large or as small.
"""

from __future__ import annotations

import numpy as np

from pcnet3d.models.lab.evaluation.testbed import BEDS, MIN_FRAMES, see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.pipeline.signals.tracker import exchanges

_TRACKS, _NEAR = 600, 2  # frames
_FARTHER = 0.3


def main() -> None:
    """Print both shares."""
    clips = [clip for clip in read_clips("val") if len(clip) >= MIN_FRAMES]
    takes = [see(clip, 11, views=view).keypoints for view in BEDS.values() for clip in clips]
    split = sum(bool(exchanges(take.times, take.joints.astype(np.float64))) for take in takes)
    print(f"of {len(takes)} tracks of one person {split} are split")
    rng = np.random.default_rng(3)
    found = []
    while len(found) < _TRACKS:
        one, other = (takes[i].joints.astype(np.float64) for i in rng.integers(len(takes), size=2))
        half = min(len(one), len(other)) // 2
        one, other = one[:half], other[-half:]
        if half < 10 or not np.isfinite(np.stack([one, other])).all():
            continue
        size, others = (np.median(np.ptp(body, axis=1).max(axis=-1)) for body in (one, other))
        way, turn = rng.uniform(0.1, 0.5), rng.uniform(0, 2 * np.pi)
        other = (other - np.mean(other[:3], axis=(0, 1))) * size / others * np.exp(rng.uniform(-0.5, 0.5))
        other = other + np.mean(one[-3:], axis=(0, 1)) + way * size * np.array([np.cos(turn), np.sin(turn)])
        rows = [row for row, _ in exchanges(np.arange(2 * half) / 30, np.concatenate([one, other]))]
        found.append((way, any(abs(row - half) <= _NEAR for row in rows)))
    far = [told for way, told in found if way >= _FARTHER]
    told = np.mean([told for _, told in found])
    print(
        f"of {len(found)} exchanges {told:.0%} are told apart, {np.mean(far):.0%} from {_FARTHER} body sizes on"
    )


if __name__ == "__main__":
    main()
