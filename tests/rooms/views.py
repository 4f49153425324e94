"""Pinhole images of textured plane patches, painted from far to near; world axes in metres, +Z up."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pcnet3d.pipeline.core.camera import view_rotation

from .textures import texture

NEAR = 0.12  # metres; what is nearer to the camera is clipped
MARGIN = 0.05  # of the longer side: painted beyond the border, for a lens that sees more than a pinhole
FINE = 2  # colours are painted at so many times the resolution, then averaged: edges are smooth
SUBPIXEL = 4  # bits


@dataclass(frozen=True, eq=False)
class View:
    """A camera: R_camera_from_world (3, 3), position (3,), focal length, size (width, height), principal point."""

    R_camera_from_world: np.ndarray
    position: np.ndarray
    focal_px: float
    size: tuple[int, int]
    centre: np.ndarray

    @property
    def up(self) -> np.ndarray:
        """(3,) the direction against gravity in camera axes (x right, y down, z away)."""
        return self.R_camera_from_world[:, 2]

    @property
    def heading(self) -> np.ndarray:
        """(3,) level direction of the view, world."""
        away = self.R_camera_from_world[2] * [1, 1, 0]
        return away / np.linalg.norm(away)

    @property
    def margin(self) -> int:
        """Pixels that a canvas shows beyond each border."""
        return int(np.ceil(MARGIN * max(self.size)))

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) world -> camera."""
        return (points - self.position) @ self.R_camera_from_world.T

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) world, in front of the camera -> (n, 2) pixels."""
        return self.pixels(self.to_camera(points))

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) camera -> (n, 2) pixels."""
        return self.focal_px * points[:, :2] / points[:, 2:] + self.centre


def held(rng: np.random.Generator, pitch_deg: float, roll_deg: float) -> View:
    """A camera as people hold or place it, at x = y = 0, looking along a heading drawn at random."""
    longer = int(rng.choice([640, 960, 1280, 1280, 1280, 1600, 1920]))
    size = (longer, int(longer / rng.choice([4 / 3, 3 / 2, 16 / 9])))
    if rng.random() < 0.35:
        size = (size[1], size[0])
    R = view_rotation(np.array(rng.uniform(0, 360)), np.array(pitch_deg), np.array(roll_deg))
    centre = np.array(size) / 2 + rng.uniform(-0.01, 0.01, 2) * longer
    focal_px = rng.uniform(0.65, 1.1) * longer
    return View(R, np.array([0, 0, rng.uniform(0.8, 2.5)]), focal_px, size, centre)


@dataclass(frozen=True, eq=False)
class Plane:
    """Metres along `right` and `up` (unit vectors, world) from `origin`."""

    origin: np.ndarray
    right: np.ndarray
    up: np.ndarray

    def at(self, xy: np.ndarray) -> np.ndarray:
        """(n, 2) metres in the plane -> (n, 3) world."""
        return self.origin + np.asarray(xy) @ np.stack([self.right, self.up])

    def rect(self, x0: float, y0: float, x1: float, y1: float, turn_deg: float = 0.0) -> np.ndarray:
        """(4, 3) corners of a rectangle, turned in the plane about its middle."""
        corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        if turn_deg:
            c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
            middle = corners.mean(axis=0)
            corners = middle + (corners - middle) @ np.array([[c, s], [-s, c]])
        return self.at(corners)


def clip_near(points: np.ndarray) -> np.ndarray:
    """(N, 3) corners in the camera -> corners of the part of the polygon beyond NEAR, possibly none."""
    depth = points[:, 2] - NEAR
    if (depth > 0).all():
        return points
    kept = []
    for i, j in zip(range(len(points)), [*range(1, len(points)), 0], strict=True):
        if depth[i] > 0:
            kept.append(points[i])
        if (depth[i] > 0) != (depth[j] > 0):
            kept.append(points[i] + (points[j] - points[i]) * depth[i] / (depth[i] - depth[j]))
    return np.array(kept).reshape(-1, 3)


class Canvas:
    """What has been painted so far: colours, and a grey gain (128 is one) for textures, light and shadow."""

    def __init__(self, view: View, background=(0, 0, 0)):
        self.view = view
        width, height = (side + 2 * view.margin for side in view.size)
        self.colour = np.empty((FINE * height, FINE * width, 3), np.uint8)
        cv2.rectangle(self.colour, (0, 0), self.colour.shape[1::-1], background, cv2.FILLED)
        self.gain: np.ndarray = np.full((height, width), 128, np.uint8)

    def seen(self, corners: np.ndarray) -> np.ndarray:
        """(n, 3) corners of a convex polygon, world -> (m, 2) canvas pixels; none where it is not in the image."""
        points = clip_near(self.view.to_camera(corners))
        if len(points) < 3:
            return np.zeros((0, 2))
        xy = self.view.pixels(points) + self.view.margin
        outside = (xy.max(axis=0) < 0) | (xy.min(axis=0) > self.gain.shape[::-1])
        return np.zeros((0, 2)) if outside.any() else xy

    def fill(self, corners: np.ndarray, colour) -> None:
        """Paint a convex polygon (n, 3), world, plain."""
        xy = self.seen(corners)
        if len(xy):
            self._colour(xy, colour)
            _fill(self.gain, xy, 128)

    def textured(self, corners: np.ndarray, colour, name: str, along: int = 0) -> None:
        """Paint a parallelogram (4, 3) with a texture that repeats; along: 0 or 1, which edge its x follows."""
        xy = self.seen(corners)
        if not len(xy):
            return
        x0, y0, x1, y1 = _bounds(xy, self.gain.shape)
        if min(x1 - x0, y1 - y0) < 12:  # too small for a texture to show
            return self.fill(corners, colour)
        self._colour(xy, colour)
        levels, metres = texture(name)
        edges = [corners[1] - corners[0], corners[3] - corners[0]]
        edges = edges[:: -1 if along else 1]
        units = [edge / np.linalg.norm(edge) for edge in edges]
        depth = max(self.view.to_camera(corners)[:, 2].mean(), 0.5)
        coarser = np.log2(levels[0].shape[0] / metres * depth / self.view.focal_px)
        level = levels[int(np.clip(round(coarser), 0, len(levels) - 1))]
        # Texture pixel (s, t, 1) -> canvas pixel, homogeneous: K R [right, up, origin - position].
        K = np.array([[self.view.focal_px, 0, 0], [0, self.view.focal_px, 0], [0, 0, 1.0]])
        K[:2, 2] = self.view.centre + self.view.margin
        pixel_m = metres / level.shape[0]
        columns = np.stack([units[0] * pixel_m, units[1] * pixel_m, corners[0] - self.view.position], axis=1)
        move = np.array([[1, 0, -x0], [0, 1, -y0], [0, 0, 1.0]])
        homography = move @ K @ self.view.R_camera_from_world @ columns
        if abs(np.linalg.det(homography)) < 1e-9:  # seen edge on
            return
        patch = cv2.warpPerspective(level, homography, (x1 - x0, y1 - y0), borderMode=cv2.BORDER_WRAP)
        mask = np.zeros(patch.shape, np.uint8)
        _fill(mask, xy - [x0, y0], 255)
        cv2.copyTo(patch, mask, self.gain[y0:y1, x0:x1])

    def shade(self, corners: np.ndarray, factor: float, soft_px: int = 7) -> None:
        """Make a convex polygon (n, 3), world, darker or brighter, with a soft border."""
        xy = self.seen(corners)
        if not len(xy):
            return
        x0, y0, x1, y1 = _bounds(xy, self.gain.shape)
        mask = np.zeros((y1 - y0, x1 - x0), np.float32)
        _fill(mask, xy - [x0, y0], factor - 1)
        part = self.gain[y0:y1, x0:x1]
        part[:] = np.clip(part * (1 + cv2.blur(mask, (soft_px, soft_px))), 0, 255)

    def image(self) -> np.ndarray:
        """(H, W, 3) uint8 RGB with the margin on every side."""
        height, width = self.gain.shape
        colour = cv2.resize(self.colour, (width, height), interpolation=cv2.INTER_AREA)
        return cv2.multiply(colour, cv2.cvtColor(self.gain, cv2.COLOR_GRAY2RGB), scale=1 / 128)

    def _colour(self, xy: np.ndarray, colour) -> None:
        fine = FINE * xy + (FINE - 1) / 2  # canvas pixel i is the average of fine pixels 2 i and 2 i + 1
        _fill(self.colour, fine, tuple(float(value) for value in colour))


def _fill(image: np.ndarray, xy: np.ndarray, value) -> None:
    fixed = np.round(xy * 2**SUBPIXEL).astype(np.int32)
    cv2.fillConvexPoly(image, fixed, value, cv2.LINE_8, SUBPIXEL)


def _bounds(xy: np.ndarray, shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    """x0, y0, x1, y1 of the part of a convex polygon inside an image of that shape, at least one pixel."""
    height, width = shape
    image = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    area, inside = cv2.intersectConvexConvex(cv2.convexHull(xy.astype(np.float32)), image)
    xy = inside.reshape(-1, 2) if area > 0 else xy
    low = np.clip(np.floor(xy.min(axis=0)), 0, np.array(shape[1::-1]) - 1).astype(int)
    high = np.clip(np.ceil(xy.max(axis=0)) + 1, low + 1, shape[1::-1]).astype(int)
    return low[0], low[1], high[0], high[1]
