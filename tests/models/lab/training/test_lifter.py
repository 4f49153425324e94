"""The lifter: joints that lie on their rays, training windows that show what they say, and a training run as small as
it gets."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from golden.trainings import LIFTER, three_people, tiny
from pcnet3d.models.lab.clips import lying
from pcnet3d.models.lab.synthetic import STANDARD_SIZE_M, Draw, Noise, size_m
from pcnet3d.models.lab.train import train
from pcnet3d.models.lab.training import lifter as module
from pcnet3d.models.lab.training.lifter import Batch, LifterNet, Material, Windows
from pcnet3d.models.lifter import features as run_time
from pcnet3d.models.lifter.builtin import network
from pcnet3d.models.lifter.builtin import run as lift_features
from pcnet3d.models.lifter.features import CHANNELS
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused

LENGTHS = "lengths = { 1 = 0.3, 16 = 0.7 }"
STILL = Material(unchanged=1.0, mirrored=0.0, other_rates=0.0)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """The networks here."""
    for name, value in (("WIDTH", 4), ("TRUNK", 16), ("DILATIONS", (1, 3))):
        monkeypatch.setattr(module, name, value)


@pytest.fixture
def clips():
    return three_people()


def batch(clips, material, count, frames):
    return Batch(*(part.numpy() for part in Windows(clips, material).batch(Draw(3, 0), count, frames)))


@pytest.mark.parametrize(("count", "frames"), [(300, 1), (3, 150)])
def test_windows_are_what_they_say_and_the_image_shows_the_target(clips, count, frames):
    """x and y of the target are the image, up to perspective, noise and scale."""
    x, joints, velocity = batch(clips, replace(STILL, derived=0.5, pans=0.3), count, frames)
    assert x.shape == (count, frames, CHANNELS)
    assert joints.shape == velocity.shape == (count, frames, 17, 3)
    assert np.isfinite(x).all()
    np.testing.assert_array_equal(joints[..., 0, :], 0)
    np.testing.assert_allclose(size_m(joints), STANDARD_SIZE_M, rtol=1e-4)
    image, visible = x[..., :34].reshape(count, frames, 17, 2), x[..., 51:68] > 0
    use = visible & visible[..., :1]
    assert np.corrcoef((image - image[..., :1, :])[use].ravel(), joints[..., :2][use].ravel())[0, 1] > 0.9
    if frames == 1:
        assert not velocity.any()  # of a single frame nothing is known, and nothing asked


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_clips_of_people_who_lie_are_drawn_as_often_as_asked(clips, facing_camera, share):
    """Of four clips as long as each other one lies."""
    still = np.tile((facing_camera[:, [0, 2, 1]] * [1, 1, -1]).astype(np.float32), (150, 1, 1))
    upright = [replace(clip, joints=still) for clip in clips]
    lies = replace(clips[0], joints=still[..., [0, 2, 1]])
    windows = Windows((*upright, lies), Material(lying=share))
    drawn = windows._motion(Draw(3, 0), 20, 30.0, 400).numpy()
    assert float(lying(drawn[:, 0]).mean()) == pytest.approx(share + (1 - share) / 4, abs=0.08)
    if share:
        with pytest.raises(InputError, match="clips in which somebody lies"):
            Windows(upright, Material(lying=share))


def test_training_and_run_time_make_the_same_features(rng):
    """Torch's and numpy's, of keypoints with gaps."""
    keypoints = rng.uniform(0, 1000, (4, 12, 17, 2))
    keypoints[rng.uniform(size=keypoints.shape[:-1]) < 0.2] = np.nan
    keypoints[1, :3] = keypoints[2, 5:8] = np.nan  # nobody at the start, nor in the middle
    confidence = rng.uniform(size=keypoints.shape[:-1])
    confidence[0] = np.nan
    up = rng.normal(size=(4, 12, 3))
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    up[0], up[1, 4] = np.nan, [0, 0, 1]  # unknown, along the ray
    given = keypoints, confidence, np.full((4, 2), 1000.0), np.full(4, 900.0), up
    x, R = run_time.features(*given)
    made_x, made_R = run_time.features(*map(torch.from_numpy, given))
    np.testing.assert_allclose(made_x, x, atol=1e-5)
    np.testing.assert_allclose(made_R, R, atol=1e-6)


def test_joints_that_were_seen_lie_on_their_rays_but_for_what_is_learned(clips, monkeypatch):
    """Exact keypoints: whatever the network answers then projects onto them, seen from one point a frame. Of joints
    that were not seen the image says nothing."""
    windows = Windows(clips, replace(STILL, focal_known=1.0))
    exact = Noise(std=0.0, outliers=0.0, swap_rate=0.0, missing_rate=0.0, absent_rate=0.0)
    monkeypatch.setattr(module, "detect", partial(module.detect, noise=exact))
    x = windows.batch(Draw(3, 0), 6, 10).x
    net = LifterNet()
    torch.nn.init.normal_(net.leave_bone.weight)
    hidden = net.hidden(net.tokens(x)).detach()
    joints = net.answer(hidden, x)[0].detach()
    image, size = x[..., :34].unflatten(-1, (17, 2)), (x[..., 71:72] - 2).exp()
    # joints + offset = image (distance + size depth): three unknowns a frame.
    left = joints[..., :2] - image * (size * joints[..., 2])[..., None]
    off, line = ((part - part.mean(-2, keepdim=True)).flatten(-2) for part in (left, image))
    distance = (off * line).sum(-1, keepdim=True) / line.square().sum(-1, keepdim=True)
    np.testing.assert_allclose(off.numpy(), (distance * line).numpy(), atol=1e-4)
    torch.nn.init.normal_(net.leave_off.weight)
    assert (net.answer(hidden, x)[0] - joints).abs().max() > 0.01
    nobody = x.clone()
    nobody[..., 51:68] = 0
    elsewhere = nobody.clone()
    elsewhere[..., :34] += 1
    assert torch.equal(net.answer(hidden, nobody)[0], net.answer(hidden, elsewhere)[0])


@pytest.fixture
def run(tmp_path, clips, monkeypatch):
    """Trains into a folder with the tiny config changed; everybody is the same three people."""
    monkeypatch.setattr(module, "read_clips", lambda subjects: clips)

    def run(*changes):
        (tmp_path / "tiny.toml").write_text(tiny(*changes, text=LIFTER))
        train(tmp_path / "tiny.toml", tmp_path / "out", "cpu", 1)
        return tmp_path / "out"

    return run


def test_a_run_gives_a_network_that_the_run_time_answers_alike(run):
    out = run()
    names = {"lifter.onnx", "best.pt", "checkpoint.pt", "config.json", "log.jsonl"}
    assert {path.name for path in out.iterdir()} == names
    lines = [json.loads(line) for line in (out / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [2, 4, 6]
    assert {"typical", "wild", "wild_up", "score", "loss"} < lines[0].keys()
    opened = network(out / "lifter.onnx")
    assert (opened.stated["reach"], opened.stated["trained_on"]) == ("4", "train")
    net = LifterNet().eval()
    net.load_state_dict(torch.load(out / "best.pt", weights_only=True))
    for value in net.parameters():
        if value.ndim > 1:
            value.data = value.data.half().float()  # as the file keeps matrices
    for frames in (1, 3, 40):
        x = np.random.default_rng(0).normal(size=(frames, CHANNELS)).astype(np.float32)
        with torch.no_grad():
            expected = [part[0].numpy() for part in net(torch.from_numpy(x)[None])]
        answers = opened.session.run(["joints", "sd", "velocity"], {"features": x[None]})
        for answer, part in zip(answers, expected, strict=True):
            np.testing.assert_allclose(answer[0], part, atol=1e-5)
        np.testing.assert_allclose(lift_features(x, out / "lifter.onnx", chunk=7)[1], expected[1], atol=1e-5)


def test_clips_that_cannot_be_trained_on_are_refused(run, clips):
    with refused("nothing-usable", "999 frames"):
        run(("16 = 0.7", "999 = 0.7"))
    for clip in clips:
        for part, x in ("hip", 0.9), ("shoulder", 1.4):
            clip.joints[:, H36M17.indices((f"l_{part}", f"r_{part}"))] = [x, 0, 0]
    with refused("nothing-usable"):  # nobody upright to validate on
        module.whole_takes(clips)


@pytest.mark.parametrize("lengths", ["", "0 = 1.0", "1 = 0.0", "9 = inf"])
def test_windows_of_no_length_are_refused(run, tmp_path, lengths):
    with pytest.raises(InputError, match="lengths"):
        run((LENGTHS, f"lengths = {{ {lengths} }}"))
    assert not (tmp_path / "out").exists()
