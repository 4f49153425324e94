"""`pcnet3d run`: files or a video in, a folder of results out."""

from __future__ import annotations

import typer

from ..core.messages import debug
from ..files.atomic import check_replaceable
from ..reading.flags import Force, Output, Resume, Strict, offering
from ..reading.settings import RunOptions
from .conclusion import conclude, point_to, show_files
from .plan import planned
from .progress import stages, tell, tell_people, telling_of_kept
from .run import checkpoint_of, inputs_of, run_files, run_people


@offering()
def run(
    options: RunOptions, output: Output, resume: Resume = False, strict: Strict = False, force: Force = False
) -> None:
    """Turn a video, 2D keypoints or 3D poses into joint angles, paths, gait and a report.

    Without --poses, a lifter makes 3D poses from the keypoints. Without --keypoints, a detector finds them in the
    video first.
    """
    chosen = planned(options)
    check_replaceable(output, force, inputs_of(options, chosen))
    if options.person == "pick":
        from .pick import pick

        pick(options, output, chosen)
        return
    kept = checkpoint_of(output) if chosen.has("detect") else None
    names = ["read", *(entry.use for entry in chosen.stages)]
    for entry in chosen.stages:
        debug(entry.use, ", ".join(f"{key}={value}" for key, value in entry.options.items()) or "defaults")
    with telling_of_kept(kept, resume), stages(names) as done:
        if options.person == "all":
            people = run_people(options, output, resume=resume, force=force, done=done)
            takes = {f"person {run.person}: ": run.take for run in people if run.take}
            shown = output / next(run.folder for run in people if run.folder)
        else:
            take = run_files(options, output, resume=resume, force=force, done=done)
            people, takes, shown = (), {"": take}, output
    if people:
        tell_people(people)
    else:
        tell(takes[""])
    show_files(output)
    code = conclude(takes, strict)
    point_to(shown)
    if not people and any(each.code == "interrupted" for each in takes[""].notices):
        code = 130
    if code:
        raise typer.Exit(code)
