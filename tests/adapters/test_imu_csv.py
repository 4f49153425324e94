"""Files of IMUs, written here and read back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.sensors import write_csv
from golden.strapped import STILL, strapped
from golden.worlds import R_Y_UP_FROM_Z_UP
from pcnet3d.adapters.imu_csv import GRAVITY_MPS2, imu_from_samples
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError
from pcnet3d.stages.study.compare.imu import read_sensors

WALK = walker(fps=60, seconds=5)


@pytest.mark.parametrize(
    ("unit", "factor"), [("m/s^2", 1.0), ("g", 1 / GRAVITY_MPS2), ("mg", 1000 / GRAVITY_MPS2)]
)
def test_units_are_told_by_the_norm_and_said(unit, factor):
    imu = strapped(WALK, "r_forearm", STILL)
    found = imu_from_samples(imu.time_s, imu.force_mps2 * factor, imu.R_world_from_sensor)
    np.testing.assert_allclose(found.force_mps2, imu.force_mps2, rtol=1e-9)
    assert [each.values["unit"] for each in found.notices] == [unit] * (unit != "m/s^2")


def test_what_is_no_specific_force_with_its_orientation_is_refused():
    imu = strapped(WALK, "r_forearm", STILL)
    R, force, time_s = imu.R_world_from_sensor, imu.force_mps2, imu.time_s
    free = force - R[:, 2] * GRAVITY_MPS2
    y_up = R_Y_UP_FROM_Z_UP @ R
    for bad_R, bad_force, code in (
        (R, free, "wrong-axes"),
        (np.swapaxes(R, 1, 2), force, "wrong-axes"),
        (y_up, force, "wrong-axes"),
        (R, np.full_like(force, np.nan), "nothing-usable"),
        (R, force * 3, "wrong-axes"),
    ):
        with pytest.raises(InputError) as refused:
            imu_from_samples(time_s, bad_force, bad_R)
        assert refused.value.code == code


def test_csv_comes_back_and_has_words_for_what_is_wrong(tmp_path):
    imu = strapped(WALK, "r_forearm")
    path = tmp_path / "wrist.csv"
    write_csv(path, imu)
    found = read_sensors([path], ["r_forearm"])["r_forearm"]
    np.testing.assert_allclose(found.force_mps2, imu.force_mps2, atol=1e-5)
    np.testing.assert_allclose(found.R_world_from_sensor, imu.R_world_from_sensor, atol=1e-5)
    np.testing.assert_allclose(found.time_s, imu.time_s, atol=1e-5)

    text = path.read_text()
    lines = text.splitlines()
    for content, segments, words in (
        (text, [], "one --segment for each --imu"),
        (text, ["r_forarm"], "did you mean r_forearm"),
        (text, ["pelvis"], "pelvis IMU alone"),
        (text.replace("time_s", "clock"), ["r_forearm"], "Expected columns time_s"),
        (text.replace("qw", "q0"), ["r_forearm"], "qw"),
        (text, ["r_forearm", "r_forearm"], "one --segment for each --imu"),
        (text.replace(lines[5], "a,b"), ["r_forearm"], "expected a number"),
        ("\n".join([lines[0], *lines[:0:-1]]), ["r_forearm"], "increase"),
        (lines[0], ["r_forearm"], "got 0"),
        ("time_s,ax,ay,az\n0,0,0,9.8\n0.01,0,0,9.8\n", ["r_forearm"], "and its orientation too"),
        ("time_s,ax,ay,az,qw\n0,0,0,9.8,1\n", ["r_forearm"], r"Expected columns .* qz"),
    ):
        path.write_text(content)
        with pytest.raises(InputError, match=words):
            read_sensors([path], segments)


def test_an_empty_cell_is_missing(tmp_path):
    imu = strapped(WALK, "r_forearm")
    path = tmp_path / "wrist.csv"
    write_csv(path, imu)
    rows = [line.split(",") for line in path.read_text().splitlines()]
    rows[7][2] = ""
    path.write_text("\n".join(";".join(row) for row in rows))
    found = read_sensors([path], ["r_forearm"])["r_forearm"]
    assert np.isnan(found.force_mps2[6, 1])
    assert np.isfinite(np.delete(found.force_mps2, 6, axis=0)).all()


@pytest.mark.parametrize("order", ["xyzw", "wzyx", "zyxw"])
def test_another_order_of_the_quaternions_is_refused(order):
    """As when columns x y z w are read as w x y z, which is what most tools of robotics write."""
    sensor = strapped(WALK, "r_forearm", STILL)
    wxyz = np.roll(Rotation.from_matrix(sensor.R_world_from_sensor).as_quat(), 1, axis=-1)
    misread = wxyz[:, ["wxyz".index(letter) for letter in order]]
    R = Rotation.from_quat(np.roll(misread, -1, axis=-1)).as_matrix()
    with pytest.raises(InputError, match="order of the quaternions"):
        imu_from_samples(sensor.time_s, sensor.force_mps2, R)
