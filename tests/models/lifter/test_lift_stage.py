"""`pcnet3d run --lifter`: what the run says about another lifter, and what it refuses."""

import json

import numpy as np
import pytest

from commands import pcnet3d, succeeded
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError, load_recipe
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.stages.lift import Lift

ZERO = np.zeros((3, 3))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    walk = walker(seconds=2)
    return write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk))


@pytest.fixture(scope="module")
def take(files):
    return open_take(RunOptions(video=files.video, keypoints=files.keypoints))


def test_a_mirrored_network_is_refused_and_put_right_when_asked(per_frame, facing_camera, take):
    good = per_frame(ZERO, facing_camera, name="good.onnx")
    mirrored = per_frame(ZERO, facing_camera * [-1, 1, 1], name="mirrored.onnx")
    expected = Lift(good)(take).poses
    with pytest.raises(
        InputError, match=r"The lift by mirrored.onnx@.* mirrored .*--set read.handedness=mirror"
    ):
        Lift(mirrored)(take)
    np.testing.assert_allclose(
        Lift(mirrored)(take.telling(handedness="mirror")).poses.joints, expected.joints, atol=1e-6
    )


def test_the_bearing_is_told_until_the_focal_length_is_known(per_frame, facing_camera, take):
    path = per_frame(ZERO, facing_camera)
    unknown, known = (
        [said.values.get("costs", "") for said in Lift(path)(take.telling(focal_px=focal)).notices]
        for focal in (None, 640.0)
    )
    assert any("the heading is off" in costs for costs in unknown)
    assert not any(known)


def test_a_lift_that_is_no_skeleton_is_warned_of(per_frame, take):
    notices = Lift(per_frame(np.diag([1, 1, 0])))(take.telling(handedness="ignore")).said
    assert "bones" in [said.code for said in notices]


def test_a_lifter_that_cannot_be_opened_ends_the_run_before_it_reads_anything(tmp_path):
    recipe = load_recipe().starting_with("lift").with_options("lift", lifter=str(tmp_path / "none.onnx"))
    with pytest.raises(InputError, match=r"none\.onnx"):
        recipe.build()


def test_run_with_a_lifter(files, per_frame, facing_camera, tmp_path):
    lifter = per_frame(ZERO, facing_camera, name="mine.onnx")
    folder = tmp_path / "out"
    arguments = ("run", files.video, "--keypoints", files.keypoints, "--lifter", lifter, "-o", folder)
    succeeded(pcnet3d(*arguments))
    summary = json.loads((folder / "summary.json").read_text())
    (step,) = (step for step in summary["history"] if step["name"] == "lift")
    assert step["options"]["kind"] == "motionbert"
    assert summary["poses"]["made_by"]["by"].startswith("mine.onnx@")
