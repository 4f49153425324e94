"""Files for other programs, read back by their own rules: nothing lost, axes and units as they say."""

import csv
import json
import os
import re

import numpy as np
import pyarrow.parquet as pq
import pytest

from golden.waving import FPS, ROWS, exported, made
from pcnet3d.pipeline import CAMERA, H36M17, LEVEL, PoseSequence, Take
from pcnet3d.pipeline.core.anthropometry import ANKLE_HEIGHT, floor_height
from pcnet3d.pipeline.core.frames import METRES, Frame
from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.files.markers import Markers, read_trc
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories
from refusals import refused


def trc_of(take, folder) -> Markers:
    """What our reader finds in the take's TRC file; OpenSim's own reads it below."""
    return read_trc(exported(take, folder, "trc") / "markers.trc")


def test_trc_is_the_filtered_skeleton_with_y_up_in_metres(take, tmp_path):
    trc = trc_of(take, tmp_path)
    found, names = trc.points, trc.names
    assert names == list(H36M17.joints)
    assert trc.unit == "m"
    assert trc.numbers.tolist() == list(range(1, ROWS + 1))
    np.testing.assert_allclose(trc.time_s, take.poses.times, atol=1e-6)
    level = take.filtered.joints
    np.testing.assert_allclose(found, np.stack([-level[..., 0], level[..., 2], level[..., 1]], -1), atol=1e-6)
    at = {name: found[0, i] for i, name in enumerate(names)}
    assert at["head"][1] - at["pelvis"][1] > 0.5  # y is up
    assert at["nose"][0] > at["thorax"][0] + 0.03  # x is forward
    assert at["r_hip"][2] > at["l_hip"][2]  # z is right
    assert np.isnan(found[20:25, names.index("l_wrist")]).all()
    assert np.isnan(found).any(axis=(1, 2)).sum() == 5


@pytest.mark.parametrize("writer", ["trc", "mot", "c3d"])
def test_what_is_too_short_to_be_smoothed_is_not_written(facing_camera, tmp_path, writer):
    """Of two to six frames the files had rows in which nothing was."""
    if writer == "c3d":
        pytest.importorskip("ezc3d", reason="the extra c3d is not installed")
    poses = PoseSequence(
        np.tile(facing_camera, (5, 1, 1)), H36M17, CAMERA.with_(unit="m"), time_s=np.arange(5) / FPS
    )
    take = Angles()(Trajectories()(Rectify("geometric")(Take("short", poses=poses))))
    run = exported(take, tmp_path, writer)
    assert {path.name for path in run.iterdir()} == {"poses.npz", "kinematics.parquet", "summary.json"}
    codes = [said["code"] for said in json.loads((run / "summary.json").read_text())["notices"]]
    assert codes.count("not-written") == 1


def test_a_person_who_walks_moves_through_the_trc(walks, tmp_path):
    trc = trc_of(walks, tmp_path)
    found, names, time_s = trc.points, trc.names, trc.time_s
    pelvis = found[:, names.index("pelvis")]
    forward = walks.rectified.R_source_from_level.T @ [0, 0, -1.3]
    speed = np.array([-forward[0], forward[2], forward[1]])
    np.testing.assert_allclose(pelvis - pelvis[0], np.outer(time_s - time_s[0], speed), atol=2e-3)
    root = walks.filtered.root[0] - [0, 0, floor_height(walks.filtered)]
    np.testing.assert_allclose(pelvis[0], root @ [[-1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-5)
    assert speed[0] > 1.2
    ankles = found[:, [names.index(f"{side}_ankle") for side in "rl"], 1]
    assert np.median(ankles.min(axis=1)) == pytest.approx(ANKLE_HEIGHT * 1.75, abs=0.02)  # the floor is at 0


def test_uneven_stamps_become_an_even_rate(facing_camera, tmp_path):
    time_s = np.cumsum(np.random.default_rng(0).uniform(0.025, 0.042, 90))
    take = made(facing_camera, time_s=time_s)
    trc = trc_of(take, tmp_path)
    found, names, even_s = trc.points, trc.names, trc.time_s
    assert np.ptp(np.diff(even_s)) < 3e-6
    wrist = take.filtered.joint("r_wrist")[:, 1]
    expected = np.interp(even_s, time_s, wrist)
    np.testing.assert_allclose(found[:, names.index("r_wrist"), 2], expected, atol=2e-3)


@pytest.mark.parametrize("jitter_s", [0.0, 0.006])
def test_images_that_the_recording_lacks_are_gaps_whatever_the_stamps(facing_camera, tmp_path, jitter_s):
    late = np.random.default_rng(0).uniform(0, jitter_s, ROWS)
    time_s = np.arange(ROWS) / FPS + late + 3 / FPS * (np.arange(ROWS) >= 40)
    trc = trc_of(made(facing_camera, time_s=time_s), tmp_path)
    found, names, even_s = trc.points, trc.names, trc.time_s
    lost = np.isnan(found[:, names.index("r_wrist")]).any(axis=1)
    assert len(even_s) == pytest.approx(ROWS + 3, abs=1)
    assert 3 <= lost.sum() <= 4
    assert abs(even_s[lost].mean() - 41 / FPS) < 1.5 / FPS


def test_mot_bears_the_coordinates_of_a_model_where_they_mean_the_same(take, tmp_path):
    lines = (exported(take, tmp_path, "mot") / "angles.mot").read_text().splitlines()
    end = lines.index("endheader")
    header = dict(line.split("=") for line in lines[:end] if "=" in line)
    names = lines[end + 1].split("\t")
    expected = {"version": "1", "nRows": str(ROWS), "nColumns": str(len(names)), "inDegrees": "yes"}
    assert header == expected
    assert set(names) > {
        "knee_angle_r",
        "hip_adduction_l",
        "trunk_lean_frontal",
        "r_thigh_trunk_flexion",
        "l_shoulder_flexion",
    }
    assert "l_hip_abduction is -hip_adduction_l" in lines
    # Against the trunk a lumbar bend would read as hip flexion or pelvic tilt.
    theirs = ("hip_flexion", "arm_flex", "pelvis_t", "pelvis_list", "pelvis_rotation", "lumbar")
    assert not [name for name in names if name.startswith(theirs)]
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[end + 2 :]])
    assert rows.shape == (ROWS, len(names))
    found = dict(zip(names, rows.T, strict=True))
    for name, values in (
        ("time", take.poses.times),
        ("knee_angle_r", take.kinematics["r_knee_flexion_deg"]),
        ("hip_adduction_l", -take.kinematics["l_hip_abduction_deg"]),
    ):
        np.testing.assert_allclose(found[name], values, atol=1e-6)


def test_mot_without_angles_is_refused(take, tmp_path):
    only_paths = Trajectories()(take.with_(kinematics=None)).kinematics
    with refused("needs-stage"):
        exported(take.with_(kinematics=only_paths), tmp_path, "mot")


def test_csv_is_the_parquet_and_nothing_but_a_table(take, tmp_path):
    folder = exported(take, tmp_path, "csv")
    content = (folder / "kinematics.csv").read_bytes()
    assert content.isascii()
    rows = list(csv.DictReader(content.decode().splitlines()))
    table = pq.read_table(folder / "kinematics.parquet")
    assert list(rows[0]) == [*table.column_names, "length_unit"]
    assert {row["length_unit"] for row in rows} == {"m"}
    for name in table.column_names:
        cells = np.array([float(row[name] or "nan") for row in rows])
        column = np.array(table[name])  # of 32 bits, or a time: the text gives either back
        np.testing.assert_array_equal(cells.astype(column.dtype), column)
    assert {row["l_wrist_x"] for row in rows[20:25]} == {""}


def test_every_table_says_where_it_comes_from(take, tmp_path):
    told = pq.read_table(exported(take, tmp_path) / "kinematics.parquet").schema.metadata
    told = {name.decode(): text.decode() for name, text in told.items()}
    assert told["take"] == "waving"
    assert told["input poses"] == f"file a, b.npy, sha256 {'0' * 64}, adapter arrays"
    assert told["axes"].startswith("LEVEL (x back, y right, z up")
    assert told["warning 1"] == "careful, please"
    assert any("low-pass filter" in text and "cutoff_hz 6.0" in text for text in told.values())
    assert any("smoother" in text and "columns_of ['r_wrist'" in text for text in told.values())


def test_what_a_file_says_of_its_axes_is_what_it_holds(walks, tmp_path):
    """All of them said the pelvis was the origin, one other axes than its own, one another unit."""
    ezc3d = pytest.importorskip("ezc3d", reason="the extra c3d is not installed")
    file = ezc3d.c3d(str(exported(walks, tmp_path, "c3d") / "markers.c3d"))
    lines = file["parameters"]["PCNET3D"]["PROVENANCE"]["value"]
    told = "\n".join(lines).replace("\n  ", " ").splitlines()
    assert not any(line.startswith("root:") for line in told)
    said = dict(line.split(": ", 1) for line in told if ": " in line)
    parts = re.fullmatch(
        r"\w+ \(x (\w+), y (\w+), z (\w+), right-handed; origin camera(.*); (\w+)\)", said["axes"]
    ).groups()
    assert parts[3:] == (", heights from the floor", said["length_unit"]) == (parts[3], "mm")
    assert file["parameters"]["POINT"]["UNITS"]["value"] == ["mm"]
    axes = Frame("told", "level", parts[:3])
    pelvis = file["data"]["points"][:3, H36M17.index("pelvis")].T * METRES["mm"]
    root = walks.filtered.root - [0, 0, floor_height(walks.filtered)]
    np.testing.assert_allclose(pelvis, root @ (axes.basis @ LEVEL.basis.T).T, atol=1e-5)


def test_opensim_opens_trc_and_mot(take, tmp_path):
    opensim = pytest.importorskip("opensim", reason="OpenSim is not installed")
    folder = exported(take, tmp_path, "trc", "mot")
    markers = opensim.TimeSeriesTableVec3(str(folder / "markers.trc"))
    assert list(markers.getColumnLabels()) == list(H36M17.joints)
    assert markers.getNumRows() == ROWS
    assert float(markers.getTableMetaDataAsString("DataRate")) == pytest.approx(FPS)
    assert markers.getTableMetaDataAsString("Units") == "m"
    np.testing.assert_allclose(markers.getIndependentColumn(), take.poses.times, atol=1e-6)
    head = markers.getDependentColumn("head")
    assert head[0].to_numpy()[1] > 0.5  # y is up in OpenSim's models
    angles = opensim.TimeSeriesTable(str(folder / "angles.mot"))
    assert angles.getTableMetaDataAsString("inDegrees") == "yes"
    knee = angles.getDependentColumn("knee_angle_r").to_numpy()
    np.testing.assert_allclose(knee, take.kinematics["r_knee_flexion_deg"], atol=1e-6)


def test_netcdf_has_the_layout_of_movement(take, tmp_path):
    xarray = pytest.importorskip("xarray", reason="xarray is not installed")
    with xarray.open_dataset(exported(take, tmp_path, "netcdf") / "poses.nc", engine="scipy") as data:
        assert data.position.dims == ("time", "space", "keypoint", "individual")
        assert data.confidence.dims == ("time", "keypoint", "individual")
        assert data.space.values.tolist() == ["x", "y", "z"]
        assert data.keypoint.values.tolist() == list(H36M17.joints)
        assert data.individual.values.tolist() == ["Ann"]
        expected = {"ds_type": "poses", "source_software": "pcnet3d", "time_unit": "seconds"}
        assert {key: data.attrs[key] for key in expected} == expected
        assert data.attrs["fps"] == pytest.approx(FPS)
        said = json.loads(data.attrs["provenance"])
        assert said["take"] == "waving"
        assert said["axes"] == data.position.axes
        steps = [text.split(" (")[0] for name, text in said.items() if name.startswith("step")]
        assert steps == ["read", "rectify"]  # its positions went through no filter
        np.testing.assert_allclose(data.time, take.poses.times)
        level = take.rectified.level
        np.testing.assert_array_equal(data.position.sel(individual="Ann", space="z"), level.joints[..., 2])
        wrist = data.position.sel(individual="Ann", keypoint="l_wrist")
        np.testing.assert_array_equal(wrist, level.joint("l_wrist"))
        in_memory = take.to_xarray()
        assert {name: value for name, value in data.attrs.items() if name != "provenance"} == in_memory.attrs
        xarray.testing.assert_equal(data.drop_attrs(), in_memory.drop_attrs())


@pytest.mark.parametrize("writer", ["csv", "c3d", "netcdf", "bvh", "glb"])
def test_folders_whose_names_are_not_utf_8(take, tmp_path, writer):
    """Linux and others know names that are bytes of any kind: an old archive's M\xfcller."""
    if writer == "c3d":
        pytest.importorskip("ezc3d")
    folder = tmp_path / os.fsdecode(b"M\xfcller")
    try:
        folder.mkdir()
    except (OSError, UnicodeError):
        pytest.skip("this system has no such names")
    take = take.with_(measures=read_measures({"walking": {"walking_speed": 1.5}}))
    assert all(file.stat().st_size for file in exported(take, folder, writer).iterdir())


def test_what_a_take_lacks_for_tables_is_said(take):
    for of, without in (("to_pandas", "kinematics"), ("to_xarray", "rectified")):
        with refused("needs-stage", without):
            getattr(take.with_(**{without: None}), of)()
