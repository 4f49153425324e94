"""Up before cameras that are pitched and rolled, by the lines of rendered rooms and by bodies of the test bed together:

    PYTHONPATH=tests PCNET3D_DATA=... python -m rooms.tilted [takes of each tilt] [first seed]

A room is drawn as a camera of that pitch and roll sees it, and a validation clip filmed and lifted by such a camera.
Prints how far the image, the bodies and both together are off, and how often the truth is inside the stated bound.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import product

import cv2
import numpy as np

from pcnet3d.models.common.metrics import relative
from pcnet3d.models.common.spread import stated_spread
from pcnet3d.models.gravity.fusion import fused_up
from pcnet3d.models.gravity.images import ImageUp, up_from_images
from pcnet3d.models.gravity.votes import of_votes, pool
from pcnet3d.models.lab.evaluation.testbed import lifted_takes
from pcnet3d.models.lab.synthetic.cameras import TYPICAL
from pcnet3d.models.rectifier.load import load_rectifier
from pcnet3d.pipeline.core.camera import Look
from pcnet3d.pipeline.core.rotations import angle_deg

from .indoors import room

PITCHES, ROLLS = (0.0, 15.0, 30.0, 45.0), (0.0, 15.0, 26.0, 35.0)
_QUITE_WRONG_DEG = 10.0


def look_of(answer: ImageUp) -> Look:
    return Look(0, answer.up, answer.covariance, answer.failure)


def main(count: int = 12, first: int = 0) -> None:
    cv2.setNumThreads(1)
    network = load_rectifier("pcnet")
    print(
        "| pitch | roll | image answers | image p50, p90 | bodies p50, p90 | both p50, p90 | inside 90 % | "
        "contradictions | image believed | off by over 10 |\n" + "| --- " * 10 + "|"
    )
    for pitch, roll in product(PITCHES, ROLLS):
        views = replace(TYPICAL, pitch_deg=(pitch, pitch), roll_deg=(roll, roll))
        takes = lifted_takes("val", first, views=views)
        rows = []
        for seed, take in zip(range(first, first + count), takes, strict=False):
            shown = room(seed, (pitch, roll))
            answer = up_from_images([shown.image], None, [shown.boxes])
            R, error_deg = network.rotation(relative(take.lifted.joints).astype(np.float32))
            votes = pool(R[..., 2], error_deg, take.lifted.times, stated_spread(take.lifted))
            # One truth for both: the bodies' errors are carried over to the room's camera, which is tilted alike.
            look = look_of(answer) if isinstance(answer, ImageUp) else None
            both = fused_up(of_votes(votes), (), look)
            truth = take.seen.up
            said = [each for each in both.notices if each.code == "image-against-bodies"]
            rows.append(
                (
                    np.nan if look is None else angle_deg(look.up, shown.up),
                    angle_deg(votes.up, truth),
                    angle_deg(both.up, truth),
                    float(both.bound_deg),
                    bool(said),
                    bool(said and said[0].values["believed"] == "image is"),
                )
            )
        image, bodies, both_deg, bound, said, believed = map(np.array, zip(*rows, strict=True))
        answered = np.isfinite(image)
        quantiles = [
            "{:.1f}, {:.1f}".format(*np.nanquantile(each, (0.5, 0.9))) if np.isfinite(each).any() else "-"
            for each in (image, bodies, both_deg)
        ]
        print(
            f"| {pitch:.0f} | {roll:.0f} | {answered.mean():.0%} | {' | '.join(quantiles)} | "
            f"{(both_deg <= bound).mean():.0%} | {said.sum()} | {believed.sum()} | "
            f"{int((both_deg > _QUITE_WRONG_DEG).sum())} |",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
