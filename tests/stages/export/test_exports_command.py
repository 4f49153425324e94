"""Filter and formats through the command line: files there, or one sentence and exit code 2."""

from contextlib import nullcontext
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from commands import pcnet3d, recipe_of, refused
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, Pipeline, PoseSequence, Take, Told
from pcnet3d.stages.clean import Clean
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.lift import Lift
from pcnet3d.stages.place import Place
from pcnet3d.stages.scale import Scale


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
def test_what_cannot_be_had_is_refused_in_a_sentence(tmp_path, facing_camera, arguments, words):
    """Of two seconds of a person who barely moves."""
    jitter = np.random.default_rng(0).normal(scale=0.002, size=(60, 17, 3))
    jitter[0, 0] = 0
    np.save(tmp_path / "X3D.npy", (facing_camera * 0.8 + [0.1, 0.1, 0] + jitter).astype(np.float32))
    stages = ("scale", "rectify", "trajectories", "angles", "measures", "export")
    recipe = recipe_of(tmp_path / "recipe.toml", *stages)
    given = ["run", "--poses", tmp_path / "X3D.npy", "--fps", 30, "--set", "rectify.rectifier=geometric"]
    refused(pcnet3d(*given, "--recipe", recipe, *arguments, "-o", tmp_path / "out"), *words)
    assert not (tmp_path / "out").exists()


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
    one = np.zeros((1, 17, 3))
    poses = PoseSequence(one, H36M17, CAMERA.with_(unit=unit)) if unit else None
    keypoints = PoseSequence(one[..., :2], H36M17, IMAGE)
    take = Take("toy", poses=poses, keypoints=keypoints, told=Told(stature_m=stature_m))
    take = take.with_(rectified=keypoints, kinematics={})  # as if they were there
    with pytest.raises(InputError, match=r"--also trc.*--stature") if refused else nullcontext():
        Pipeline(stages).check(take)
