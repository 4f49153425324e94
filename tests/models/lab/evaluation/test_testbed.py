"""Lifted takes: deterministic, true to their camera, and judged by evaluate."""

import csv

import numpy as np
import pytest

from golden.bodies import facing_camera
from golden.virtual import exact
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab.evaluation import evaluate as reports
from pcnet3d.models.lab.evaluation import runs as evaluation_sets
from pcnet3d.models.lab.evaluation import testbed as module
from pcnet3d.models.lab.evaluation.lifter import groups, motion_classes
from pcnet3d.models.lab.evaluation.testbed import LiftedTake, lay_down, lifted_takes, see, write_takes
from pcnet3d.models.lab.mocap.clips import Clip, trunk_lean_deg
from pcnet3d.models.lifter.builtin import Network
from pcnet3d.pipeline import CAMERA, H36M17, InputError
from refusals import refused


def clip(name="09_01", frames=50):
    """Someone who walks half a metre without moving a limb."""
    pose = facing_camera()[:, [0, 2, 1]] * [1, 1, -1] + [0, 0, 0.9]
    way = np.linspace(0, 0.5, frames)[:, None, None] * np.array([0, -1, 0])
    return Clip(name, name[:2], "asfamc", 30.0, (pose + way).astype(np.float32))


def test_a_take_depends_on_seed_and_name_only():
    a, b = see(clip(), 0), see(clip(), 0)
    np.testing.assert_array_equal(a.keypoints.joints, b.keypoints.joints)
    assert not np.allclose(a.R_camera_from_world, see(clip(), 1).R_camera_from_world)
    assert not np.allclose(a.R_camera_from_world, see(clip("09_02"), 0).R_camera_from_world)


def test_truth_fits_itself():
    take = see(clip(), 0)
    np.testing.assert_allclose(take.R_camera_from_body, body_axes(take.truth, take.up), atol=1e-9)
    np.testing.assert_allclose(take.R_camera_from_body[..., 2], np.broadcast_to(take.up, (50, 3)), atol=1e-9)
    np.testing.assert_array_equal(take.truth[:, 0], 0)
    centre = take.joints_camera[:, H36M17.indices(("pelvis", "thorax"))].mean(axis=1)
    along = np.einsum("tji,tj->ti", take.R_camera_from_ray, centre)
    assert (np.abs(along[:, :2]) < 0.05 * along[:, 2:]).all()  # the body's centre lies on the ray
    assert not take.lying.any()


def test_a_lift_is_as_wrong_as_it_was_made_and_in_the_direction():
    assert all(figure.p95 < 1e-2 for figure in groups([exact(clip())])["upright"]["frame"].values())
    for column, name, other in ((2, "depth", "lateral"), (0, "lateral", "depth")):
        take = exact(clip())
        error = np.zeros((50, 17, 3))
        error[:, H36M17.index("l_wrist")] = 0.017 * take.seen.R_camera_from_ray[..., column]
        lifted = take.lifted.with_(joints=take.seen.truth + error)
        figures = groups([LiftedTake(lifted, take.seen)])["upright"]["frame"]
        assert figures[name].mean == pytest.approx(1.0, abs=0.2)  # 17 mm at one of 17 joints
        assert figures[other].mean < 0.4


@pytest.mark.parametrize(
    ("subjects", "trained_on", "fine"),
    [("test", "train", True), ("train", "mine.npz, split.json", True), ("train", "train", False)],
)
def test_no_take_is_lifted_by_who_saw_its_subject(subjects, trained_on, fine, monkeypatch):
    monkeypatch.setattr(module, "network", lambda model: Network(None, "", 0, trained_on))
    monkeypatch.setattr(module, "read_clips", lambda subjects: ())
    if fine:
        assert list(lifted_takes(subjects)) == []
    else:
        with refused("files-apart"):
            next(lifted_takes(subjects))
        assert list(lifted_takes(subjects, trained_on=True)) == []


def test_a_laid_body_lies_and_moves_as_before():
    upright = clip()
    for seed in range(5):
        laid = lay_down(upright, np.random.default_rng(seed))
        apart = [
            np.linalg.norm(np.diff(one.joints[:, [0, 5, 9]], axis=1), axis=-1) for one in (upright, laid)
        ]
        np.testing.assert_allclose(*apart, atol=1e-5)
        assert (np.abs(trunk_lean_deg(laid.joints) - 90) < 40).all()
        assert abs(np.quantile(laid.joints[..., 2], 0.05)) < 1e-5
    np.testing.assert_array_equal(laid.joints, lay_down(upright, np.random.default_rng(4)).joints)


def test_the_command_writes_plain_arrays(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "read_clips", lambda subjects: (clip(), clip("09_02", 20), clip("09_03", 40)))
    write_takes("test", tmp_path / "takes.npz")
    with np.load(tmp_path / "takes.npz", allow_pickle=False) as file:
        assert file["take_start"].tolist() == [0, 50, 90]  # 20 frames are too few
        assert file["clip"].tolist() == ["09_01", "09_03"]
        assert str(file["device"]) == "cpu"
        np.testing.assert_allclose(file["truth"][:50], see(clip(), 0).truth, atol=1e-6)
        np.testing.assert_allclose(file["R_camera_from_body"][..., 2], file["up"], atol=1e-9)


@pytest.mark.parametrize("report", ["takes", "errors"])
def test_a_set_without_takes_is_refused_before_the_work(tmp_path, monkeypatch, report):
    clips = (clip(), clip("accad-m1_01", 20), clip("tennis-a_01"))
    monkeypatch.setattr(evaluation_sets, "lifted_takes", lambda *_, **__: pytest.fail("it works"))
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: clips)
    with refused("nothing-usable"):
        reports.evaluate(report, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_motion_has_a_row_of_its_own():
    faster = clip(frames=40)
    faster.joints[..., 1] -= np.linspace(0, 0.9, 40)[:, None]
    seen = see(faster, 0)
    joints = seen.truth.copy()
    walking = motion_classes(seen.world, 30.0)["walking"]
    joints[~walking] += 1.0
    take = LiftedTake(seen.keypoints.with_(joints=joints, frame=CAMERA.with_(unit="arbitrary")), seen)
    rows = groups([take, exact(clip())])
    assert set(rows) == {"upright", "walking"}
    assert rows["walking"]["counts"]["frames"] == walking.sum()
    assert rows["walking"]["frame"]["MPJPE"].p95 < 1e-2


@pytest.mark.parametrize("asked", [{"sets": "test"}, {"sets": "test", "because": " "}, {"because": "I may"}])
def test_test_subjects_are_looked_at_for_a_reason_only(tmp_path, asked, monkeypatch):
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: pytest.fail("it looks"))
    with pytest.raises(InputError, match="--because"):
        reports.evaluate("takes", tmp_path / "out", **asked)
    assert not (tmp_path / "out").exists()


def test_a_report_takes_its_own_options_alone(tmp_path):
    for report, asked in (
        ("gait", {"part": ["typical"]}),
        ("real-take", {"seed": 1}),
        ("lifter", {"bed": "wild"}),
    ):
        with refused("option-conflict"):
            reports.evaluate(report, tmp_path / "out", **asked)
    with refused("name-unknown"):
        reports.evaluate("take", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_looks_at_test_subjects_are_kept(tmp_path, monkeypatch):
    for reason in ("first", "a comma, and\na line"):
        reports.note_look(tmp_path, "pcnet3d lab evaluate takes", ["pcnet3d@1", "pcnet@2"], reason)
    with open(tmp_path / "ledger.csv", newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert first["networks"] == "pcnet3d@1 pcnet@2"
    assert second["because"] == "a comma, and a line"
    (tmp_path / "repository" / ".git").mkdir(parents=True)
    monkeypatch.setattr(reports, "ROOT", tmp_path / "repository")
    assert reports.ledger_of(tmp_path) == tmp_path / "repository" / "docs" / "accuracy" / "ledger.csv"
