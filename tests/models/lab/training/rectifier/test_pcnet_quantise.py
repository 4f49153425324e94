"""A rectifier in int8 answers as the original does, on people who really move."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.lab.synthetic.sample_poses import sample_poses
from pcnet3d.models.rectifier.onnx import PCNetRectifier
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.rotations import geodesic_deg, rotate

onnx = pytest.importorskip("onnx", reason="quantising needs onnx, the extra 'train'")
quantising = pytest.importorskip("pcnet3d.models.lab.training.rectifier.quantise")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The shipped network and its int8 form."""
    original = load_rectifier("pcnet").path
    path = tmp_path_factory.mktemp("int8") / "pcnet-int8.onnx"
    change = quantising.quantise(original, path)
    return original, path, change


def test_it_answers_as_the_original_on_the_walker(files):
    original, path, change = files
    walk = walker()
    joints = rotate(side_camera(walk).R_camera_from_world, walk.world - walk.world[:, :1])
    one, other = load_rectifier(str(original)), load_rectifier(str(path))
    apart = geodesic_deg(one.rotation(joints)[0], other.rotation(joints)[0])
    assert 0 < apart.mean() < quantising.LARGEST_CHANGE_DEG  # it is another computation, and nearly the same
    assert 0 < change.mean < quantising.LARGEST_CHANGE_DEG


def test_it_is_smaller_and_says_what_it_is(files):
    original, path, _ = files
    assert path.stat().st_size < original.stat().st_size
    quantised = PCNetRectifier(path)
    assert quantised.precision == "int8"
    assert quantised.method != PCNetRectifier(original).method
    stated = {entry.key: entry.value for entry in onnx.load(path).metadata_props}
    assert stated["quantised_from"] == PCNetRectifier(original).method


def test_bones_keep_their_lengths_and_rotations_stay_rotations(files):
    """The geometry is float32 still."""
    R, error_deg = PCNetRectifier(files[1]).rotation(sample_poses(200))
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-5)
    assert (error_deg > 0).all()


def test_what_cannot_be_quantised_is_refused_and_nothing_is_written(files, tmp_path, monkeypatch):
    original, path, _ = files
    refused = tmp_path / "no.onnx"
    with pytest.raises(InputError, match="int8 already"):
        quantising.quantise(path, refused)
    with pytest.raises(InputError, match=r"gone\.onnx"):
        quantising.quantise(tmp_path / "gone.onnx", refused)
    monkeypatch.setattr(quantising, "LARGEST_CHANGE_DEG", 1e-4)
    with pytest.raises(InputError, match="not written"):
        quantising.quantise(original, refused)
    monkeypatch.setattr(quantising, "_SMALLEST", 10**6)
    with pytest.raises(InputError, match="layers of"):
        quantising.quantise(original, refused)
    assert list(tmp_path.iterdir()) == []
