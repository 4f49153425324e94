"""The files of a run, read back."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.rotations import rotate
from pcnet3d.pipeline.take import Event
from pcnet3d.stages.export import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories


@pytest.fixture
def take(facing_camera) -> Take:
    joints = np.repeat(facing_camera[None], 8, axis=0) * np.linspace(1, 1.1, 8)[:, None, None]
    joints[3, H36M17.index("r_wrist")] = np.nan
    joints[5, H36M17.index("r_hip")] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=np.arange(8) / 25, frame_index=np.arange(8) + 4)
    poses = poses.noted("read", adapter="arrays")
    inputs = ({"role": "poses", "file": "a.npy", "sha256": "0" * 64, "adapter": "arrays"},)
    take = Take("t", poses=poses, inputs=inputs, events=(Event("warning", "careful"), Event("seam", "s", 3)))
    return Trajectories()(Rectify("geometric")(take))


@pytest.fixture
def folder(take, tmp_path):
    Export(tmp_path / "out")(take)
    return tmp_path / "out"


def test_poses_npz_has_plain_arrays_that_agree_with_each_other(take, folder):
    with np.load(folder / "poses.npz", allow_pickle=False) as file:
        arrays = dict(file)
    assert set(arrays) == {
        "source", "level", "body", "R_source_from_body", "R_source_from_level", "error_deg", "time_s",
        "frame_index", "joint_names", "unit",
    }  # fmt: skip
    np.testing.assert_array_equal(arrays["source"], take.poses.joints)
    for name in ("body", "level"):
        back = rotate(arrays[f"R_source_from_{name}"], arrays[name].astype(float))
        centred = take.poses.joints - take.poses.joints[:, :1]
        if name == "body":
            assert np.isnan(back[5]).all()
            back[5] = centred[5]
        np.testing.assert_allclose(back, centred, atol=1e-5)
    assert arrays["joint_names"].tolist() == list(H36M17.joints)
    assert arrays["frame_index"].tolist() == list(range(4, 12))


def test_kinematics_has_a_row_a_frame_and_units_in_its_names(take, folder):
    table = pq.read_table(folder / "kinematics.parquet")
    assert table.num_rows == len(take.poses)
    assert table["frame"].to_pylist() == list(range(4, 12))
    unitless = [
        name for name in table.column_names if not name.endswith(("_m", "_mps", "_s")) and name != "frame"
    ]
    assert unitless == []
    wrist = np.array(table["r_wrist_x_m"])
    np.testing.assert_allclose(wrist, take.rectified.level.joint("r_wrist")[:, 0])


def test_summary_tells_where_everything_came_from(folder):
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["warnings"][0] == "careful"
    assert summary["inputs"][0]["sha256"] == "0" * 64
    assert summary["poses"]["fps"] == pytest.approx(25)
    assert summary["rectification"]["method"] == "geometric"
    assert summary["rectification"]["frames_rectified"] == 7
    assert summary["rectification"]["error_deg_mean"] is None
    assert [step["name"] for step in summary["history"]] == ["read", "rectify"]
    assert any("too few torso joints" in text for text in summary["warnings"])


def test_no_partial_file_is_left(folder):
    assert sorted(path.name for path in folder.iterdir()) == [
        "kinematics.parquet",
        "poses.npz",
        "summary.json",
    ]
