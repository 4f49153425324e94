"""Recipes, options, registry and runner: wrong names are caught before any data is touched."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, InputError, Pipeline, PoseSequence, Take, load_recipe
from pcnet3d.pipeline.plugins import registry
from refusals import refused


def written(tmp_path, text):
    path = tmp_path / "recipe.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stage = 1", ["'stage'", "did you mean stages"]),
        ('[[stages]]\nuse = "clen"', ["'clen'", "did you mean clean"]),
        ('[[stages]]\nuse = "clean"\nmax_gaps = 1', ["'max_gaps'", "did you mean max_gap_s"]),
        ('[[stages]]\nuse = "clean"\nmax_gap_s = "long"', ["max_gap_s", "long", "number"]),
        ('[[stages]]\nname = "clean"', ["use"]),
        ("stages = 3", ["stages"]),
        ("= nonsense", ["TOML"]),
        ("stages = []", ["stages", "at least 1"]),
        ('extends = "other"\n[[stages]]\nuse = "clean"', ['extends = "default"', "other"]),
        ('extend = "default"', ["extend", "did you mean extends"]),
        ('[[stages]]\nuse = "clean"\nafter = "scale"', ["clean.after", "extends"]),
        ('extends = "default"\n[[stages]]\nuse = "reach"\nafter = "rectfy"', ["'rectfy'", "rectify"]),
        ('extends = "default"\n[[stages]]\nuse = "reach"', ["'reach'", "after"]),
        ('extends = "default"', ["stages"]),
    ],
)
def test_a_wrong_recipe_is_refused_with_the_nearest_right_word(tmp_path, text, words):
    with refused(None, *words):
        load_recipe(written(tmp_path, text)).build()


def test_a_recipe_adds_to_the_default_one(tmp_path):
    text = """extends = "default"
[[stages]]
use = "one"
after = "rectify"
side = "r"
[[stages]]
use = "two"
after = "rectify"
[[stages]]
use = "three"
after = "two"
[[stages]]
use = "clean"
max_gap_s = 0.5
"""
    default, recipe = load_recipe(), load_recipe(written(tmp_path, text))
    names = [entry.use for entry in recipe.stages]
    at = names.index("rectify")
    assert names[at : at + 5] == ["rectify", "one", "two", "three", "scale"]
    assert [name for name in names if name not in ("one", "two", "three")] == [e.use for e in default.stages]
    options = {entry.use: entry.options for entry in recipe.stages}
    assert options["one"] == {"side": "r"}
    assert options["clean"] == {"max_gap_s": 0.5}


@dataclass(frozen=True)
class Doubling:
    name: ClassVar[str] = "doubling"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("rectified",)

    def __call__(self, take: Take) -> Take:
        return take.with_(poses=take.poses.with_(joints=take.poses.joints * 2))


@dataclass(frozen=True)
class Needing(Doubling):
    name: ClassVar[str] = "needing"
    needs: ClassVar[tuple[str, ...]] = ("rectified",)


@dataclass(frozen=True)
class Cleaning(Doubling):
    name: ClassVar[str] = "cleaning"
    gives: ClassVar[tuple[str, ...]] = ("poses",)


@dataclass(frozen=True)
class Impossible(Doubling):
    name: ClassVar[str] = "impossible"
    needs: ClassVar[tuple[str, ...]] = ("soul",)


@pytest.mark.parametrize(
    ("stages", "words"),
    [
        ((Needing(), Doubling()), ["'needing'", "rectified", "needing > doubling"]),
        ((Impossible(),), ["soul"]),
        ((Doubling(), Cleaning()), ["'cleaning' would change poses", "put it before 'doubling'"]),
    ],
)
def test_the_runner_refuses_a_chain_before_touching_data(stages, words):
    touched = []
    poses = PoseSequence(np.ones((1, 17, 3)), H36M17, CAMERA)
    with refused(None, *words):
        Pipeline(stages)(Take("t", poses=poses), lambda stage, seconds: touched.append(stage))
    assert touched == []


def test_two_packages_of_one_name_are_refused(monkeypatch):
    from importlib.metadata import EntryPoint

    twins = [EntryPoint("x", "a:A", "pcnet3d.stages"), EntryPoint("x", "b:B", "pcnet3d.stages")]
    monkeypatch.setattr(registry, "installed", lambda: {"stages": twins})
    registry.registered.cache_clear()
    with pytest.raises(InputError, match="a:A and b:B"):
        registry.registered("stages")
    registry.registered.cache_clear()


@pytest.mark.parametrize(
    "value",
    [
        "/etc/x.onnx",
        "../x.onnx",
        "a/../../x.onnx",
        "C:\\\\x.onnx",
        "\\\\\\\\host\\\\x",
        "~/x.onnx",
        "c:x.onnx",
    ],
)
def test_paths_of_a_recipe_stay_in_the_folder(tmp_path, value):
    path = tmp_path / "recipe.toml"
    path.write_text(f'[[stages]]\nuse = "rectify"\nrectifier = "{value}"\n')
    with pytest.raises(InputError, match=r"rectify\.rectifier = .* leads out of the folder"):
        load_recipe(path)
    path.write_text('[[stages]]\nuse = "rectify"\nrectifier = "mine/x..onnx"\n')
    load_recipe(path)
