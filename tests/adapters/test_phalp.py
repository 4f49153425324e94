"""4D-Humans' pickles, through joblib's form and pickle's own, and pickles that must not run."""

import pickle
import zipfile

import numpy as np
import pytest

from golden import phalp
from golden.bodies import turning
from pcnet3d.adapters import read, read_all
from pcnet3d.adapters.kit.pickles import load
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.reading.load import adapters
from refusals import refused

FRAMES = 40


@pytest.fixture
def tracks() -> dict:
    return phalp.tracks(turning(FRAMES))


@pytest.mark.parametrize("write", phalp.WRITERS.values(), ids=phalp.WRITERS.keys())
def test_tracks(tracks, tmp_path, write):
    path = tmp_path / "demo_walk.pkl"
    path.write_bytes(write(tracks))
    assert [name for name, each in adapters().items() if each.sniff(path)] == ["phalp"]
    people = {poses.person: poses for poses in read_all(path)}
    assert sorted(people) == ["1", "2"]
    np.testing.assert_array_equal(people["1"].frame_index, np.arange(FRAMES))
    np.testing.assert_array_equal(people["2"].frame_index, np.arange(10, 30))
    poses = people["1"]
    assert (poses.frame.name, poses.frame.unit) == ("CAMERA", "m")
    assert poses.frames_known
    assert poses.time_s is None
    kept = [i for i, joint in enumerate(H36M17.joints) if joint != "spine"]
    np.testing.assert_allclose(poses.joints[:, kept], turning(FRAMES)[:, kept], atol=1e-6)


def test_without_time_the_frames_are_not_known(tracks, tmp_path):
    for frame in tracks.values():
        del frame["time"]
    (tmp_path / "x.pkl").write_bytes(pickle.dumps(tracks))
    assert not read(tmp_path / "x.pkl", person="1").frames_known


def test_other_joints_have_words(tracks, tmp_path):
    path = tmp_path / "x.pkl"
    next(iter(tracks.values()))["3d_joints"][0] = np.zeros((24, 3))
    path.write_bytes(pickle.dumps(tracks))
    with pytest.raises(InputError, match=r"\(45, 3\)"):
        read(path)


def test_arrays_of_objects_become_lists(tmp_path):
    objects = np.empty((2, 2), dtype=object)
    objects[:] = [[{"a": 1}, None], ["b", np.arange(3)]]
    (tmp_path / "x.pkl").write_bytes(pickle.dumps({"a": objects, "one": np.array({"b": 2}, dtype=object)}))
    held = load(tmp_path / "x.pkl")
    assert held["a"][0] == [{"a": 1}, None]
    np.testing.assert_array_equal(held["a"][1][1], [0, 1, 2])
    assert held["one"] == {"b": 2}
    frames = {"1.jpg": {"tid": [1], "3d_joints": np.array([{}], dtype=object), "time": 0}}
    (tmp_path / "y.pkl").write_bytes(pickle.dumps(frames))
    with pytest.raises(InputError, match=r"\(45, 3\)"):
        read(tmp_path / "y.pkl", "phalp")


def test_parameters_alone_are_refused_with_the_way_out(tmp_path):
    with zipfile.ZipFile(tmp_path / "hmr4d_results.pt", "w") as archive:
        archive.writestr("results/data.pkl", pickle.dumps({"smpl_params_global": {}}))
    with refused("format-unknown", "GVHMR", "adapter amass"):
        read(tmp_path / "hmr4d_results.pt")
