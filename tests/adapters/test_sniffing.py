"""Recognising a file reads its beginning, however long it is."""

import json
import pickle
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.pipeline.reading.load import adapters

LONG = 24 << 20  # bytes; a sniff may read a sixth of it
_ROWS = LONG // (17 * 3 * 4)


def _npy(path: Path, shape: tuple[int, ...]) -> None:
    np.save(path, np.random.default_rng(0).normal(0, 0.3, shape).astype(np.float32))


def _npz(path: Path) -> None:
    np.savez(path, reconstruction=np.full((_ROWS, 17, 3), 0.1, np.float32))


def _json(path: Path) -> None:
    entry = {"image_id": "0.jpg", "category_id": 1, "keypoints": [0.5] * 51, "score": 2.0}
    _repeated(path, "[", entry, "]")


def _frames(path: Path) -> None:
    person = {"keypoints": [[0.5, 0.5, 0.5]] * 17, "keypoint_scores": [1.0] * 17}
    _repeated(path, '{"meta_info": {}, "instance_info": [', {"frame_id": 0, "instances": [person]}, "]}")


def _repeated(path: Path, head: str, entry: dict, tail: str) -> None:
    text = json.dumps(entry)
    path.write_text(head + ", ".join([text] * (LONG // len(text))) + tail, encoding="utf-8")


def _csv(path: Path) -> None:
    kind = "landmark" if path.stem == "landmarks" else "keypoint"
    path.write_text(f"frame,{kind},x,y,z\n" + "0,nose,1.0,2.0,3.0\n" * (LONG // 19), encoding="utf-8")


def _pickle(path: Path) -> None:
    path.write_bytes(pickle.dumps({"0.jpg": {"3d_joints": np.zeros((_ROWS, 17, 3), np.float32), "tid": [1]}}))


def _keypoints(path: Path) -> None:
    np.savez(path, pred_keypoints_3d=np.zeros((LONG // (70 * 3 * 4), 70, 3), np.float32))


def _wham(path: Path) -> None:
    arrays = {"pose": np.zeros((_ROWS, 72), np.float32), "verts": np.zeros((99, 6890, 3), np.float32)}
    path.write_bytes(pickle.dumps(defaultdict(dict, {0: arrays})))


def _folder(path: Path) -> None:
    path.mkdir()
    for frame in range(400):
        people = [{"pose_keypoints_2d": [0.5] * 75}]
        (path / f"clip_{frame:012}_keypoints.json").write_text(json.dumps({"people": people * 20}))


FILES = {
    "X3D.npy": lambda path: _npy(path, (_ROWS, 17, 3)),
    "proposals.npy": lambda path: _npy(path, (1, 2, _ROWS // 2, 17, 3)),
    "clips.npy": lambda path: _npy(path, (_ROWS // 243, 243, 17, 3)),
    "freemocap.npy": lambda path: _npy(path, (LONG // (33 * 3 * 4), 33, 3)),
    "keypoints.npz": _npz,
    "alphapose.json": _json,
    "mmpose.json": _frames,
    "landmarks.csv": _csv,
    "phalp.pkl": _pickle,
    "sam3d.npz": _keypoints,
    "wham_output.pkl": _wham,
    "freemocap.csv": _csv,
    "openpose": _folder,
}


def _bytes_read() -> int:
    """By this process so far, those out of the page cache too."""
    counted = Path("/proc/self/io")
    if not counted.exists():
        pytest.skip("only Linux counts what a process reads")
    return int(counted.read_text(encoding="utf-8").split()[1])


@pytest.mark.parametrize("name", FILES)
def test_a_sniff_reads_the_beginning_only(tmp_path, name):
    path = tmp_path / name
    FILES[name](path)
    read = {}
    for adapter in adapters().values():
        before = _bytes_read()
        adapter.sniff(path)
        read[adapter.name] = _bytes_read() - before
    assert {who: count for who, count in read.items() if count > LONG / 5} == {}


def test_an_adapter_of_one_program_comes_before_those_of_any(tmp_path, monkeypatch):
    """The template's table of x, y, z by joint fitted two adapters."""
    from types import SimpleNamespace

    from pcnet3d.pipeline.reading import load

    def sniffing(name: str, **more: bool) -> SimpleNamespace:
        return SimpleNamespace(name=name, gives="poses", reads=name, sniff=lambda path: True, **more)

    both = {"any": sniffing("any", general=True), "own": sniffing("own")}
    monkeypatch.setattr(load, "adapters", lambda gives=None: both)
    (tmp_path / "poses.csv").write_text("x\n")
    assert load.find_adapter(tmp_path / "poses.csv").name == "own"
    del both["own"]
    assert load.find_adapter(tmp_path / "poses.csv").name == "any"
