"""Calibration files of one and the same cameras, as each program writes them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

MATRIX = np.array([[1000.0, 0.0, 630.0], [0.0, 1010.0, 365.0], [0.0, 0.0, 1.0]])
DISTORTION = (-0.25, 0.08, 0.001, -0.0005, 0.01)
SIZE = (1280, 720)


def _opencv(suffix: str) -> Callable[[Path], Path]:
    """By OpenCV itself, with the names of its calibration sample."""

    def write(folder: Path) -> Path:
        path = folder / f"calibration{suffix}"
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        storage.write("calibration_time", "Tue 01 Sep 2026 12:00:00")
        storage.write("image_width", SIZE[0])
        storage.write("image_height", SIZE[1])
        storage.write("camera_matrix", MATRIX)
        storage.write("distortion_coefficients", np.array(DISTORTION)[:, None])
        storage.write("avg_reprojection_error", 0.31)
        storage.release()
        return path

    return write


def _json(folder: Path) -> Path:
    """As scripts after the tutorial do."""
    path = folder / "camera.json"
    content = {
        "cameraMatrix": MATRIX.tolist(),
        "distCoeffs": [DISTORTION],
        "image_size": SIZE,
        "fisheye": False,
    }
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def _yaml_dump(folder: Path) -> Path:
    """PyYAML's way with lists, which OpenCV's own parser does not read."""
    rows = "".join(f"- - {a}\n  - {b}\n  - {c}\n" for a, b, c in MATRIX)
    path = folder / "camera.yaml"
    bent = "- - " + "\n  - ".join(map(str, DISTORTION))
    path.write_text(f"camera_matrix:\n{rows}dist_coeff:\n{bent}\n", encoding="utf-8")
    return path


def _ros(folder: Path) -> Path:
    def matrix(rows: int, cols: int, data: np.ndarray) -> str:
        return (
            f"\n  rows: {rows}\n  cols: {cols}\n  data: [{', '.join(f'{number:.6f}' for number in data)}]\n"
        )

    projection = np.column_stack([MATRIX, np.zeros(3)])
    path = folder / "ost.yaml"
    path.write_text(
        f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ncamera_name: narrow_stereo\n"
        f"camera_matrix:{matrix(3, 3, MATRIX.ravel())}distortion_model: plumb_bob\n"
        f"distortion_coefficients:{matrix(1, 5, np.array(DISTORTION))}"
        f"rectification_matrix:{matrix(3, 3, np.eye(3).ravel())}projection_matrix:{matrix(3, 4, projection.ravel())}",
        encoding="utf-8",
    )
    return path


def _pose2sim(folder: Path) -> Path:
    content = "".join(
        f'[int_{name}_img]\nname = "{name}"\nsize = [ {SIZE[0]}.0, {SIZE[1]}.0]\nmatrix = {MATRIX.tolist()}\n'
        f"distortions = {list(DISTORTION[:4])}\nrotation = [ 1.67, 1.03, -0.39]\ntranslation = [ 0.26, 0.96, 2.93]\n"
        "fisheye = false\n\n"
        for name in ("cam01", "cam02")
    )
    path = folder / "Calib_scene.toml"
    path.write_text(content + "[metadata]\nadjusted = false\nerror = 0.0\n", encoding="utf-8")
    return path


def _caliscope(folder: Path) -> Path:
    """The first camera was never calibrated; the last is a fisheye."""
    lens = f"size = [{SIZE[0]}, {SIZE[1]}]\nmatrix = {MATRIX.tolist()}\n"
    content = (
        f"[cameras.0]\nport = 0\nignore = true\nsize = [{SIZE[0]}, {SIZE[1]}]\n\n"
        f"[cameras.1]\nport = 1\nerror = 0.371\n{lens}distortions = {list(DISTORTION)}\nrotation = [0.3, 2.2, -1.8]\n\n"
        f"[cameras.2]\nport = 2\n{lens}distortions = [0.1, 0.02, 0.0, 0.0]\nfisheye = true\n"
    )
    (folder / "camera_array.toml").write_text(content, encoding="utf-8")
    return folder / "camera_array.toml"


WRITERS = {
    "OpenCV YAML": _opencv(".yml"),
    "OpenCV JSON": _opencv(".json"),
    "tutorial JSON": _json,
    "PyYAML": _yaml_dump,
    "ROS": _ros,
    "Pose2Sim": _pose2sim,
    "Caliscope": _caliscope,
}
