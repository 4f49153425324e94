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
COLMAP = {
    "SIMPLE_PINHOLE": ("1000 630.5 365.5", (1000, 1000), ()),
    "PINHOLE": ("1000 1010 630.5 365.5", (1000, 1010), ()),
    "SIMPLE_RADIAL": ("1000 630.5 365.5 -0.2", (1000, 1000), (-0.2, 0, 0, 0)),
    "RADIAL": ("1000 630.5 365.5 -0.2 0.1", (1000, 1000), (-0.2, 0.1, 0, 0)),
    "OPENCV": ("1000 1010 630.5 365.5 -0.2 0.1 0.01 0.02", (1000, 1010), (-0.2, 0.1, 0.01, 0.02)),
    "OPENCV_FISHEYE": ("1000 1010 630.5 365.5 -0.02 0.01 0.03 0.04", (1000, 1010), (-0.02, 0.01, 0.03, 0.04)),
    "FULL_OPENCV": (
        "1000 1010 630.5 365.5 -0.2 0.1 0.01 0.02 3e-3 4e-3 5e-3 6e-3",
        (1000, 1010),
        (-0.2, 0.1, 0.01, 0.02, 0.003, 0.004, 0.005, 0.006),
    ),
}  # parameters in the file, then focal lengths and coefficients of OpenCV


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


def _colmap(folder: Path) -> Path:
    lines = [
        f"{number} {model} {SIZE[0]} {SIZE[1]} {parameters}"
        for number, (model, (parameters, _, _)) in enumerate(COLMAP.items(), 1)
    ]
    head = (
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
        f"# Number of cameras: {len(lines)}\n"
    )
    (folder / "cameras.txt").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return folder / "cameras.txt"


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


def _qualisys(folder: Path) -> Path:
    """Two cameras that show all of their sensor and one that shows a part, and one without calibration."""
    k1, k2, p1, p2, k3 = DISTORTION

    def camera(serial: str, left: int, top: int, intrinsic: bool = True) -> str:
        fov = f'left="{left}" top="{top}" right="{left + SIZE[0] - 1}" bottom="{top + SIZE[1] - 1}"'
        lens = (
            f'<intrinsic focallength="9.3" sensorMinU="0.000000" sensorMaxU="{64 * SIZE[0] - 1}" '
            f'sensorMinV="0.000000" sensorMaxV="{64 * SIZE[1] - 1}" focalLengthU="{64 * MATRIX[0, 0]}" '
            f'focalLengthV="{64 * MATRIX[1, 1]}" centerPointU="{64 * (MATRIX[0, 2] + left)}" '
            f'centerPointV="{64 * (MATRIX[1, 2] + top)}" skew="0.000000" radialDistortion1="{k1}" '
            f'radialDistortion2="{k2}" radialDistortion3="{k3}" tangentalDistortion1="{p1}" '
            f'tangentalDistortion2="{p2}"/>'
        )
        return (
            f'<camera active="1" avg-residual="0.402" model="Miqus Video" serial="{serial}" viewrotation="0">'
            f"<fov_marker {fov}/><fov_video {fov}/>"
            '<transform x="1460.2" y="-1909.2" z="1896.5" r11="1" r12="0" r13="0" r21="0" r22="1" r23="0" r31="0" '
            f'r32="0" r33="1"/>{lens if intrinsic else ""}</camera>'
        )

    cameras = camera("26578", 0, 0) + camera("26580", 100, 40) + camera("26581", 0, 0, intrinsic=False)
    path = folder / "Calib.qca.txt"
    path.write_text(
        f"<?xml version='1.0' encoding='ASCII'?>\n<calibration created=\"2023\" type=\"regular\"><cameras>{cameras}"
        "</cameras></calibration>\n",
        encoding="utf-8",
    )
    return path


WRITERS = {
    "OpenCV YAML": _opencv(".yml"),
    "OpenCV JSON": _opencv(".json"),
    "OpenCV XML": _opencv(".xml"),
    "tutorial JSON": _json,
    "PyYAML": _yaml_dump,
    "ROS": _ros,
    "COLMAP": _colmap,
    "Pose2Sim": _pose2sim,
    "Caliscope": _caliscope,
    "Qualisys": _qualisys,
}
