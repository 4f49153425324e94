"""The built-in walker, with its measures."""

import numpy as np
import pytest

from golden.walks import measured
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=12)


@pytest.fixture(scope="module")
def take(walk):
    return measured(walk.poses)


@pytest.fixture
def without(walk):
    """without(joint, rows): the walker's poses with that joint missing there."""

    def make(joint, rows):
        joints = walk.poses.joints.copy()
        joints[rows, H36M17.index(joint)] = np.nan
        return walk.poses.with_(joints=joints)

    return make
