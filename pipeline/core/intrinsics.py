"""A calibrated camera, and points and images as an ideal pinhole camera in its place would have seen them.

Pixels are OpenCV's: x right, y down, the centre of the upper left pixel at (0, 0). The distortion models are OpenCV's
as well: polynomial (Brown-Conrady, rational, thin prism) and fisheye (Kannala-Brandt).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from .errors import InputError

_COUNTS = (0, 4, 5, 8, 12)  # of OpenCV's polynomial coefficients; its 14 are of a tilted sensor
_FISHEYE_COUNTS = (0, 4)
_FOCAL = (0.2, 20.0)  # focal length over the longer side of the image: fisheye lenses to telephoto lenses
_PIXEL_ASPECT = 2.0  # the most that one focal length may be over the other: anamorphic video has 1.46
# Of a side, from the image's middle: lenses stay within some per cent, 4:3 in 16:9 is 0.125 off.
_OFF_CENTRE = 0.1
_SAME_ASPECT = 0.01  # by which the aspect of two images may differ: video is cut to even or round numbers
_SEARCH = (3, 100, 1e-12)  # for a ray: both of OpenCV's criteria, steps at most, change at which it ends
_ALONG = np.linspace(0, 1, 11)  # shares of the way from the axis to a ray at which the lens is looked at
_MISSED = 1e-4  # of the focal length; a point that is missed by more is none that the lens can give


@dataclass(frozen=True)
class Intrinsics:
    """What one camera does to a ray.

    focal_px: (fx, fy). principal_point_px: (cx, cy). distortion: coefficients in OpenCV's order k1 k2 p1 p2 [k3 ...],
    for a fisheye lens k1 k2 k3 k4; empty for none. image_size: (width, height) in pixels that these belong to, None
    where nobody said. name: of the camera. source: the file it is from.
    InputError, naming source and camera, for anything that no camera has.
    """

    focal_px: tuple[float, float]
    principal_point_px: tuple[float, float]
    distortion: tuple[float, ...] = ()
    fisheye: bool = False
    image_size: tuple[int, int] | None = None
    name: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        (fx, fy), (cx, cy) = self.focal_px, self.principal_point_px
        counts = _FISHEYE_COUNTS if self.fisheye else _COUNTS
        if len(self.distortion) not in counts:
            raise self._refused(
                f"{', '.join(map(str, counts))} coefficients of distortion", f"{len(self.distortion)}"
            )
        width, height = self.image_size or (2 * cx, 2 * cy)
        if not (0 < cx < width and 0 < cy < height):
            raise self._refused(
                f"a principal point inside an image of {width:g} x {height:g} pixels", f"({cx:g}, {cy:g})"
            )
        least, most = (share * max(width, height) for share in _FOCAL)
        if not (least < min(fx, fy) and max(fx, fy) < min(most, _PIXEL_ASPECT * min(fx, fy))):
            raise self._refused(
                f"nearly equal focal lengths of {least:g} to {most:g} pixels", f"{fx:g} and {fy:g}"
            )

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) as OpenCV takes it: homogeneous pixels of a ray, before distortion."""
        (fx, fy), (cx, cy) = self.focal_px, self.principal_point_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def pinhole_focal_px(self) -> float:
        """The one focal length of the ideal camera that `undistorted` gives pixels of: the geometric mean of two."""
        return float(np.sqrt(self.focal_px[0] * self.focal_px[1]))

    def at_size(self, image_size: tuple[int, int]) -> Intrinsics:
        """The same camera's with images of this width and height, scaled as a whole. InputError for an image of another
        aspect, which was cut or turned in a way that nobody told. Intrinsics that belong to no size are taken to belong
        to this one, unless their principal point lies far from its middle."""
        width, height = image_size
        like = f"a calibration of images like the video's, which has {width} x {height} pixels"
        (fx, fy), (cx, cy) = self.focal_px, self.principal_point_px
        if self.image_size is None:
            if max(abs((cx + 0.5) / width - 0.5), abs((cy + 0.5) / height - 0.5)) > _OFF_CENTRE:
                raise self._refused(
                    like,
                    f"one that names no image size, with a principal point ({cx:g}, {cy:g}) far from the middle of "
                    "such an image; add the image_width and image_height of the calibration's own images to the file",
                )
            return replace(self, image_size=image_size)
        if self.image_size == image_size:
            return self
        sx, sy = width / self.image_size[0], height / self.image_size[1]
        if abs(sx / sy - 1) > _SAME_ASPECT:
            raise self._refused(
                like,
                f"one of {self.image_size[0]} x {self.image_size[1]}; calibrate with the camera's settings of this "
                "video, and turn the calibration's images as the video was turned",
            )
        # The image's border, not its first pixel's centre, stays where it is.
        centre = ((cx + 0.5) * sx - 0.5, (cy + 0.5) * sy - 0.5)
        return replace(self, focal_px=(fx * sx, fy * sy), principal_point_px=centre, image_size=image_size)

    def _refused(self, expected: str, got: str) -> InputError:
        camera = f"camera '{self.name}'" if self.name else "the camera"
        return InputError(
            "bad-value", f"{self.source or 'Intrinsics'}: expected {expected} of {camera}, got {got}."
        )


def undistorted(points_px: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """(..., 2) pixels of a video as an ideal pinhole camera shows them, for (..., 2) pixels as they were filmed.

    That camera has one focal length, `intrinsics.pinhole_focal_px`, and its principal point at (width / 2, height / 2):
    what a lifter assumes. Its image is of the same size, and points of the filmed image's border may lie outside of it.
    Missing points stay NaN, and points that the lens cannot have drawn there, such as those beyond the range in which a
    polynomial rises or 90 degrees off a fisheye's axis, become NaN. InputError for intrinsics without image size.
    """
    points = np.asarray(points_px, dtype=np.float64)
    ideal = _ideal_matrix(intrinsics)
    observed = (points.reshape(-1, 2) - intrinsics.principal_point_px) / intrinsics.focal_px
    rays = np.full_like(observed, np.nan)
    finite = np.isfinite(observed).all(axis=1)
    rays[finite] = _rays(observed[finite], intrinsics)
    return (rays * ideal[0, 0] + ideal[:2, 2]).reshape(points.shape)


def undistorted_image(image: np.ndarray, intrinsics: Intrinsics | None) -> np.ndarray:
    """The image, (H, W) or (H, W, channels) uint8, as the ideal camera of `undistorted` shows it, of the same shape;
    black where the camera saw nothing; as it is where nothing is known."""
    if intrinsics is None:
        return image
    import cv2

    return cv2.remap(image, *_maps(intrinsics), interpolation=cv2.INTER_LINEAR)


def _ideal_matrix(intrinsics: Intrinsics) -> np.ndarray:
    if intrinsics.image_size is None:
        raise intrinsics._refused("an image size", "none; give the video's")
    focal, (width, height) = intrinsics.pinhole_focal_px, intrinsics.image_size
    return np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])


def _rays(observed: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """(N, 2) rays x / z, y / z that the lens bends to the observed ones, NaN where there is none: OpenCV, which does
    not say where its search failed, answers something there too."""
    import cv2

    if not len(observed):
        return observed
    points, ideal, coefficients = observed[:, None], np.eye(3), _coefficients(intrinsics)
    if intrinsics.fisheye:
        rays = cv2.fisheye.undistortPoints(points, ideal, coefficients, criteria=_SEARCH)[:, 0]
    else:
        rays = cv2.undistortImagePoints(points, ideal, coefficients, None, _SEARCH)[:, 0]
    with np.errstate(all="ignore"):
        met = (np.abs(observed - _bent(rays, intrinsics)) < _MISSED).all(axis=1)
        # Where a polynomial no longer rises on the way to a ray, other rays meet the same point.
        way = [np.linalg.norm(_bent(rays * share, intrinsics), axis=1) for share in _ALONG]
        rising = (np.diff(way, axis=0) >= 0).all(axis=0)
    rays[~(met & rising)] = np.nan
    return rays


def _bent(rays: np.ndarray, intrinsics: Intrinsics) -> np.ndarray:
    """(N, 2) normalised image coordinates of (N, 2) rays, after the lens."""
    import cv2

    ideal, coefficients = np.eye(3), _coefficients(intrinsics)
    if intrinsics.fisheye:
        return cv2.fisheye.distortPoints(rays[:, None], ideal, coefficients)[:, 0]
    still, points = np.zeros(3), np.column_stack([rays, np.ones(len(rays))])
    return cv2.projectPoints(points, still, still, ideal, coefficients)[0][:, 0]


def _coefficients(intrinsics: Intrinsics) -> np.ndarray:
    # Of whole numbers OpenCV would read memory beyond them.
    return np.array(intrinsics.distortion or (0, 0, 0, 0), dtype=np.float64)


@lru_cache(maxsize=2)
def _maps(intrinsics: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """Where each pixel of the ideal image comes from."""
    import cv2

    functions: Any = cv2.fisheye if intrinsics.fisheye else cv2
    lens = intrinsics.matrix, _coefficients(intrinsics), np.eye(3)
    return functions.initUndistortRectifyMap(
        *lens, _ideal_matrix(intrinsics), intrinsics.image_size, cv2.CV_32FC1
    )
