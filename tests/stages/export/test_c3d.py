"""C3D files, read back by another package: points, clock, events, texts, and what the format cannot hold."""

import json
import sys

import numpy as np
import pytest

from golden.waving import FPS, ROWS, WALK, exported, made
from pcnet3d.adapters import c3d
from pcnet3d.pipeline import CAMERA, H36M17, InputError, PoseSequence, Take
from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.core.notices import own_notice
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.export.markers import write_c3d
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories


@pytest.fixture
def ezc3d():
    return pytest.importorskip("ezc3d", reason="the extra c3d is not installed")


def test_c3d_round_trip(ezc3d, take, tmp_path):
    file = ezc3d.c3d(str(exported(take, tmp_path, "c3d") / "markers.c3d"))
    point = file["parameters"]["POINT"]
    assert point["LABELS"]["value"] == list(H36M17.joints)
    assert point["UNITS"]["value"] == ["mm"]
    assert point["RATE"]["value"][0] == pytest.approx(FPS)
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["-X"], ["+Z"])
    found = np.moveaxis(file["data"]["points"][:3], -1, 0).swapaxes(1, 2) / 1000
    np.testing.assert_allclose(found, take.filtered.joints, atol=1e-6)
    missing = np.isnan(take.filtered.joints).any(axis=-1).T
    np.testing.assert_array_equal(file["data"]["meta_points"]["residuals"][0] < 0, missing)
    assert any("sha256 000" in line for line in file["parameters"]["PCNET3D"]["PROVENANCE"]["value"])


@pytest.mark.parametrize(
    ("begin_s", "numbered"), [(0.0, True), (0.4, True), (7.0, True), (-1.0, False), (3000.0, False)]
)
def test_c3d_read_again_is_on_the_clock_of_the_take_or_says_when_it_is(
    ezc3d, facing_camera, tmp_path, begin_s, numbered
):
    """Its first frame has a number, but not any."""
    take = made(facing_camera, time_s=np.arange(ROWS) / FPS + begin_s)
    path = exported(take, tmp_path, "c3d") / "markers.c3d"
    first_frame = round(begin_s * FPS) if numbered else 0
    assert ezc3d.c3d(str(path))["header"]["points"]["first_frame"] == first_frame
    (poses,) = c3d.read(path)
    np.testing.assert_allclose(poses.times, take.poses.times - (0 if numbered else begin_s), atol=1e-5)
    notices = json.loads((tmp_path / "summary.json").read_text())["notices"]
    said = [each["values"] for each in notices if each["code"] == "file-begins"]
    assert said == ([] if numbered else [{"file": "markers.c3d", "begin_s": begin_s}])


def test_c3d_has_the_events_of_a_walk_and_none_without_one(ezc3d, take, tmp_path):
    write_c3d(take.with_(measures=read_measures(WALK)), tmp_path / "markers.c3d")
    event = {name: of["value"] for name, of in ezc3d.c3d(str(tmp_path / "markers.c3d"))["parameters"]["EVENT"].items()
             if name != "__METADATA__"}  # fmt: skip
    assert event["USED"][0] == 5
    assert event["CONTEXTS"] == ["Right", "Left", "Right", "Right", "Left"]
    assert event["LABELS"] == ["Foot Strike", "Foot Strike", "Foot Off", "Foot Strike", "Foot Off"]
    np.testing.assert_allclose(event["TIMES"], [[0, 0, 0, 0, 1], [0.5, 1.0, 1.1, 1.5, 2.5]], atol=1e-6)
    write_c3d(take, tmp_path / "markers.c3d")
    assert "EVENT" not in ezc3d.c3d(str(tmp_path / "markers.c3d"))["parameters"]


def test_more_frames_than_c3d_counts_cost_that_file_alone(ezc3d, take, tmp_path):
    """They ended the run at its end, and everything else was lost."""
    rows = 65_536
    joints = np.broadcast_to(take.filtered.joints[0], (rows, 17, 3))
    long = PoseSequence(joints, H36M17, take.filtered.frame, time_s=np.arange(rows) / FPS)
    (said,) = write_c3d(take.with_(filtered=long), tmp_path / "markers.c3d")
    assert said.code == "not-written"
    assert "65535 frames" in said.text
    assert "65536 at an even rate" in said.text
    assert not list(tmp_path.iterdir())


def test_a_single_frame_costs_c3d_alone(ezc3d, facing_camera, tmp_path):
    """Its rate was written as no number, and no program opened the file."""
    poses = PoseSequence(facing_camera[None], H36M17, CAMERA.with_(unit="m"), time_s=np.array([1.0]))
    take = Angles()(Trajectories()(Rectify("geometric")(Take("photo", poses=poses))))
    folder = exported(take, tmp_path, "c3d", "trc")
    assert (folder / "markers.trc").exists()
    assert not (folder / "markers.c3d").exists()
    notices = json.loads((folder / "summary.json").read_text())["notices"]
    assert "not-written" in [said["code"] for said in notices]


def test_c3d_takes_texts_of_any_length_and_script(ezc3d, take, tmp_path):
    """A text of more than 255 characters makes a file that nothing opens."""
    said = [own_notice("test.said", text) for text in ("word " * 300, "x" * 400, "čeština")]
    folder = exported(take.saying(*said).with_(name="Übung"), tmp_path, "c3d")
    file = ezc3d.c3d(str(folder / "markers.c3d"))
    lines = file["parameters"]["PCNET3D"]["PROVENANCE"]["value"]
    assert sum(line.count("word") for line in lines) == 300
    assert sum(line.count("x") for line in lines) >= 400
    assert max(map(len, lines)) <= 100


def test_c3d_without_its_package_is_refused_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with pytest.raises(InputError, match=r"pcnet3d\[c3d\]"):
        Export(tmp_path, also=("c3d",))
