"""Motion capture read from files that are written here."""

import numpy as np
import pytest

from golden.skeleton import bvh
from golden.worlds import trc, y_up
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.stages.study.compare.side import read_truth
from refusals import refused


def distances(joints: np.ndarray) -> np.ndarray:
    """(T, 17, 17), which no rotation changes."""
    return np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)


@pytest.mark.parametrize("name", ["markers.trc", "markers.c3d"])
def test_our_own_exports_come_back(runs, walk, name):
    if name.endswith("c3d"):
        pytest.importorskip("ezc3d")
    poses = read_truth(runs / "side" / name)
    assert poses.frame.name == "Z_UP"
    np.testing.assert_allclose(poses.times, walk.time_s, atol=1e-4)
    np.testing.assert_allclose(distances(poses.joints), distances(walk.world), atol=0.02)  # filtered
    heights = poses.joint("r_wrist")[:, 2] - poses.joint("pelvis")[:, 2]
    truth = walk.joint("r_wrist")[:, 2] - walk.root[:, 2]
    assert np.abs(heights - truth).max() < 0.08


def test_the_points_of_one_subject_are_taken_and_of_two_refused(walk, tmp_path):
    path, names = tmp_path / "x.trc", [f"Ann:{joint}" for joint in H36M17.joints]
    points = y_up(walk.world)
    ball = np.concatenate([points, points[:, :1] + 1], axis=1)
    trc(path, [*names, "Ball:top"], ball)
    np.testing.assert_allclose(distances(read_truth(path).joints), distances(walk.world), atol=1e-3)
    both = [*names, *(name.replace("Ann", "Bob") for name in names)]
    trc(path, both, np.concatenate([points, points + 3], axis=1))
    with pytest.raises(InputError, match="one person's points, got those of Ann, Bob"):
        read_truth(path)


@pytest.mark.parametrize(("unit", "size"), [("mm", "0.001"), ("inch", "0.04"), (None, "1.75e")])
def test_a_person_of_no_persons_size_has_another_unit(walk, tmp_path, unit, size):
    """In a wrong unit the run was scaled to a person of 2 mm, from whom its joints differed by 0 mm."""
    points = y_up(walk.world) * (1 if unit else 1000)
    trc(tmp_path / "x.trc", H36M17.joints, points)
    with pytest.raises(InputError, match=rf"stature of {size}.* give its unit with --unit"):
        read_truth(tmp_path / "x.trc", unit=unit)


@pytest.mark.filterwarnings("error")
def test_a_joint_that_never_is_there_says_nothing_of_up(walk, tmp_path):
    for joint in ("l_wrist", "r_knee"):
        world = walk.world.copy()
        world[:, H36M17.index(joint)] = np.nan
        trc(tmp_path / f"{joint}.trc", H36M17.joints, world)
    poses = read_truth(tmp_path / "l_wrist.trc", up="z")
    np.testing.assert_allclose(poses.joint("r_wrist"), walk.joint("r_wrist"), atol=1e-4)
    with refused("wrong-axes"):
        read_truth(tmp_path / "l_wrist.trc")
    with refused("nothing-usable"):
        read_truth(tmp_path / "r_knee.trc", up="z")


def test_a_file_of_several_clips_is_refused(walk, tmp_path):
    arrays = {
        "joints": walk.world,
        "joint_names": H36M17.joints,
        "fps": 30.0,
        "clip_start": [0, 60, len(walk)],
    }
    np.savez(tmp_path / "x.npz", **arrays)
    with refused("wrong-content", "several clips"):
        read_truth(tmp_path / "x.npz")


def test_other_files_are_to_be_run_first(tmp_path):
    (tmp_path / "x.bvh").write_text(bvh(np.zeros((40, 16, 3))))
    with refused("format-unknown", "run --poses"):
        read_truth(tmp_path / "x.bvh")


LEGS = ["r_hip", "r_knee", "r_ankle", "l_hip", "l_knee", "l_ankle"]


@pytest.mark.parametrize("pattern", ["{}JC", "{}_JC"])
def test_a_lower_limb_laboratorys_joint_centres_are_read_and_the_rest_is_missing(walk, tmp_path, pattern):
    short = {"hip": "H", "knee": "K", "ankle": "A"}
    names = [pattern.format(name[0].upper() + short[name[2:]]) for name in LEGS]
    points = 1000 * y_up(walk.world[:, H36M17.indices(LEGS)])
    points[5, 2] = np.nan
    marked = np.concatenate([points[:, :1], points], axis=1)
    trc(tmp_path / "x.trc", ["LASI", *names], marked, units="mm")
    poses = read_truth(tmp_path / "x.trc")
    there = np.isfinite(poses.joints).all(axis=(0, 2))
    known = {joint for joint, there in zip(H36M17.joints, there, strict=True) if there}
    assert known == {"pelvis", *LEGS} - {"r_ankle"}
    assert np.flatnonzero(np.isnan(poses.joint("r_ankle")).any(axis=1)).tolist() == [5]
    np.testing.assert_allclose(poses.joint("r_knee")[:, 2], walk.joint("r_knee")[:, 2], atol=1e-4)


def test_half_a_leg_is_too_little(walk, tmp_path):
    points = 1000 * y_up(walk.world[:, H36M17.indices(LEGS[:-1])])
    trc(tmp_path / "x.trc", LEGS[:-1], points, units="mm")
    with refused("wrong-content"):
        read_truth(tmp_path / "x.trc")


@pytest.mark.data("real")
def test_the_real_takes_truth_of_twelve_joints_is_read(data):
    poses = read_truth(data / "real/pose2sim/truth.npz")
    assert np.isfinite(poses.joint("r_wrist")).all()
    assert np.isnan(poses.joint("thorax")).all()
