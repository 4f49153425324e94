"""The check of adapters finds each promise that an adapter can break."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from golden.bodies import turning
from pcnet3d.pipeline import CAMERA, H36M17, InputError, PoseSequence
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.reading.load import find_adapter
from pcnet3d.pipeline.reading.testing import check_adapter


@dataclass
class Toy:
    """An adapter of .toy files, bare bytes of float32 joints, which keeps its promises or breaks one of them."""

    name: str = "toy"
    gives: str = "poses"
    reads: str = "toys"
    broken: str = ""

    def sniff(self, path: Path) -> bool:
        if self.broken == "sniff raises":
            return len(path.read_bytes()) > 0
        return self.broken == "greedy" or self._joints(path) is not None

    def read(self, path: Path, metric: bool = True):
        joints = self._joints(path)
        if joints is None:
            raise (
                KeyError(path)
                if self.broken == "read raises"
                else InputError("bad-value", f"{path} is no toy.")
            )
        if self.broken == "axes":
            joints = joints * [-1, 1, 1]
        scores = np.linspace(1, 1 if self.broken == "all alike" else 0, 17)
        poses = PoseSequence(
            joints,
            H36M17,
            CAMERA.with_(unit="px" if self.broken == "pixels" else "m" if metric else "arbitrary"),
            confidence=np.broadcast_to(scores, joints.shape[:2]),
        )
        return {"a list": [poses], "twins": (poses, poses)}.get(self.broken, (poses,))

    def _joints(self, path: Path) -> np.ndarray | None:
        try:
            joints = np.frombuffer(path.read_bytes(), np.float32).reshape(-1, 17, 3)
        except (OSError, ValueError):
            return None
        if self.broken == "reads nothing":
            return joints if len(joints) else np.ones((2, 17, 3))
        return joints if len(joints) and abs(joints).max() < 3 else None


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """toy(broken, frames) -> the golden file of the toy, which is registered beside the other adapters."""

    def make(broken: str = "", frames: int = 40, **fields: str) -> Path:
        one = Toy(broken=broken, **fields)
        known = {**registry.load_all("adapters"), "toy": one}
        monkeypatch.setattr(registry, "load_all", lambda group: known)
        monkeypatch.setattr(registry, "load", lambda group, name: known[name])
        path = tmp_path / "golden.toy"
        path.write_bytes(turning(frames).astype(np.float32).tobytes())
        return path

    return make


def test_a_toy_that_keeps_its_promises(toy):
    (person,) = check_adapter("toy", toy(), metric=False)
    assert (len(person), person.frame.unit) == (40, "arbitrary")


BROKEN = {
    "sniff raises": "a directory",
    "greedy": "it recognises a folder",
    "read raises": r"Path\(",
    "reads nothing": "it recognises an empty file",
    "axes": "mirrored",
    "all alike": "all scores are equal",
    "pixels": "call it arbitrary",
    "a list": "not a tuple",
    "twins": "the same name",
}


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        *(({"broken": broken}, says) for broken, says in BROKEN.items()),
        ({"name": "doll"}, "its name is 'doll'"),
        ({"gives": "joints"}, "gives 'joints'"),
        ({"reads": "a\nb"}, "one line"),
        ({"frames": 5}, "needs 20 frames"),  # too short for the guard
    ],
    ids=str,
)
def test_a_broken_promise_is_found(toy, fields, says):
    with pytest.raises((AssertionError, InputError, OSError, KeyError), match=says):
        check_adapter("toy", toy(**fields))


def test_a_file_that_another_adapter_takes_too_is_said(toy, tmp_path):
    golden = toy()
    registry.load_all("adapters")["rival"] = Toy(name="rival")
    with pytest.raises(InputError, match=r"fits several adapters.*toy.*rival"):
        check_adapter("toy", golden)


def test_an_adapter_that_fails_over_a_file_does_not_keep_the_others_from_it(toy, capsys):
    golden = toy()

    def failing(path: Path) -> bool:
        raise KeyError("a fault")

    registry.load_all("adapters")["faulty"] = rival = Toy(name="faulty")
    rival.sniff = failing
    assert find_adapter(golden).name == "toy"
    assert "warning: adapter 'faulty' failed at" in capsys.readouterr().err
