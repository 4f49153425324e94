"""Files of IMUs and of TotalCapture, written here in the documented formats (formats.md 8.2) and read back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.sensors import PERFECT, write_csv, write_sensors
from golden.strapped import Faults, strapped
from golden.worlds import R_Y_UP_FROM_Z_UP, totalcapture
from pcnet3d.adapters import read
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, InputError, rotate
from pcnet3d.pipeline.reading.find import find_adapter
from pcnet3d.pipeline.signals.imu import GRAVITY_MPS2, imu_from_samples, point_on
from pcnet3d.stages.study.imu.align import align
from pcnet3d.stages.study.imu.command import read_imus, root_acceleration
from pcnet3d.stages.study.imu.motion import even_times, imu_signal, path_acceleration


@pytest.fixture(scope="module")
def walk():
    return walker(fps=60, seconds=5)


@pytest.mark.parametrize("extra", [0, 6])
def test_totalcapture_sensors_become_accelerations_of_their_segments_in_the_world(walk, tmp_path, extra):
    path = write_sensors(tmp_path, walk, extra)
    assert find_adapter(path, gives="imu").name == "totalcapture_imu"
    sensors, compared = read_imus([path], [])
    assert compared == ["r_forearm", "l_shank"]
    for segment, imu in sensors.items():
        truth = point_on(segment, walk.acceleration_mps2)
        np.testing.assert_allclose(imu.acceleration_mps2, truth, atol=1e-4)
        assert imu.rate_hz == pytest.approx(60)


def test_without_calibration_the_inertial_world_still_has_z_up(walk, tmp_path):
    path = write_sensors(tmp_path, walk)
    (tmp_path / "s1_acting1_calib_imu_ref.txt").unlink()
    sensors, _ = read_imus([path], ["r_forearm"])
    truth = point_on("r_forearm", walk.acceleration_mps2)
    found = sensors["r_forearm"].acceleration_mps2
    np.testing.assert_allclose(found[:, 2], truth[:, 2], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), np.linalg.norm(truth, axis=-1), atol=1e-4)


def test_damaged_sensors_are_refused_in_words(walk, tmp_path):
    path = write_sensors(tmp_path, walk)
    text, calibration = path.read_text(), tmp_path / "s1_acting1_calib_imu_ref.txt"
    cut = text[: len(text) // 2]
    for damaged in (cut, text.replace("R_LowArm", "R_Hand"), text.replace("\t0.", "\tnull.", 1)):
        path.write_text(damaged)
        with pytest.raises(InputError, match="Expected"):
            read_imus([path], [])
    path.write_text(text)
    calibration.write_text("\n".join(calibration.read_text().splitlines()[:-1]))
    with pytest.raises(InputError, match="Expected"):
        read_imus([path], [])


def test_totalcapture_positions(walk, tmp_path):
    path = totalcapture(tmp_path, walk.world)
    poses = read(path)
    assert poses.history[0].options["adapter"] == "totalcapture"
    assert poses.fps == pytest.approx(60)
    truth = walk.world - walk.world[:, :1]
    world = rotate(R_Y_UP_FROM_Z_UP.T, poses.joints)
    for joint in H36M17.joints:
        if joint != "nose":  # TotalCapture has none
            np.testing.assert_allclose(
                world[:, H36M17.index(joint)], truth[:, H36M17.index(joint)], atol=1e-5, err_msg=joint
            )


def test_the_path_of_the_root_keeps_its_acceleration(walk, tmp_path):
    root = root_acceleration(totalcapture(tmp_path, walk.world), 6.0)
    inner = slice(30, -30)
    found, truth = root(walk.time_s)[inner], walk.acceleration_mps2[inner, 0]
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.05 * np.sqrt(np.mean(truth**2))


def test_with_the_path_of_the_root_no_pelvis_imu_is_needed(walk, tmp_path):
    root = root_acceleration(totalcapture(tmp_path, walk.world), 6.0)
    grid = even_times(walk.time_s, 6.0)
    path = point_on("r_forearm", walk.world - walk.world[:, :1])
    video = path_acceleration(path, walk.time_s, (), grid, 6.0)
    sensor = strapped(walk, "r_forearm", Faults(lag_s=0.0, heading_deg=0.0))
    assert align(grid, video, imu_signal(sensor, root, 6.0), 0.5).score > 0.99


@pytest.mark.parametrize(
    ("unit", "factor"), [("m/s^2", 1.0), ("g", 1 / GRAVITY_MPS2), ("mg", 1000 / GRAVITY_MPS2)]
)
def test_units_are_told_by_the_norm_and_said(walk, unit, factor):
    imu = strapped(walk, "r_forearm", PERFECT)
    found = imu_from_samples("r_forearm", imu.time_s, imu.force_mps2 * factor, imu.R_world_from_sensor)
    np.testing.assert_allclose(found.force_mps2, imu.force_mps2, rtol=1e-9)
    assert [each.values["unit"] for each in found.notices] == [unit] * (unit != "m/s^2")


def test_what_is_no_specific_force_with_its_orientation_is_refused(walk):
    imu = strapped(walk, "r_forearm", PERFECT)
    R, force, time_s = imu.R_world_from_sensor, imu.force_mps2, imu.time_s
    free = force - R[:, 2] * GRAVITY_MPS2
    y_up = R_Y_UP_FROM_Z_UP @ R
    for bad_R, bad_force, words in (
        (R, free, "include gravity"),
        (np.swapaxes(R, 1, 2), force, "inverse fits better"),
        (y_up, force, "y seems to be the vertical"),
        (R, np.full_like(force, np.nan), "no sample"),
        (R, force * 3, "mean norm"),
    ):
        with pytest.raises(InputError, match=words):
            imu_from_samples("r_forearm", time_s, bad_force, bad_R)


def test_csv_comes_back_and_has_words_for_what_is_wrong(walk, tmp_path):
    imu = strapped(walk, "r_forearm")
    path = tmp_path / "wrist.csv"
    write_csv(path, imu)
    sensors, _ = read_imus([path], ["r_forearm"])
    found = sensors["r_forearm"]
    np.testing.assert_allclose(found.force_mps2, imu.force_mps2, atol=1e-5)
    np.testing.assert_allclose(found.R_world_from_sensor, imu.R_world_from_sensor, atol=1e-5)
    np.testing.assert_allclose(found.time_s, imu.time_s, atol=1e-5)
    assert found.segment == "r_forearm"

    text = path.read_text()
    lines = text.splitlines()
    for content, options, segments, words in (
        (text, {}, [], "one --segment for each --imu"),
        (text, {}, ["r_forarm"], "did you mean r_forearm"),
        (text, {}, ["pelvis"], "pelvis IMU alone"),
        (text, {"rate_hz": 50}, ["r_forearm"], "contradict"),
        (text, {"maps": "sensor_from_world"}, ["r_forearm"], "inverse fits better"),
        (text.replace("time_s", "clock"), {}, ["r_forearm"], "no column time_s"),
        (text.replace("qw", "q0"), {}, ["r_forearm"], "qw"),
        (text.replace(lines[5], "a,b"), {}, ["r_forearm"], "a,b"),
        ("\n".join([lines[0], *lines[:0:-1]]), {}, ["r_forearm"], "increase"),
        (lines[0], {}, ["r_forearm"], "got 0"),
        ("time_s,ax,ay,az\n0,0,0,0.1\n0.01,0.1,0,0\n", {}, ["r_forearm"], "include gravity"),
        ("time_s,ax,ay,az,qw\n0,0,0,9.8,1\n", {}, ["r_forearm"], r"Expected columns .* qz"),
    ):
        path.write_text(content)
        with pytest.raises(InputError, match=words):
            read_imus([path], segments, "imu_csv", options)


def test_a_csv_without_a_clock_takes_the_rate_and_an_empty_cell_is_missing(walk, tmp_path):
    imu = strapped(walk, "r_forearm")
    path = tmp_path / "wrist.csv"
    write_csv(path, imu)
    rows = [line.split(",") for line in path.read_text().replace("time_s", "t").splitlines()]
    rows[7][2] = ""
    path.write_text("# made by hand\n" + "\n".join(";".join(row) for row in rows))
    sensors, _ = read_imus([path], ["r_forearm"], options={"rate_hz": 100})
    found = sensors["r_forearm"]
    np.testing.assert_allclose(found.time_s, np.arange(len(imu.time_s)) / 100)
    assert np.isnan(found.force_mps2[6, 1])
    assert np.isfinite(np.delete(found.force_mps2, 6, axis=0)).all()


@pytest.mark.parametrize("order", ["xyzw", "wzyx", "zyxw"])
def test_another_order_of_the_quaternions_is_named(walk, order):
    """As when columns x y z w are read as w x y z, which is what most tools of robotics write."""
    sensor = strapped(walk, "r_forearm", PERFECT)
    wxyz = np.roll(Rotation.from_matrix(sensor.R_world_from_sensor).as_quat(), 1, axis=-1)
    misread = wxyz[:, ["wxyz".index(letter) for letter in order]]
    R = Rotation.from_quat(np.roll(misread, -1, axis=-1)).as_matrix()
    with pytest.raises(InputError, match=f"numbers seem to be {' '.join(order)}, not w x y z"):
        imu_from_samples("r_forearm", sensor.time_s, sensor.force_mps2, R)


@pytest.mark.parametrize("unit", [1.0, 1 / GRAVITY_MPS2])
def test_a_csv_without_orientations_keeps_its_norm(walk, tmp_path, unit):
    sensor = strapped(walk, "r_forearm")
    path = tmp_path / "imu.csv"
    write_csv(path, replace(sensor, force_mps2=sensor.force_mps2 * unit, R_world_from_sensor=None))
    found = read_imus([path], ["r_forearm"])[0]["r_forearm"]
    assert found.R_world_from_sensor is None
    np.testing.assert_allclose(found.force_mps2, sensor.force_mps2, atol=1e-4)
    with pytest.raises(InputError, match="export the quaternions too"):
        found.acceleration_mps2  # noqa: B018
