"""The test bed's takes as files, for training and for lifters of others:

pcnet3d lab testbed test -o takes.npz
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many
from ....pipeline.files.arrays import write_arrays
from ....pipeline.files.atomic import refuse_unwritable, refuse_unwritable_file
from ....pipeline.reading.settings import OnDevice
from ....pipeline.running.progress import each
from ...common.spread import stated_spread
from ..mocap.clips import Subjects, read_clips
from ..synthetic.bodies import BodyRange
from .foreign import Answers
from .testbed import BEDS, MIN_FRAMES, Bed, LiftedTake, file_name, lifted_takes, see


def write_takes(
    subjects: Annotated[Subjects, typer.Argument(help="Whose takes.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="The .npz file to write; with --keypoints, a folder.")
    ],
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    lifter: Annotated[
        str,
        typer.Option(help="pcnet3d (built-in), or an .onnx file; it must not be trained on the subjects."),
    ] = "pcnet3d",
    bodies: Annotated[bool, typer.Option("--bodies", help="Draw other proportions and mirror some.")] = False,
    bed: Annotated[
        Bed,
        typer.Option(
            help="Cameras: wild (also steep, tilted, with long lenses) or typical (as people film)."
        ),
    ] = "wild",
    trained_on: Annotated[
        bool,
        typer.Option(
            "--trained-on", help="Also subjects that the lifter was trained on: not for evaluation."
        ),
    ] = False,
    laid: Annotated[
        float, typer.Option(min=0, max=1, help="Only this share of the clips, with the bodies lying down.")
    ] = 0.0,
    answers: Annotated[
        Path | None,
        typer.Option(
            help="Folder of another lifter's answers to the files of --keypoints, instead of --lifter."
        ),
    ] = None,
    keypoints: Annotated[
        bool,
        typer.Option(
            "--keypoints", help="Only the input for a lifter of your own, with the truth, one file per take."
        ),
    ] = False,
    device: OnDevice = "auto",
) -> None:
    """Write lifted takes with ground truth for training and evaluation.

    One .npz of plain arrays, takes one after another: lifted, truth (N, 17, 3), R_camera_from_body (N, 3, 3),
    up (N, 3), lying (N,), spread (N,), the lifter's stated error (models/common/spread.py); take_start (C + 1,),
    clip, subject, source (C,); device (), where the lifter computed. With --keypoints instead, for every take
    OUTPUT/TAKE.npz: keypoints (T, 17, 2) in pixels, NaN where missing, confidence (T, 17), image_size (2,), fps (),
    joint_names (17,); and the truth: joints (T, 17, 3) in metres, z up, and R_camera_from_world (3, 3).
    """
    if keypoints:
        if bodies or laid or trained_on or answers or lifter != "pcnet3d":
            raise InputError(
                "option-conflict", "--keypoints goes with --seed and --bed alone; leave the others out."
            )
        refuse_unwritable(output)
        print(f"{output}: {how_many(write_keypoints(subjects, output, bed, seed), 'take')}")
        return
    refuse_unwritable_file(output)
    drawn = BodyRange() if bodies else None
    with computing_on(device) as where:
        if answers is not None:
            takes = answered(Answers(answers), subjects, bed, seed)
        else:
            takes = list(
                lifted_takes(
                    subjects,
                    seed,
                    model=lifter,
                    bodies=drawn,
                    views=BEDS[bed],
                    trained_on=trained_on,
                    laid=laid,
                )
            )
    if not takes:
        raise InputError(
            "nothing-usable", f"There is no take of {MIN_FRAMES} frames or more of the subjects '{subjects}'."
        )
    frames = [len(take.lifted) for take in takes]
    seen = [take.seen for take in takes]
    output.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(
        output,
        lifted=np.concatenate([take.lifted.joints for take in takes]),
        truth=np.concatenate([take.truth for take in seen]).astype(np.float32),
        R_camera_from_body=np.concatenate([take.R_camera_from_body for take in seen]),
        up=np.concatenate([np.tile(take.up, (len(take.lying), 1)) for take in seen]),
        lying=np.concatenate([take.lying for take in seen]),
        spread=np.concatenate([stated_spread(take.lifted) for take in takes]).astype(np.float32),
        take_start=np.cumsum([0, *frames]),
        clip=np.array([take.clip for take in seen]),
        subject=np.array([take.subject for take in seen]),
        source=np.array([take.source for take in seen]),
        device=np.array(", ".join(sorted({*where.used.values()}))),
    )
    print(f"{output}: {how_many(len(takes), 'take')}, {sum(frames):,} frames")


def answered(lifter: Answers, subjects: Subjects, bed: Bed, seed: int) -> list[LiftedTake]:
    """The takes as another lifter has them. InputError for one without an answer."""
    seen = (see(clip, seed, views=BEDS[bed]) for clip in read_clips(subjects) if len(clip) >= MIN_FRAMES)
    return [LiftedTake(lifter.poses(take, bed, seed), take) for take in seen]


def write_keypoints(subjects: Subjects, folder: Path, bed: Bed = "wild", seed: int = 0) -> int:
    """Write what a lifter is given, and the truth: for every take a file in the folder. -> how many."""
    folder.mkdir(parents=True, exist_ok=True)
    clips = [clip for clip in read_clips(subjects) if len(clip) >= MIN_FRAMES]
    for clip in each(iter(clips), "takes", len(clips)):
        take = see(clip, seed, views=BEDS[bed])
        write_arrays(
            folder / f"{file_name(clip.name, bed, seed)}.npz",
            keypoints=take.keypoints.joints,
            confidence=take.keypoints.confidence,
            image_size=np.array(take.image_size),
            fps=np.array(clip.fps),
            joint_names=np.array(take.keypoints.layout.joints),
            joints=clip.joints,
            R_camera_from_world=take.R_camera_from_world,
        )
    return len(clips)
