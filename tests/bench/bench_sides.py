"""How often keypoints with left and right exchanged are told, and sound ones called so.

    python tests/bench/bench_sides.py

Validation people before wild and typical cameras.
"""

from __future__ import annotations

import numpy as np

from pcnet3d.models.lab.evaluation.testbed import BEDS, MIN_FRAMES, see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.models.lifter.builtin import lifted
from pcnet3d.models.lifter.sides import sides_doubts
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.lifted import ToLift
from pcnet3d.pipeline.signals.visibility import seen_only


def main() -> None:
    """Print both shares."""
    clips = [clip for clip in read_clips("val") if len(clip) >= MIN_FRAMES]
    for bed, views in BEDS.items():
        told: dict[bool, list[bool]] = {False: [], True: []}
        for take in (see(clip, 11, views=views) for clip in clips):
            seen = seen_only(take.keypoints, take.image_size)
            order = H36M17.mirror
            other = seen.with_(joints=seen.joints[:, order], confidence=seen.confidence[:, order])
            for exchanged, keypoints in ((False, seen), (True, other)):
                asked = ToLift(keypoints, take.image_size)
                told[exchanged].append(bool(sides_doubts(asked, lifted(asked).poses)))
        sound, found = (np.mean(told[exchanged]) for exchanged in (False, True))
        print(
            f"{bed} cameras, {len(clips)} takes: sound ones called exchanged {sound:.1%}, exchanged told {found:.1%}"
        )


if __name__ == "__main__":
    main()
