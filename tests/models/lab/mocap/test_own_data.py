"""Training and evaluation on a file of clips and a split of one's own; the paper's targets."""

import json

import numpy as np
import pytest

from golden.trainings import tiny
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lab.mocap.clips import read_parts
from pcnet3d.models.lab.mocap.files import write_mocap
from pcnet3d.models.lab.synthetic.views import seen, views
from pcnet3d.pipeline import H36M17, InputError, rotate
from pcnet3d.pipeline.core.rotations import transpose

SPLIT = {"train": ["01", "02"], "val": ["03"], "test": ["04"]}


@pytest.fixture
def files(tmp_path, clip_of):
    """A file of clips of four people, and a split of them."""
    write_mocap(
        tmp_path / "clips.npz", [clip_of(f"{s}_{i}") for s in ("01", "02", "03", "04") for i in (1, 2)]
    )
    (tmp_path / "split.json").write_text(json.dumps(SPLIT))
    return tmp_path / "clips.npz", tmp_path / "split.json"


def names(clips):
    return [clip.name for clip in clips]


def test_parts_by_subject(files):
    parts = read_parts(*files)
    assert parts.by == "subject"
    assert names(parts.clips["train"]) == ["01_1", "01_2", "02_1", "02_2"]
    assert names(parts.clips["test"]) == ["04_1", "04_2"]


def test_parts_by_clip_may_share_people(files):
    files[1].write_text(json.dumps({"by": "clip", "train": ["01_1"], "val": ["02_1"], "test": ["01_2"]}))
    parts = read_parts(*files)
    assert parts.by == "clip"
    assert names(parts.clips["train"] + parts.clips["test"]) == ["01_1", "01_2"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"test": ["04", "01"]}, "01 is in train and test"),
        ({"val": ["04"]}, "04 is in val and test"),
        ({"train": ["01", "99"]}, "does not have: 99"),
        ({"test": []}, "test has none"),
        ({"test": "all"}, r"split\.json: test"),
        ({"test": [4]}, r"split\.json: test"),
        ({"by": "frame"}, r"split\.json: by"),
        ({"by": "clip", "train": ["01_1"], "val": ["01_1"], "test": ["02_1"]}, "every clip"),
    ],
)
def test_a_wrong_split_is_refused(files, change, words):
    files[1].write_text(json.dumps({**SPLIT, **change}))
    with pytest.raises(InputError, match=words):
        read_parts(*files)


@pytest.mark.parametrize("content", ["", "[]", "{", "[" * 100_000], ids=["empty", "list", "cut off", "deep"])
def test_what_is_no_split_is_refused(files, content):
    files[1].write_text(content)
    with pytest.raises(InputError, match=r"split\.json"):
        read_parts(*files)


def test_axes_are_the_views_own_rotation(clip_of):
    """With targets "axes" R takes the world's axes to the camera's, whatever the person does there."""
    clip = clip_of("01_1")
    R = views("wide", np.random.default_rng(0), len(clip))
    joints, fine = seen(clip.joints, R, "axes")
    assert fine.all()
    np.testing.assert_allclose(rotate(transpose(R), joints), clip.joints - clip.joints[:, :1], atol=1e-6)
    turned = clip.joints[..., [1, 0, 2]] * np.array([-1, 1, 1])  # the person faces another way
    other, _ = seen(turned, R, "axes")
    body, _ = seen(turned, R, "body")
    np.testing.assert_allclose(body, seen(clip.joints, R, "body")[0], atol=1e-6)
    assert np.abs(other - joints).max() > 0.1


@pytest.mark.parametrize("targets", ["body", "axes"])
def test_batches_have_the_targets_asked_for(clip_of, targets):
    """Turned back by R everybody faces -x upright: left at -y, never mirrored to face +x."""
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    from pcnet3d.models.lab.synthetic.draw import Draw
    from pcnet3d.models.lab.training.rectifier.train import Mixture, TrainingFrames

    material = TrainingFrames([clip_of("01_1")], Mixture(wide=0.5), targets=targets)
    _, _, truth, R = (part.double().numpy() for part in material.batch(Draw(0, 0), 200))
    canonical = rotate(transpose(R), truth)
    assert (canonical[:, H36M17.index("l_shoulder"), 1] < -0.1).all()
    assert (canonical[:, H36M17.index("nose"), 0] < canonical[:, H36M17.index("thorax"), 0]).mean() > 0.9
    if targets == "axes":
        poses = clip_of("01_1").joints
        nearest = np.abs(canonical[:, None] - (poses - poses[:, :1])).max(axis=(-2, -1)).min(axis=1)
        assert nearest.max() < 1e-4


def test_evaluation_of_own_test_subjects(files, tmp_path, capsys):
    data, split = files
    evaluate("rectifiers", tmp_path / "out", rectifier=["geometric"], data=data, split=split)
    assert (tmp_path / "out" / "evaluation.md").read_text() in capsys.readouterr().out
    report = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    rows = report["rectifiers"]["geometric"]["rows"]
    assert rows["clips.npz, test, clean, paper's views, upright"]["frames"] == 80
    assert {name.rpartition(", ")[0] for name in rows} == {
        f"clips.npz, test, clean, {views} views" for views in ("paper's", "wide")
    }
    assert report["subjects"] == ["04"]
    evaluate("rectifiers", tmp_path / "out", rectifier=["geometric"], data=data)
    report = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    rows = report["rectifiers"]["geometric"]["rows"]
    assert rows["clips.npz, everybody, clean, paper's views, upright"]["frames"] == 320


@pytest.fixture
def training(files, tmp_path, monkeypatch):
    """Trains with the file's text changed; nothing else is read than the files."""
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
    from pcnet3d.models.lab.training.rectifier import train as pcnet_train

    monkeypatch.setenv("PCNET3D_DATA", str(tmp_path / "nowhere"))
    clips, split = (file.as_posix() for file in files[:2])
    text = tiny(
        ("steps = 6", "steps = 4"),
        ("symmetric = true", f'symmetric = false\ndata = "{clips}"\nsplit = "{split}"\ntargets = "axes"'),
        ('residual = "off"\nalign = true', 'residual = "free"'),
    )
    text = text.partition("[mixture]")[0] + "[mixture]\nwide = 0.5\n"

    def train(change=lambda text: text):
        (tmp_path / "own.toml").write_text(change(text))
        pcnet_train.train_pcnet(tmp_path / "own.toml", tmp_path / "out")
        return tmp_path / "out"

    return train


def test_training_on_own_data(training):
    import onnxruntime

    from pcnet3d.models import load_rectifier

    out = training()
    rectifier = load_rectifier(str(out / "pcnet.onnx"))
    assert np.isfinite(rectifier.rotation(np.random.default_rng(0).normal(0, 0.4, (5, 17, 3)))[0]).all()
    properties = onnxruntime.InferenceSession(out / "pcnet.onnx").get_modelmeta().custom_metadata_map
    assert properties["targets"] == "axes"
    assert properties["trained_on"] == "clips.npz, split.json"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace('"axes"', '"compass"'), "targets"),
        (lambda t: t.replace("lifted = []", 'lifted = ["a.npz"]'), "Lifted takes"),
        (lambda t: t.replace("clips.npz", "clip.npz"), "found nothing"),
        (lambda t: t + "[mixture.poses]\nturned = 0.1\n", "as they were recorded"),
    ],
)
def test_a_config_that_contradicts_itself_is_refused(training, tmp_path, change, words):
    with pytest.raises(InputError, match=words):
        training(change)
    assert not (tmp_path / "out").exists()


def test_a_run_does_not_go_on_with_another_split(training, files, monkeypatch):
    from pcnet3d.models.lab.training.rectifier import train as pcnet_train

    monkeypatch.setattr(pcnet_train, "export", lambda deployed, path, **said: None)
    training()
    training()  # the same goes on, and has nothing left to do
    files[1].write_text(json.dumps({"train": ["01"], "val": ["03"], "test": ["04", "02"]}))
    with pytest.raises(InputError, match="other recordings or another split"):
        training()
