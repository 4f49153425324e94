"""The package movement takes what to_xarray gives: its validators, its functions, and the loader of the examples."""

import numpy as np
import pytest

movement = pytest.importorskip("movement", minversion="0.17", reason="movement is not installed")

from movement.io import load_dataset  # noqa: E402  # all need the package
from movement.kinematics import compute_velocity  # noqa: E402
from movement.validators.datasets import ValidPosesInputs  # noqa: E402

import pcnet3d  # noqa: E402
from pcnet3d.examples import movement_loader  # noqa: E402, F401  # it registers itself
from pcnet3d.examples.walker import camera_poses, side_camera, walker  # noqa: E402
from pcnet3d.pipeline import InputError  # noqa: E402


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """X3D.npy of the walker's joints."""
    walk = walker(seconds=2)
    path = tmp_path_factory.mktemp("poses") / "X3D.npy"
    np.save(path, camera_poses(walk, side_camera(walk)).joints)
    return path


def test_its_validators_and_functions_take_a_take(file):
    data = pcnet3d.process(poses=file, adapter="arrays", fps=30).to_xarray()
    ValidPosesInputs.validate(data)
    velocity = compute_velocity(data.position)
    wrist = data.position.sel(keypoint="r_wrist").values
    np.testing.assert_allclose(
        velocity.sel(keypoint="r_wrist"), np.gradient(wrist, data.time, axis=0), atol=1e-4
    )


def test_its_loader_opens_runs_and_files(file, tmp_path):
    told = {"adapter": "arrays", "fps": 30}
    pcnet3d.process(output=tmp_path / "run", poses=file, **told)
    of_run = load_dataset(tmp_path / "run", source_software="pcnet3d")
    of_file = load_dataset(file, source_software="pcnet3d", **told)
    assert of_run.sizes == {"time": 60, "space": 3, "keypoint": 17, "individual": 1}
    np.testing.assert_allclose(of_run.position, of_file.position, atol=1e-5)
    assert of_run.attrs["fps"] == pytest.approx(30)
    with pytest.raises(InputError):
        load_dataset(tmp_path, source_software="pcnet3d")
