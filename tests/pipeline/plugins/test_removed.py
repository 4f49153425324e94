"""A name that was removed is refused with what to do instead, by whatever way it is given."""

import pytest

import pcnet3d
from commands import pcnet3d as typed
from commands import refused
from pcnet3d.models.lab.evaluation.evaluate import REPORTS
from pcnet3d.models.lab.training import lifter
from pcnet3d.models.lab.training.rectifier import NetConfig
from pcnet3d.pipeline import RunOptions
from pcnet3d.pipeline.cli import load_command
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.plugins.options import option_types
from pcnet3d.pipeline.plugins.removed import removed
from pcnet3d.pipeline.reading.settings import reading_options
from refusals import refused as input_refused

ROWS = [(kind, name) for kind, names in removed().items() for name in names]
LAB = ("evaluate", "mmfi", "testbed", "train")  # commands whose flags are named without "lab"
RUN = ("run", "--poses", "X3D.npy", "-o", "out")
LINES = {
    "commands": lambda name: (name, "x"),
    "lab": lambda name: ("lab", name, "x"),
    "flags": lambda name: (*["lab"][: name.startswith(LAB)], *name.split(), "-o", "out"),
    "settings": lambda name: (*RUN, "--set", name if "=" in name else f"{name}=1"),
    "adapters": lambda name: (*RUN, "--adapter", name),
    "writers": lambda name: (*RUN, "--also", name),
    "lifters": lambda name: ("run", "--keypoints", "X3D.npy", "--lifter", name, "-o", "out"),
    "reports": lambda name: ("lab", "evaluate", name, "-o", "out"),
}


@pytest.fixture
def here(tmp_path, save, facing_camera):
    """A folder with the file that the command lines name."""
    save(facing_camera[None].repeat(60, axis=0), "X3D.npy")
    return tmp_path


@pytest.mark.parametrize(("kind", "name"), [row for row in ROWS if row[0] in LINES], ids=lambda text: text)
def test_a_removed_name_is_refused_before_anything_is_written(kind, name, here):
    refused(
        typed(*LINES[kind](name), cwd=here, COLUMNS="10000"), f"{name} was removed: {removed()[kind][name]}."
    )
    assert [path.name for path in here.iterdir()] == ["X3D.npy"]


def test_nothing_that_is_there_is_in_the_table():
    commands = [(name, group) for group in ("commands", "lab") for name in registry.registered(group)]
    options = {stage: option_types(kind) for stage, kind in registry.load_all("stages").items()}
    there = {
        **{group: registry.registered(group) for group in registry.GROUPS},
        "flags": {
            f"{command[0]} {flag}"
            for command in commands
            for parameter in load_command(*command).params
            for flag in parameter.opts
        },
        "settings": {f"{stage}.{key}" for stage, keys in options.items() for key in keys}
        | {f"read.{name}" for name in reading_options()},
        "reports": REPORTS,
        "training": {*lifter.TrainConfig.model_fields, *(f"net.{key}" for key in NetConfig.__annotations__)},
        "names": pcnet3d.__all__,
    }
    assert not [(kind, name) for kind, name in ROWS if name in there[kind]]


def test_recipes_configs_and_python_are_told_too(here):
    (here / "recipe.toml").write_text('[[stages]]\nuse = "detect"\nperson_kind = "x"\n', encoding="utf-8")
    refused(typed(*RUN, "--recipe", "recipe.toml", cwd=here), "detect.person_kind was removed")
    for name, text in (("weights", "[weights]"), ("net.graph_layers", "[net]\ngraph_layers = 3")):
        (here / "own.toml").write_text(text, encoding="utf-8")
        refused(typed("lab", "train", "own.toml", "-o", "out", cwd=here), f"{name} was removed")
    with input_refused("name-unknown", "read.missing was removed"):
        RunOptions(missing="gap")
    with input_refused("name-unknown", "pcnet3d.process"):
        _ = pcnet3d.run
