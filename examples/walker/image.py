"""Draws the walker on a floor with a grid of metres, as the camera sees them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...pipeline.core.layouts import HALPE26
from ...pipeline.core.rotations import rotate, transpose
from .camera import Camera
from .landmarks import halpe26
from .walk import Walk

_SHARPER = 3  # the floor is drawn this many times larger, then averaged down
_SUBPIXEL_BITS = 4  # of cv2's fixed-point coordinates

# RGB. The person's left and right differ, so a viewer can tell which side is which.
_COLOURS = {"l": (52, 120, 190), "r": (226, 122, 52), "m": (78, 86, 98), "head": (196, 160, 136)}
_OUTLINE_SHADE = 0.72
_FLOOR, _GRID, _DISTANCE = (
    np.array([226, 229, 233.0]),
    np.array([186, 193, 202.0]),
    np.array([245, 247, 249.0]),
)
_SHADOW = 0.72  # brightness of the floor in the shadow
_OUTLINE = 0.006  # statures

# Every part is the hull of discs on landmarks: colour, and radii in statures.
_PARTS: tuple[tuple[str, dict[str, float]], ...] = (
    ("m", {"l_shoulder": 0.038, "r_shoulder": 0.038, "l_hip": 0.052, "r_hip": 0.052}),
    ("head", {"neck": 0.030, "ears": 0.030}),
    ("head", {"ears": 0.058, "nose": 0.016}),
    *(
        (side, {f"{side}_{joint}": radius for joint, radius in discs.items()})
        for side in "lr"
        for discs in (
            {"hip": 0.048, "knee": 0.033},
            {"knee": 0.032, "ankle": 0.021},
            {"ankle": 0.021, "heel": 0.014, "big_toe": 0.010, "small_toe": 0.010},
            {"shoulder": 0.030, "elbow": 0.023},
            {"elbow": 0.022, "wrist": 0.017},
            {"wrist": 0.024},
        )
    ),
)


def images(walk: Walk, camera: Camera, frames: Iterable[int] | None = None) -> Iterator[np.ndarray]:
    """(height, width, 3) uint8 RGB of the take's frames: of these, or of each."""
    floor, places = _floor(camera), halpe26(walk)
    for landmarks in places if frames is None else (places[frame] for frame in frames):
        image = (floor * _shadow(landmarks, walk.stature_m, camera)[..., None]).astype(np.uint8)
        _draw_person(image, landmarks, walk.stature_m, camera)
        yield image


def _floor(camera: Camera) -> np.ndarray:
    """(height, width, 3) the grid of metres, paler with distance."""
    import cv2

    size = np.array([camera.width, camera.height])
    x, y = np.meshgrid(*((np.arange(n * _SHARPER) + 0.5) / _SHARPER for n in size))
    pixels = np.stack([x, y], axis=-1) - size / 2
    rays = np.concatenate([pixels / camera.focal_px, np.ones((*x.shape, 1))], axis=-1)
    rays = rotate(transpose(camera.R_camera_from_world), rays)
    below = rays[..., 2] < -1e-6
    reach = np.where(below, -camera.position[2] / np.where(below, rays[..., 2], 1.0), np.inf)
    ground = camera.position[:2] + np.where(below, reach, 0)[..., None] * rays[..., :2]
    to_line = np.abs(ground - np.round(ground)).min(axis=-1)
    line = np.clip((0.014 - to_line) / 0.008, 0, 1)[..., None]
    fog = np.clip((reach - 5) / 14, 0, 1)[..., None]
    floor = (_FLOOR + line * (_GRID - _FLOOR)) * (1 - fog) + _DISTANCE * fog
    return cv2.resize(floor, (camera.width, camera.height), interpolation=cv2.INTER_AREA)


def _shadow(landmarks: np.ndarray, stature_m: float, camera: Camera) -> np.ndarray:
    """(height, width) brightness: the body's parts straight down on the floor, blurred."""
    import cv2

    mask = np.zeros((camera.height, camera.width), np.uint8)
    for _, discs in _PARTS:
        centres, radii, _ = _discs(discs, landmarks * [1, 1, 0], stature_m, camera)
        cv2.fillConvexPoly(mask, _hull(centres, radii, flat=0.5), 255, cv2.LINE_AA, _SUBPIXEL_BITS)
    return 1 - (1 - _SHADOW) * cv2.GaussianBlur(mask, (0, 0), 4) / 255.0


def _draw_person(image: np.ndarray, landmarks: np.ndarray, stature_m: float, camera: Camera) -> None:
    import cv2

    parts = [(colour, *_discs(discs, landmarks, stature_m, camera)) for colour, discs in _PARTS]
    for colour, centres, radii, depth in sorted(parts, key=lambda part: -part[3]):
        outline = _OUTLINE * stature_m * camera.focal_px / depth
        for margin, shade in ((outline, _OUTLINE_SHADE), (0.0, 1.0)):
            rgb = tuple(shade * channel for channel in _COLOURS[colour])
            cv2.fillConvexPoly(image, _hull(centres, radii + margin), rgb, cv2.LINE_AA, _SUBPIXEL_BITS)


def _discs(
    discs: dict[str, float], landmarks: np.ndarray, stature_m: float, camera: Camera
) -> tuple[np.ndarray, np.ndarray, float]:
    """Centres (N, 2) and radii (N,) in pixels, and the mean distance from the camera."""
    points = np.stack([_point(name, landmarks) for name in discs])
    depth = camera.points(points)[:, 2]
    radii = np.array(list(discs.values())) * stature_m * camera.focal_px / depth
    return camera.project(points), radii, float(depth.mean())


def _point(name: str, landmarks: np.ndarray) -> np.ndarray:
    if name == "ears":
        return (_point("l_ear", landmarks) + _point("r_ear", landmarks)) / 2
    return landmarks[HALPE26.index(name)]


def _hull(centres: np.ndarray, radii: np.ndarray, flat: float = 1.0) -> np.ndarray:
    """Outline of discs taken together, in cv2's fixed-point pixels; `flat` squeezes the discs vertically."""
    import cv2

    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rim = np.stack([np.cos(turn), flat * np.sin(turn)], axis=-1)
    points = centres[:, None] + radii[:, None, None] * rim
    return cv2.convexHull(np.round(points.reshape(-1, 2) * 2**_SUBPIXEL_BITS).astype(np.int32))
