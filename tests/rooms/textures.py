"""Grey textures that repeat without a seam: gains of a surface's colour, 128 leaves it as it is."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np

SIDE = 512  # pixels


def fractal(
    seed: int, falloff: float, stretch: float = 1.0, side: int = SIDE, knee: float = 4.0
) -> np.ndarray:
    """(N, N) noise, N = side, of mean 0 and standard deviation 1 that repeats: power falls as frequency**-falloff.

    stretch: how much longer its streaks are along x than along y. knee: cycles a side below which it is flat.
    """
    white = np.random.default_rng(seed).standard_normal((side, side))
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], stretch * np.fft.rfftfreq(side)) * side
    spectrum = np.fft.rfft2(white) * (frequency**2 + knee**2) ** (-falloff / 4)
    spectrum[0, 0] = 0
    noise = np.fft.irfft2(spectrum, s=(side, side))
    return noise / noise.std()


def _bricks() -> np.ndarray:
    """Eight courses a side, every second one moved by half a brick; each brick has its own grey."""
    rng = np.random.default_rng(5)
    wall = 0.07 * fractal(6, 1.5) + 0.3  # mortar
    course, brick = SIDE // 8, SIDE // 4
    for row in range(8):
        for column in range(4):
            left = column * brick + (row % 2) * brick // 2 + 5
            columns = np.arange(left, left + brick - 10) % SIDE
            rows = np.arange(row * course + 5, (row + 1) * course - 5)
            wall[np.ix_(rows, columns)] += rng.normal(-0.35, 0.06)
    return wall


@cache
def texture(name: str) -> tuple[list[np.ndarray], float]:
    """The texture (H, H) at full, half, quarter ... resolution, uint8, and the metres along its side."""
    noise, metres = {
        "plaster": lambda: (0.015 * fractal(1, 2.4) + 0.01 * fractal(2, 0.5), 3.0),
        "carpet": lambda: (0.03 * fractal(3, 2) + 0.12 * fractal(4, 0.6), 1.2),
        "wood": lambda: (0.08 * fractal(7, 1.8, stretch=12) + 0.02 * fractal(8, 0.3), 1.5),
        "bricks": lambda: (_bricks(), 0.9),
        "asphalt": lambda: (0.06 * fractal(9, 2.2) + 0.1 * fractal(10, 0.4), 2.5),
        "grass": lambda: (0.12 * fractal(11, 1.6) + 0.22 * fractal(12, 0.5), 1.5),
        "cloth": lambda: (0.07 * fractal(13, 2.6), 0.8),
    }[name]()
    levels = [np.clip(128 * (1 + noise), 0, 255).astype(np.uint8)]
    while levels[-1].shape[0] > 16:
        levels.append(cv2.resize(levels[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
    return levels, metres
