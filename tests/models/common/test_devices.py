"""Networks on devices that onnxruntime offers, offers and cannot start, or that fail half-way."""

import json

import numpy as np
import onnxruntime
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.common.onnx import PlacedSession, open_onnx
from pcnet3d.models.lifter.builtin import SHIPPED
from pcnet3d.pipeline.cli import load_command
from pcnet3d.pipeline.core.device import KINDS, computing_on, listed, placement
from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry
from pcnet3d.pipeline.running.run import run_files

CUDA = KINDS["cuda"].provider
POSES = np.random.default_rng(3).normal(size=(300, 17, 3))
REAL = onnxruntime.InferenceSession


class Fake:
    """A session on CUDA that is really one on the CPU. opens: "well", "not", or "silently not", as onnxruntime itself
    does; fails_after: runs that go well."""

    opens = "well"
    fails_after = 10**9
    runs = 0

    def __init__(self, content, options, providers):
        self.asked = providers[0][0] if isinstance(providers[0], tuple) else providers[0]
        self._real = REAL(content, options, providers=["CPUExecutionProvider"])
        if self.asked == CUDA and Fake.opens == "not":
            raise RuntimeError("no kernel image.\nIn file 7")

    def __getattr__(self, name):
        return getattr(self._real, name)

    def get_providers(self):
        return ["CPUExecutionProvider"] if Fake.opens == "silently not" else [self.asked]

    def run(self, names, values):
        if self.asked == CUDA:
            Fake.runs += 1
            if Fake.runs > Fake.fails_after:
                raise RuntimeError("out of memory")
        return self._real.run(names, values)


@pytest.fixture
def cuda(monkeypatch):
    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: [CUDA, "CPUExecutionProvider"])
    monkeypatch.setattr(onnxruntime, "InferenceSession", Fake)
    monkeypatch.setattr(onnxruntime, "preload_dlls", lambda: print("what CUDA misses"))
    for name, value in (("opens", "well"), ("fails_after", 10**9), ("runs", 0)):
        monkeypatch.setattr(Fake, name, value)
    return Fake


def answers():
    return np.concatenate(
        [part.reshape(len(POSES), -1) for part in load_rectifier("pcnet").rotation(POSES)], axis=1
    )


ON_CPU = answers()


def test_a_run_refuses_a_missing_device_and_leaves_nothing(tmp_path):
    poses = tmp_path / "poses.npy"
    np.save(poses, POSES)
    with pytest.raises(InputError, match="directml"):
        run_files(RunOptions(poses=poses, fps=30, device="directml"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_auto_takes_the_device_that_is_offered(cuda, capsys):
    with computing_on("auto") as where:
        found = answers()
    np.testing.assert_array_equal(found, ON_CPU)
    assert where.summary() == {"asked": "auto", "networks": {"pcnet.onnx": "cuda"}, "notes": []}
    assert cuda.runs > 1
    assert capsys.readouterr() == ("", "")


def test_on_the_cpu_and_outside_of_a_run_the_device_is_left_alone(cuda):
    with computing_on("cpu") as where:
        answers()
    assert where.used == {"pcnet.onnx": "cpu"}
    answers()  # outside of a run
    assert cuda.runs == 0
    assert not isinstance(open_onnx(SHIPPED).session, PlacedSession)


@pytest.mark.parametrize("opens", ["not", "silently not"])
def test_auto_goes_to_the_cpu_when_the_device_cannot_start(cuda, monkeypatch, capsys, opens):
    monkeypatch.setattr(cuda, "opens", opens)
    with computing_on("auto") as where:
        found = answers()
        open_onnx(SHIPPED)
    np.testing.assert_array_equal(found, ON_CPU)
    assert where.used == {"pcnet.onnx": "cpu", "lifter.onnx": "cpu"}
    assert len(where.notes) == 1  # the second network does not try what failed
    assert where.notes[0] in capsys.readouterr().err


@pytest.mark.parametrize("opens", ["not", "silently not"])
def test_a_device_asked_for_by_name_has_to_start(cuda, monkeypatch, opens):
    monkeypatch.setattr(cuda, "opens", opens)
    reason = {"not": "no kernel image", "silently not": f"{CUDA} cannot start; its driver or .* too old"}[
        opens
    ]
    expected = f"to open on --device cuda, got: {reason}; give --device auto"
    with pytest.raises(InputError, match=expected), computing_on("cuda"):
        answers()


@pytest.mark.parametrize("asked", ["auto", "cuda"])
def test_the_cpu_takes_over_when_the_device_fails_half_way(cuda, monkeypatch, capsys, asked):
    monkeypatch.setattr(cuda, "fails_after", 2)
    with computing_on(asked) as where:
        found = answers()
    np.testing.assert_array_equal(found, ON_CPU)  # also what was computed before
    assert where.used == {"pcnet.onnx": "cpu"}
    assert where.notes == ["pcnet.onnx fails on cuda and runs on the CPU: out of memory."]
    assert cuda.runs == 3  # never asked again
    assert where.notes[0] in capsys.readouterr().err


def test_an_input_at_fault_is_not_the_device_at_fault(cuda):
    with computing_on("cuda") as where:
        network = open_onnx(SHIPPED)
        with pytest.raises(Exception, match=r"(?i)invalid"):
            network.run(np.zeros((1, 5, 3), dtype=np.float32))
    assert where.notes == []
    assert where.used == {"lifter.onnx": "cuda"}


def test_the_summary_says_where_each_network_computed(cuda, monkeypatch, tmp_path):
    monkeypatch.setattr(cuda, "fails_after", 0)
    walk, poses = walker(seconds=2), tmp_path / "poses.npy"
    np.save(poses, camera_poses(walk, side_camera(walk)).joints)
    recipe = Recipe(stages=(StageEntry(use="rectify"),))
    run_files(RunOptions(poses=poses, adapter="motionbert", fps=30), tmp_path / "out", recipe)
    device = json.loads((tmp_path / "out" / "summary.json").read_text())["device"]
    assert device["asked"] == "auto"
    assert device["networks"] == {"pcnet.onnx": "cpu"}
    assert "out of memory" in device["notes"][0]


def test_one_inside_another_of_the_same_name_is_the_same():
    with computing_on("auto") as outer, computing_on("auto") as inner, computing_on("cpu") as other:
        assert inner is outer
        assert placement() is other is not outer


def test_devices_are_listed(cuda, capsys):
    assert {row["name"]: row["is"] for row in listed()}["cuda"] == "offered"
    load_command("list").main(["devices"], standalone_mode=False)
    assert "coreml    not offered  onnxruntime, on macOS" in capsys.readouterr().out
