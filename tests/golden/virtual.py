"""Clips of the walker, and takes of virtual cameras whose lift is the truth."""

import numpy as np

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation.testbed import LiftedTake, see
from pcnet3d.pipeline import CAMERA
from pcnet3d.pipeline.reading.mocap.clip import Clip


def walked(name="03_01", **how):
    """The walker as motion capture; how: as examples/walker/walk.py has it."""
    walk = walker(**how)
    return Clip(name, name.partition("_")[0], "asfamc", walk.fps, walk.world.astype(np.float32))


def exact(clip, scale=0.7, error=0.0, **changes):
    """A clip before a camera, and a "lift" that is the truth at another scale, with a known error."""
    seen = see(clip, 0)
    frame = CAMERA.with_(unit="arbitrary", origin="pelvis")
    return LiftedTake(seen.keypoints.with_(joints=seen.truth * scale + error, frame=frame, **changes), seen)
