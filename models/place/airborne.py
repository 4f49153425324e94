"""Flights of a take: by the pelvis path where it was measured, else by keypoints and the lifted body before a camera
that stands still."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.camera import Camera
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.path import RootPath
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import on_lines
from ...pipeline.signals.reprojection import FEWEST, JOINTS, keypoint_rays
from .flights import (
    LIFTED,
    MEASURED,
    NEEDED,
    Flight,
    Rule,
    cut,
    flights,
)

BUILT_IN = "pcnet3d"  # lifter
_FEWEST = 10  # frames
_LEVEL = 0.5  # least share of the view that is horizontal: steeper, heights are depths
_NEAREST = 0.1  # statures before the camera
_ROBUST = 0.03  # statures off the usual height at which a joint's say is halved
_ROUNDS = 5  # of weighing joints


@dataclass(frozen=True, eq=False)
class Airborne:
    """A take's flights, in order. observable: (T,) in which frames the body and its place are known well enough for
    one; None where flights are not looked for at all. cut: whether an end of the take or a gap cuts one. lifted: that
    they are of lifted poses, whose errors are larger; judged: by the built-in lifter, of which these are known.
    shake: statures, by how much a camera that shakes moves the person in the image; NaN where it may go elsewhere.
    ankle: (T,) statures, how high the lower ankle is in each frame by itself; None where that is not known."""

    flights: tuple[Flight, ...] = ()
    observable: np.ndarray | None = None
    cut: bool = False
    lifted: bool = False
    judged: bool = False
    shake: float = 0.0
    ankle: np.ndarray | None = None


def airborne(take: Take) -> Airborne:
    """The flights of a rectified take. InputError without poses, or where nothing has rectified them."""
    poses, rectified, level = take.need("poses"), take.need("rectified"), take.need("rectified").level
    if level.root is None or not rectified.level_ok:
        return Airborne()
    body = is_finite(level.joints[:, level.layout.indices(NEEDED)]).all(axis=1)
    if (body & is_finite(level.root)).sum() < _FEWEST:
        return Airborne()
    if level.measured_root is not None:
        return _airborne(level, MEASURED)
    if take.keypoints is None or take.camera is None or rectified.in_world:
        return Airborne()
    rays, trust = keypoint_rays(poses, take.keypoints, take.camera)
    height = own_height(level, rectified, rays, trust)
    if height is None:
        return Airborne()
    root = np.column_stack([level.root[:, :2], height])
    level = level.with_(joints=bridged(level.joints, level.times), path=RootPath(root))
    flown = _airborne(level, LIFTED, _stature_m(level))
    judged = poses.made_by.in_run and poses.made_by.by.partition("@")[0] == BUILT_IN
    return replace(flown, lifted=True, judged=judged, shake=_shake(take, take.camera, poses))


def _shake(take: Take, camera: Camera, poses: PoseSequence) -> float:
    """As Airborne has it. poses: in CAMERA axes, placed."""
    if take.stands or poses.root is None:
        return 0.0 if take.stands else np.nan
    shakes = camera.background is not None and camera.background.kind == "hand-held" and not take.told.moving
    distance = float(np.nanmedian(np.linalg.norm(poses.root, axis=1))) / implied_stature(poses.joints)
    return camera.shake_rad * distance if shakes else np.nan


def _airborne(level: PoseSequence, rule: Rule, stature_m: float | None = None) -> Airborne:
    """By a path (T, 3) of which each frame has its own height."""
    assert level.root is not None
    joints = level.joints[:, level.layout.indices(NEEDED)]
    observable = is_finite(joints).all(axis=1) & is_finite(level.root)
    ankles = level.joints[:, level.layout.indices(("r_ankle", "l_ankle")), 2].min(axis=1)
    ankle = (ankles + level.root[:, 2]) / implied_stature(level.joints)
    return Airborne(tuple(flights(level, rule, stature_m)), observable, cut(level, rule), ankle=ankle)


def _stature_m(level: PoseSequence) -> float | None:
    return implied_stature(level.joints) if level.frame.unit == "m" else None


def bridged(joints: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Joints (T, 17, 3) relative to the pelvis; those that hardly weigh on the centre of mass are on a line where they
    were not seen. Ankles, whose floor counts, stay missing."""
    filled = joints.copy()
    for name in NEEDED:
        if not name.endswith("ankle"):
            joint = H36M17.index(name)
            filled[:, joint] = on_lines(filled[:, joint], time_s)
    return filled


def own_height(
    level: PoseSequence, rectified: Rectified, rays: np.ndarray, trust: np.ndarray
) -> np.ndarray | None:
    """(T,) the height of the pelvis over the camera in each frame by itself, in LEVEL; NaN where too few joints tell.
    None where the camera looks down or up steeply.

    level: lifted, with the smooth path of `pelvis_path`, whose horizontal distance from the camera is kept; a fall is
    no longer in its height. rays (T, 17, 2), trust (T, 17): of keypoint_rays. At that distance each joint's ray says
    how high the body is; joints are weighed by how far they are off their usual answer (Cauchy).
    """
    assert level.root is not None
    R = rectified.R_source_from_level
    ahead = R[2, :2]  # the camera's z axis over the floor
    if R.ndim != 2 or np.linalg.norm(ahead) < _LEVEL:
        return None
    ahead = ahead / np.linalg.norm(ahead)
    stature = implied_stature(level.joints)
    use = H36M17.indices(JOINTS)
    height = np.empty(len(level))
    for rows in blocks(len(level)):
        body, lines = (each[rows, use].astype(np.float64) for each in (level.joints, rays))
        height[rows] = _height(body, lines, trust[rows, use], level.root[rows], R, ahead, stature)
    return height


def _height(
    body: np.ndarray,
    lines: np.ndarray,
    trust: np.ndarray,
    root: np.ndarray,
    R: np.ndarray,
    ahead: np.ndarray,
    stature: float,
) -> np.ndarray:
    """As `own_height`, (T,), of the joints (T, J, 3), rays (T, J, 2) and trust (T, J) that tell it."""
    lines = rotate(transpose(R), np.concatenate([lines, np.ones((*lines.shape[:2], 1))], axis=-1))
    distance = (body[..., :2] + root[:, None, :2]) @ ahead
    reach = lines[..., :2] @ ahead
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = lines[..., 2] / reach * distance - body[..., 2]
    usable = np.isfinite(heights) & (reach > 0) & (distance > _NEAREST * stature) & (trust > 0)
    enough = usable.sum(axis=1) >= FEWEST
    heights, trust = np.where(usable, heights, np.nan), np.where(usable, trust, 0.0)
    height = np.full(len(heights), np.nan)
    height[enough] = np.nanmedian(heights[enough], axis=1)
    for _ in range(_ROUNDS):
        off = np.where(usable, heights - height[:, None], 0.0)
        weights = trust / (1 + (off / (_ROBUST * stature)) ** 2)
        height[enough] += (weights * off).sum(axis=1)[enough] / weights.sum(axis=1)[enough]
    return height
