"""MediaPipe's world landmarks (T, 33, 4) in the forms that people save (formats.md 5)."""

import csv
import json
from pathlib import Path

import numpy as np

from golden.bodies import hips_of, placed
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33

NAMES = [
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index",
    "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle", "left_heel", "right_heel", "left_foot_index", "right_foot_index",
]  # fmt: skip


def image(world: np.ndarray) -> np.ndarray:
    landmarks = world.copy()
    landmarks[..., :2] = 0.25 * landmarks[..., :2] + [0.5, 0.6]
    return landmarks


def points(values: np.ndarray) -> list[dict]:
    return [dict(zip(("x", "y", "z", "visibility"), map(float, point), strict=True)) for point in values]


def write_csv(path, header, rows, delimiter=","):
    with path.open("w", newline="") as file:
        writer = csv.writer(file, delimiter=delimiter)
        writer.writerows([header, *rows] if header else rows)
    return path


def wide(folder, world):
    header = ["frame", *[f"{axis}{i}" for i in range(33) for axis in "xyzv"]]
    return write_csv(folder / "a.csv", header, [[i + 3, *row.ravel()] for i, row in enumerate(world)])


def wide_from_1(folder, world):
    header = ["class", *[f"{axis}{i + 1}" for i in range(33) for axis in "xyzv"]]
    return write_csv(folder / "a.csv", header, [["walk", *row.ravel()] for row in world])


def wide_named(folder, world):
    header = [
        "timestamp_ms",
        *[f"{joint.upper()}_{axis}" for joint in NAMES for axis in ("x", "y", "z", "visibility")],
    ]
    rows = [[40 * i, *row.ravel()] for i, row in enumerate(world)]
    return write_csv(folder / "a.csv", header, rows, delimiter=";")


def wide_both(folder, world):
    """The image's landmarks before those of the world."""
    header = [f"{kind}{joint}_{axis}" for kind in ("", "world_") for joint in NAMES for axis in "xyz"]
    pixels = image(world)
    return write_csv(
        folder / "a.csv",
        header,
        [[*p[:, :3].ravel(), *w[:, :3].ravel()] for p, w in zip(pixels, world, strict=True)],
    )


def long(folder, world):
    header = ["timestamp_s", "landmark", "x_m", "y_m", "z_m", "visibility"]
    rows = [
        [0.04 * i, joint.upper(), *point]
        for i, row in enumerate(world)
        for joint, point in zip(NAMES, row, strict=True)
    ]
    return write_csv(folder / "a.csv", header, rows)


def long_numbered(folder, world):
    header = ["frame_id", "landmark_id", "landmark_name", "x", "y", "z", "visibility"]
    rows = [[i + 3, j, NAMES[j], *point] for i, row in enumerate(world) for j, point in enumerate(row)]
    return write_csv(folder / "a.csv", header, rows)


def dump(folder, content):
    (folder / "a.json").write_text(json.dumps(content))
    return folder / "a.json"


def tasks_json(folder, *people):
    """The Tasks API's people beside the image's landmarks, in which they stand side by side."""
    frames = [
        {
            "frame": i + 3,
            "timestamp_ms": 40 * i,
            "pose_landmarks": [points(image(p)[i] + [0.4 * at, 0, 0, 0]) for at, p in enumerate(people)],
            "pose_world_landmarks": [points(p[i]) for p in people],
        }
        for i in range(len(people[0]))
    ]
    return dump(folder, frames)


def pose_world_json(folder, world):
    return dump(folder, [{"pose_world": row.tolist()} for row in world])


def message_json(folder, world):
    return dump(folder, [{"poseWorldLandmarks": {"landmark": points(row)}} for row in world])


def tfjs(folder: Path, points: np.ndarray) -> Path:
    """BlazePose of TF.js: pixels, and metres about the hips in keypoints3D."""
    frames = [
        [
            {
                "score": 1,
                "keypoints": [{"x": 100 + 9 * x, "y": 200 + 9 * y, "score": 0.9} for x, y, *_ in row],
                "keypoints3D": [{"x": x, "y": y, "z": z, "score": score} for x, y, z, score in row],
            }
        ]
        for row in points.tolist()
    ]
    (folder / "blazepose.json").write_text(json.dumps(frames), encoding="utf-8")
    return folder / "blazepose.json"


def bare_json(folder, world):
    return dump(folder, [points(row) for row in world])


def landmarks(bodies: np.ndarray) -> np.ndarray:
    """(T, 33, 4) of bodies (T, 17, 3) in CAMERA: the hips' middle at the origin, with visibilities; what our layout
    lacks lies near head and hands."""
    bodies = bodies - hips_of(bodies)
    points = placed(bodies, BLAZEPOSE33.joints)
    visibility = np.broadcast_to(np.arange(33) / 40, (len(bodies), 33))
    return np.concatenate([points, visibility[..., None]], axis=-1)
