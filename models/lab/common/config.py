"""Training configs and splits, checked against a pydantic model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from ....pipeline.core.errors import InputError, readable

Config = TypeVar("Config", bound=BaseModel)
Share = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]  # such as a standard deviation


def read_json(path: Path, model: type[Config], what: str) -> Config:
    """A file of JSON as that model; InputError naming the file and the key that is wrong. what: in words."""
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
