"""Training windows, and a training run as small as it gets."""

import numpy as np
import pytest

from pcnet3d.models.bodies import STANDARD_SIZE_M, BodyRange, size_m
from pcnet3d.models.lifter_features import CHANNELS, body_rays
from pcnet3d.models.lifter_windows import Windows, target
from pcnet3d.models.mocap import Clip
from pcnet3d.pipeline import H36M17, InputError, rotate

CONFIG = """
subjects = "train"
seed = 1
threads = 1
[net]
width = 8
dilations = [1, 3]
[[stages]]
steps = 9
stop = 3
frames = 64
single = 1
lengths = { 1 = 0.5, 16 = 0.5 }
rate = 1e-3
warmup = 1
average = 0.9
velocity = 0.5
pans = 0.2
derived = 0.4
combined = 0.5
limbs = 0.1
trunk = 0.1
"""


@pytest.fixture
def clips():
    rng = np.random.default_rng(0)
    poses = rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 1.8], (3, 1, 17, 3)) + rng.normal(
        0, 0.01, (3, 150, 17, 3)
    )
    poses[:, :, 0] = poses[:, :, H36M17.indices(("l_hip", "r_hip"))].mean(axis=2)
    return [
        Clip(f"0{i}_01", f"0{i}", "asfamc", 30.0, pose.astype(np.float32)) for i, pose in enumerate(poses)
    ]


@pytest.mark.parametrize(("count", "frames"), [(50, 1), (8, 30), (3, 150)])
def test_windows_are_what_they_say(clips, count, frames):
    windows = Windows(clips, other_rates=0)
    x, y = windows.batch(np.random.default_rng(0), count, frames)
    assert x.shape == (count, frames, CHANNELS)
    assert y.shape == (count, frames, 17, 3)
    assert x.dtype == y.dtype == np.float32
    assert np.isfinite(x).all()
    np.testing.assert_array_equal(y[..., 0, :], 0)
    np.testing.assert_allclose(size_m(y), STANDARD_SIZE_M, rtol=1e-4)


def test_same_seed_same_windows(clips):
    a, b = (Windows(clips).batch(np.random.default_rng(3), 4, 20)[0] for _ in range(2))
    np.testing.assert_array_equal(a, b)


def test_the_picture_shows_the_target(clips):
    """x and y of the target are the picture, up to perspective, noise and scale."""
    x, y = Windows(clips, other_rates=0).batch(np.random.default_rng(0), 300, 1)
    picture = x[:, 0, :34].reshape(-1, 17, 2)
    seen = x[:, 0, 51:68] > 0
    correlation = np.corrcoef(
        (picture - picture[:, :1])[seen & seen[:, :1]].ravel(), y[:, 0, ..., :2][seen & seen[:, :1]].ravel()
    )[0, 1]
    assert correlation > 0.9


def test_the_target_is_the_skeleton_seen_along_its_ray():
    joints = np.random.default_rng(0).normal([1.0, -0.5, 4.0], 0.3, (4, 17, 3))
    back = rotate(body_rays(joints), target(joints).astype(np.float64))
    relative = joints - joints[:, :1]
    ratio = np.linalg.norm(relative[:, 1:]) / np.linalg.norm(back[:, 1:])
    np.testing.assert_allclose(back * ratio, relative, atol=1e-5)


def test_combined_windows_have_other_upper_bodies(clips):
    plain, mixed = (
        Windows(clips, bodies=BodyRange(unchanged=1, mirrored=0), other_rates=0, combined=share).batch(
            np.random.default_rng(0), 60, 1
        )[1]
        for share in (0.0, 1.0)
    )

    def variety(y, joints):
        return np.linalg.norm(y[:, 0, H36M17.index(joints[0])] - y[:, 0, H36M17.index(joints[1])], axis=-1)

    knees, wrists = ("l_knee", "r_knee"), ("l_wrist", "r_wrist")
    linked, loose = (abs(np.corrcoef(variety(y, knees), variety(y, wrists))[0, 1]) for y in (plain, mixed))
    assert linked > 0.4  # three people: who has these knees has these wrists
    assert loose < 0.3


def test_windows_longer_than_every_clip_are_refused(clips):
    with pytest.raises(ValueError, match="no clip is as long"):
        Windows(clips, other_rates=0).batch(np.random.default_rng(0), 2, 151)


def test_a_run_gives_a_network_that_the_run_time_answers_alike(clips, tmp_path, monkeypatch):
    torch = pytest.importorskip("torch")
    pytest.importorskip("onnxscript")
    from pcnet3d.models import lifter_train
    from pcnet3d.models.lifter import run

    monkeypatch.setattr(lifter_train, "read_clips", lambda subjects: clips)
    (tmp_path / "tiny.toml").write_text(CONFIG)
    lifter_train.train_lifter(tmp_path / "tiny.toml", tmp_path / "out")
    net = lifter_train.LifterNet(lifter_train.read_config(tmp_path / "tiny.toml").net)
    net.load_state_dict(torch.load(tmp_path / "out" / "lifter.pt"))
    for frames in (1, 3, 40):
        x = np.random.default_rng(0).normal(size=(frames, CHANNELS)).astype(np.float32)
        with torch.no_grad():
            expected = net(torch.from_numpy(x)[None]).numpy()[0]
        np.testing.assert_allclose(run(x, tmp_path / "out" / "lifter.onnx"), expected, atol=1e-5)


def test_a_stage_goes_on_from_the_averaged_weights_of_the_one_before(clips, tmp_path, monkeypatch):
    torch = pytest.importorskip("torch")
    from pcnet3d.models import lifter_train

    stage = CONFIG[CONFIG.index("[[stages]]") :]
    still = stage.replace("rate = 1e-3", "rate = 0.0")
    weights = {}
    for name, text in (("one", CONFIG), ("two", CONFIG + still)):
        monkeypatch.setattr(lifter_train, "read_clips", lambda subjects: clips)
        monkeypatch.setattr(lifter_train, "export", lambda net, *_, **__: None)
        (tmp_path / "c.toml").write_text(text)
        lifter_train.train_lifter(tmp_path / "c.toml", tmp_path / name)
        weights[name] = torch.load(tmp_path / name / "lifter.pt")
        log = (tmp_path / name / "log.jsonl").read_text().splitlines()
        assert len(log) == len(lifter_train.read_config(tmp_path / "c.toml").stages)
    for name, values in weights["one"].items():
        torch.testing.assert_close(weights["two"][name], values)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("seed", "sede"), "sede|seed"),
        (lambda text: text.replace("steps = 9", "steps = 'many'"), "stages.0.steps"),
        (lambda text: text.replace('"train"', '"everybody"'), "subjects"),
        (lambda text: text + "]", "TOML"),
    ],
)
def test_a_wrong_config_is_refused_by_its_key(tmp_path, change, words):
    pytest.importorskip("torch")
    from pcnet3d.models.train import train

    (tmp_path / "c.toml").write_text(change(CONFIG))
    with pytest.raises(InputError, match=words):
        train(tmp_path / "c.toml", tmp_path / "out")


def test_a_missing_config_is_refused(tmp_path):
    pytest.importorskip("torch")
    from pcnet3d.models.train import train

    with pytest.raises(InputError, match="Expected a training config"):
        train(tmp_path / "none.toml", tmp_path / "out")
