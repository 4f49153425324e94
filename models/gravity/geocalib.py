"""Up and the focal length from what GeoCalib's network sees at every pixel: for scenes without straight lines.

The network (Veicht et al., GeoCalib, ECCV 2024) answers with four fields, and the camera whose fields are nearest is
found by Levenberg-Marquardt. Its conventions, github.com/cvg/GeoCalib, perspective_fields.py: at the ray
q = ((x - cx) / f, (y - cy) / f, 1) of a pixel and for up (a, b, c) in CAMERA axes, the up field is the direction
(a, b) - c (qx, qy) in the image, of length one, and the latitude asin(q . up / |q|), positive above the horizon. Their
"gravity" is up: (0, -1, 0) for an upright camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD
from ...pipeline.core.device import Placement, placement
from ...pipeline.core.errors import InputError
from ...pipeline.core.rotations import unit
from ...pipeline.plugins.registry import open_model
from ..common.onnx import OnnxFile, open_onnx, reason_of
from .images import TOLD_SPREAD
from .lines import UpOfImages, tangent

# The network's input and outputs, as it was trained and exported.
_SIDE = 320  # pixels of the input's shorter side before it is cropped
_CELL = 32  # pixels; both sides of the input are multiples, and nearer than that the fields know nothing of their own
_CHANNELS = {"up_field": 2, "up_confidence": 1, "latitude_field": 1, "latitude_confidence": 1}

# The fit's, as GeoCalib's own.
_EVERY = 4  # pixels of the fields that are looked at, along either side: the network's features are no finer
_LOSS = 1e-2  # scale of Huber's loss, radians
_STEPS = 60
_CONVERGED = 1e-6  # of the step, radians

# The network's bias, which no number of pixels or frames averages out: GeoCalib's published median errors on LaMAR and
# Stanford2D3D are 1.4 to 1.5 degrees of pitch, 0.5 of roll, and about 3 of the field of view.
_PITCH_DEG, _ROLL_DEG, _LOG_FOCAL = 1.5, 0.7, 0.08
_FOCALS = (0.2, 10.0)  # over the longer side, where the search stays


@dataclass(frozen=True, eq=False)
class Fields:
    """What the network says of one image. up: (H, W, 2) unit vectors in the image, x right, y down. latitude: (H, W)
    radians. up_confidence, latitude_confidence: (H, W) in [0, 1]. pixels: (H, W, 2) of the image, x and y, that each
    value is of. image_size: width and height of the image."""

    up: np.ndarray
    up_confidence: np.ndarray
    latitude: np.ndarray
    latitude_confidence: np.ndarray
    pixels: np.ndarray
    image_size: tuple[int, int]


def up_from_network(
    images: Sequence[np.ndarray],
    model: str | Path = "geocalib",
    focal_px: float | None = None,
    focal_spread: float = TOLD_SPREAD,
) -> UpOfImages:
    """Which way is up in images of one camera that stood still.

    images: (H, W, 3) RGB uint8, of one size, without lens distortion to speak of; one is enough, as the network's error
    is the same in each. model: name of a gravity network, or an .onnx file. focal_px, focal_spread: as of
    `up_from_fields`. InputError for images of other types or several sizes and for a file that is no such network.
    """
    sizes = {image.shape for image in images}
    if len(sizes) != 1 or any(
        image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 for image in images
    ):
        said = ", ".join(sorted({f"{image.shape} {image.dtype}" for image in images})) or "none"
        raise InputError(
            "wrong-content", f"Expected RGB images (height, width, 3) of uint8 of one size, got {said}."
        )
    network = opened(model)
    found = [up_from_fields(fields_of(network, image), focal_px, focal_spread) for image in images]
    return UpOfImages(
        up=unit(np.sum([one.up for one in found], axis=0)),
        covariance=np.mean([one.covariance for one in found], axis=0),
        focal_px=float(np.exp(np.mean([np.log(one.focal_px) for one in found]))),
        focal_sd_px=float(np.mean([one.focal_sd_px for one in found])),
    )


def up_from_fields(
    fields: Fields, focal_px: float | None = None, focal_spread: float = TOLD_SPREAD
) -> UpOfImages:
    """The camera whose fields are the nearest to these: its up, and its focal length unless that is told. The image's
    middle is taken for the principal point.

    focal_px, focal_spread: the focal length where it is known, and the spread of its logarithm, 0 to keep it as it is;
    unknown, it is drawn to what phones that film have. Residuals of the up field and of the latitude's sine count by
    Huber's loss and the network's confidence, and the values of a cell of 32 x 32 pixels as one observation. The stated
    error is the fit's and, in quadrature, the network's bias of 1.5 degrees of pitch and 0.7 of roll.
    InputError for a focal length that no camera has.
    """
    side = max(fields.image_size)
    if focal_px is not None and not _FOCALS[0] * side < focal_px < _FOCALS[1] * side:
        raise InputError(
            "bad-value",
            f"Expected a focal length in pixels, near the image's longer side of {side}; got {focal_px:g}.",
        )
    prior, spread = (focal_px, focal_spread) if focal_px else (PRIOR_FOCAL * side, PRIOR_FOCAL_SPREAD)
    fit = _Fit(fields, prior, spread)
    up, log_focal = _first_guess(fields), np.log(prior)
    damping, (cost, gradient, information, scatter) = 1e-3, fit.at(up, log_focal)
    for _ in range(_STEPS):
        step = np.linalg.solve(information + damping * np.diag(np.diag(information) + 1e-9), -gradient)
        step[2] *= fit.free
        moved = unit(up + tangent(up) @ step[:2])
        stretched = float(np.clip(log_focal + step[2], *np.log(np.multiply(_FOCALS, side))))
        tried = fit.at(moved, stretched)
        if tried[0] > cost:
            damping *= 10
            if damping > 1e8:
                break
            continue
        up, log_focal, damping = moved, stretched, max(damping / 10, 1e-9)
        cost, gradient, information, scatter = tried
        if np.abs(step).max() < _CONVERGED:
            break
    covariance = np.linalg.inv(information) * max(scatter, 1.0)
    bias = np.radians([_PITCH_DEG, _ROLL_DEG]) ** 2
    log_error = np.hypot(np.sqrt(covariance[2, 2]), _LOG_FOCAL)
    focal = float(np.exp(log_focal))
    return UpOfImages(
        up=up,
        covariance=covariance[:2, :2] + np.diag(bias),
        focal_px=focal,
        # The network is no better than whoever told the focal length, or than the prior.
        focal_sd_px=focal * float(min(log_error, spread)),
    )


class _Fit:
    """The misfit of fields, as a function of up and the logarithm of the focal length."""

    def __init__(self, fields: Fields, prior: float, spread: float) -> None:
        cells = fields.latitude.size / _CELL**2
        few = np.s_[::_EVERY, ::_EVERY]
        self._points = (fields.pixels[few] - np.array(fields.image_size) / 2).reshape(-1, 2)
        self._up = fields.up[few].reshape(-1, 2)
        self._sine = np.sin(fields.latitude[few].ravel())
        confidences = fields.up_confidence[few].ravel(), fields.latitude_confidence[few].ravel()
        self._weights = [confidence * cells / confidence.size for confidence in confidences]
        self._prior = np.log(prior)
        self.free = spread > 0
        self._information = 1 / spread**2 if self.free else 1e12

    def at(self, up: np.ndarray, log_focal: float) -> tuple[float, np.ndarray, np.ndarray, float]:
        """Cost, gradient (3,) and information (3, 3) of steps along `tangent(up)` and of the logarithm, and the mean
        square of the residuals in units of the loss's scale, large ones counting less."""
        from_plane = tangent(up)
        uv = self._points / np.exp(log_focal)
        drawn = up[:2] - up[2] * uv
        length = np.maximum(np.linalg.norm(drawn, axis=1), 1e-9)[:, None]
        along = drawn / length
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        # Steps of up and of log f move the drawn vector by (N, 2, 3); only what is across it turns it.
        moves = np.empty((len(uv), 2, 3))
        moves[:, :, :2] = from_plane[:2] - uv[:, :, None] * from_plane[2]
        moves[:, :, 2] = up[2] * uv
        turns = np.einsum("ni,nij->nj", across, moves) / length
        q = np.column_stack([uv, np.ones(len(uv))])
        far = np.linalg.norm(q, axis=1)[:, None]
        rays = q / far
        rise = np.column_stack([rays @ from_plane, (rays @ up) * (uv**2).sum(axis=1) / far[:, 0] ** 2])
        rise[:, 2] -= (uv @ up[:2]) / far[:, 0]
        off_up, off_sine = along - self._up, rays @ up - self._sine
        cost, scatter, total = 0.0, 0.0, 0.0
        gradient, information = np.zeros(3), np.zeros((3, 3))
        for missed, square, slopes, weight in (
            ((off_up * across).sum(axis=1), (off_up**2).sum(axis=1), turns, self._weights[0]),
            (off_sine, off_sine**2, rise, self._weights[1]),
        ):
            scaled = np.sqrt(square) / _LOSS
            share = weight / np.maximum(scaled, 1)
            cost += float(weight @ np.where(scaled < 1, scaled**2, 2 * scaled - 1)) / 2
            scatter, total = scatter + float(share @ scaled**2), total + float(weight.sum())
            gradient += slopes.T @ (share * missed) / _LOSS**2
            information += (slopes * share[:, None]).T @ slopes / _LOSS**2
        apart = log_focal - self._prior
        cost += apart**2 * self._information / 2
        gradient[2] += apart * self._information
        information[2, 2] += self._information
        return cost, gradient, information, scatter / max(total, 1e-9)


def _first_guess(fields: Fields) -> np.ndarray:
    """Roll by the mean of the up field, pitch by the latitude in the image's middle."""
    middle = np.linalg.norm(fields.pixels - np.array(fields.image_size) / 2, axis=-1)
    near = middle <= np.quantile(middle, 0.05)
    sine = np.sin(np.median(fields.latitude[near]))
    mean = (fields.up * fields.up_confidence[..., None]).sum(axis=(0, 1))
    length = np.linalg.norm(mean)
    flat = mean / length if length > 0 else np.array([0.0, -1.0])
    return unit(np.append(flat * np.sqrt(1 - sine**2), sine))


def fields_of(network: OnnxFile, image: np.ndarray) -> Fields:
    """What the network says of an image (H, W, 3) RGB uint8. InputError when it answers with something else."""
    value, pixels = network_input(image)
    try:
        answers = dict(zip(network.outputs, network.run(value), strict=True))
    except Exception as error:  # onnxruntime's errors have no common class but Exception
        raise InputError(
            "wrong-network", f"{network.path} fails on an input of shape {value.shape}: {reason_of(error)}."
        ) from None
    height, width = value.shape[2:]
    found = {}
    for name, channels in _CHANNELS.items():
        answer = np.asarray(answers[name], dtype=np.float64)
        shapes = [(1, channels, height, width)] + [(1, height, width)] * (channels == 1)
        if answer.shape not in shapes or not np.isfinite(answer).all():
            raise InputError(
                "wrong-network",
                f"{network.path}: expected finite numbers of shape {shapes[0]} from '{name}', got "
                + (f"shape {answer.shape}." if answer.shape not in shapes else "others."),
            )
        found[name] = np.moveaxis(answer.reshape(channels, height, width), 0, -1)
    return Fields(
        up=np.nan_to_num(unit(found["up_field"])),
        up_confidence=np.clip(found["up_confidence"][..., 0], 0, 1),
        latitude=found["latitude_field"][..., 0],
        latitude_confidence=np.clip(found["latitude_confidence"][..., 0], 0, 1),
        pixels=pixels,
        image_size=(image.shape[1], image.shape[0]),
    )


def network_input(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(1, 3, h, w) float32 in 0..1 for an image (H, W, 3) RGB uint8, and (h, w, 2) the pixels of the image that its
    pixels are of: the shorter side becomes 320, the longer one is cut to a whole number, and of both the middle is
    kept, a multiple of 32."""
    import cv2

    height, width = image.shape[:2]
    aspect = width / height
    across, down = (int(_SIDE * aspect), _SIDE) if aspect >= 1 else (_SIDE, int(_SIDE / aspect))
    scale = np.array([across / width, down / height])
    how = cv2.INTER_AREA if scale.min() <= 0.5 else cv2.INTER_LINEAR
    small = cv2.resize(image.astype(np.float32) / 255, (across, down), interpolation=how)
    kept = np.array([across, down]) // _CELL * _CELL
    left, top = start = -((kept - (across, down)) // 2)
    part = small[top : top + kept[1], left : left + kept[0]]
    grid = np.stack(np.meshgrid(np.arange(kept[0]), np.arange(kept[1])), axis=-1)
    return np.ascontiguousarray(part.transpose(2, 0, 1)[None]), (grid + start) / scale


def opened(model: str | Path) -> OnnxFile:
    """The network of that name, or of that .onnx file. InputError for another one."""
    return _open(open_model("gravity_networks", model), placement())


@lru_cache(maxsize=1)
def _open(path: Path, where: Placement) -> OnnxFile:
    """It computes where `placement` says. InputError for a network of other inputs and outputs."""
    network = open_onnx(path, "GeoCalib's network")
    image, outputs = network.only_input, network.outputs
    fits = (
        len(image) == 4
        and image[0] in (1, None)
        and image[1] in (3, None)
        and outputs.keys() == _CHANNELS.keys()
        and all(
            len(outputs[name]) in ((4,) if channels > 1 else (3, 4)) for name, channels in _CHANNELS.items()
        )
        and network.input_dtype == np.float32
    )
    if not fits:
        raise InputError(
            "wrong-network",
            f"{network.path} is not GeoCalib's network: expected one image (1, 3, height, width) of float32 and the "
            f"outputs {', '.join(_CHANNELS)}, got {network.looks}.",
        )
    if image[2:] != (None, None):
        raise InputError(
            "wrong-network",
            f"{network.path}: expected an input of any height and width, got {network.looks}; export it that way.",
        )
    return network
