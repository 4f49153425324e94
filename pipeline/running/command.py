"""`pcnet3d run`: files or a video in, a folder of results out."""

from __future__ import annotations

from pathlib import Path

import typer

from ..errors import InputError
from ..files.detections import KEYPOINTS, interrupted_at
from ..messages import debug
from ..reading.settings import Force, Output, Pick, Resume, RunOptions, Strict, offering
from .conclusion import conclude, point_to, show_files
from .pick import pick as write_sheet
from .plan import planned
from .progress import stages, tell, tell_people, telling_of_kept
from .recipe import Recipe
from .run import checkpoints_of, run_files, run_people


@offering()
def run(
    options: RunOptions,
    output: Output,
    pick: Pick = False,
    resume: Resume = False,
    strict: Strict = False,
    force: Force = False,
) -> None:
    """Turn a recorded video, its keypoints or a lifter's poses into levelled kinematics.

    Without --poses the keypoints are lifted, by the built-in lifter or --lifter; without --keypoints too, they are
    first detected in the video.
    """
    chosen = planned(options)
    if pick:
        write_sheet(options, output, chosen)
        return
    kept = [path for stage, path in checkpoints_of(output).items() if chosen.has(stage)]
    if resume:
        chosen = _resumed(chosen, output)
    names = ["read", *(entry.use for entry in chosen.stages)]
    for entry in chosen.stages:
        debug(entry.use, ", ".join(f"{key}={value}" for key, value in entry.options.items()) or "defaults")
    with telling_of_kept(kept, resume), stages(names) as done:
        if options.person == "all":
            people = run_people(options, output, chosen, force=force, done=done)
            takes = {f"person {run.person}: ": run.take for run in people if run.take}
            shown = output / next(run.folder for run in people if run.folder)
        else:
            take = run_files(options, output, chosen, force=force, done=done)
            people, takes, shown = (), {"": take}, output
    if people:
        tell_people(people)
    else:
        tell(takes[""])
    show_files(output)
    code = conclude(takes, strict)
    point_to(shown)
    if not people and interrupted_at(takes[""]) is not None:
        code = 130
    if code:
        raise typer.Exit(code)


def _resumed(recipe: Recipe, output: Path) -> Recipe:
    """The recipe that goes on from what an interrupted run left, beside its folder or in it."""
    places = {stage: [path] for stage, path in checkpoints_of(output).items() if recipe.has(stage)}
    if not places:
        raise InputError("--resume is for the stages 'detect' and 'lift', which this run does not have.")
    if "detect" in places:
        places["detect"].append(output / KEYPOINTS)
    found = {
        stage: path for stage, paths in places.items() if (path := next(filter(Path.is_file, paths), None))
    }
    if not found:
        raise InputError(f"There is no interrupted run in {output} to go on with; leave --resume out.")
    for stage, path in found.items():
        recipe = recipe.with_options(stage, resume=path)
    return recipe
