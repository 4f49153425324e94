"""A name that was removed is refused with what to do instead, and was removed indeed."""

from pathlib import Path

import pytest

from commands import pcnet3d, refused
from pcnet3d.models.lab.evaluation.evaluate import REPORTS
from pcnet3d.pipeline import cli
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.plugins.removed import REMOVED
from pcnet3d.pipeline.reading.settings import reading_options
from pcnet3d.pipeline.running.recipe import load_recipe
from refusals import refused as input_refused

ROWS = [(kind, name) for kind, names in REMOVED.items() for name in names]
OPTION_OF = {"adapters": "--adapter", "writers": "--also"}
MODELS = ("lifters", "detectors", "rectifiers")


def typed(kind: str, name: str) -> list[str]:
    """The command line of somebody who still uses that name."""
    run = ["run", "--poses", "X3D.npy", "-o", "out"]
    if kind == "commands":
        return [name, "x"]
    if kind == "flags":
        command, *words = name.split()
        return [command, "x", *words, "-o", "out"]
    if kind == "settings":
        return [*run, "--set", name if "=" in name else f"{name}=1"]
    if kind == "reports":
        return ["lab", "evaluate", name, "-o", "out"]
    if kind == "stages":
        return [*run, "--set", f"{name}=off"]
    return [*run, OPTION_OF[kind], name]


@pytest.fixture
def here(tmp_path, save, facing_camera):
    """A folder with the file that the command lines name."""
    save(facing_camera[None].repeat(60, axis=0), "X3D.npy")
    return tmp_path


def heeded(kind: str, name: str, folder: Path) -> None:
    """Whoever asks for the name is refused with its sentence, and nothing is written."""
    sentence = f"{name} was removed: {REMOVED[kind][name]}."
    if kind in MODELS:
        with input_refused("name-unknown", sentence):
            registry.open_model(kind, name)
        return
    refused(pcnet3d(*typed(kind, name), cwd=folder, COLUMNS="10000"), sentence)
    assert [path.name for path in folder.iterdir()] == ["X3D.npy"]


@pytest.mark.parametrize(("kind", "name"), ROWS, ids=lambda text: text)
def test_a_removed_name_is_refused_with_its_sentence(kind, name, here):
    heeded(kind, name, here)


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("commands", "toy"), ("flags", "run --toy"), ("flags", "compare --toy"), ("settings", "read.toy"),
        ("settings", "read.swaps=toy"), ("settings", "measures.toy"), ("settings", "rectify.rectifier=toy"),
        ("adapters", "toy"), ("writers", "toy"), ("lifters", "toy"), ("detectors", "toy"), ("rectifiers", "toy"),
        ("stages", "toy"),
    ],
)  # fmt: skip
def test_a_row_of_each_kind_is_heeded(kind, name, here, monkeypatch):
    monkeypatch.setitem(REMOVED, kind, {name: "say what to do"})
    heeded(kind, name, here)


def test_a_recipe_that_names_it_is_refused(here, monkeypatch):
    monkeypatch.setitem(REMOVED, "stages", {"toy": "say what to do"})
    monkeypatch.setitem(REMOVED, "settings", {"measures.toy": "say what to do"})
    for text in ('[[stages]]\nuse = "toy"\n', '[[stages]]\nuse = "measures"\ntoy = 1\n'):
        (here / "recipe.toml").write_text(text, encoding="utf-8")
        said = pcnet3d(
            *typed("settings", "read.swaps=report"), "--recipe", "recipe.toml", cwd=here, COLUMNS="10000"
        )
        refused(said, "was removed: say what to do.")
        (here / "recipe.toml").unlink()


@pytest.mark.parametrize(("kind", "name"), ROWS, ids=lambda text: text)
def test_nothing_of_that_name_is_there(kind, name):
    if kind == "commands":
        assert name not in cli._points()
    elif kind == "flags":
        command, flag, *value = name.split()
        options = {option for each in cli.load_command(command).params for option in each.opts}
        assert value or flag not in options
    elif kind == "reports":
        assert name not in REPORTS
    elif kind != "settings":
        assert name not in registry.registered(kind)
    elif name.startswith("read.") and "=" not in name:
        assert name.removeprefix("read.") not in reading_options()


def test_the_default_recipe_names_nothing_that_was_removed():
    assert not {entry.use for entry in load_recipe().stages} & set(REMOVED.get("stages", ()))
