"""`pcnet3d run`: files or a video in, a folder of results out."""

from __future__ import annotations

import typer

from ..core.messages import is_verbose, say
from ..files.atomic import check_replaceable
from ..reading.settings import Force, Output, Resume, RunOptions, offering
from .progress import stages, telling_of_kept
from .recipe import planned
from .run import checkpoint_of, inputs_of, run_people
from .sentences import conclude_people


@offering()
def run(options: RunOptions, output: Output, resume: Resume = False, force: Force = False) -> None:
    """Turn a video, 2D keypoints or 3D poses into joint angles, paths, gait and a report.

    Without --poses, a lifter makes 3D poses from the keypoints. Without --keypoints, a detector finds them in the
    video first.
    """
    chosen = planned(options)
    check_replaceable(output, force, inputs_of(options, chosen))  # before anything is said of kept work
    names = ["read", *(entry.use for entry in chosen.stages)]
    for entry in chosen.stages if is_verbose() else ():
        say(entry.use, ", ".join(f"{key}={value}" for key, value in entry.options.items()) or "defaults")
    kept = checkpoint_of(output) if chosen.has("detect") else None
    with telling_of_kept(kept, resume), stages(names) as done:
        runs = run_people(options, output, resume=resume, force=force, done=done)
    conclude_people(runs, output)
    if any(each.code == "interrupted" for person in runs if person.take for each in person.take.notices):
        raise typer.Exit(130)
