"""Limbs that are exchanged between poses and keypoints, on the walker with exact keypoints."""

import pytest

from pcnet3d.pipeline import H36M17, Take
from pcnet3d.pipeline.signals.reprojection import residuals_of
from pcnet3d.pipeline.signals.swaps import kinds
from pcnet3d.stages.measures.off_keypoints import exchanged

LEGS, ARMS = kinds(H36M17, depth=False)


def codes(take: Take) -> list[str]:
    return [each.code for each in exchanged(take, residuals_of(take))]


@pytest.mark.parametrize("which", ["poses", "keypoints"])
@pytest.mark.parametrize("way", [LEGS, ARMS], ids=lambda way: way.name)
def test_legs_that_fit_each_others_keypoints_are_said_to_be_exchanged(filmed, which, way):
    """A lift had a walker's legs exchanged, and the page said only that both contradict the keypoints."""
    of = getattr(filmed, which)
    joints = of.joints.copy()
    joints[20:50] = way.applied(joints[20:50])
    assert codes(filmed.with_(**{which: of.with_(joints=joints)})) == ["swapped-to-keypoints"]


def test_legs_that_are_elsewhere_are_not_said_to_be_exchanged(filmed):
    joints = filmed.poses.joints.copy()
    joints[20:50, H36M17.indices(("r_ankle", "l_ankle"))] += [0.4, 0.0, 0.0]
    assert codes(filmed.with_(poses=filmed.poses.with_(joints=joints))) == []
    assert codes(filmed) == []
    assert exchanged(filmed.with_(keypoints=None), None) == []
