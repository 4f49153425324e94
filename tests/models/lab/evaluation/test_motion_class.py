"""Motion classes: the walker does what it says, known poses fall where the formulas put them."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation.lifter import CLASSES, motion_classes
from pcnet3d.pipeline import H36M17

FPS = 30.0


@pytest.fixture
def standing(standing):
    """(60, 17, 3) an upright person who stands still, +Z up."""
    return np.tile(standing, (60, 1, 1))


def of(joints, fps=FPS):
    """The classes that all frames belong to; every other has none."""
    classes = motion_classes(joints, fps)
    assert tuple(classes) == CLASSES
    assert all(mask.shape == (len(joints),) and mask.all() == mask.any() for mask in classes.values())
    return {name for name, mask in classes.items() if mask.all()}


def moving(joints, speed, fps=FPS):
    return joints + np.arange(len(joints))[:, None, None] / fps * np.array([speed, 0, 0])


@pytest.mark.parametrize("fps", [30.0, 120.0])
@pytest.mark.parametrize(
    ("speed", "name"),
    [(0.0, set()), (0.35, set()), (1.2, {"walking"}), (1.9, {"walking"}), (2.1, set())],
)
def test_speed_over_the_floor(standing, speed, name, fps):
    assert of(moving(standing, speed, fps), fps) == name


def low_with_feet(standing, ahead_m):
    """Thighs forward and level, the feet 0.4 m under the hips and so far ahead of them."""
    pose = standing.copy()
    ahead = np.sign(standing[0, H36M17.index("nose"), 0] - standing[0, H36M17.index("head"), 0]) * np.array(
        [1, 0, 0]
    )
    for side in "lr":
        hip = pose[:, H36M17.index(f"{side}_hip")]
        pose[:, H36M17.index(f"{side}_knee")] = hip + 0.42 * ahead
        pose[:, H36M17.index(f"{side}_ankle")] = hip + ahead_m * ahead - np.array([0, 0, 0.4])
    return pose


def test_whose_weight_is_behind_the_feet_sits(standing):
    assert of(low_with_feet(standing, 0.35)) == {"sitting"}
    assert of(low_with_feet(standing, 0.02)) == {"squatting"}


def test_the_walker_walks_and_squats():
    walk = walker(seconds=16, turn_deg=0)
    classes = motion_classes(walk.world, walk.fps)
    assert classes["walking"][walk.time_s < walk.phases_s["walk"][1] - 1.5].all()
    assert classes["squatting"][walk.angles_deg["l_knee_flexion_deg"] > 90].all()
    assert not classes["squatting"][~walk.during("squat")].any()
    assert not classes["sitting"].any()
