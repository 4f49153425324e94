"""A run against inertial sensors: lag and heading whose answers are known, and the command on the walker's sensors."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commands import pcnet3d, refused, succeeded
from golden.sensors import write_csv
from golden.strapped import Faults, strapped
from pcnet3d.adapters.imu_csv import GRAVITY_MPS2, point_on
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.finished import read_run
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.stages.study.compare.imu import (
    aligned,
    compared_with,
    even_times,
    low_passed,
    path_acceleration,
    read_sensors,
    resampled,
)

RECIPE = Recipe(stages=[{"use": stage} for stage in ("rectify", "trajectories", "export")])


def seen(walk, segment):
    """What a perfect video shows: even times and accelerations relative to the pelvis."""
    grid = even_times(walk.time_s)
    path = point_on(segment, walk.world - walk.world[:, :1])
    return grid, path_acceleration(path, walk.time_s, (), grid)


def felt(walk, segment, faults):
    """The sensor's clock and acceleration, less the pelvis'."""
    sensor, pelvis = strapped(walk, segment, faults), strapped(walk, "pelvis", faults, seed=1)
    own = resampled(low_passed(pelvis), pelvis.time_s, sensor.time_s)
    return sensor.time_s, low_passed(sensor) - own


@pytest.mark.parametrize("segment", ["r_forearm", "l_shank", "r_thigh"])
@pytest.mark.parametrize(("lag", "turned_deg"), [(0.137, 70.0), (-1.2345, -160.0), (0.0, 0.0)])
def test_lag_and_heading_of_the_walker(walk, segment, lag, turned_deg):
    sensor = felt(walk, segment, Faults(lag_s=lag, heading_deg=turned_deg))
    lag_s, heading_deg, score, _ = aligned(*seen(walk, segment), *sensor, 3.0)
    assert lag_s == pytest.approx(lag, abs=0.005)
    assert abs((heading_deg + turned_deg + 180) % 360 - 180) < 2  # the video's world less the IMU's
    assert score > 0.99


def test_clip_boundaries_and_gaps_are_never_crossed(walk):
    path = point_on("r_forearm", walk.world - walk.world[:, :1]).copy()
    path[120:] += 0.3  # as a lifter's new clip may
    path[60:63] = np.nan
    grid = even_times(walk.time_s)
    found = path_acceleration(path, walk.time_s, (120,), grid)
    truth = point_on("r_forearm", walk.acceleration_mps2 - walk.acceleration_mps2[:, :1])
    limit = 1.5 * np.abs(truth).max()
    assert np.nanmax(np.abs(found)) < limit
    blind = path_acceleration(path, walk.time_s, (), grid)
    assert np.nanmax(np.abs(blind)) > 2 * limit
    gap = (grid > walk.time_s[59]) & (grid < walk.time_s[63])
    assert np.isnan(found[gap]).all()


def test_too_little_in_common_has_words(walk):
    grid, video = seen(walk, "r_forearm")
    time_s, values = felt(walk, "r_forearm", Faults(lag_s=100.0))
    with pytest.raises(InputError, match="--offset"):
        aligned(grid, video, time_s, values, 5.0)
    with pytest.raises(InputError, match="did not move"):
        aligned(grid, video, time_s, np.zeros_like(values), 5.0)


def test_a_periodic_motion_has_a_runner_up():
    time_s = np.arange(0, 20, 1 / 60)
    wave = np.stack([np.sin(2 * np.pi * time_s), np.cos(2 * np.pi * time_s), 0 * time_s], axis=-1)
    grid = even_times(time_s)
    *_, score, second = aligned(grid, resampled(wave, time_s, grid), time_s, wave, 3.0)
    assert second > 0.95 * score


@pytest.fixture(scope="module")
def made(walk, tmp_path_factory) -> Path:
    """A folder with a finished run of clean video poses, and the files of three sensors."""
    folder = tmp_path_factory.mktemp("imu")
    np.save(folder / "poses.npy", camera_poses(walk, side_camera(walk)).joints)
    run_files(RunOptions(poses=folder / "poses.npy", adapter="videopose3d", fps=30), folder / "run", RECIPE)
    for seed, segment in enumerate(("r_forearm", "pelvis", "l_shank")):
        write_csv(folder / f"{segment}.csv", strapped(walk, segment, Faults(), seed=seed))
    return folder


def words(made: Path, *segments: str) -> list[str | Path]:
    """The command line of these sensors."""
    pairs = [("--imu", made / f"{segment}.csv", "--segment", segment) for segment in segments]
    return ["compare", made / "run", *(word for pair in pairs for word in pair)]


def test_lag_and_correlation_reach_their_aims(made, tmp_path):
    shutil.copytree(made / "run", tmp_path / "run")
    for segment in ("r_forearm", "pelvis", "l_shank"):
        shutil.copy(made / f"{segment}.csv", tmp_path)
    done = succeeded(pcnet3d(*words(tmp_path, "r_forearm", "pelvis", "l_shank")))
    content = json.loads((tmp_path / "run/compare/compare.json").read_text())
    assert "compare" in json.loads((tmp_path / "run/summary.json").read_text())["files"]
    assert [of["segment"] for of in content["sensors"]] == ["r_forearm", "l_shank"]
    for of in content["sensors"]:
        assert of["lag_s"] == pytest.approx(0.137, abs=0.005)
        assert "pelvis IMU" in of["means"]
        assert list(of["agreement"]) == ["x", "y", "z", "norm"]
        assert all(figures["r"] >= 0.99 for figures in of["agreement"].values())
        assert of["notices"] == []
        assert re.search(rf"{of['segment']}: the sensor is 13[678] ms late", done.stdout)
    assert {each["file"] for each in content["inputs"]} == {"r_forearm.csv", "pelvis.csv", "l_shank.csv"}
    page = (tmp_path / "run/compare/compare.html").read_text()
    titles = re.findall(r"<figcaption>([^<:]+)", page)
    assert titles == ["Right forearm", "Left shank"]


def test_without_a_pelvis_imu_its_motion_counts_as_error(walk, made):
    run, sensor = read_run(made / "run"), strapped(walk, "r_forearm")
    (alone,) = compared_with(run, {"r_forearm": sensor})
    (beside,) = compared_with(run, {"r_forearm": sensor, "pelvis": strapped(walk, "pelvis", seed=1)})
    assert "counts as error" in alone.means
    assert alone.agreement["norm"]["rmse_mps2"] > 2 * beside.agreement["norm"]["rmse_mps2"]


def test_g_is_said_and_gives_the_same(made, tmp_path):
    (sensor,) = read_sensors([made / "l_shank.csv"], ["l_shank"]).values()
    write_csv(tmp_path / "g.csv", replace(sensor, force_mps2=sensor.force_mps2 / GRAVITY_MPS2))
    (again,) = read_sensors([tmp_path / "g.csv"], ["l_shank"], offset_s=3.0).values()
    assert [each.code for each in again.notices] == ["imu-unit"]
    np.testing.assert_allclose(again.force_mps2, sensor.force_mps2, atol=1e-3)
    np.testing.assert_allclose(again.time_s, sensor.time_s + 3.0)


def test_a_run_without_a_scale_is_given_the_sensor_s(walk, made):
    run = read_run(made / "run")
    frame = run.poses.frame.with_(unit="arbitrary")
    level = run.rectified.level.with_(joints=run.rectified.level.joints / 2)
    run = run.with_(poses=run.poses.with_(frame=frame), rectified=replace(run.rectified, level=level))
    sensors = {
        segment: strapped(walk, segment, Faults(), seed=i)
        for i, segment in enumerate(("r_forearm", "pelvis"))
    }
    (found,) = compared_with(run, sensors)
    assert found.metres_per_unit == pytest.approx(2, rel=0.05)
    assert "imu-scale-fitted" in [each.code for each in found.notices]


def test_a_sensor_that_does_not_fit_is_doubted(walk, made):
    sensors = {
        "r_foot": strapped(walk, "r_forearm", Faults(noise_mps2=8.0)),
        "pelvis": strapped(walk, "pelvis", seed=1),
    }
    (found,) = compared_with(read_run(made / "run"), sensors)
    assert "imu-weak" in [each.code for each in found.notices]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--imu", "pelvis.csv", "--segment", "pelvis", "--offset", "100"], "--offset"),
        (["--segment", "l_foot"], "--segment"),
        (["--imu", "r_forearm.csv", "--segment", "r_forearm"], "two for the same"),
        (["--imu", "poses.npy", "--segment", "l_foot"], "3D poses"),
        (["--truth", "walk.trc"], "--truth"),
        (["--align", "stamps"], "--align"),
        (["--rate", "0"], "--rate"),
        (["--rate", "nan"], "--rate"),
    ],
)
def test_bad_input_has_words(made, tmp_path, more, said):
    refused(pcnet3d(*words(made, "r_forearm"), *more, "-o", tmp_path / "out", cwd=made), said)
    assert not (tmp_path / "out").exists()
