"""The lifter's report: known errors in their direction, motions where the formulas put them."""

import numpy as np
import pytest

from golden.virtual import exact, walked
from pcnet3d.models.lab.beds import LiftedTake
from pcnet3d.models.lab.evaluation.lifter import groups_of, lift_errors, motion_classes, summary
from pcnet3d.models.lifter.features import body_rays
from pcnet3d.pipeline import H36M17

FPS = 30.0


@pytest.fixture
def standing(standing):
    """(60, 17, 3) an upright person who stands still, +Z up."""
    return np.tile(standing, (60, 1, 1))


def of(joints, fps=FPS):
    """The classes that all frames belong to; every other has none."""
    classes = motion_classes(joints, fps)
    assert all(mask.shape == (len(joints),) and mask.all() == mask.any() for mask in classes.values())
    return {name for name, mask in classes.items() if mask.all()}


@pytest.mark.parametrize(("speed", "name"), [(0.35, set()), (1.2, {"walking"}), (2.1, set())])
def test_speed_over_the_floor(standing, speed, name):
    for fps in (30.0, 120.0):
        assert of(standing + np.arange(60)[:, None, None] / fps * np.array([speed, 0, 0]), fps) == name


@pytest.mark.parametrize(("ahead_m", "name"), [(0.35, "sitting"), (0.02, "squatting")])
def test_whose_weight_is_behind_the_feet_sits(standing, ahead_m, name):
    """Thighs forward and level, the feet 0.4 m under the hips and so far ahead of them; the person faces -x."""
    for side in "lr":
        hip = standing[:, H36M17.index(f"{side}_hip")]
        standing[:, H36M17.index(f"{side}_knee")] = hip - [0.42, 0, 0]
        standing[:, H36M17.index(f"{side}_ankle")] = hip - [ahead_m, 0, 0.4]
    assert of(standing) == {name}


def figures_of(take, group):
    return summary([lift_errors(take).where(groups_of(take.seen)[group])])


@pytest.mark.parametrize(("column", "name", "other"), [(2, "depth", "lateral"), (0, "lateral", "depth")])
def test_a_lift_is_as_wrong_as_it_was_made_in_its_direction_and_motion(column, name, other):
    take = exact(walked(seconds=3))
    assert all(figure.p95 < 1e-2 for figure in figures_of(take, "upright")["frame"].values())
    walking = motion_classes(take.seen.world, FPS)["walking"]
    error = np.zeros(take.seen.truth.shape)
    error[:, H36M17.index("l_wrist")] = 0.017 * body_rays(take.seen.joints_camera)[..., column]
    error[~walking] += 1.0
    wrong = take.lifted.with_(joints=take.seen.truth + error)
    of_walking = figures_of(LiftedTake(wrong, take.seen), "walking")
    assert of_walking["counts"]["frames"] == walking.sum() < len(walking)
    assert of_walking["frame"][name].mean == pytest.approx(1.0, abs=0.2)  # 17 mm at one of 17 joints
    assert of_walking["frame"][other].mean < 0.4
