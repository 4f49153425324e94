"""What a real camera adds to an image: people, the lens, motion, light, noise of the sensor, JPEG."""

from __future__ import annotations

import cv2
import numpy as np

from .furniture import colour
from .textures import SIDE, fractal, texture
from .views import View

SKIN = (205, 160, 130)
# Joints of a standing person: metres to the right and up.
BODY = {
    "head": (0, 1.62), "neck": (0, 1.45), "pelvis": (0, 0.95), "l_shoulder": (-0.18, 1.42), "r_shoulder": (0.18, 1.42),
    "l_elbow": (-0.27, 1.13), "r_elbow": (0.27, 1.13), "l_wrist": (-0.3, 0.88), "r_wrist": (0.3, 0.88),
    "l_hip": (-0.1, 0.93), "r_hip": (0.1, 0.93), "l_knee": (-0.12, 0.5), "r_knee": (0.12, 0.5), "l_foot": (-0.14, 0.05),
    "r_foot": (0.14, 0.05),
}  # fmt: skip
LIMBS = {
    "legs": [("l_hip", "l_knee", 0.17), ("l_knee", "l_foot", 0.12), ("r_hip", "r_knee", 0.17),
             ("r_knee", "r_foot", 0.12)],
    "shirt": [("neck", "pelvis", 0.34), ("l_shoulder", "r_shoulder", 0.16), ("l_shoulder", "l_elbow", 0.1),
              ("r_shoulder", "r_elbow", 0.1)],
    "skin": [("l_elbow", "l_wrist", 0.08), ("r_elbow", "r_wrist", 0.08), ("neck", "head", 0.11), ("head", "head", 0.2)],
}  # fmt: skip


def paint_person(image: np.ndarray, view: View, rng: np.random.Generator) -> np.ndarray:
    """Paint somebody who stands in front of the camera into (H, W, 3) -> the box (4,) x0 y0 x1 y1, NaN if unseen.

    The box holds every pixel that changed; its right and lower border lie one beyond the last.
    """
    right = np.array([view.heading[1], -view.heading[0], 0])
    distance = rng.uniform(1.8, 6)
    at = rng.uniform(-0.35, 0.35) * distance * right + distance * view.heading
    sway = rng.normal(0, 0.1, 2)
    pixels = {}
    for joint, (x, up) in BODY.items():
        x, up = (
            x + sway[0] * up + rng.normal(0, 0.06),
            up + (rng.normal(0, 0.05) if "foot" not in joint else 0),
        )
        pixels[joint] = view.project((at + [0, 0, up] + x * right)[None])[0]
    metre = view.focal_px / distance
    paints = {
        "legs": colour(rng, (0.1, 0.8), 0.8),
        "shirt": colour(rng, (0.1, 0.95), 0.9),
        "skin": np.array(SKIN),
    }
    cloth = texture("cloth")[0][0]
    changed = np.zeros(image.shape[:2], np.uint8)
    for part, limbs in LIMBS.items():
        mask = np.zeros_like(changed)
        for a, b, thick in limbs:
            ends = np.round([pixels[a], pixels[b]]).astype(int).tolist()
            cv2.line(mask, ends[0], ends[1], 1, max(1, int(thick * metre)), cv2.LINE_8)
        rows, columns = np.nonzero(mask)
        image[rows, columns] = np.clip(paints[part] / 128 * cloth[rows % SIDE, columns % SIDE, None], 0, 255)
        changed |= mask
    x0, y0, width, height = cv2.boundingRect(changed)
    return np.array([x0, y0, x0 + width, y0 + height], float) if width else np.full(4, np.nan)


def through_lens(image: np.ndarray, view: View, k1: float) -> np.ndarray:
    """A canvas's image with its margin -> (H, W, 3); an output point x shows what a pinhole has at x (1 + k1 r^2)."""
    K = np.array([[view.focal_px, 0, 0], [0, view.focal_px, 0], [0, 0, 1.0]])
    source, shown = K.copy(), K.copy()
    source[:2, 2], shown[:2, 2] = view.centre + view.margin, view.centre
    maps = cv2.initUndistortRectifyMap(
        source, np.array([k1, 0, 0, 0]), np.eye(3), shown, view.size, cv2.CV_16SC2
    )
    return cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def lit(gain: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(H, W) uint8 gain, made brighter and darker smoothly, and exposed as a whole."""
    field = fractal(int(rng.integers(2**31)), 4, side=16, knee=1) * rng.uniform(0.03, 0.15)
    field = (128 * np.clip(rng.uniform(0.55, 1.1) * (1 + field), 0.2, 1.3)).astype(np.uint8)
    field = cv2.resize(field, gain.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return cv2.multiply(gain, field, scale=1 / 128)


def blurred(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(H, W, 3) sharp, out of focus or moved, each as often as in videos; at most 0.4 % of the longer side."""
    most = 0.004 * max(image.shape)
    how = rng.choice(["sharp", "defocus", "motion"], p=[0.5, 0.3, 0.2])
    if how == "sharp":
        return image
    if how == "defocus":
        return cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 0.45 * most))
    angle, reach = rng.uniform(0, np.pi), rng.uniform(0.5, most / 2)
    middle = int(np.ceil(reach))
    kernel = np.zeros((2 * middle + 1, 2 * middle + 1), np.float32)
    step = 16 * reach * np.array([np.cos(angle), np.sin(angle)])
    ends = np.round(16 * middle + np.stack([-step, step])).astype(int)
    cv2.line(kernel, ends[0].tolist(), ends[1].tolist(), 1.0, 1, cv2.LINE_AA, 4)
    return cv2.filter2D(image, -1, kernel / kernel.sum())


def noisy(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(H, W, 3) with noise of the sensor, brightness more than colour; it repeats after SIDE pixels."""
    sigma = rng.choice([1, 3, 8], p=[0.4, 0.4, 0.2]) * rng.uniform(0.5, 1.2)
    noise = rng.standard_normal((SIDE, SIDE, 1), np.float32) + 0.5 * rng.standard_normal(
        (SIDE, SIDE, 3), np.float32
    )
    noise = np.round(sigma * noise).astype(np.int16)
    height, width = image.shape[:2]
    noise = np.tile(noise, (height // SIDE + 1, width // SIDE + 1, 1))[:height, :width]
    return cv2.add(image, noise, dtype=cv2.CV_8U)


def compressed(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(H, W, 3) to JPEG of quality 25 to 90 and back."""
    quality = int(rng.integers(25, 91))
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return np.asarray(
        cv2.imdecode(data, cv2.IMREAD_COLOR)
    )  # the order of the channels does not matter to either


def spoilt(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(H, W, 3) with what happens behind the lens."""
    return compressed(noisy(blurred(image, rng), rng), rng)
