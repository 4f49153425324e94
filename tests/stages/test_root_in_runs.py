"""`pcnet3d run` on files that know where the person is, and on one that does not."""

import json

import numpy as np
import pytest

from commands import pcnet3d, recipe_of, succeeded
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.files import write_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.rotations import angle_deg, rotate, transpose

STAGES = ("clean", "scale", "rectify", "trajectories", "angles", "measures", "export")
# Around a corner, so that the feet tell both directions of the floor.
WALK = walker(seconds=10, turn_deg=-110)
CAMERA = aimed(WALK.root.mean(axis=0), 6, heading_deg=70, pitch_deg=25, roll_deg=6)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """run(*arguments): the summary and the arrays of a run with those, without recording and report."""
    folder = tmp_path_factory.mktemp("runs")
    recipe = recipe_of(folder / "recipe.toml", *STAGES)

    def make(name: str, *arguments):
        given = ["run", *arguments, "--recipe", recipe, "-o", folder / name]
        succeeded(pcnet3d(*given))
        with np.load(folder / name / "poses.npz", allow_pickle=False) as file:
            return json.loads((folder / name / "summary.json").read_text()), dict(file), folder / name

    return make


@pytest.fixture(scope="module")
def placed(run, tmp_path_factory):
    """The run on true joints in the pitched camera's own coordinates, millimetres."""
    file = tmp_path_factory.mktemp("places") / "places.npz"
    np.savez(file, joints=1000 * CAMERA.points(WALK.world), time_s=WALK.time_s)
    told = [f"--option={key}" for key in ("layout=H36M17", "frame=CAMERA", "unit=mm")]
    return run("placed", "--poses", file, "--adapter", "arrays", *told)


def test_the_floor_tells_up_in_a_run(placed):
    summary, arrays, _ = placed
    assert summary["rectification"]["up_shares"]["floor"] > 0.3
    assert angle_deg(arrays["R_source_from_level"][:, 2], CAMERA.up) < 1.5


def test_level_and_root_are_places_in_the_cameras_room(placed):
    _, arrays, _ = placed
    points = CAMERA.points(WALK.world)
    level = arrays["level"] + arrays["root"][:, None]
    np.testing.assert_allclose(rotate(arrays["R_source_from_level"], level), points, atol=1e-4)
    expected = rotate(transpose(arrays["R_source_from_level"]), points[:, :1])[:, 0]
    np.testing.assert_allclose(arrays["root"], expected, atol=1e-4)


def test_the_walk_has_its_speed_and_lengths(placed):
    found = placed[0]["measures"]["walking"]
    stride_m = WALK.speed_mps * 120 / WALK.cadence_spm
    assert found["walking_speed"] == pytest.approx(WALK.speed_mps, rel=0.02)
    assert found["mean_stride_length"] == pytest.approx(stride_m, rel=0.02)
    assert found["mean_step_length"] == pytest.approx(stride_m / 2, rel=0.02)
    for side in ("right", "left"):
        assert found[side]["mean_step_length"] == pytest.approx(stride_m / 2, rel=0.02)


def test_a_lifters_file_has_no_floor_no_way_and_says_why(run, tmp_path):
    write_poses(tmp_path / "X3D.npy", WALK, CAMERA, np.arange(len(WALK)), 0.0, np.random.default_rng(0))
    summary, arrays, _ = run(
        "lifted", "--poses", tmp_path / "X3D.npy", "--fps", 30, "--stature", WALK.stature_m
    )
    assert "floor" not in summary["rectification"]["up_shares"]
    assert np.isnan(arrays["root"]).all()
    found = summary["measures"]["walking"]
    assert found["cadence_spm"] == pytest.approx(WALK.cadence_spm, rel=0.03)  # in a unit that grows
    assert found["lengths_withheld"] == "place-unknown"
    assert not any("speed" in key or "length_m" in key for key in found)
