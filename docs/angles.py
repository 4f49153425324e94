"""Draws what every angle means:  python docs/angles.py docs/angles.png

One panel an angle: the body where it is 0 (grey) and at the value written above (colour), and the path between, in the
direction in which the angle grows. The values are those that pcnet3d.pipeline.signals.angles computes for the drawn
body.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import cv2
import numpy as np

from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.signals.angles import angles
from pcnet3d.stages.drawing.palette import side_colour

CELL, SCALE = 300, 125  # pixels of a panel's side, and of a metre
GREY, RED = (215, 215, 215), (40, 40, 200)  # BGR
FORWARD, BACK, RIGHT, LEFT, UP, DOWN = np.array(
    [(-1, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=float
)
RIGHT_HALF = {
    "pelvis": (0, 0, 0), "r_hip": (0, 0.11, 0), "r_knee": (0, 0.11, -0.43), "r_ankle": (0, 0.11, -0.86),
    "spine": (0, 0, 0.25), "thorax": (0, 0, 0.5), "nose": (-0.1, 0, 0.62), "head": (0, 0, 0.75),
    "r_shoulder": (0, 0.19, 0.49), "r_elbow": (0, 0.19, 0.18), "r_wrist": (0, 0.19, -0.07),
}  # fmt: skip
PARENT = {child: parent for parent, child in H36M17.bones}
VIEWS = {  # picture axes (right, up) of what the reader sees
    "from its right": (FORWARD, UP),
    "from the front": (LEFT, UP),
    "from above": (RIGHT, FORWARD),
}
Pose = Callable[[float], dict[str, np.ndarray]]


def towards(start: np.ndarray, end: np.ndarray) -> Callable[[float], np.ndarray]:
    """The direction some degrees from start towards end, which is square to it."""
    return lambda degrees: np.cos(np.radians(degrees)) * start + np.sin(np.radians(degrees)) * end


def body(bones: dict[str, np.ndarray]) -> np.ndarray:
    """(17, 3) in BODY: standing, but with the bones that end in these joints pointing elsewhere."""
    left = {"l" + name[1:]: (x, -y, z) for name, (x, y, z) in RIGHT_HALF.items() if name.startswith("r_")}
    still = {name: np.array(place, dtype=float) for name, place in (RIGHT_HALF | left).items()}
    placed: dict[str, np.ndarray] = {}

    def place(joint: str) -> np.ndarray:
        if joint not in PARENT:
            return still[joint]
        if joint not in placed:
            bone = still[joint] - still[PARENT[joint]]
            if joint in bones:
                bone = np.linalg.norm(bone) * bones[joint]
            placed[joint] = place(PARENT[joint]) + bone
        return placed[joint]

    return np.array([place(joint) for joint in H36M17.joints])


def turning(degrees: float) -> dict[str, np.ndarray]:
    return {"r_shoulder": towards(RIGHT, FORWARD)(degrees), "l_shoulder": towards(LEFT, BACK)(degrees)}


def bent(*joints: str, start: np.ndarray, end: np.ndarray) -> Pose:
    return lambda degrees: {joint: towards(start, end)(degrees) for joint in joints}


# angle, value drawn, joint whose path shows the direction, view, pose
PANELS: tuple[tuple[str, float, str, str, Pose], ...] = (
    ("r_knee_flexion", 70, "r_ankle", "from its right", bent("r_ankle", start=DOWN, end=BACK)),
    ("r_elbow_flexion", 80, "r_wrist", "from its right", bent("r_wrist", start=DOWN, end=FORWARD)),
    ("r_thigh_trunk_flexion", 60, "r_knee", "from its right", bent("r_knee", "r_ankle", start=DOWN, end=FORWARD)),
    ("r_hip_abduction", 35, "r_knee", "from the front", bent("r_knee", "r_ankle", start=DOWN, end=RIGHT)),
    ("r_shoulder_flexion", 120, "r_elbow", "from its right", bent("r_elbow", "r_wrist", start=DOWN, end=FORWARD)),
    ("r_shoulder_abduction", 70, "r_elbow", "from the front", bent("r_elbow", "r_wrist", start=DOWN, end=RIGHT)),
    ("r_shoulder_elevation", 140, "r_elbow", "from the front", bent("r_elbow", "r_wrist", start=DOWN, end=RIGHT)),
    ("r_thigh_sagittal", 50, "r_knee", "from its right", bent("r_knee", start=DOWN, end=FORWARD)),
    ("r_shank_sagittal", 40, "r_ankle", "from its right", bent("r_ankle", start=DOWN, end=FORWARD)),
    ("r_upper_arm_sagittal", 50, "r_elbow", "from its right", bent("r_elbow", "r_wrist", start=DOWN, end=FORWARD)),
    ("trunk_lean_sagittal", 35, "thorax", "from its right", bent("spine", "thorax", start=UP, end=FORWARD)),
    ("trunk_lean_frontal", 25, "thorax", "from the front", bent("spine", "thorax", start=UP, end=RIGHT)),
    (
        "pelvis_obliquity", 20, "r_hip", "from the front",
        lambda degrees: {"r_hip": towards(RIGHT, UP)(degrees), "l_hip": towards(LEFT, DOWN)(degrees)},
    ),
    ("thorax_pelvis_rotation", 35, "r_shoulder", "from above", turning),
)  # fmt: skip


def panel(name: str, value: float, tip: str, view: str, pose: Pose) -> np.ndarray:
    image = np.full((CELL, CELL, 3), 255, np.uint8)
    axes, middle = np.array(VIEWS[view]), np.array([CELL / 2, CELL * 0.52])
    scale = SCALE * (2.2 if view == "from above" else 1.0)

    def at(points: np.ndarray) -> np.ndarray:
        return np.round(middle + scale * (points @ axes.T) * (1, -1)).astype(int)

    for degrees, coloured in ((0.0, False), (value, True)):
        places = at(body(pose(degrees)))
        for parent, child in H36M17.bones:
            start, end = (tuple(map(int, places[H36M17.index(joint)])) for joint in (parent, child))
            red, green, blue = side_colour(parent, child)
            colour = (blue, green, red) if coloured else GREY
            cv2.line(image, start, end, colour, 3, cv2.LINE_AA)
    path = at(np.array([body(pose(d))[H36M17.index(tip)] for d in np.linspace(0, value, 40)]))
    cv2.polylines(image, [path], False, RED, 2, cv2.LINE_AA)
    cv2.arrowedLine(
        image, tuple(map(int, path[-8])), tuple(map(int, path[-1])), RED, 2, cv2.LINE_AA, tipLength=0.6
    )
    found = angles(body(pose(value)))[name]
    for row, (text, size) in enumerate(((f"{name}  {found:+.0f}", 0.45), (f"seen {view}", 0.38))):
        cv2.putText(
            image, text, (8, 18 + 16 * row), cv2.FONT_HERSHEY_SIMPLEX, size, (60, 60, 60), 1, cv2.LINE_AA
        )
    cv2.rectangle(image, (0, 0), (CELL - 1, CELL - 1), (235, 235, 235), 1)
    return image


def main() -> None:
    panels = [panel(*row) for row in PANELS]
    panels += [np.full_like(panels[0], 255)] * (-len(panels) % 5)
    rows = [np.hstack(panels[start : start + 5]) for start in range(0, len(panels), 5)]
    cv2.imwrite(sys.argv[1], np.vstack(rows))


if __name__ == "__main__":
    main()
