"""`pcnet3d imu` from files to table, image and recording, on the walker with simulated sensors."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import commands
from golden.recordings import Recording
from golden.sensors import write_csv
from golden.strapped import Faults, strapped
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.finished import read_run
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.pipeline.signals.imu import GRAVITY_MPS2
from pcnet3d.stages.study.imu.command import compare as compare_with_run
from pcnet3d.stages.study.imu.command import imu, read_imus
from pcnet3d.stages.study.imu.output import as_markdown

RECIPE = Recipe(stages=[{"use": stage} for stage in ("rectify", "trajectories", "record", "export")])
METHODS = ["camera axes", "geometric per frame", "geometric", "pcnet per frame", "pcnet"]


def run_of(walk, folder: Path) -> Path:
    """The folder with a finished run of clean video poses in it."""
    np.save(folder / "poses.npy", camera_poses(walk, side_camera(walk)).joints)
    run_files(RunOptions(poses=folder / "poses.npy", adapter="videopose3d", fps=30), folder / "run", RECIPE)
    return folder


@pytest.fixture(scope="module")
def made(walk, tmp_path_factory) -> Path:
    """A folder with a finished run, and the files of three sensors."""
    folder = run_of(walk, tmp_path_factory.mktemp("imu"))
    for seed, segment in enumerate(("r_forearm", "pelvis", "l_shank")):
        write_csv(folder / f"{segment}.csv", strapped(walk, segment, Faults(), seed=seed))
    return folder


def compare(made: Path, *segments: str, **options) -> str:
    """imu.md of the comparison with the files of those segments."""
    files = [made / f"{segment}.csv" for segment in segments]
    imu(made / "run", imu=files, segment=list(segments), **options)
    return (made / "run" / "imu" / "imu.md").read_text()


@pytest.fixture(scope="module")
def compared(made) -> dict:
    compare(made, "r_forearm", "pelvis", "l_shank")
    return json.loads((made / "run" / "imu" / "imu.json").read_text())


def test_lag_and_correlation_reach_their_aims(compared):
    for segment in ("r_forearm", "l_shank"):
        figures = compared["segments"][segment]
        assert figures["lag_s"] == pytest.approx(0.137, abs=0.005)
        assert figures["clock_rate"] == pytest.approx(1, abs=1e-4)
        assert "pelvis IMU" in figures["pelvis"]
        assert list(figures["methods"]) == METHODS
        for axis, of in figures["methods"]["pcnet"].items():
            assert of["r"] >= 0.99, (segment, axis, of)
        assert figures["notices"] == []


def test_a_lag_is_told_with_the_offset_that_it_comes_on_top_of(made, tmp_path):
    """Stamps of a clock that began a thousand seconds earlier were said to be 137 ms late."""
    run = tmp_path / "run"
    shutil.copytree(made / "run", run, ignore=shutil.ignore_patterns("imu"))
    segments = ["r_forearm", "pelvis"]
    sensors, _ = read_imus([made / f"{segment}.csv" for segment in segments], segments)
    files = [tmp_path / f"{segment}.csv" for segment in segments]
    for file, segment in zip(files, segments, strict=True):
        write_csv(file, replace(sensors[segment], time_s=sensors[segment].time_s + 1000))
    imu(run, imu=files, segment=segments, offset=-1000.0)
    figures = json.loads((run / "imu/imu.json").read_text())["segments"]["r_forearm"]
    assert figures["lag_s"] - figures["offset_s"] == pytest.approx(1000.137, abs=0.005)
    for file, words in (
        ("imu.md", "stamps{} are 13[678] ms later"),
        ("r_forearm.html", "IMU{} is 13[678] ms late"),
    ):
        said = (run / "imu" / file).read_text()
        assert re.search(words.format(", with -1000 s added by --offset,"), said), file
    epoch = {**figures, "offset_s": -1700000000.25}
    assert "-1700000000.25 s added" in as_markdown("walk", {"r_forearm": epoch})


def test_levelling_shows_against_the_tilted_camera(compared):
    methods = compared["segments"]["r_forearm"]["methods"]
    assert methods["pcnet"]["z"]["rmse_mps2"] < 0.5 * methods["camera axes"]["z"]["rmse_mps2"]
    norms = [of["norm"]["r"] for name, of in methods.items() if "per frame" not in name]
    assert np.ptp(norms) < 1e-3  # no rotation of the take changes a norm


def test_an_unknown_figure_keeps_its_place_among_the_axes(compared):
    figures = compared["segments"]["r_forearm"]
    axes = {axis: dict.fromkeys(of, 1.0) for axis, of in figures["methods"]["pcnet"].items()}
    axes["x"] |= {"r": None, "lag_s": None, "offset_mps2": None}
    words = as_markdown("walk", {"r_forearm": {**figures, "lag_s": 0.0, "methods": {"pcnet": axes}}})
    assert (
        "| pcnet | ? / 1.000 / 1.000 / 1.000 | 1.00 / 1.00 / 1.00 / 1.00 | 1.00 / 1.00 / 1.00 / 1.00 | "
        "? / 1000 / 1000 / 1000 | ? / 1.00 / 1.00 |"
    ) in words


def test_files_of_the_comparison(compared, made):
    folder = made / "run" / "imu"
    assert {"imu.json", "imu.md", "imu.rrd", "r_forearm.html", "l_shank.html"} <= {
        f.name for f in folder.iterdir()
    }
    page = (folder / "r_forearm.html").read_text()
    assert re.findall(r"<figcaption>([^<]+)</figcaption>", page) == [
        "Back (m/s²)", "Right (m/s²)", "Up (m/s²)", "Norm (m/s²)"
    ]  # fmt: skip
    assert re.search(r"the IMU is 13[678] ms late", page)
    words = (folder / "imu.md").read_text()
    assert all(f"| {method} |" in words for method in METHODS)
    assert "imu" in json.loads((made / "run" / "summary.json").read_text())["files"]
    for figures in compared["segments"].values():
        files = {entry["file"] for entry in figures["inputs"]}
        assert files == {"r_forearm.csv", "pelvis.csv", "l_shank.csv"}


def test_recording_holds_the_runs_own_and_both_curves(compared, made):
    own, joined = (Recording(made / "run" / name) for name in ("take.rrd", "imu/imu.rrd"))
    assert own.entities < joined.entities
    frames, _, values = joined.over_time("imu/r_forearm/z", "Scalars:scalars")
    values = np.array(values, float)
    assert values.shape == (len(frames), 2)
    known = np.isfinite(values).all(axis=1)
    assert known.mean() > 0.9
    assert np.corrcoef(values[known].T)[0, 1] > 0.99


def test_without_a_pelvis_imu_only_still_spans_are_compared(made):
    with pytest.raises(InputError, match=r"pelvis stands still.*IMU on the pelvis"):
        compare(made, "r_forearm")


@pytest.fixture(scope="module")
def longer(tmp_path_factory) -> tuple[Walk, Path]:
    walk = walker(seconds=14)
    return walk, run_of(walk, tmp_path_factory.mktemp("longer"))


def test_still_spans_of_a_longer_take(longer):
    walk, tmp_path = longer
    write_csv(tmp_path / "r_forearm.csv", strapped(walk, "r_forearm"))
    assert "only spans in which the pelvis stands still" in compare(tmp_path, "r_forearm")
    figures = json.loads((tmp_path / "run/imu/imu.json").read_text())["segments"]["r_forearm"]
    assert figures["lag_s"] == pytest.approx(0.137, abs=0.005)
    assert 2 < figures["compared_s"] < 7
    assert figures["methods"]["pcnet"]["norm"]["r"] > 0.99


def test_without_an_orientation_the_norm_alone_is_compared(longer):
    walk, tmp_path = longer
    write_csv(tmp_path / "r_forearm.csv", replace(strapped(walk, "r_forearm"), R_world_from_sensor=None))
    words = compare(tmp_path, "r_forearm")
    assert "no orientation of the IMU on r_forearm is given: only the norm" in words
    assert "its heading" not in words
    figures = json.loads((tmp_path / "run/imu/imu.json").read_text())["segments"]["r_forearm"]
    assert figures["lag_s"] == pytest.approx(0.137, abs=0.01)
    assert list(figures["methods"]) == ["pcnet"]
    assert list(figures["methods"]["pcnet"]) == ["norm"]
    assert figures["methods"]["pcnet"]["norm"]["r"] > 0.98
    entities = Recording(tmp_path / "run/imu/imu.rrd").entities
    assert [entity for entity in entities if "/r_forearm/" in entity] == ["imu/r_forearm/norm"]
    assert (tmp_path / "run/imu/r_forearm.html").is_file()


def test_the_norm_of_a_known_path_is_that_of_the_sensor(walk, made):
    """The true path with its pelvis: what is left is the sensor's noise, bias and time of 137 ms."""
    run = read_run(made / "run")
    level = run.rectified.level.with_(joints=walk.world - walk.root[:, None], root=walk.root)
    run = run.with_(rectified=replace(run.rectified, level=level))
    sensor = replace(strapped(walk, "r_forearm"), R_world_from_sensor=None)
    found = compare_with_run(run, sensor)
    of = found.agreement["pcnet"]["norm"]
    assert found.alignment.lag_s == pytest.approx(0.137, abs=0.005)
    assert of["r"] > 0.99
    assert of["rmse_mps2"] < 0.3
    assert of["gain"] == pytest.approx(1, abs=0.03)
    unknown = run.poses.frame.with_(unit="arbitrary")
    without_a_scale = run.with_(poses=run.poses.with_(frame=unknown))
    with pytest.raises(InputError, match="--stature"):
        compare_with_run(without_a_scale, sensor)


def test_g_is_said_and_gives_the_same(compared, made, tmp_path):
    imu_in_g = read_imus([made / "r_forearm.csv"], ["r_forearm"])[0]["r_forearm"]
    write_csv(made / "g.csv", replace(imu_in_g, force_mps2=imu_in_g.force_mps2 / GRAVITY_MPS2))
    imu(made / "run", imu=[made / "g.csv", made / "pelvis.csv"], segment=["r_forearm", "pelvis"])
    again = json.loads((made / "run/imu/imu.json").read_text())["segments"]["r_forearm"]
    assert (again["notices"][0]["code"], again["notices"][0]["values"]["unit"]) == ("imu-unit", "g")
    before = compared["segments"]["r_forearm"]["methods"]["pcnet"]["x"]
    assert again["methods"]["pcnet"]["x"]["r"] == pytest.approx(before["r"], abs=1e-4)
    assert again["methods"]["pcnet"]["x"]["rmse_mps2"] == pytest.approx(before["rmse_mps2"], abs=1e-3)


@pytest.mark.parametrize(
    ("segments", "options", "words"),
    [
        (("r_forearm", "pelvis"), {"offset": 100.0}, "--offset"),
        (("r_forearm",), {"offset": 100.0}, "--offset"),  # without a pelvis', whose movement was blamed
        (("r_forearm", "pelvis"), {"cutoff": 50.0}, "30 frames a second"),
        (("r_forearm",), {"root": Path("nothing.txt")}, "--root"),
        (("r_forearm", "r_forearm"), {}, "two for the same"),
    ],
)
def test_bad_input_has_words(made, segments, options, words):
    with pytest.raises(InputError, match=words):
        compare(made, *segments, **options)


@pytest.mark.parametrize(
    ("option", "value"), [("--rate", 0), ("--rate", -3), ("--rate", "nan"), ("--offset", "nan")]
)
def test_a_figure_that_cannot_be_is_blamed_and_not_the_file(made, option, value):
    words = ("imu", made / "run", "--imu", made / "r_forearm.csv", "--segment", "r_forearm")
    commands.refused(commands.pcnet3d(*words, option, value), option, f"got {value}")


def test_a_rate_is_blamed_on_the_option_that_gave_it(made):
    with pytest.raises(InputError, match="rate_hz") as told:
        imu(made / "run", imu=[made / "r_forearm.csv"], segment=["r_forearm"], option=["rate_hz=0"])
    assert "--rate" not in str(told.value)


def test_what_is_no_run_and_no_imu_has_words(made, tmp_path):
    with pytest.raises(InputError, match="finished"):
        read_run(tmp_path)
    with pytest.raises(InputError, match=r"inertial sensor.s recording .* got 3D poses"):
        imu(made / "run", imu=[made / "poses.npy"])
    with pytest.raises(InputError, match="--root"):
        imu(made / "run", imu=[made / "r_forearm.csv"], segment=["r_forearm"], root=made / "poses.npy")


def test_a_sensor_that_does_not_fit_is_doubted(walk, made):
    write_csv(made / "r_foot.csv", strapped(walk, "r_forearm", Faults(noise_mps2=8.0)))
    assert "agree weakly" in compare(made, "r_foot", "pelvis")
