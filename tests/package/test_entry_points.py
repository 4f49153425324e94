"""What is built in is registered: in pyproject.toml, in the environment of the tests, and under its own name."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

from pcnet3d.pipeline.plugins import registry

ROOT = Path(__file__).parents[2]
POINTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]


@pytest.mark.parametrize("group", registry.GROUPS)
def test_the_environment_has_what_the_project_registers(group):
    """An editable install notes the entry points when it is made, not when pyproject.toml is edited."""
    installed = {
        name: point.value
        for name, point in registry.registered(group).items()
        if point.value.startswith("pcnet3d.")
    }
    assert installed == POINTS.get(f"pcnet3d.{group}", {}), "install again: pip install --no-deps -e ."


def test_every_adapter_is_registered_under_its_name():
    modules = {path.stem: f"pcnet3d.adapters.{path.stem}" for path in (ROOT / "adapters").glob("[a-z]*.py")}
    assert POINTS["pcnet3d.adapters"] == modules


def test_every_writer_is_registered():
    """What stages/export/writers.py makes at its top level by `_Format`."""
    text = (ROOT / "stages" / "export" / "writers.py").read_text(encoding="utf-8")
    made = {
        f"pcnet3d.stages.export.writers:{target.id}"
        for statement in ast.parse(text).body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.value).startswith("_Format(")
        for target in statement.targets
        if isinstance(target, ast.Name)
    }
    assert made == set(POINTS["pcnet3d.writers"].values())
