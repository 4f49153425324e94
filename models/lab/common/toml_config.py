"""Training configs and splits: files of TOML and JSON checked against a pydantic model."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from ....pipeline.core.errors import InputError, readable
from ....pipeline.running.recipe import load_toml

Config = TypeVar("Config", bound=BaseModel)
Share = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]  # such as a standard deviation


def read_toml(path: Path, model: type[Config]) -> Config:
    """The file's content as that model; InputError naming the file and the key that is wrong."""
    return checked(load_toml(path, "a training config"), model, str(path))


def read_json(path: Path, model: type[Config], what: str) -> Config:
    """The same of a file of JSON. what: in words."""
    with readable(path, what):
        text = path.read_text(encoding="utf-8")
    return _valid(lambda: model.model_validate_json(text), str(path))


def checked(content: dict[str, Any], model: type[Config], where: str) -> Config:
    """The content as that model; InputError with `where` and the key that is wrong."""
    return _valid(lambda: model.model_validate(content), where)


def _valid(made: Callable[[], Config], where: str) -> Config:
    try:
        return made()
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            "bad-value",
            ": ".join(filter(None, [where, ".".join(map(str, first["loc"])), f"{first['msg']}."])),
        ) from None


def as_toml(config: BaseModel) -> str:
    """A config as the TOML text that it would be read from; what is None is left out, as TOML has no such value."""
    return "\n".join(_lines(config.model_dump(mode="json", exclude_none=True))) + "\n"


def _lines(table: dict[str, Any], name: str = "") -> list[str]:
    tables = {key: value for key, value in table.items() if isinstance(value, dict)}
    # Numbers, truth values, strings and lists of them are written alike in JSON and TOML.
    lines = [f"{key} = {json.dumps(value)}" for key, value in table.items() if key not in tables]
    for key, value in tables.items():
        lines += ["", f"[{name}{key}]", *_lines(value, f"{name}{key}.")]
    return lines
