"""Filter and formats through the command line: files there, or one sentence and exit code 2."""

import subprocess
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from commands import pcnet3d, recipe_of, refused
from pcnet3d.pipeline import InputError, Pipeline, Told
from pcnet3d.stages.clean import Clean
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.lift import Lift
from pcnet3d.stages.place import Place
from pcnet3d.stages.scale import Scale


@pytest.fixture
def run(tmp_path, facing_camera):
    """pcnet3d run on two seconds of a person who barely moves; recording and report are left out."""
    jitter = np.random.default_rng(0).normal(scale=0.002, size=(60, 17, 3))
    jitter[0, 0] = 0
    np.save(tmp_path / "X3D.npy", (facing_camera * 0.8 + [0.1, 0.1, 0] + jitter).astype(np.float32))
    stages = ("scale", "rectify", "trajectories", "angles", "measures", "export")
    recipe_of(tmp_path / "recipe.toml", *stages)

    def run(*arguments) -> tuple[subprocess.CompletedProcess, Path]:
        given = ["run", "--poses", tmp_path / "X3D.npy", "--fps", 30, "--set", "rectify.rectifier=geometric"]
        given += ["--recipe", tmp_path / "recipe.toml", *arguments, "-o", tmp_path / "out"]
        return pcnet3d(*given), tmp_path / "out"

    return run


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "trajectories.cutoff_hz=50"], ["15 Hz", "got 50 Hz", "Nyquist"]),
        (["--also", "mp4", "--no-frames"], ["annotated.mp4", "leave one of the two out"]),
        (["--also", "trc"], ["metres", "--stature"]),
        (["--also", "csv", "--set", "export.names=mixamo"], ["bones", "--also glb"]),
        (["--also", "glb", "--set", "export.names=maya"], ["mixamo", "maya"]),
    ],
)
def test_what_cannot_be_had_is_refused_in_a_sentence(run, arguments, words):
    result, folder = run(*arguments)
    refused(result, *words)
    assert not folder.exists()


@dataclass(frozen=True)
class Measuring:
    """A stage of another package, which may find a scale."""

    name: ClassVar[str] = "measuring"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)


@pytest.mark.parametrize(
    ("unit", "before", "stature_m", "refused"),
    [
        ("arbitrary", [Clean], None, True),
        ("m", [Clean, Place], None, False),
        ("", [Clean], None, False),  # nobody knows
        ("", [Lift, Clean, Scale, Place], None, True),
        ("", [Lift, Clean, Scale, Place], 1.75, False),
        ("m", [Lift], None, True),
        ("arbitrary", [Measuring], None, False),
    ],
)
def test_metres_of_a_take_without_a_scale_are_refused_before_any_work(
    unit, before, stature_m, refused, tmp_path
):
    """A video of somebody without a height was detected and lifted first."""
    stages = (*(stage() for stage in before), Export(tmp_path, also=("trc",)))
    given = ("poses", "keypoints", "rectified", "kinematics")
    with pytest.raises(InputError, match=r"--also trc.*--stature") if refused else nullcontext():
        Pipeline(stages).check_given(given, unit, Told(stature_m=stature_m))
