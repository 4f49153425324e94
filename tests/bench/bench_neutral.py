"""What subtracting a standing posture does to lifted angles: `python tests/bench/bench_neutral.py [CLIPS]`.

Validation clips in which the person stands still for a second, all or so many of each person, each seen by two typical
cameras: by angle the root mean square error before and after, and the share of differences inside the stated 90 %, each
person with one weight.
"""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from golden.virtual import lifted
from golden.walks import JUDGED
from pcnet3d.models.angle_error.neutral import less_neutral, neutral_deg
from pcnet3d.models.angle_error.take_angles import AngleSeries
from pcnet3d.models.common.metrics import SD_90
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.pipeline import H36M17, Z_UP, Pipeline, PoseSequence, Take
from pcnet3d.pipeline.signals.angles import ANGLES, near, of_both
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

STAGES = (Rectify(), Trajectories(), Angles())
WINDOW = 30  # frames
STANDS = [
    f"{side}_{part}" for side in "rl" for part in ("knee_flexion", "thigh_trunk_flexion", "thigh_sagittal")
]


def series(take: Take) -> dict[str, AngleSeries]:
    of = Pipeline(STAGES)(take).need("kinematics")
    return {
        name: AngleSeries(of[f"{name}_deg"], of[f"{name}_sd_deg"], of[f"{name}_reason"], of[f"{name}_sd_deg"])
        for name in ANGLES
    }


def standing(true: dict[str, AngleSeries]) -> int | None:
    """The first row of a second in which legs and trunk are within 30 degrees of straight and move by less than 6."""
    values = np.stack([true[name].value_deg for name in (*STANDS, "trunk_lean_sagittal")])
    for row in range(0, values.shape[1] - WINDOW, 5):
        part = values[:, row : row + WINDOW]
        if np.isfinite(part).all() and np.abs(part).max() < 30 and np.ptp(part, axis=1).max() < 6:
            return row
    return None


def main(most: int) -> None:
    clips, judged = [clip for clip in read_clips("val") if len(clip) >= 3 * WINDOW], Counter[str]()
    np.random.default_rng(0).shuffle(clips)
    found: dict[str, dict[str, list[tuple[float, float, float]]]] = defaultdict(lambda: defaultdict(list))
    for clip in clips:
        if judged[clip.subject] == most:
            continue
        time_s = np.arange(len(clip)) / clip.fps
        true = series(Take(clip.name, poses=PoseSequence(clip.joints, H36M17, Z_UP, time_s=time_s)))
        if (row := standing(true)) is None:
            continue
        judged[clip.subject] += 1
        span_s = (time_s[row], time_s[row + WINDOW - 1])
        true_less = less_neutral(true, neutral_deg(true, time_s, span_s), judged=False)
        for seed in range(2):
            got = series(lifted(clip, seed, JUDGED)[0])
            less = less_neutral(got, neutral_deg(got, time_s, span_s), judged=True)
            outside = (time_s < span_s[0]) | (time_s > span_s[1])
            for name in ANGLES:
                off = near(less[name].value_deg - true_less[name].value_deg, 0.0)
                before = near(got[name].value_deg - true[name].value_deg, 0.0)
                known = outside & np.isfinite(off) & np.isfinite(less[name].sd_deg)
                if known.sum() >= 10:
                    inside = (np.abs(off) <= SD_90 * less[name].sd_deg)[known].mean()
                    one = (before[known] ** 2).mean(), (off[known] ** 2).mean(), inside
                    found[of_both(name)][clip.subject].append(one)
    print(f"{judged.total()} clips of {len(judged)} people")
    for name, people in found.items():
        each = np.mean([np.mean(takes, axis=0) for takes in people.values()], axis=0)
        before, after = np.sqrt(each[:2])
        print(
            f"{name:24s} {before:5.1f} {after:5.1f} degrees, inside {100 * each[2]:.0f} % ({len(people)} people)"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else sys.maxsize)
