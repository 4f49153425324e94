"""What the wheel holds, and what it says of itself."""

from __future__ import annotations

import re
import tomllib
from email import message_from_string
from email.message import Message
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def names(wheel) -> set[str]:
    return set(ZipFile(wheel).namelist())


@pytest.fixture(scope="module")
def metadata(wheel) -> Message:
    with ZipFile(wheel) as file:
        (name,) = (name for name in file.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_string(file.read(name).decode())


def test_everything_that_our_code_opens_is_there(names):
    """All modules, and beside them every network, card, config and table."""
    for folder in ("pipeline", "stages", "adapters", "models", "examples"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and not {"plugin", "__pycache__"} & set(path.parts):
                assert f"pcnet3d/{path.relative_to(ROOT)}" in names


def test_nothing_else_is_there(names):
    folders = {name.split("/")[0] for name in names}
    assert folders == {"pcnet3d", f"pcnet3d-{PROJECT['version']}.dist-info"}
    assert not [
        name
        for name in names
        if re.search(r"/tests?/|/test_|conftest|plugin/|acme|__pycache__|egg-info", name)
    ]


def test_every_part_tells_its_types(names):
    """py.typed counts for all below it (PEP 561) if no folder on the way down is a namespace."""
    assert "pcnet3d/py.typed" in names
    packages = {name.rpartition("/")[0] for name in names if name.endswith(".py")}
    assert {f"{package}/__init__.py" for package in packages} <= names


def test_the_licence_comes_with_it(names, wheel, metadata):
    (name,) = (name for name in names if name.endswith("/licenses/LICENSE"))
    assert ZipFile(wheel).read(name).decode() == (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert metadata["License-Expression"] == "MIT"


def test_metadata(metadata):
    assert metadata["Name"] == "pcnet3d"
    assert metadata["Summary"] == PROJECT["description"]
    assert metadata["Requires-Python"] == ">=3.11"
    required = metadata.get_all("Requires-Dist") or []
    assert len([line for line in required if "extra ==" not in line]) == len(PROJECT["dependencies"])
    assert metadata.get_all("Project-URL") is None  # none exists yet


def test_citation_and_changes_are_of_this_version():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\S+)", changes, re.MULTILINE)[0] == PROJECT["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {PROJECT['version']}\n" in citation
    assert PROJECT["description"] in citation


def test_the_conda_recipe_is_of_this_version_and_its_dependencies():
    recipe = yaml.safe_load((ROOT / ".github" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == PROJECT["version"]
    needed = [Requirement(line) for line in PROJECT["dependencies"] if ";" not in line]
    own = {"opencv-python-headless": "py-opencv"}
    expected = {own.get(need.name, need.name): str(need.specifier) for need in needed}
    stated = dict(line.split(" ", 1) for line in recipe["requirements"]["run"])
    assert stated.pop("python") == PROJECT["requires-python"]
    assert set(stated) == set(expected)
    for name in stated.keys() - {"py-opencv"}:
        assert SpecifierSet(stated[name]) == SpecifierSet(expected[name]), name
