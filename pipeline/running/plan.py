"""What the options of a run mean: which stages there are to be, and with which options of theirs."""

from __future__ import annotations

from typing import Any

from ..errors import InputError
from ..plugins import registry
from ..plugins.options import checked
from ..reading.settings import OFF, RunOptions, flag_of
from .recipe import Recipe, load_recipe


def planned(options: RunOptions) -> Recipe:
    """The recipe of a run.

    Without poses the keypoints are lifted, without keypoints too they are first detected; a second lifter lifts them
    again; a video's images are asked about the camera. InputError for an option of a stage or a file that this run
    does not have, and for a setting that its stage does not know or of another type.
    """
    alone = options.poses is None and options.keypoints is None and options.video is not None
    _check_readers(options, alone)
    goals = tuple(options.goals())
    chosen = load_recipe(options.recipe)
    if options.poses is None:
        chosen = chosen.starting_with("lift")
    if options.video is not None:
        chosen = chosen.starting_with("calibrate")
    if alone:
        chosen = chosen.starting_with("detect")
    if options.also_lifter is not None:
        chosen = chosen.following("second_lift", after="angles")
    for name, value in options.settings.items():
        if value == OFF and "." not in name:
            _require(chosen, name, f"{name}={OFF}")
            chosen = chosen.without(name)
    for name, value, goal in goals:
        first = [place for place in goal.first if chosen.has(place.partition(".")[0])]
        if goal.first and not first:
            _require(chosen, goal.first[-1].partition(".")[0], flag_of(name))
        for place in (*first[:1], *goal.too):
            stage, _, key = place.partition(".")
            chosen = chosen.with_options(stage, **{key: value})
    for name, value in options.settings.items():
        stage, dot, key = name.partition(".")
        if dot:
            value = checked_setting(name, value)
            _require(chosen, stage, name)
            chosen = chosen.with_options(stage, **{key: value})
    if options.no_frames:
        for stage in ("record", "export", "report"):
            chosen = chosen.with_options(stage, frames=False)
    return chosen


def checked_setting(name: str, value: Any) -> Any:
    """The value of "STAGE.KEY" in the type that the stage asks for; InputError for a stage, an option or a type that is
    none, naming the nearest that exist."""
    stage, _, key = name.partition(".")
    return checked(registry.load("stages", stage), what=f"Stage '{stage}'", options={key: value})[key]


def _require(recipe: Recipe, stage: str, what: str) -> None:
    if not recipe.has(stage):
        registry.load("stages", stage)  # says that there is none at all
        raise InputError(f"{what} is for the stage '{stage}', which this run does not have.")


def _check_readers(options: RunOptions, alone: bool) -> None:
    """InputError for an option of a file that is not given."""
    readers = {
        "poses": {"--adapter": options.adapter != "auto", "--option": options.options},
        "keypoints": {
            flag_of("keypoints_adapter"): options.keypoints_adapter != "auto",
            flag_of("keypoints_person"): options.keypoints_person,
            "--set keypoints": options.keypoints_options,
        },
    }
    for role, told in readers.items():
        unread = [flag for flag, given in told.items() if given]
        if unread and getattr(options, role) is None:
            raise InputError(f"{', '.join(unread)} is for --{role} FILE, which this run does not have.")
    if alone and options.first_frame is not None:
        raise InputError(
            f"{flag_of('first_frame')} numbers the rows of a file, and there is none; leave it out."
        )
