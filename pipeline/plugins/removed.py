"""What there was before the first release and is not any more, with what to do instead: removed.toml.

Its only callers stand where an unknown name is refused: commands and flags in pipeline/cli.py, plug-ins in registry.py,
settings in pipeline/reading/settings.py, pipeline/running/recipe.py and stages/study/batch/manifest.py, reports and
configs of trainings in models/lab, names of Python in __init__.py. They, this module and the table go with the first
release.
"""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

from ..core.errors import InputError


@cache
def removed() -> dict[str, dict[str, str]]:
    """What to do instead, by kind and name."""
    return tomllib.loads(Path(__file__).with_name("removed.toml").read_text(encoding="utf-8"))


def refuse_removed(kind: str, *names: str) -> None:
    """InputError with the sentence of the first of these names that was removed, if one was."""
    for name in names:
        if instead := removed().get(kind, {}).get(name):
            raise InputError("name-unknown", f"{name} was removed: {instead}.")
