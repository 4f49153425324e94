"""One run: files in, a folder of results out."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from .config import Recipe, load_recipe
from .errors import InputError
from .intake import Sources, open_take
from .outputs import whole_folder
from .take import Take

_WRITERS = ("detect", "record", "export", "report")  # stages that are told where the run's folder is


def run_files(
    sources: Sources,
    output: Path,
    recipe: Recipe | None = None,
    *,
    force: bool = False,
    done: Callable[[str, float], None] = lambda stage, seconds: None,
) -> Take:
    """Read the sources, run the recipe, leave its files in `output`; all of them or none.

    done: called with "read" and then each stage's name, and its seconds. Raises InputError.
    """
    recipe = recipe or load_recipe()
    for entry in recipe.stages:
        if entry.use in _WRITERS and "folder" in entry.options:
            raise InputError(f"Stage '{entry.use}': the folder is the run's own (-o DIR), not the recipe's.")
    inputs = [path for path in (sources.poses, sources.keypoints, sources.video) if path]
    with whole_folder(output, force, inputs) as folder:
        pipeline = _aimed(recipe, folder).build()
        start = time.perf_counter()
        take = open_take(sources)
        done("read", time.perf_counter() - start)
        return pipeline(take, done)


def _aimed(recipe: Recipe, folder: Path) -> Recipe:
    for stage in _WRITERS:
        recipe = recipe.with_options(stage, folder=folder)
    return recipe
