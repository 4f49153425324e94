"""Training configs and splits, checked against a pydantic model."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from ...pipeline.core.errors import InputError

Config = TypeVar("Config", bound=BaseModel)
Share = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]  # such as a standard deviation


def checked(content: dict[str, Any] | str, model: type[Config], where: str) -> Config:
    """The content, or a text in JSON, as that model; InputError with `where` and the key that is wrong."""
    try:
        if isinstance(content, str):
            return model.model_validate_json(content)
        return model.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            "bad-value",
            ": ".join(filter(None, [where, ".".join(map(str, first["loc"])), f"{first['msg']}."])),
        ) from None
