"""Takes of the built-in walker, with their measures."""

import numpy as np

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.pipeline import H36M17, IMAGE, Pipeline, PoseSequence, Take, Told
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

SIZE, FOCAL_PX = (1280, 720), 900.0
STAGES = (Rectify(), Trajectories(), Angles(), Measures(("r_elbow_flexion",)))
GEOMETRIC = (Rectify("geometric"), Trajectories(), Angles(), Measures())
JUDGED = MadeBy("estimated", shipped_noise().lifter)  # as the stage `lift` says


def measured(poses, stages=STAGES, **told):
    return Pipeline(stages)(Take("walker", poses=poses, told=Told(**told)))


def remeasured(take, **columns) -> dict:
    """The measures of the take with other values in these columns."""
    return nested(STAGES[3](take.with_(kinematics={**take.kinematics, **columns})).measures)


def filmed(walk, camera, noise_px=0.0, focal_share=0.02) -> Take:
    """The walker's body before a camera whose focal length is told, give or take that share, and keypoints with so much
    noise."""
    body, points = camera_poses(walk, camera), camera.points(walk.world)
    pixels = FOCAL_PX * points[..., :2] / points[..., 2:] + np.array(SIZE) / 2
    pixels = pixels + np.random.default_rng(0).normal(0, noise_px, pixels.shape)
    keypoints = PoseSequence(pixels, H36M17, IMAGE, time_s=body.time_s, frame_index=body.frame_index)
    lens = Camera(SIZE, FOCAL_PX, focal_share * FOCAL_PX, "told")
    return Take("walk", poses=body, keypoints=keypoints, camera=lens)


def unsure(take: Take, joint: str, rows: slice, score: float = 0.4, detector: str = "movenet@0") -> Take:
    """The detector gives 0.8 to all joints but to this one in these rows."""
    confidence = np.full(take.keypoints.joints.shape[:2], 0.8)
    confidence[rows, H36M17.index(joint)] = score
    made_by = MadeBy("estimated", detector)
    return take.with_(keypoints=take.keypoints.with_(confidence=confidence, made_by=made_by))


def seen_from(walk, heading_deg, flat=1.0):
    """The walker in CAMERA axes, metres, as the built-in lifter's, depth made `flat` of what it is."""
    camera = aimed(walk.root.mean(axis=0), 6.0, heading_deg, 0.0, 0.0)
    poses = camera_poses(walk, camera)
    return poses.with_(
        joints=poses.joints * np.array([1.0, 1.0, flat], np.float32), path=None, made_by=JUDGED
    )
