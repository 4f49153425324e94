"""Placing: the pelvis's path before the camera, from 2D keypoints, the lifted body and the focal length."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import ClassVar

import numpy as np

from ..models.angle_error.joint_noise import made_by_the_built_in
from ..models.angle_error.posture import folding
from ..models.gravity.view import known_camera
from ..models.place.path import (
    FEWEST_FRAMES,
    FOLDING_SD,
    POSTURE_SD,
    SCALE_SD,
    UNUSUAL,
    PelvisPath,
    pelvis_path,
)
from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.camera import Camera
from ..pipeline.core.errors import InputError
from ..pipeline.core.measures import half_bar
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence, RootPath, moved_covariance
from ..pipeline.core.rotations import is_finite
from ..pipeline.core.take import Take, Told


@dataclass(frozen=True)
class Place:
    """The stage. With a moving camera it places nobody."""

    name: ClassVar[str] = "place"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    reads: ClassVar[tuple[str, ...]] = ("camera", "focal_px", "image_size")

    def unit_of(self, before: str, told: Told) -> str:
        """Places are in the unit of the body."""
        return before

    def __call__(self, take: Take) -> Take:
        poses, keypoints = take.need("poses"), take.keypoints
        if keypoints is None and take.video is None and (take.told.focal_px or take.told.image_size):
            raise InputError(
                "option-conflict",
                "A focal length and an image size are for keypoints or a video, and this run has neither; leave "
                "--focal and read.image_size out.",
            )
        if poses.root is not None:
            return take
        camera, size = take.camera, take.image_size
        if camera is None and size is not None:
            camera = known_camera(size, take.told.focal_px, None)
        if reason := _why_not(poses, keypoints, take.moving, camera):
            return take.saying(notice("not-placed", reason=reason))
        assert keypoints is not None  # or there is a reason
        assert camera is not None
        path = pelvis_path(poses, keypoints, camera)
        if path is None or not is_finite(path.root).any():
            return take.saying(notice("not-placed", reason="too few joints were seen"))
        focal_sd = round(path.focal_sd, 3)
        growth = path.growth[:, None, None]
        placed = poses.with_(
            joints=poses.joints / growth,
            covariance=moved_covariance(poses.covariance, np.eye(3) / growth),
            path=RootPath(path.root, path.covariance, (SCALE_SD, focal_sd)),
        ).noted(
            "place",
            focal_px=round(camera.focal_px, 1),
            focal_source=camera.focal_source,
            focal_sd=focal_sd,
            scale_sd=SCALE_SD,
            frames_placed=int(is_finite(path.root).sum()),
        )
        visible = np.asarray(is_finite(poses.without_feet.joints).any(axis=-1))
        return take.with_(poses=placed, camera=camera).saying(
            _said(path, camera, placed, visible, take.told.stature_m)
        )


def _why_not(
    poses: PoseSequence, keypoints: PoseSequence | None, moving: bool, camera: Camera | None
) -> str | None:
    """Why the person cannot be placed, in words, first what no option mends; None where nothing is in the way."""
    if poses.frame.family != "camera":
        return "the poses are not in a camera's axes"
    if moving:
        return "the camera moves, and its motion is not known"
    if len(poses) < FEWEST_FRAMES:
        return f"a path needs {FEWEST_FRAMES} frames, got {len(poses)}"
    if keypoints is None:
        return "there are no 2D keypoints (--keypoints)"
    if camera is None:
        return "the image's size is not known (--set read.image_size=WIDTHxHEIGHT)"
    return None


def _said(
    path: PelvisPath, camera: Camera, poses: PoseSequence, visible: np.ndarray, stature_m: float | None
) -> Notice:
    """poses: placed. visible: (T,) whether a frame has any joint; the path bridges others. stature_m: told, by which
    the stage `scale` makes metres of lengths later."""
    located = is_finite(path.root)
    own_sd = float(np.median(np.sqrt(np.linalg.eigvalsh(path.own[located])[:, -1])))
    posture = POSTURE_SD * float(np.median(np.linalg.norm(path.root[located], axis=1)))
    body = poses.without_feet.joints
    squares = folding(body) ** 2 @ np.square(FOLDING_SD)
    folded = implied_stature(body) * float(np.sqrt(np.quantile(squares, UNUSUAL)))
    metres = 1.0 if stature_m is None else stature_m / implied_stature(poses.joints)
    depth = half_bar(100 * path.focal_sd)
    return notice(
        "placed",
        placed=int((located & visible).sum()),
        frames=len(visible),
        within=half_bar(metres * hypot(own_sd, posture, folded)),
        unit="m" if poses.frame.unit == "m" or stature_m is not None else "units",
        size_percent=half_bar(100 * SCALE_SD),
        depth=f"is within {depth:g} % because of the focal length" if depth < 100 else "is not known",
        guess="; the focal length is a guess" if camera.focal_source == "prior" else "",
        unjudged="" if made_by_the_built_in(poses) else "; these errors were not measured for these poses",
    )
