"""Training configs: a TOML file checked against a pydantic model."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from ..pipeline.errors import InputError

Config = TypeVar("Config", bound=BaseModel)


def read_toml(path: Path, model: type[Config]) -> Config:
    """The file's content as that model; InputError naming the file and the key that is wrong."""
    try:
        return model.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise InputError(f"Expected a training config at {path}: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"Expected a TOML file at {path}: {error}.") from None
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}.") from None
