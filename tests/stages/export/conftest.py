"""The walker's own joints, its feet too, as a take that can be exported: every joint is where it was made to be."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from golden import bodies, waving
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import Z_UP, Pipeline, PoseSequence, Take
from pcnet3d.pipeline.core.conversions import body_in, remap
from pcnet3d.pipeline.core.layouts import HALPE26
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories


@pytest.fixture(scope="session")
def walk() -> Walk:
    return walker(seconds=4)


@pytest.fixture(scope="session")
def walked(walk) -> Callable[..., Take]:
    """walked(feet=False, **changes): the take, neither scaled nor smoothed; changes of its poses."""

    @cache
    def made(feet: bool) -> Take:
        return make(feet)

    def make(feet: bool, **changes) -> Take:
        poses = walk.poses
        if feet:
            points = PoseSequence(
                halpe26(walk), HALPE26, Z_UP, time_s=poses.time_s, frame_index=poses.frame_index
            )
            poses = remap(points, body_in(points))
        stages = Rectify("geometric"), Trajectories()
        take = Pipeline(stages)(Take("walker", poses=poses.with_(**changes)))
        return take.with_(filtered=take.need("rectified").level)

    return lambda feet=False, **changes: make(feet, **changes) if changes else made(feet)


@pytest.fixture(scope="session")
def gappy(walked, walk) -> Take:
    """The walker, of whom nothing is seen in rows 0 to 3 and 60 to 69, and no left wrist in rows 20 to 24."""
    take = walked()
    joints = np.array(take.filtered.joints)
    joints[:4] = joints[60:70] = np.nan
    joints[20:25, take.filtered.layout.index("l_wrist")] = np.nan
    return take.with_(filtered=take.filtered.with_(joints=joints))


@pytest.fixture(scope="session")
def take() -> Take:
    """A person who waves."""
    return waving.made(bodies.facing_camera())


@pytest.fixture(scope="session")
def walks() -> Take:
    """The same, walking towards the camera, whose place before it is known."""
    return waving.made(bodies.facing_camera(), walks=True)
