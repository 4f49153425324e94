# %% [markdown]
# # From a file of keypoints to acceleration and joint angles
#
# For users of pcnet3d in Python, in a notebook or a script.
#
# A detector's 2D keypoints are read, lifted to 3D, levelled, and turned into the acceleration of the right wrist in
# LEVEL (z is up against gravity, one heading for the take) and the flexion of the right knee, each with the error
# that pcnet3d states for it. The person is the built-in walker, whose motion is known exactly, so every picture has
# the truth beside it.

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, Pipeline, Take, Told
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.lift import Lift
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.scale import Scale
from pcnet3d.stages.trajectories import Trajectories

# %% [markdown]
# ## A file
#
# With your own video this is the file that your detector has written. Here a camera that looks down by 15 degrees and
# is rolled by 5 sees the walker's joints with an error of one pixel; they are written as AlphaPose would. `read`
# recognises the format by its content.

# %%
walk = walker()  # walks, squats, raises both arms
camera = side_camera(walk)
with TemporaryDirectory() as folder:
    file = Path(folder) / "alphapose-results.json"
    write_keypoints(file, walk, camera, np.arange(len(walk)), 1.0, np.random.default_rng(0))
    keypoints = read(file, fps=walk.fps)
print(f"{len(keypoints)} frames at {keypoints.fps:g} per second, {keypoints.joints.shape[1]} keypoints")

# %% [markdown]
# ## The take
#
# The same stages as those of `pcnet3d run`. The stature gives metres; a known focal length helps, but is not needed.

# %%
stages = Pipeline(
    (
        Lift(),
        Scale(),
        Rectify(),
        Trajectories(),
        Angles(),
    )
)
told = Told(image_size=(camera.width, camera.height), focal_px=camera.focal_px, stature_m=walk.stature_m)
take = stages(Take("walker", keypoints=keypoints, told=told))
for notice in take.notices:
    print(f"{notice.weight}: {notice.text}")

# %% [markdown]
# ## Which way is up
#
# The camera is tilted, which the run does not know. It finds one direction of gravity for the take, and its error.

# %%
rectified = take.need("rectified")
up = rectified.R_source_from_level[:, 2]  # in camera axes: x right, y down, z away
off_deg = np.degrees(np.arccos(up @ camera.up))
print(f"up is stated to be off by {rectified.up_error_deg[0]:.1f} degrees, and is off by {off_deg:.1f}")
print(f"camera axes taken for level would be off by {np.degrees(np.arccos(-camera.up[1])):.1f}")

# %% [markdown]
# ## Pictures with error bands
#
# Every column of `kinematics` has its standard deviation beside it. The truth should lie within 1.645 of them in nine
# of ten frames.

# %%
columns, time_s = take.need("kinematics"), take.need("poses").time_s


def chart(title: str, value: np.ndarray, sd: np.ndarray, truth: np.ndarray) -> None:
    """A value (T,), its 90 % band and the truth, over time."""
    figure, axes = plt.subplots(figsize=(8, 2.8), dpi=80)
    axes.fill_between(time_s, value - 1.645 * sd, value + 1.645 * sd, alpha=0.25, label="90 % band")
    axes.plot(time_s, value, label="pcnet3d")
    axes.plot(time_s, truth, "k--", linewidth=1, label="truth")
    axes.set_title(title, loc="left")
    axes.set_xlabel("s")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, frameon=False)
    figure.tight_layout()
    plt.show()
    error = value - truth
    inside = np.abs(error) < 1.645 * sd
    print(
        f"RMSE {np.sqrt(np.nanmean(error**2)):.1f}, {np.mean(inside[np.isfinite(error)]):.0%} inside the band"
    )


# %% [markdown]
# **The right wrist's acceleration upwards**, relative to the pelvis, in LEVEL:

# %%
upwards = walk.acceleration_mps2[..., 2]
wrist, pelvis = (H36M17.index(name) for name in ("r_wrist", "pelvis"))
chart(
    "right wrist, upward acceleration, m/s²",
    columns["r_wrist_az"],
    columns["r_wrist_az_sd"],
    upwards[:, wrist] - upwards[:, pelvis],
)

# %% [markdown]
# **The right knee's flexion**, an angle between segments, the same in any axes:

# %%
chart(
    "right knee flexion, degrees",
    columns["r_knee_flexion_deg"],
    columns["r_knee_flexion_sd_deg"],
    walk.angles_deg["r_knee_flexion_deg"],
)

# %% [markdown]
# What the angles mean and how good they are: [angles.md](angles.md#errors). How paths are smoothed, and what
# accelerations are worth: [movements.md](movements.md#paths-velocities-and-accelerations). The same from the command
# line, with a report: [start.md](start.md).
