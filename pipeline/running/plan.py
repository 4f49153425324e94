"""What the options of a run mean: which stages there are to be, and with which options of theirs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..core.errors import InputError
from ..core.take import SILENT, Told
from ..plugins import registry
from ..plugins.options import checked
from ..reading.settings import OFF, SHORT, TOLD, RunOptions, flag_of
from .recipe import Recipe, load_recipe

# Of what is told: heeded by reading, whatever stages there are.
HEEDED_BY_READING = ("fps", "person", "handedness", "check", "swaps")


def planned(options: RunOptions, recipe: Recipe | None = None) -> Recipe:
    """The recipe of a run, with all that the options ask for.

    recipe: replaces the default one and that of the options; no stages are added to it. Without it: keypoints are
    lifted if there are no poses, and first detected if there are no keypoints; a video's images are asked
    about the camera. InputError for an option of a stage or a file that this run does not have, for what the user says
    and no stage reads, for a setting that its stage does not know or of another type, and for two recipes.
    """
    _check_readers(options)
    if recipe is not None and options.recipe is not None:
        raise InputError(
            "option-conflict", f"Expected one recipe, got another beside {options.recipe}; leave one out."
        )
    chosen = load_recipe(options.recipe) if recipe is None else recipe
    off = [name for name, value in options.settings.items() if value == OFF and "." not in name]
    if recipe is None:
        alone = options.poses is None and options.keypoints is None and options.video is not None
        needed = {"lift": options.poses is None, "calibrate": options.video is not None, "detect": alone}
        for stage in (stage for stage, is_needed in needed.items() if is_needed):
            chosen = chosen.starting_with(stage)
        for name in off:
            _require(chosen, name, f"{name}={OFF}")
    for name in off:
        chosen = chosen.without(name)
    short = [(flag_of(name), place, getattr(options, name)) for name, place in SHORT.items()]
    settings = [(name, value) for name, value in options.settings.items() if "." in name]
    settings = [(name, name, checked_setting(name, value)) for name, value in settings]
    for flag, place, value in [*(each for each in short if each[2]), *settings]:
        stage, _, key = place.partition(".")
        _require(chosen, stage, flag)
        chosen = chosen.with_options(stage, **{key: value})
    _check_read(options.told, chosen)
    return chosen


def checked_setting(name: str, value: Any) -> Any:
    """The value of "STAGE.KEY" in the type that the stage asks for; InputError for a stage, an option or a type that is
    none, naming the nearest that exist."""
    stage, _, key = name.partition(".")
    return checked(registry.load("stages", stage), what=f"Stage '{stage}'", options={key: value})[key]


def _check_read(told: Told, recipe: Recipe) -> None:
    """InputError for something told that stages read, but none of the recipe."""
    every = registry.registered("stages")
    for name, of_told in TOLD.items():
        said = getattr(told, of_told) != getattr(SILENT, of_told)
        # The recipe's own stages first: to load the others takes time.
        if not said or of_told in HEEDED_BY_READING or _readers(of_told, filter(recipe.has, every)):
            continue
        if readers := _readers(of_told, every):
            named = " or ".join(f"'{stage}'" for stage in readers)
            raise InputError(
                "option-conflict",
                f"{flag_of(name)} is for the stage {named}, which this run does not have.",
            )


def _readers(of_told: str, stages: Iterable[str]) -> list[str]:
    return [stage for stage in stages if of_told in getattr(registry.load("stages", stage), "reads", ())]


def _require(recipe: Recipe, stage: str, what: str) -> None:
    if not recipe.has(stage):
        registry.load("stages", stage)  # says that there is none at all
        given = {"detect": "keypoints or poses", "lift": "poses"}.get(stage)
        instead = f": {given} that are given take its place" if given else ""
        raise InputError(
            "option-conflict", f"{what} is for the stage '{stage}', which this run does not have{instead}."
        )


def _check_readers(options: RunOptions) -> None:
    """InputError for an option of a file that is not given."""
    readers = {
        "poses": {"adapter": "auto", "options": {}},
        "keypoints": {"keypoints_adapter": "auto", "keypoints_person": None, "keypoints_options": {}},
    }
    for role, usual in readers.items():
        said = [name for name, value in usual.items() if getattr(options, name) != value]
        if role in options.in_memory:  # of whom one may be chosen too
            said = [name for name in said if name != "keypoints_person"]
        if said and (getattr(options, role) is None or role in options.in_memory):
            unread = ", ".join(map(flag_of, said))
            raise InputError(
                "option-conflict",
                f"{unread} is for --{role} FILE, which this run does not have; leave it out.",
            )
