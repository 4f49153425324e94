"""Draws the accelerations that `pcnet3d evaluate takes --sets test --because REASON -o DIR` found:

    python docs/acceleration.py DIR/evaluation.json OUT.png

Root mean square error of wrists and ankles, median over CMU test takes: of lifted takes, of the part that a rotation
adds to them, and of the real joints. Of several networks the first is drawn.
"""

from __future__ import annotations

import json
import re
import sys

import cv2
import numpy as np

WIDTH, TOP, PANEL, LEFT = 1660, 145, 330, 90  # pixels: twice the width that a README shows
INK, GRID = (60, 60, 60), (228, 228, 228)
BARS = (  # how a method's name begins and ends, what it is called, BGR
    ("camera axes", "camera axes", (170, 170, 170)),
    ("geometric, a frame", "geometric, frame by frame", (130, 190, 235)),
    ("pcnet, a frame", "network, frame by frame (the paper)", (52, 122, 226)),
    ("pcnet, a take", "network, one gravity per take", (170, 105, 40)),
)
LINES = (
    ("true axes", "the right rotation", (0, 0, 0)),
    ("no motion", "baseline: zero acceleration", (70, 70, 200)),
)
PANELS = (
    ("CMU test, lifted", "level", "Lifted from noisy 2D, against motion capture"),
    ("CMU test, lifted", "lift", "The same, only what the rotation adds"),
    ("CMU test, clean", "level", "Real joints, against motion capture"),
)
GROUPS = [(part, way) for part in ("wrist", "ankle") for way in ("vertical", "horizontal")]


def write(
    image: np.ndarray, text: str, at: tuple[float, float], size: float = 0.8, centred: bool = False
) -> None:
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 2)
    x, y = at
    corner = round(x - width / 2 if centred else x), round(y)
    cv2.putText(image, text, corner, cv2.FONT_HERSHEY_SIMPLEX, size, INK, 2, cv2.LINE_AA)


def p50(methods: dict, name: str, group: tuple[str, str]) -> float | None:
    return methods[name][group[0]][group[1]]["rmse"]["p50"] if name in methods else None


def panel(methods: dict, title: str) -> np.ndarray:
    image = np.full((PANEL, WIDTH, 3), 255, np.uint8)
    values = [p50(methods, name, group) for name, *_ in (*BARS, *LINES) for group in GROUPS]
    highest = max(value for value in values if value is not None)
    floor, scale = PANEL - 50, (PANEL - 125) / highest
    for tick in range(int(highest) + 1):
        y = round(floor - tick * scale)
        cv2.line(image, (LEFT, y), (WIDTH - 20, y), GRID if tick else INK, 2)
        write(image, str(tick), (LEFT - 35, y + 9), 0.7)
    write(image, title, (20, 36), 0.95)
    step = (WIDTH - 20 - LEFT) / len(GROUPS)
    for i, group in enumerate(GROUPS):
        start, wide = LEFT + i * step + 0.08 * step, 0.84 * step / len(BARS)
        end = start + len(BARS) * wide
        levels = {name: floor - (p50(methods, name, group) or 0) * scale for name, *_ in (*BARS, *LINES)}
        for j, (name, _, colour) in enumerate(BARS):
            x, y = start + j * wide, round(levels[name])
            cv2.rectangle(image, (round(x + 4), y), (round(x + wide - 4), floor), colour, -1)
        for name, _, colour in LINES:
            if levels[name] < floor:
                cv2.line(
                    image, (round(start), round(levels[name])), (round(end), round(levels[name])), colour, 3
                )
        for j, (name, *_) in enumerate(BARS):
            lines = [levels[line] for line, *_ in LINES if 0 < levels[name] - levels[line] < 25]
            at = start + (j + 0.5) * wide, min([levels[name], *lines]) - 9
            write(image, f"{p50(methods, name, group):.2f}", at, 0.62, centred=True)
        write(image, ", ".join(group), ((start + end) / 2, floor + 34), 0.75, centred=True)
    return image


def legend() -> np.ndarray:
    image = np.full((TOP, WIDTH, 3), 255, np.uint8)
    entries = [*BARS, *LINES]
    for i, (_, label, colour) in enumerate(entries):
        x, y = 20 + (i % 3) * 555, 40 + (i // 3) * 42
        if i < len(BARS):
            cv2.rectangle(image, (x, y - 20), (x + 30, y + 2), colour, -1)
        else:
            cv2.line(image, (x, y - 8), (x + 30, y - 8), colour, 3)
        write(image, label, (x + 42, y), 0.75)
    write(
        image, "RMSE of acceleration, m/s^2, relative to the pelvis, 6 Hz; median take", (20, TOP - 21), 0.75
    )
    return image


def first_network(methods: dict) -> dict:
    """Networks' names without their hashes."""
    plain: dict = {}
    for name, row in methods.items():
        plain.setdefault(re.sub("@[0-9a-f]+", "", name), row)
    return plain


def main() -> None:
    with open(sys.argv[1], encoding="utf-8") as file:
        sets = json.load(file)["acceleration"]
    panels = [panel(first_network(sets[label][axes]), title) for label, axes, title in PANELS]
    cv2.imwrite(sys.argv[2], np.vstack([legend(), *panels]))


if __name__ == "__main__":
    main()
