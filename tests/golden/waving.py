"""A person who waves, as a take to export."""

import numpy as np

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.notices import own_notice
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

ROWS, FPS = 60, 30.0


def made(facing_camera, unit: str = "m", time_s: np.ndarray | None = None, walks: bool = False) -> Take:
    """A person who waves the right hand; the left wrist is missing in rows 20 to 24."""
    time_s = np.arange(ROWS) / FPS + 0.4 if time_s is None else time_s
    joints = np.tile(facing_camera, (len(time_s), 1, 1))
    joints[:, H36M17.index("r_wrist"), 0] += 0.1 * np.sin(2 * np.pi * time_s)
    joints[20:25, H36M17.index("l_wrist")] = np.nan
    frame = CAMERA.with_(unit=unit)
    if walks:
        joints[..., 2] += 6 - 1.3 * time_s[:, None]
        frame = frame.with_(origin="camera")
    index = np.arange(len(time_s)) + 12
    poses = PoseSequence(joints, H36M17, frame, time_s=time_s, frame_index=index, person="Ann")
    poses = poses.noted("read", adapter="arrays")
    inputs = ({"role": "poses", "file": "a,\nb.npy", "sha256": "0" * 64, "adapter": "arrays"},)
    take = Take("waving", poses=poses, inputs=inputs, notices=(own_notice("test.said", "careful, please"),))
    take = Angles()(Trajectories()(Rectify("geometric")(take)))
    bend = 20 + 10 * np.sin(time_s)
    bend[3] = np.nan
    angles = {
        "r_knee_flexion_deg": bend,
        "r_knee_flexion_sd_deg": 0 * bend + 4,
        "l_hip_abduction_deg": bend / 2,
    }
    return take.with_(kinematics={**take.kinematics, **angles})


def exported(take: Take, folder, *also: str):
    Export(folder, also=also)(take)
    return folder


WALK = {
    "walking": {
        "right": {"landings_s": [0.5, 1.5], "toe_offs_s": [1.1]},
        "left": {"landings_s": [1.0], "toe_offs_s": [62.5]},
    },
}
