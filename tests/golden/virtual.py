"""Clips of the walker, and takes of virtual cameras whose lift is the truth."""

import numpy as np

from golden.lifts import lift
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.beds import LiftedTake, see
from pcnet3d.models.lab.clips import Clip
from pcnet3d.pipeline import CAMERA, Take
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.stages.scale import scale


def walked(name="03_01", **how):
    """The walker as motion capture; how: as examples/walker/walk.py has it."""
    walk = walker(**how)
    return Clip(name, name.partition("_")[0], "asfamc", walk.fps, walk.world.astype(np.float32))


def lifted(clip, seen, made_by=None):
    """What a run is given of a clip, as `see` has it, that the built-in lifter lifts, in metres."""
    camera = Camera(seen.image_size, seen.focal_px, 0.02 * seen.focal_px, "told")
    poses = scale(lift(seen.keypoints, seen.image_size, seen.focal_px), implied_stature(clip.joints))[0]
    poses = poses if made_by is None else poses.with_(made_by=made_by)
    return Take(clip.name, keypoints=seen.keypoints, camera=camera, poses=poses)


def exact(clip, scale=0.7, error=0.0, **changes):
    """A clip before a camera, and a "lift" that is the truth at another scale, with a known error."""
    seen = see(clip, 0)
    frame = CAMERA.with_(unit="arbitrary", origin="pelvis")
    return LiftedTake(seen.keypoints.with_(joints=seen.truth * scale + error, frame=frame, **changes), seen)
