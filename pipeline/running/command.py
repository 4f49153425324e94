"""`pcnet3d run`: files or a video in, a folder of results out."""

from __future__ import annotations

import typer

from ..core.messages import debug
from ..files.atomic import check_replaceable
from ..reading.flags import Force, Output, Strict, offering
from ..reading.settings import RunOptions
from .conclusion import conclude, conclude_people
from .plan import planned
from .progress import stages
from .run import inputs_of, run_files, run_people


@offering()
def run(options: RunOptions, output: Output, strict: Strict = False, force: Force = False) -> None:
    """Turn a video, 2D keypoints or 3D poses into joint angles, paths, gait and a report.

    Without --poses, a lifter makes 3D poses from the keypoints. Without --keypoints, a detector finds them in the
    video first.
    """
    chosen = planned(options)
    check_replaceable(output, force, inputs_of(options, chosen))
    names = ["read", *(entry.use for entry in chosen.stages)]
    for entry in chosen.stages:
        debug(entry.use, ", ".join(f"{key}={value}" for key, value in entry.options.items()) or "defaults")
    with stages(names) as done:
        if options.everyone:
            people = run_people(options, output, force=force, done=done)
        else:
            take = run_files(options, output, force=force, done=done)
    code = (
        conclude_people(people, output, strict) if options.everyone else conclude({"": take}, output, strict)
    )
    if code:
        raise typer.Exit(code)
