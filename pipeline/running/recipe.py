"""Recipes: which stages run, in which order, with which options; a TOML file or the default one."""

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
from ..plugins import registry
from ..plugins.options import call, did_you_mean
from ..plugins.removed import refuse_removed
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
