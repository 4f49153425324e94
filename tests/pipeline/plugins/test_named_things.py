"""Models and writers that another package registers are listed, opened and used as the built-in ones are."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pcnet3d.models import load_lifter, load_rectifier
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.shipped import PCNET
from pcnet3d.pipeline import (
    CAMERA,
    GL_CAMERA,
    H36M17,
    IMAGE,
    Camera,
    InputError,
    Lifted,
    Pipeline,
    PoseSequence,
    Take,
    cli,
)  # fmt: skip
from pcnet3d.pipeline.core.intrinsics import Intrinsics
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.plugins.options import checked
from pcnet3d.pipeline.reading.load import load
from pcnet3d.pipeline.running.runner import run_together
from pcnet3d.stages import lift as stage_of_lift
from pcnet3d.stages.export.stage import RUN_FILES, Export
from pcnet3d.stages.lift import Lift
from refusals import refused

OBJECTS = {
    "rectifiers": SimpleNamespace(method="toy@1", rotation=lambda joints: (np.eye(3), 0)),
    "lifters": SimpleNamespace(method="toy@1", unit="", takes=(), lift=lambda asked: None),
    "detectors": SimpleNamespace(method="toy@1", layout=None, people=lambda *_: ()),
    "person_detectors": SimpleNamespace(method="toy@1", boxes=lambda image: np.zeros((0, 4))),
}
LOADERS = {"rectifiers": load_rectifier, "lifters": load_lifter, "detectors": load_detector}


@pytest.fixture
def register(monkeypatch):
    """register(group, thing) installs a package that has it under the name "toy"."""
    added = {}
    others = registry.installed()
    monkeypatch.setattr(
        registry, "installed", lambda: {of: [*others[of], *added.get(of, ())] for of in others}
    )

    def install(group, thing):
        monkeypatch.setitem(sys.modules, "toy_package", SimpleNamespace(THING=thing))
        added[group] = [EntryPoint("toy", "toy_package:THING", f"pcnet3d.{group}")]
        forget()

    def forget():
        registry.registered.cache_clear()
        registry.load_all.cache_clear()

    yield install
    added.clear()
    forget()


def model(opened):
    return SimpleNamespace(what="a toy", open=lambda: opened)


@pytest.mark.parametrize("group", LOADERS)
def test_another_packages_model_is_listed_and_opened(register, group):
    register(group, model(OBJECTS[group]))
    kind = group.removesuffix("s")
    assert {"name": "toy", "is": kind, "what": "a toy"} in registry.listed("models")
    assert LOADERS[group]("toy") is OBJECTS[group]
    with pytest.raises(InputError, match=rf"There is no {kind} 'toys'; did you mean toy.*\.onnx file"):
        LOADERS[group]("toys")


def test_another_packages_model_may_be_a_file(register):
    register("rectifiers", model(PCNET.file))
    assert load_rectifier("toy").method == load_rectifier("pcnet").method


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (SimpleNamespace(what="a toy"), "it has no open"),
        (model(SimpleNamespace(method="toy@1")), "it has no rotation"),
        (SimpleNamespace(what="a toy", open=lambda: 1 / 0), "division by zero"),
    ],
)
def test_a_broken_model_is_named(register, thing, words):
    register("rectifiers", thing)
    with pytest.raises(
        InputError, match=rf"The rectifier 'toy' \(toy_package:THING\) cannot be loaded: {words}"
    ):
        load_rectifier("toy")


class Toy:
    """A lifter of another package, which answers as the built-in one does but for these changes."""

    method, unit = "toy@1", "arbitrary"

    def __init__(self, *takes, answers=lambda lifted: lifted, **changes):
        self.takes, self.answers, self.changes, self.asked = takes, answers, changes, []

    def lift(self, asked):
        self.asked.append(asked)
        given = {"model": "toy@1", "kind": "toy", **self.changes}
        return self.answers(replace(load_lifter("pcnet3d").lift(asked), **given))


@pytest.fixture
def take():
    pixels = 100 + 50 * np.random.default_rng(0).random((20, 17, 2))
    keypoints = PoseSequence(pixels, H36M17, IMAGE, time_s=np.arange(20) / 30)
    return Take("toy", keypoints=keypoints).telling(image_size=(400, 300), focal_px=400.0)


def lifted_by(register, toy, take):
    register("lifters", model(toy))
    return Lift("toy")(take.telling(handedness="ignore"))


def test_of_another_packages_lifter_is_said_what_it_says(register, take):
    def said(take, **changes):
        return {each.code: each.values for each in lifted_by(register, Toy(**changes), take).notices}

    guessing = take.telling(focal_px=None)
    assert "focal-guessed" not in said(take)
    assert said(guessing)["focal-guessed"]["focal_px"] == 400
    assert said(take, frames_without_joints=7)["frames-without-joints"]["frames"] == 7
    lifted = lifted_by(register, Toy(), take).poses
    assert lifted.made_by == MadeBy("estimated", "toy@1", in_run=True)
    assert lifted.history[-1].name == "lift" or lifted.history[-2].name == "lift"


LENS = Intrinsics((400.0, 400.0), (200.0, 150.0), (-0.3, 0.05, 0.0, 0.0), image_size=(400, 300))


@pytest.mark.parametrize("it_takes", [True, False])
@pytest.mark.parametrize("what", ["up", "guessed focal", "gaps", "images"])
def test_another_packages_lifter_is_given_what_it_takes(register, take, monkeypatch, what, it_takes):
    """Up; a guessed focal length; joints out of the image as missing ones; keypoints as they were filmed."""
    joints = take.keypoints.joints.copy()
    joints[3:, 16] = [420, 100]
    match what:
        case "up":
            monkeypatch.setattr(stage_of_lift, "_known_up", lambda take, poses: np.array([0.0, -1.0, 0.0]))
        case "guessed focal":
            take = take.with_(camera=Camera((400, 300), 300.0, 90.0, "prior"))
        case "gaps":
            take = take.with_(keypoints=take.keypoints.with_(joints=joints))
        case "images":
            take = take.with_(camera=Camera((400, 300), 400.0, 0.0, "told", intrinsics=LENS))
    toy = Toy(*[what] * it_takes)
    lifted_by(register, toy, take)
    *_, asked = toy.asked
    given = {
        "up": asked.up is not None and len(toy.asked) == 2,
        "guessed focal": asked.focal_px == 300.0 and not asked.focal_known,
        "gaps": np.isnan(asked.keypoints.joints[3, 16]).all(),
        "images": asked.intrinsics is LENS and np.array_equal(asked.keypoints.joints, take.keypoints.joints),
    }
    assert given[what] == it_takes


@pytest.mark.parametrize(
    ("toy", "words"),
    [
        (Toy(answers=lambda lifted: lifted.poses), "a Lifted of 20 rows, got PoseSequence: repair"),
        (
            Toy(answers=lambda lifted: replace(lifted, poses=lifted.poses.rows(0, 9))),
            "of 20 rows, got 9: repair",
        ),
        (Toy("gap"), "takes 'gap', which is unknown"),
    ],
)
def test_a_lifter_that_keeps_no_promises_is_named(register, take, toy, words):
    with pytest.raises(InputError, match=words):
        lifted_by(register, toy, take)


@pytest.mark.parametrize(("layout", "frame"), [(COCO17, CAMERA), (H36M17, GL_CAMERA)])
def test_poses_in_other_joints_or_axes_are_no_lift(layout, frame):
    poses = PoseSequence(np.zeros((3, 17, 3)), layout, frame)
    with pytest.raises(InputError, match="toy@1 to return poses of H36M17"):
        Lifted(poses, "toy@1", "toy", None, False)


def answering(answer):
    """A pipeline of a stage "toy" that answers so."""
    stage = {"name": "toy", "needs": (), "gives": (), "__call__": lambda self, take: answer(take)}
    return Pipeline((type("Toy", (), stage)(),))


def test_a_stage_that_returns_no_take_is_named():
    with refused("plugin-broken", "a take from stage 'toy', got NoneType"):
        answering(lambda take: None)(Take("toy"))
    (end,) = run_together([answering(lambda take: None)], [Take("toy")])
    assert "got NoneType" in str(end)


@pytest.mark.parametrize("columns", [{"sway": np.zeros(19)}, {"sway": np.zeros((20, 1))}])
def test_a_stage_that_adds_a_column_of_another_length_is_named(columns):
    """The stage `export` ended with a traceback of pyarrow's, for a fault that it has not."""
    poses = PoseSequence(np.zeros((20, 17, 3)), H36M17, CAMERA)
    with refused("plugin-broken", "toy", "sway", columns["sway"].shape):
        answering(lambda take: take.with_(kinematics=columns))(Take("toy", poses=poses))


@pytest.mark.parametrize(
    ("given", "got"), [((), "()"), (None, "None"), (np.zeros((5, 17, 3)), "array"), (("a",), "a")]
)
def test_an_adapter_that_returns_no_people_is_named(register, tmp_path, given, got):
    register(
        "adapters",
        SimpleNamespace(
            name="toy", gives="poses", reads="a toy", sniff=lambda path: True, read=lambda path: given
        ),
    )
    (tmp_path / "toy.txt").write_text("toy")
    with refused("plugin-broken", "'toy'", got):
        load(tmp_path / "toy.txt", "toy", "poses", {})


def test_a_fault_may_be_another_packages(monkeypatch, capsys):
    def fails(**_):
        raise RuntimeError("a fault")

    monkeypatch.setattr(cli, "app", fails)
    for packages, words in (
        ({"pcnet3d": "1"}, "a fault of pcnet3d, not of your input"),
        (
            {"pcnet3d": "1", "pcnet3d-acme": "2"},
            "or of a package that adds to it (pcnet3d-acme), not of your input",
        ),
    ):
        monkeypatch.setattr(registry, "packages", lambda packages=packages: packages)
        with pytest.raises(SystemExit) as end:
            cli.main()
        assert end.value.code == 1
        assert words in " ".join(capsys.readouterr().err.split())


def test_a_detector_of_another_package_takes_no_person_detector(register):
    register("detectors", model(OBJECTS["detectors"]))
    with pytest.raises(InputError, match="finds people by itself"):
        load_detector("toy", "yolox")


def writer(file, **more):
    return SimpleNamespace(file=file, what="a toy", write=lambda take, path: None, **more)


def test_another_packages_writer_is_checked_before_the_work(register, tmp_path):
    register("writers", writer("toy.txt"))
    assert {"name": "toy", "file": "toy.txt", "what": "a toy"} in registry.listed("writers")
    Export(tmp_path, also=("toy",))

    def check():
        raise InputError("bad-value", "The toy needs batteries.")

    register("writers", writer("toy.txt", check=check))
    with pytest.raises(InputError, match="batteries"):
        Export(tmp_path, also=("toy",))
    with pytest.raises(InputError, match=r"There is no writer 'c3f'; did you mean c3d\?"):
        Export(tmp_path, also=("c3f",))


@pytest.mark.parametrize(
    ("file", "whose"),
    [
        *(
            (name, "the run")
            for name in ("poses.npz", "Summary.json", "take.rrd", "report.html", "keypoints.npz")
        ),
        ("kinematics.csv", "writer 'csv' writes"),
    ],
)
def test_a_writer_of_a_file_that_is_anothers_is_refused(register, tmp_path, file, whose):
    register("writers", writer(file))
    with pytest.raises(InputError, match=f"--also toy to write a file of its own, got {file}, which {whose}"):
        Export(tmp_path, also=("csv", "toy"))
    Export(tmp_path, also=("csv", "csv"))


def test_the_files_of_a_run_are_those_of_the_documents():
    results = (Path(__file__).parents[3] / "docs" / "results.md").read_text()
    table = results.partition("| file | content |")[2].partition("`--also")[0]
    listed = {line.split("`")[1] for line in table.splitlines() if line.startswith("| `")}
    assert listed == set(RUN_FILES) - {"video.ts"}


def test_listing_imports_nothing_heavy():
    heavy = ("torch", "onnxruntime", "rerun", "cv2", "av", "matplotlib", "pyarrow")
    program = (
        "import sys\nfrom pcnet3d.pipeline.plugins.registry import listed\n"
        "for what in ('adapters', 'stages', 'models', 'writers'):\n    assert listed(what)\n"
        f"print(*set(sys.modules).intersection({heavy}))\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (result.returncode, result.stdout.strip()) == (0, ""), result.stderr


@dataclass(frozen=True)
class _Window:
    seconds: float


def test_an_option_of_another_package_may_be_a_dataclass():
    def of_plugin(window: _Window, share: float = 0.5) -> None: ...

    found = checked(of_plugin, what="a stage", options={"window": {"seconds": 2}, "share": "0.25"})
    assert found == {"window": _Window(2.0), "share": 0.25}
    with pytest.raises(InputError) as refused:
        checked(of_plugin, what="a stage", options={"share": "nan"})
    assert refused.value.code == "bad-value"
