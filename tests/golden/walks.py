"""Takes of the built-in walker, with their measures."""

import numpy as np

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.pipeline import Pipeline, Take, Told
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

STAGES = (Rectify(), Trajectories(), Angles(), Measures(("r_elbow_flexion",)))
GEOMETRIC = (Rectify("geometric"), Trajectories(), Angles(), Measures())
JUDGED = MadeBy("estimated", shipped_noise().lifter)  # as the stage `lift` says


def measured(poses, stages=STAGES, **told):
    return Pipeline(stages)(Take("walker", poses=poses, told=Told(**told)))


def columns_with(take, **changes):
    return {**take.kinematics, **changes}


def seen_from(walk, heading_deg, flat=1.0):
    """The walker in CAMERA axes, metres, as the built-in lifter's, depth made `flat` of what it is."""
    camera = aimed(walk.root.mean(axis=0), 6.0, heading_deg, 0.0, 0.0)
    poses = camera_poses(walk, camera)
    return poses.with_(
        joints=poses.joints * np.array([1.0, 1.0, flat], np.float32), root=None, made_by=JUDGED
    )
