"""How well images tell up and the focal length, on rendered rooms and streets whose cameras are known:

    python tests/bench/bench_gravity_images.py [rooms and streets of each] [first seed]

Prints error against what is stated, the same of the focal length, its error where the camera is pitched, and what
becomes of images that have no lines, or misleading ones.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from pcnet3d.models.common.metrics import RAYLEIGH_90, SD_90
from pcnet3d.models.gravity.images import ImageUp, Unknown, up_from_images
from pcnet3d.pipeline.core.rotations import angle_deg
from rooms import KINDS, Room, no_lines, room, street

_PITCHED_DEG = 10.0
_QUITE_WRONG_DEG = 5.0


def judged(shown: Room, told: bool) -> tuple[float, ImageUp | Unknown, float]:
    """Error in degrees (NaN without an answer), the answer, seconds."""
    start = time.perf_counter()
    answer = up_from_images([shown.image], shown.focal_px if told else None, [shown.boxes])
    seconds = time.perf_counter() - start
    error = float("nan") if isinstance(answer, Unknown) else float(angle_deg(answer.up, shown.up))
    return error, answer, seconds


def row(name: str, images: list[Room], told: bool) -> str:
    results = [judged(shown, told) for shown in images]
    errors = np.array([error for error, _, _ in results])
    fine = np.isfinite(errors)
    stated = np.array([a.error_deg if isinstance(a, ImageUp) else np.nan for _, a, _ in results])
    inside = (errors <= RAYLEIGH_90 * stated)[fine].mean() if fine.any() else np.nan
    ratio = np.array(
        [
            a.focal_px / shown.focal_px
            for shown, (_, a, _) in zip(images, results, strict=True)
            if isinstance(a, ImageUp) and abs(shown.pitch_deg) > _PITCHED_DEG
        ]
    )
    within = [
        abs(a.focal_px - shown.focal_px) <= SD_90 * a.focal_sd_px
        for shown, (_, a, _) in zip(images, results, strict=True)
        if isinstance(a, ImageUp)
    ]
    # What is told stays a camera's focal length, whatever the lines make of it.
    focal = "as told" if told else f"{100 * np.mean(np.abs(ratio - 1)):.1f} %" if len(ratio) else "-"
    focal_inside = "as told" if told else f"{100 * np.mean(within):.0f} %" if within else "-"
    p50, p95 = np.quantile(errors[fine], (0.5, 0.95)) if fine.any() else (np.nan, np.nan)
    mean = errors[fine].mean() if fine.any() else np.nan
    cells = [
        name, len(images), f"{100 * fine.mean():.0f} %", f"{p50:.2f}", f"{mean:.2f}", f"{p95:.2f}",
        f"{np.nanmean(stated):.2f}" if fine.any() else "-", f"{100 * inside:.0f} %", focal, focal_inside,
        int((errors > _QUITE_WRONG_DEG).sum()), f"{np.nanmax(errors):.1f}" if fine.any() else "-",
        f"{np.median([s for *_, s in results]):.2f}",
    ]  # fmt: skip
    return f"| {' | '.join(map(str, cells))} |"


def main(count: int = 40, first: int = 0) -> None:
    cv2.setNumThreads(1)
    print(
        "| images | of | answered | p50 | mean | p95 | stated | inside 90 % | focal off | focal inside | off by over 5 "
        "| worst | s |"
    )
    print("| --- " * 13 + "|")
    for kind, make in (("rooms", room), ("streets", street)):
        images = [make(seed) for seed in range(first, first + count)]
        print(row(f"{kind}, focal unknown", images, False), flush=True)
        print(row(f"{kind}, focal given", images, True), flush=True)
    for kind in KINDS:
        print(row(kind, [no_lines(kind, seed) for seed in range(10)], False), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
