"""MM-Fi: axes and joint order of small trees, trees that contradict them, the paper's table end to end, and the pose
that the residual head corrects judged as it is."""

import json
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
import torch

from golden.trainings import tiny
from pcnet3d.models.lab import mmfi as module
from pcnet3d.models.lab.cases import procrustes_error
from pcnet3d.models.lab.evaluation.rectifiers import clean_takes
from pcnet3d.models.lab.mmfi import PROTOCOLS, read_tree
from pcnet3d.models.lab.training import rectifier
from pcnet3d.models.lab.training.rectifier import Answer, Deployed, NetConfig, PCNet
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import rotate, transpose
from refusals import refused

PEOPLE = ("S01", "S02", "S03", "S05", "S31")


@pytest.fixture
def mmfi_tree(tmp_path, facing_camera):
    """Writes a tree as MM-Fi has it: people who face the sensor, 3 m away, and sway a little."""

    def make(people, actions=("A01",), sway_m=0.02, change=lambda joints: joints):
        sway = sway_m * np.sin(np.linspace(0, 6, 40))[:, None] * (facing_camera[:, 1] < 0)
        for subject, action in ((subject, action) for subject in people for action in actions):
            joints = np.tile(facing_camera, (40, 1, 1))
            joints[..., 0] += sway
            folder = tmp_path / "MMFi" / f"E{(int(subject[1:]) - 1) // 10 + 1:02d}" / subject / action
            folder.mkdir(parents=True)
            joints = change(joints + np.array([0.2, 0.1, 3.0]))
            np.save(folder / "ground_truth.npy", joints, allow_pickle=True)
        return tmp_path / "MMFi"

    return make


def test_camera_axes_become_the_papers(mmfi_tree, facing_camera):
    (clip,) = read_tree(mmfi_tree(["S01"], sway_m=0.0).parent)  # the whole tree is read from above too
    assert (clip.name, clip.subject, clip.source, clip.fps, len(clip)) == ("S01_A01", "S01", "mmfi", 10, 40)
    pelvis = clip.joints[0, 0]
    np.testing.assert_allclose(pelvis, [3.0, -0.2, -0.1], atol=1e-6)  # 3 m away, 0.2 m right, 0.1 m below
    r_wrist = clip.joints[0, H36M17.index("r_wrist")] - pelvis
    x, y, z = facing_camera[H36M17.index("r_wrist")]
    np.testing.assert_allclose(r_wrist, [z, -x, -y], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda j: j * [-1, 1, 1], "exchanged"),  # a mirrored body
        (lambda j: j * [-1, 1, -1] + [0, 0, 6], "only 0 %"),  # turned about the vertical
        (lambda j: j * [-1, -1, 1], "only 0 %"),  # a camera upside down
        (lambda j: 1000 * j, "metres"),
        (lambda j: j[:, :16], "frames, 17, 3"),
        (lambda j: np.where(np.arange(17)[:, None] == 3, np.nan, j), "all joints"),
    ],
)
def test_a_tree_that_contradicts_is_refused(mmfi_tree, change, words):
    with pytest.raises(InputError, match=words):
        read_tree(mmfi_tree(["S01", "S02"], change=change))


def test_the_protocols_people_and_others_are_refused(mmfi_tree):
    """Across subjects every fifth is tested, across environments the last ten."""
    assert PROTOCOLS["S2"] == {f"S{i:02d}" for i in range(5, 41, 5)}
    assert PROTOCOLS["S3"] == {f"S{i}" for i in range(31, 41)}
    tree = mmfi_tree(PEOPLE)
    for name, test in (("S2", "S05"), ("S3", "S31")):
        split = module.split_of(read_tree(tree), PROTOCOLS[name])
        people = {part: {clip.subject for clip in of} for part, of in split.items()}
        assert people == {"train": set(PEOPLE) - {test, "S01"}, "val": {"S01"}, "test": {test}}
    (tree / "E01").rename(tree / "E02")
    with refused("name-unknown", "E02/S01"):
        read_tree(tree)


def test_the_table(mmfi_tree, tmp_path, capsys, monkeypatch):
    # Export takes seconds, and is the trainer's.
    monkeypatch.setattr(rectifier, "export", lambda deployed, path, **said: path.write_bytes(b"slow"))
    text = files("pcnet3d.models.lab.training").joinpath("mmfi.toml").read_text(encoding="utf-8")
    small = ("batch = 1024", "batch = 32"), ("steps = 20000", "steps = 3"), ("[net]", "[net]\nwidth = 16\n#")
    (tmp_path / "tiny.toml").write_text(tiny(*small, text=text), encoding="utf-8")
    tree, out = mmfi_tree(PEOPLE, ("A01", "A13", "A14")), tmp_path / "out"
    module.mmfi(tree, out, config=tmp_path / "tiny.toml", device="cpu", threads=1)
    said = capsys.readouterr().out
    assert said.index("2 trainings take about") < said.index("parameters")  # before it starts
    assert (out / "mmfi.md").read_text() in said
    tested = json.loads((out / "mmfi.json").read_text())["rows"]
    assert list(tested) == ["S2", "S3"]
    for name, of in tested.items():
        assert set(of) == {"geometric", "pcnet"}
        for row in of.values():
            assert row["frames"] == 3 * 40
            for figure in ("rotation", "mpjpe", "unscaled", "pa_mpjpe", "turned only", "frobenius"):
                assert np.isfinite(list(row[figure].values())).all(), figure
        assert (out / name / "pcnet.onnx").is_file()
        kept = json.loads((out / name / "config.json").read_text())
        assert (kept["targets"], kept["schedule"]["steps"]) == ("axes", 3)
    assert tested["S2"]["geometric"]["pa_mpjpe"]["p95"] < 0.1
    assert tested["S2"]["geometric"]["rotation"]["mean"] < 15


def test_what_a_residual_head_makes_better_is_seen(clips, monkeypatch):
    """Joints moved by a few centimetres, as a lifter would: all taken away, or kept."""
    clean = clean_takes(clips["test"], "wide")[0]
    joints = clean.truth + np.random.default_rng(3).normal(0, 0.03, clean.truth.shape)
    joints -= joints[:, :1]
    take, net = replace(clean, joints=joints), PCNet(NetConfig(width=8, output=8))

    def judged(corrected):
        told = (clean.R, np.ones(len(joints)), rotate(transpose(clean.R), corrected), corrected, corrected)
        monkeypatch.setattr(net, "forward", lambda *_: Answer(*map(torch.from_numpy, told)))
        return module.judge_net(Deployed(net, symmetric=False), [take])

    kept, perfect = judged(joints), judged(take.truth)
    own_mm = 1000 * procrustes_error(joints, take.truth).mean()
    assert kept["pa_mpjpe"].mean == pytest.approx(own_mm, abs=0.1)
    assert perfect["pa_mpjpe"].mean < 0.01
    assert perfect["turned only"].mean == pytest.approx(kept["mpjpe"].mean, abs=0.01)
