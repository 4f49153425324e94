"""The published mixture of views, truth that fits the joints, and files of lifted takes."""

import numpy as np
import pytest

from golden.takes import write_lifted
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab.synthetic.views import paper_angles, read_lifted, seen, views
from pcnet3d.pipeline.core.rotations import rotate, transpose
from refusals import refused


def test_the_published_mixture():
    roll, pitch, yaw = paper_angles(np.random.default_rng(0), 200_000)
    front = np.abs(yaw) <= 60  # no side view reaches 3 standard deviations in
    assert front.mean() == pytest.approx(0.75 * 60 / 70, abs=0.01)
    assert (np.abs(yaw) > 140).mean() == pytest.approx(0.10 * 0.954, abs=0.01)
    assert np.abs(pitch).max() == 20
    assert np.abs(roll).max() == 8
    assert (np.abs(pitch[front]) == 20).mean() == pytest.approx(0.0956, abs=0.01)  # 12 degrees clamped at 20
    assert ((yaw > 100) & (yaw < 140)).mean() < 0.02


@pytest.mark.parametrize(
    ("view", "angles", "up"),
    [
        # Yaw last: the camera of the paper's mixture rolls when the subject stands sideways and "pitches".
        ("paper", (0, 20, 90), (-np.sin(np.radians(20)), -np.cos(np.radians(20)), 0)),
        # Yaw first: a camera that is really pitched sees up lean away from it whatever the heading.
        ("wide", (0, 20, 90), (0, -np.cos(np.radians(20)), np.sin(np.radians(20)))),
    ],
)
def test_pitch_tilts_body_or_camera(view, angles, up, monkeypatch):
    values = tuple(np.array([float(a)]) for a in angles)
    monkeypatch.setattr(f"pcnet3d.models.lab.synthetic.views.{view}_angles", lambda rng, count: values)
    np.testing.assert_allclose(views(view, np.random.default_rng(0), 1)[0, :, 2], up, atol=1e-9)


def test_the_joints_seen_have_the_rotation_asked_for_to_the_body_or_to_the_worlds_axes(standing):
    """With targets "axes" R takes the world's axes to the camera's, whatever the person does there."""
    world = np.tile(standing, (20, 1, 1))
    R = views("wide", np.random.default_rng(0), 20)
    joints, fine = seen(world, R)
    assert fine.all()
    np.testing.assert_allclose(body_axes(joints, R[..., 2]), R, atol=1e-9)
    by_axes, _ = seen(world, R, "axes")
    np.testing.assert_allclose(rotate(transpose(R), by_axes), world - world[:, :1], atol=1e-6)
    turned = world[..., [1, 0, 2]] * np.array([-1, 1, 1])  # the person faces another way
    np.testing.assert_allclose(seen(turned, R, "body")[0], joints, atol=1e-6)
    assert np.abs(seen(turned, R, "axes")[0] - by_axes).max() > 0.1


def test_lifted_frames_come_with_their_truth_at_their_scale_and_other_files_are_refused(standing, tmp_path):
    path = write_lifted(tmp_path / "takes.npz", standing)
    takes = read_lifted([path])
    assert len(takes.joints) == 59  # one was not lifted
    np.testing.assert_allclose(takes.truth, takes.joints, atol=1e-5)
    assert takes.clips == ("01_01", "02_01")
    held = dict(np.load(path))
    wrong = [("lifted", np.zeros((60, 17, 2))), ("lying", np.array(["no"] * 60)), ("clip", ["01_01"])]
    for name, content in [*wrong, *(("take_start", start) for start in ([0, 40, 20, 60], [1, 60], []))]:
        np.savez(path, **held | {name: content})
        with refused("wrong-content", name):
            read_lifted([path])
