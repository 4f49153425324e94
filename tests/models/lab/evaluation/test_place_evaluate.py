"""How paths are judged: errors along and across the ray, coverage and speed are counted by hand."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation.place import figures, judge
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.place.path import PelvisPath
from pcnet3d.pipeline.reading.mocap.clip import Clip


@pytest.fixture(scope="module")
def seen():
    return see(Clip("09_01", "09", "asfamc", 30.0, walker(seconds=6).world.astype(np.float32)), 0)


def path_of(seen, factor, sd):
    root = factor * seen.joints_camera[:, 0]
    frames = len(root)
    return PelvisPath(root, np.tile(sd**2 * np.eye(3), (frames, 1, 1)), 0.0, np.ones(frames))


def test_the_truth_has_no_error_and_its_speed(seen):
    row = figures([judge(path_of(seen, 1.0, 0.1), seen)])
    assert row["path"].mean == pytest.approx(0, abs=1e-9)
    assert (row["inside_along"], row["inside_across"], row["walks"]) == (1, 1, 1)
    assert row["speed_mps"] == pytest.approx(0, abs=1e-9)


def test_a_path_ten_per_cent_too_far_is_wrong_along_the_ray(seen):
    distance = np.linalg.norm(seen.joints_camera[:, 0], axis=1)
    row = figures([judge(path_of(seen, 1.1, 1e-6), seen), None])
    assert row["along"].mean == pytest.approx(0.1 * np.sqrt((distance**2).mean()))
    assert row["across"].mean == pytest.approx(0, abs=1e-9)
    assert row["path"].mean > row["still"].mean
    assert row["inside_along"] == 0
    assert row["speed_percent"].mean == pytest.approx(10, abs=1e-6)
    assert row["not placed"] == 1
