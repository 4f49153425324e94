"""The shipped network through the rectify stage, on the walker whose gravity and heading are known."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import R_camera_from_body, camera_poses, side_camera
from pcnet3d.models import load_rectifier
from pcnet3d.models.shipped import PCNET
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg
from pcnet3d.stages import rectify
from refusals import refused


@pytest.fixture(scope="module")
def poses(walk):
    return camera_poses(walk, side_camera(walk))


def test_it_is_the_default_and_much_nearer_to_the_truth_than_geometry(walk, poses):
    """The walker squats: his trunk leans by 40 degrees, which geometry takes for a tilted camera."""
    truth = R_camera_from_body(walk, side_camera(walk))
    joints, errors = poses.joints - poses.joints[:, :1], {}
    for name in ("pcnet", "geometric"):
        errors[name] = geodesic_deg(load_rectifier(name).rotation(joints)[0], truth).mean()
    assert errors["pcnet"] < 0.5 * errors["geometric"]
    taken = rectify(poses)
    assert taken.method == load_rectifier("pcnet").method
    assert geodesic_deg(taken.R_source_from_body, truth).mean() < errors["pcnet"]  # one gravity for the take
    assert angle_deg(taken.R_source_from_level[:, 2], truth[0, :, 2]) < 3


def test_a_missing_arm_changes_little(poses):
    joints = poses.joints[::20].copy()
    joints[:, H36M17.indices(["r_elbow", "r_wrist"])] = np.nan
    rectifier = load_rectifier("pcnet")
    assert geodesic_deg(rectifier.rotation(joints)[0], rectifier.rotation(poses.joints[::20])[0]).mean() < 10


def test_the_papers_network_comes_too(poses):
    joints = poses.joints[::20] - poses.joints[::20, :1]
    shipped, paper = (load_rectifier(name).rotation(joints)[0] for name in ("pcnet", "paper"))
    assert 0.1 < geodesic_deg(shipped, paper).mean() < 8


def test_a_network_of_a_data_sets_own_axes_is_refused(poses, tmp_path):
    onnx = pytest.importorskip("onnx", reason="needs onnx, the extra 'train'")
    network = onnx.load(PCNET.open())
    (targets,) = (each for each in network.metadata_props if each.key == "targets")
    targets.value = "axes"
    onnx.save(network, tmp_path / "axes.onnx")
    with refused("wrong-network", "own axes"):
        rectify(poses, str(tmp_path / "axes.onnx"))
