"""The files of a run, read back."""

import json
from collections import ChainMap
from dataclasses import asdict, replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from golden.bodies import facing_camera
from golden.walks import GEOMETRIC, measured
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.messages import bound_in_words
from pcnet3d.pipeline.core.notices import notice, own_notice
from pcnet3d.pipeline.core.rotations import angle_deg, rotate
from pcnet3d.pipeline.core.take import Session
from pcnet3d.pipeline.running.sentences import trusted, up_bound
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories, trajectory

SESSION = Session("Visit 1", "P-07", "2026-03-31")


@pytest.fixture(scope="module")
def take() -> Take:
    joints = np.repeat(facing_camera()[None], 8, axis=0) * np.linspace(1, 1.1, 8)[:, None, None]
    joints[3, H36M17.index("r_wrist")] = np.nan
    joints[5, H36M17.index("r_hip")] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=np.arange(8) / 25, frame_index=np.arange(8) + 4)
    poses = poses.noted("read", adapter="arrays")
    inputs = ({"role": "poses", "file": "a.npy", "sha256": "0" * 64, "adapter": "arrays"},)
    take = Take(
        "t",
        poses=poses,
        inputs=inputs,
        session=SESSION,
        notices=(own_notice("test.said", "careful"), notice("seam", rows=[3], where="here")),
    )
    take = Rectify("geometric")(take)
    rectified = take.need("rectified")
    level = rectified.level.without(np.repeat(~rectified.turned[:, None], 17, axis=1))
    columns = [trajectory(level, joint) for joint in Trajectories.joints]
    return take.with_(filtered=level, kinematics=dict(ChainMap(*columns)))


@pytest.fixture(scope="module")
def folder(take, tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "out"
    Export(path)(take)
    return path


def test_poses_npz_has_plain_arrays_that_agree_with_each_other(take, folder):
    with np.load(folder / "poses.npz", allow_pickle=False) as file:
        arrays = dict(file)
    assert set(arrays) == {
        "source", "level", "body", "R_source_from_body", "R_source_from_level", "root", "root_sd", "error_deg",
        "up_error_deg", "up_bound_deg", "up_votes", "time_s", "frame_index", "joint_names", "unit",
        "filtered",
    }  # fmt: skip
    np.testing.assert_array_equal(arrays["source"], take.poses.joints)
    for name in ("body", "level"):
        back = rotate(arrays[f"R_source_from_{name}"], arrays[name].astype(float))
        centred = take.poses.joints - take.poses.joints[:, :1]
        if name == "body":
            assert np.isnan(back[5]).all()
            back[5] = centred[5]
        np.testing.assert_allclose(back, centred, atol=1e-5)
    assert arrays["root"].shape == (8, 3)
    assert np.isnan(arrays["root"]).all()
    assert arrays["joint_names"].tolist() == list(H36M17.joints)
    assert arrays["frame_index"].tolist() == list(range(4, 12))
    assert arrays["up_error_deg"].shape == arrays["up_bound_deg"].shape == (8,)
    assert (arrays["up_error_deg"] < arrays["up_bound_deg"]).all()
    votes = arrays["up_votes"]
    assert np.flatnonzero(np.isnan(votes).any(axis=1)).tolist() == [5]
    assert np.nanmax(angle_deg(votes, arrays["R_source_from_level"][:, 2])) < 1  # one posture, one up


def test_columns_have_the_same_names_for_every_estimator():
    """One in metres that states its errors, one without a scale that states none."""
    joints = np.repeat(facing_camera()[None], 12, axis=0) * np.linspace(1, 1.1, 12)[:, None, None]
    metric = PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis", unit="m"), time_s=np.arange(12) / 25)
    covariance = np.broadcast_to(1e-4 * np.eye(3), (12, 17, 3, 3))
    bare = metric.with_(frame=metric.frame.with_(unit="arbitrary"))
    names = [
        list(measured(poses, GEOMETRIC[:3]).kinematics)
        for poses in (metric.with_(covariance=covariance), bare)
    ]
    assert names[0] == names[1]
    assert {"r_wrist_az", "r_wrist_az_sd", "r_wrist_acceleration_reason", "r_knee_flexion_deg"} <= set(
        names[0]
    )


def test_kinematics_has_a_row_a_frame_and_the_units_of_its_columns(take, folder):
    table = pq.read_table(folder / "kinematics.parquet")
    assert table.num_rows == len(take.poses)
    assert table["frame"].to_pylist() == list(range(4, 12))
    assert table.schema.metadata[b"length_unit"] == b"m"
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in table.schema}
    assert [name for name, unit in units.items() if not unit] == ["frame"]
    assert units["r_wrist_x"] == units["r_wrist_distance"] == "m"
    assert units["l_ankle_vz"] == units["l_ankle_speed"] == "m/s"
    assert units["r_wrist_acceleration"] == "m/s2"
    assert units["time_s"] == "s"
    wrist = np.array(table["r_wrist_x"])
    np.testing.assert_array_equal(wrist, take.filtered.joint("r_wrist")[:, 0])
    assert np.flatnonzero(np.isnan(wrist)).tolist() == [3, 5]  # missing, and refused by the rectifier


def test_summary_tells_where_everything_came_from(folder):
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["notices"][0] == {
        "code": "test.said",
        "weight": "warning",
        "about": "",
        "text": "careful",
        "rows": None,
        "values": {"text": "careful"},
    }
    assert summary["session"] == asdict(SESSION)
    assert summary["inputs"][0]["sha256"] == "0" * 64
    assert summary["poses"]["fps"] == pytest.approx(25)
    assert summary["rectification"]["method"] == "geometric"
    assert summary["rectification"]["frames_rectified"] == 7
    assert summary["rectification"]["error_deg_mean"] is None
    assert [step["name"] for step in summary["history"]] == ["read", "rectify"]


def rectification(folder) -> dict:
    return json.loads((folder / "summary.json").read_text())["rectification"]


def test_a_moving_camera_is_marked_everywhere(take, tmp_path):
    take = Rectify("geometric")(take.telling(camera="moving"))
    Export(tmp_path / "out")(take)
    found = rectification(tmp_path / "out")
    assert found["camera"] == "moving"
    for name in ("up_error_deg", "up_bound_deg"):
        values = getattr(take.rectified, name)[take.rectified.turned]
        assert found[f"{name}_mean"] == pytest.approx(values.mean())
        assert found[f"{name}_max"] == pytest.approx(values.max())
    metadata = pq.read_table(tmp_path / "out" / "kinematics.parquet").schema.metadata
    assert metadata[b"horizontal"] == b"relative to the camera"
    with np.load(tmp_path / "out" / "poses.npz") as file:
        assert file["R_source_from_level"].shape == (8, 3, 3)


def test_up_that_nobody_was_there_to_show_is_in_no_figure_of_a_moving_camera(take, tmp_path):
    rectified = Rectify("geometric")(take.telling(camera="moving")).rectified
    assert np.flatnonzero(~rectified.turned).tolist() == [5]
    wide = np.where(rectified.turned, rectified.up_bound_deg, 80.0)
    take = take.with_(rectified=replace(rectified, up_bound_deg=wide, level_ok=True, level_reason=""))
    Export(tmp_path / "out")(take)
    most = rectified.up_bound_deg[rectified.turned].max()
    assert rectification(tmp_path / "out")["up_bound_deg_max"] == pytest.approx(most)
    assert up_bound(take.rectified)[1] == pytest.approx(most)
    assert f"{bound_in_words(most)}° (90 %)" in trusted(take)


def test_no_figure_of_up_is_null_not_nan(take, tmp_path):
    unknown = replace(take.rectified, up_error_deg=None, up_bound_deg=None, up_votes=None)
    Export(tmp_path / "out")(take.with_(rectified=unknown))
    found = rectification(tmp_path / "out")
    assert found["up_error_deg"] is found["up_bound_deg"] is None
