"""Recipes: which stages run, in which order, with which options, from a TOML file or the default one; and what the
options of a run make of them."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path, PureWindowsPath
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.errors import InputError
from ..core.take import SILENT, Told
from ..plugins import registry
from ..plugins.options import call, checked, did_you_mean
from ..plugins.removed import refuse_removed
from ..reading.settings import OFF, SHORT, TOLD, RunOptions, flag_of
from .runner import Pipeline

_EXTENDS, _AFTER = "extends", "after"


class StageEntry(BaseModel):
    """A stage by its registered name; every other key is an option of it."""

    model_config = ConfigDict(extra="allow", frozen=True)
    use: str

    @property
    def options(self) -> dict[str, Any]:
        return self.model_extra or {}

    def with_options(self, options: dict[str, Any]) -> StageEntry:
        """A copy with these options too."""
        return StageEntry(use=self.use, **{**self.options, **options})


class Recipe(BaseModel):
    """An ordered list of stages."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    stages: tuple[StageEntry, ...] = Field(min_length=1)

    def with_options(self, stage: str, **options: Any) -> Recipe:
        """A copy in which every stage of that name has these options; a recipe without it is left as it is."""
        return Recipe(
            stages=tuple(
                entry.with_options(options) if entry.use == stage else entry for entry in self.stages
            )
        )

    def has(self, stage: str) -> bool:
        """Whether a stage of that name is in it."""
        return any(entry.use == stage for entry in self.stages)

    def starting_with(self, stage: str) -> Recipe:
        """A copy whose first stage is this one; the same recipe when it has that stage already."""
        return self if self.has(stage) else Recipe(stages=(StageEntry(use=stage), *self.stages))

    def only(self, stage: str) -> Recipe:
        """A copy that has this stage alone, with its options."""
        return Recipe(stages=tuple(entry for entry in self.stages if entry.use == stage))

    def without(self, stage: str) -> Recipe:
        """A copy without that stage, if it has it; InputError when it has no other."""
        rest = tuple(entry for entry in self.stages if entry.use != stage)
        if not rest:
            raise InputError("option-conflict", f"'{stage}' is the only stage of this run; leave it in.")
        return Recipe(stages=rest)

    def build(self) -> Pipeline:
        """The pipeline; InputError for an unknown stage or option, naming the nearest ones that exist."""
        return Pipeline(
            tuple(
                call(registry.load("stages", entry.use), what=f"Stage '{entry.use}'", options=entry.options)
                for entry in self.stages
            )
        )


def load_toml(file: Path | Traversable, what: str) -> dict[str, Any]:
    """The content of a TOML file. InputError, saying that `what` was expected, when there is none."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("cannot-open", f"Expected {what} at {file}: {error.strerror}.") from None
    except ValueError as error:  # also bytes that are no text, and numbers of thousands of digits
        raise InputError("file-damaged", f"Expected {what} in {file}, a TOML file: {error}.") from None
    except RecursionError:
        raise InputError(
            "unsafe", f"Expected {what} in {file}, a TOML file, got one that is nested too deeply."
        ) from None


def load_recipe(path: str | Path | None = None) -> Recipe:
    """The recipe in a TOML file, or the default one.

    `extends = "default"` makes it the default one with changes: a stage with `after = NAME` comes behind that stage
    (several in the file's order); a stage without `after` sets options of the default's stage. InputError names the
    file and the key that is wrong.
    """
    file = files("pcnet3d.pipeline.running").joinpath("default.toml") if path is None else Path(path)
    content = load_toml(file, "a recipe")
    keys = (*Recipe.model_fields, _EXTENDS)
    for key in content:
        if key not in keys:
            raise InputError("name-unknown", f"Recipe {path}: unknown key '{key}'; {did_you_mean(key, keys)}")
    base = content.pop(_EXTENDS, None)
    if base not in (None, "default"):
        raise InputError("bad-value", f'Recipe {path}: expected {_EXTENDS} = "default", got {base!r}.')
    try:
        recipe = Recipe(**content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError("bad-value", f"Recipe {path}: {place}: {first['msg']}.") from None
    for entry in recipe.stages:
        for option, value in entry.options.items():
            refuse_removed("settings", f"{entry.use}.{option}", f"{entry.use}.{option}={value}")
            if isinstance(value, str) and _leads_out(value):
                raise InputError(
                    "unsafe",
                    f"Recipe {path}: {entry.use}.{option} = '{value}' leads out of the folder; a recipe, which may be "
                    "somebody else's, names files in the current folder only: put the file there, or name it on the "
                    "command line.",
                )
            if option == _AFTER and base is None:
                raise InputError(
                    "option-conflict",
                    f'Recipe {path}: {entry.use}.{_AFTER} is for a recipe that begins with {_EXTENDS} = "default"; '
                    "without it the stages run in the order of the file.",
                )
    return recipe if base is None else _extended(load_recipe(), recipe.stages, f"Recipe {path}")


def _extended(recipe: Recipe, changes: Iterable[StageEntry], where: str) -> Recipe:
    """The recipe with stages inserted, and options set, as `load_recipe` has it."""
    stages, behind = list(recipe.stages), Counter[str]()
    for change in changes:
        options = dict(change.options)
        after = options.pop(_AFTER, change.use)
        uses = [entry.use for entry in stages]
        if after not in uses:
            hint = did_you_mean(str(after), uses)
            needed = f'; or say where it goes, {_AFTER} = "..."' if after == change.use else ""
            raise InputError(
                "name-unknown",
                f"{where}: the default recipe has no stage '{after}'; {hint.rstrip('.')}{needed}.",
            )
        place = uses.index(after)
        if after == change.use:
            stages[place] = stages[place].with_options(options)
        else:
            behind[after] += 1
            stages.insert(place + behind[after], StageEntry(use=change.use, **options))
    return Recipe(stages=tuple(stages))


def _leads_out(text: str) -> bool:
    """Whether a text is a path that begins elsewhere or goes up, on any system."""
    path = PureWindowsPath(text)  # knows both kinds of slashes
    return bool(path.anchor) or ".." in path.parts or text.startswith("~")


# Of what is told: heeded by reading, whatever stages there are.
HEEDED_BY_READING = ("fps", "person", "handedness", "check")


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
