"""Lifted takes with their truth, as files for training:  pcnet3d lab testbed test -o takes.npz"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Argument, Option

from ...pipeline.core.device import computing_on
from ...pipeline.core.errors import InputError
from ...pipeline.core.messages import how_many
from ...pipeline.files.arrays import write_arrays
from ...pipeline.files.atomic import refuse_unwritable
from ...pipeline.reading.settings import OnDevice
from .evaluation.runs import Configuration, EvaluationSet, lifted
from .evaluation.testbed import Bed
from .mocap.clips import Subjects
from .synthetic.bodies import BodyRange


def write_takes(
    subjects: Annotated[Subjects, Argument(help="Whose takes.")],
    output: Annotated[Path, Option("-o", "--output", help="The .npz file.")],
    seed: Annotated[int, Option(min=0, help="Random seed.")] = 0,
    lifter: Annotated[str, Option(help="A name or an .onnx file, not trained on the subjects.")] = "pcnet3d",
    bodies: Annotated[bool, Option("--bodies", help="Draw other proportions and mirror some.")] = False,
    bed: Annotated[Bed, Option(help="Cameras: from everywhere, or as people film.")] = "wild",
    trained_on: Annotated[bool, Option("--trained-on", help="Also people the lifter knows.")] = False,
    laid: Annotated[float, Option(min=0, max=1, help="Only this share, with bodies that lie.")] = 0.0,
    device: OnDevice = "auto",
) -> None:
    """Write lifted takes with ground truth for training.

    One .npz of plain arrays, takes one after another: lifted, truth (N, 17, 3), R_camera_from_body (N, 3, 3),
    lying (N,); take_start (C + 1,), clip (C,).
    """
    refuse_unwritable(output.parent)
    drawn = BodyRange() if bodies else None
    with computing_on(device):
        asked = Configuration(seed=seed, lifter=lifter, bed=bed, bodies=drawn, laid=laid)
        takes = list(lifted(asked, EvaluationSet(subjects, subjects, known=trained_on)))
    if not takes:
        raise InputError(
            "nothing-usable", f"No take of the subjects '{subjects}' was laid down; give a larger --laid."
        )
    output.parent.mkdir(parents=True, exist_ok=True)
    seen, ends = [take.seen for take in takes], np.cumsum([0, *(len(take.lifted) for take in takes)])
    write_arrays(
        output,
        lifted=np.concatenate([take.lifted.joints for take in takes]),
        truth=np.concatenate([take.truth for take in seen]).astype(np.float32),
        R_camera_from_body=np.concatenate([take.R_camera_from_body for take in seen]),
        lying=np.concatenate([take.lying for take in seen]),
        take_start=ends,
        clip=np.array([take.clip for take in seen]),
    )
    print(f"{output}: {how_many(len(takes), 'take')}, {ends[-1]:,} frames")
