"""Inertial sensors strapped to the walker: what they would have measured, with their faults known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcnet3d.adapters.imu_csv import GRAVITY_MPS2, Imu, point_on
from pcnet3d.examples.walker.skeleton import UP
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.rotations import from_columns, rotate, transpose, unit

_SPINE = ("pelvis", "thorax")
_BONES = {"upper_arm": ("shoulder", "elbow"), "forearm": ("elbow", "wrist"), "thigh": ("hip", "knee")}


@dataclass(frozen=True)
class Faults:
    """Of one sensor, as a good strapped-down one has them after its own filter.

    noise_mps2: standard deviation of each sample's white noise. bias_mps2: in the sensor's axes. lag_s: by how much
    its stamps are late. clock: its seconds per second. heading_deg: of its world against the walker's. lean_deg: of
    its idea of up. mounting_deg: turns about x, y and z from the segment's axes to the sensor's.
    """

    noise_mps2: float = 0.05
    bias_mps2: tuple[float, float, float] = (0.08, -0.05, 0.1)
    lag_s: float = 0.137
    clock: float = 1.0
    heading_deg: float = 70.0
    lean_deg: float = 1.0
    mounting_deg: tuple[float, float, float] = (30.0, -50.0, 110.0)


STILL = Faults(
    noise_mps2=0.0, bias_mps2=(0.0, 0.0, 0.0), lag_s=0.0, heading_deg=0.0, lean_deg=0.0
)  # no fault


def strapped(
    walk: Walk, segment: str, faults: Faults | None = None, rate_hz: float = 100.0, seed: int = 0
) -> Imu:
    """The sensor on that segment (adapters.imu_csv.SEGMENTS) of a walker who moves as `walk` and turns as usual."""
    from scipy.spatial.transform import Rotation

    faults = faults or Faults()
    rng = np.random.default_rng(seed)
    seconds, heading_deg = len(walk) / walk.fps, float(walk.heading_deg[-1])
    fine = walker(rate_hz, seconds, walk.speed_mps, walk.stature_m, heading_deg)
    acceleration = point_on(segment, fine.acceleration_mps2)
    mounting = Rotation.from_euler("xyz", faults.mounting_deg, degrees=True).as_matrix()
    R_world_from_sensor = segment_axes(fine, segment) @ mounting
    force = rotate(transpose(R_world_from_sensor), (acceleration + GRAVITY_MPS2 * UP)[:, None])[:, 0]
    force += np.array(faults.bias_mps2) + faults.noise_mps2 * rng.standard_normal(force.shape)
    turns = [faults.heading_deg, faults.lean_deg]
    R_imu_world_from_world = Rotation.from_euler("zx", turns, degrees=True).as_matrix()
    time_s = fine.time_s * faults.clock + faults.lag_s
    return Imu(time_s, force, R_imu_world_from_world @ R_world_from_sensor)


def segment_axes(walk: Walk, segment: str) -> np.ndarray:
    """R_world_from_segment (T, 3, 3): z from the segment's end to its start, y across the walking direction."""
    side, _, name = segment.partition("_")
    start, end = _SPINE[::-1]
    if name in _BONES:
        start, end = (f"{side}_{joint}" for joint in _BONES[name])
    elif name:
        start, end = f"{side}_knee", f"{side}_ankle"
    along = unit(walk.joint(start) - walk.joint(end))
    hips = walk.world[:, H36M17.index("l_hip")] - walk.world[:, H36M17.index("r_hip")]
    across = unit(hips - (hips * along).sum(-1, keepdims=True) * along)
    return from_columns(np.cross(across, along), across, along)
