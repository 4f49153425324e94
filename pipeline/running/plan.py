"""What the options of a run mean: which stages there are to be, and with which options of theirs."""

from __future__ import annotations

from typing import Any

from ..core.errors import InputError
from ..plugins import registry
from ..plugins.options import checked, option_types
from ..plugins.removed import refuse_removed
from ..reading.settings import OFF, SHORT, TOLD, RunOptions, flag_of
from .recipe import Recipe, load_recipe

# Options of stages that there are not, for they are told of the recording, and how they are told.
_TOLD = {tells.field: flag_of(name) for name, tells in TOLD.items()} | {"frames": flag_of("no_frames")}


def planned(options: RunOptions, recipe: Recipe | None = None) -> Recipe:
    """The recipe of a run, with all that the options ask for.

    recipe: replaces the default one and that of the options; no stages are added to it. Without it: keypoints are
    lifted if there are no poses, and first detected if there are no keypoints; a video's images are asked
    about the camera. InputError for an option of a stage or a file that this run does not have, for what the user says
    and no stage reads, for a setting that its stage does not know or of another type, and for two recipes.
    """
    alone = options.poses is None and options.keypoints is None and options.video is not None
    _check_readers(options, alone)
    if recipe is not None and options.recipe is not None:
        raise InputError(
            "option-conflict", f"Expected one recipe, got another beside {options.recipe}; leave one out."
        )
    chosen = load_recipe(options.recipe) if recipe is None else recipe
    for entry in chosen.stages:
        for key, value in entry.options.items():
            _check_own(entry.use, key, value)
    if recipe is None:
        chosen = _with_needed(chosen, options, alone)
    for name, value in options.settings.items():
        if value == OFF and "." not in name:
            if recipe is None:
                _require(chosen, name, f"{name}={OFF}")
            chosen = chosen.without(name) if chosen.has(name) else chosen
    for name, sets in SHORT.items():
        if value := getattr(options, name):
            stage, _, key = sets.place.partition(".")
            _require(chosen, stage, flag_of(name))
            chosen = chosen.with_options(stage, **{key: value})
    for name, value in options.settings.items():
        stage, dot, key = name.partition(".")
        if dot:
            value = checked_setting(name, value)
            _require(chosen, stage, name)
            chosen = chosen.with_options(stage, **{key: value})
    _check_read(options, chosen)
    return chosen


def checked_setting(name: str, value: Any) -> Any:
    """The value of "STAGE.KEY" in the type that the stage asks for; InputError for a stage, an option or a type that is
    none, naming the nearest that exist, and for what is told of the recording."""
    stage, _, key = name.partition(".")
    _check_own(stage, key, value)
    return checked(registry.load("stages", stage), what=f"Stage '{stage}'", options={key: value})[key]


def _with_needed(recipe: Recipe, options: RunOptions, alone: bool) -> Recipe:
    """With the stages that these files ask for. alone: whether there is only a video."""
    if options.poses is None:
        recipe = recipe.starting_with("lift")
    if options.video is not None:
        recipe = recipe.starting_with("calibrate")
    if alone:
        recipe = recipe.starting_with("detect")
    return recipe


def _check_own(stage: str, key: str, value: Any) -> None:
    """InputError for an option of a stage that has none of that name, because it was removed or is told of the
    recording."""
    refuse_removed("settings", f"{stage}.{key}")
    refuse_removed("settings", f"{stage}.{key}={value}")
    if key in _TOLD and key not in option_types(registry.load("stages", stage)):
        raise InputError(
            "name-unknown",
            f"{stage}.{key} is not an option of a stage, but of the recording, for all stages; give {_TOLD[key]}.",
        )


def _check_read(options: RunOptions, recipe: Recipe) -> None:
    """InputError for something told that no stage of the recipe reads."""
    told = options.told  # refuses what cannot be
    asked = {name: tells.field for name, tells in TOLD.items() if not tells.by_reading}
    given = {name: field for name, field in asked.items() if getattr(told, field) is not None}
    read = {field for entry in recipe.stages for field in _reads(entry.use)} if given else set()
    for name, field in given.items():
        if field not in read:
            readers = [f"'{stage}'" for stage in registry.registered("stages") if field in _reads(stage)]
            raise InputError(
                "option-conflict",
                f"{flag_of(name)} is for the stage {' or '.join(readers)}, which this run does not have.",
            )


def _reads(stage: str) -> tuple[str, ...]:
    return getattr(registry.load("stages", stage), "reads", ())


def _require(recipe: Recipe, stage: str, what: str) -> None:
    if not recipe.has(stage):
        registry.load("stages", stage)  # says that there is none at all
        given = {"detect": "keypoints or poses", "lift": "poses"}.get(stage)
        instead = f": {given} that are given take its place" if given else ""
        raise InputError(
            "option-conflict", f"{what} is for the stage '{stage}', which this run does not have{instead}."
        )


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
            raise InputError(
                "option-conflict", f"{', '.join(unread)} is for --{role} FILE, which this run does not have."
            )
    if alone and options.first_frame is not None:
        raise InputError(
            "option-conflict",
            f"{flag_of('first_frame')} numbers the rows of a file, and there is none; leave it out.",
        )
