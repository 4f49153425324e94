"""Files of calibrated cameras, recognised by content:

| program | file |
|---|---|
| OpenCV, and scripts that follow its tutorials | YAML or JSON with a camera matrix and distortion coefficients |
| ROS | camera_info in YAML |
| Pose2Sim, Caliscope, FreeMoCap, Anipose | TOML with a section for each camera |

Only what is within a camera is read. Pose2Sim's and Caliscope's files know its orientation as well, in a world that
often has z up; but neither promises that: they take the axes of whatever lay in the scene, a board or a set of points,
and the first camera's where nothing did. A wrong vertical that a file vouches for would be worse than none, so gravity
is never taken from it.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ..core.errors import InputError, readable
from ..core.intrinsics import Intrinsics
from ..plugins.options import did_you_mean

_LARGEST = 1 << 20  # bytes; a camera takes some hundred
_SKEW = 0.01  # of the focal length; what calibrations that fit it find, and OpenCV's models leave out
_FORMATS = (
    "a camera's calibration: OpenCV's YAML or JSON, ROS's camera_info, or Pose2Sim's or Caliscope's .toml; of other "
    "programs write one with K, dist and image_size"
)

# Names of entries in lower case without underscores.
_MATRIX = ("cameramatrix", "intrinsicmatrix", "matrix", "k", "mtx")
_DISTORTION = ("distortioncoefficients", "distcoeffs", "distcoeff", "distortions", "distortion", "d", "dist")
_WIDTH, _HEIGHT, _SIZE = (
    ("imagewidth", "width"),
    ("imageheight", "height"),
    ("imagesize", "size", "resolution"),
)
_FISHEYE, _MODEL = ("fisheye", "fisheyemodel"), ("distortionmodel",)
_NAME = ("name", "cameraname")
_FISHEYE_MODELS = ("equidistant", "fisheye", "kannala_brandt")
_POLYNOMIAL_MODELS = ("plumb_bob", "rational_polynomial", "radtan", "opencv", "none", "")

Camera = dict[str, Any]


def read_camera(
    path: str | Path, name: str | None = None, image_size: tuple[int, int] | None = None
) -> Intrinsics:
    """The intrinsics of one camera of a calibration file.

    name: of the camera, where the file holds several.
    image_size: width and height of the video's images, upright as they are shown; intrinsics of images of another size
    and the same aspect are scaled to it.
    InputError for a file of another kind or a damaged one, for several cameras without name, and for numbers that no
    camera has or that do not go with the video.
    """
    path = Path(path)
    cameras = _cameras(path)
    if name is None and len(cameras) > 1:
        raise InputError(
            "choose-entry", f"{path} holds {len(cameras)} cameras; name one: {', '.join(cameras)}."
        )
    if name is not None and name not in cameras:
        raise InputError("name-unknown", f"{path} holds no camera '{name}'; {did_you_mean(name, cameras)}")
    chosen = next(iter(cameras)) if name is None else name
    intrinsics = _intrinsics(cameras[chosen], chosen, str(path))
    return intrinsics if image_size is None else intrinsics.at_size(image_size)


def _cameras(path: Path) -> dict[str, Camera]:
    """Every camera by name, as entries of the names above; never none."""
    text = _text(path)
    try:
        named = [(name or path.stem, camera) for name, camera in _in_tree(_parsed(text))]
    except ValueError as error:
        detail = f" ({str(error).strip().splitlines()[-1]})" if str(error).strip() else ""
        raise InputError(
            "format-unknown", f"Expected {_FORMATS}; {path} is not one, or is damaged{detail}."
        ) from None
    except RecursionError:
        raise InputError("unsafe", f"Expected {_FORMATS}; {path} nests its values too deeply.") from None
    if not named:
        raise InputError("wrong-content", f"Expected {_FORMATS}; {path} has no camera matrix.")
    cameras = dict(named)
    if len(cameras) < len(named):
        raise InputError(
            "wrong-content",
            f"{path}: expected cameras with different names, got {', '.join(name for name, _ in named)}.",
        )
    return cameras


def _text(path: Path) -> str:
    with readable(path, _FORMATS):
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise InputError("unsafe", f"Expected {_FORMATS}; {path} is larger than {_LARGEST} bytes.")
        return content.decode("utf-8-sig")


def _parsed(text: str) -> Any:
    """What a text of JSON, TOML or YAML holds, told by how it begins. ValueError for a damaged one."""
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "").lstrip()
    if first.startswith("{"):
        return json.loads(text)
    return tomllib.loads(text) if re.match(r"\[|[\w.\"'-]+[ \t]*=", first) else _of_yaml(text)


def _of_yaml(text: str) -> Any:
    """The first document as text, lists and mappings, whatever its tags say. OpenCV's own parser ends the process on
    deeply nested text and does not read what PyYAML writes; it begins its files with a directive that YAML writes
    otherwise."""
    text = text.replace("%YAML:", "%YAML ", 1)
    loader = getattr(
        yaml, "CBaseLoader", yaml.BaseLoader
    )  # in C, ten times as fast, where PyYAML was built with it
    try:
        # By aliases a short text could stand for one without end.
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, loader)):
            raise ValueError("it has an alias")
        tree = next(yaml.load_all(text, loader), None)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    if isinstance(tree, str | list):
        raise ValueError("it has no entries by name")
    return tree


def _in_tree(tree: Any, name: str = "") -> Iterator[tuple[str, Camera]]:
    """Every mapping with a camera matrix, by the name that it states or has where it lies; "" for the whole file."""
    if not isinstance(tree, dict):
        return
    entries = {str(key).lower().replace("_", ""): value for key, value in tree.items()}
    if _first(entries, _MATRIX) is not None:
        camera_name = _first(entries, _NAME)
        yield (camera_name if isinstance(camera_name, str) and camera_name else name), entries
        return
    for key, value in tree.items():
        yield from _in_tree(value, str(key))


def _intrinsics(camera: Camera, name: str, source: str) -> Intrinsics:
    where = f"{source}: camera '{name}'"
    matrix = _numbers(_first(camera, _MATRIX), f"{where}: camera matrix", 9)
    fx, skew, cx, zero, fy, cy, *last = matrix.tolist()
    if zero != 0 or last != [0, 0, 1] or not abs(skew) <= _SKEW * abs(fx):
        raise InputError(
            "wrong-content",
            f"{where}: expected a camera matrix fx 0 cx, 0 fy cy, 0 0 1, got {fx:g} {skew:g} {cx:g}, {zero:g} {fy:g} "
            f"{cy:g}, {' '.join(f'{number:g}' for number in last)}.",
        )
    distortion, model = _first(camera, _DISTORTION), _first(camera, _MODEL)
    if model not in (None, *_FISHEYE_MODELS, *_POLYNOMIAL_MODELS):
        raise InputError(
            "wrong-content",
            f"{where}: expected one of the distortion models {', '.join(filter(None, _POLYNOMIAL_MODELS))} and "
            f"{', '.join(_FISHEYE_MODELS)}, got {model!r}.",
        )
    marked = _first(camera, _FISHEYE) or 0
    marked = {"true": 1, "false": 0}.get(str(marked).lower(), marked)
    return Intrinsics(
        focal_px=(fx, fy),
        principal_point_px=(cx, cy),
        distortion=() if distortion is None else tuple(_numbers(distortion, f"{where}: distortion").tolist()),
        fisheye=model in _FISHEYE_MODELS or bool(_numbers(marked, f"{where}: fisheye", 1)[0]),
        image_size=_size(camera, where),
        name=name,
        source=source,
    )


def _size(camera: Camera, where: str) -> tuple[int, int] | None:
    size = _first(camera, _SIZE)
    if size is None:
        sides = [_first(camera, _WIDTH), _first(camera, _HEIGHT)]
        if None in sides:
            return None
        size = sides
    width, height = _numbers(size, f"{where}: image size", 2)
    if not (1 <= width < 1e6 and 1 <= height < 1e6 and width % 1 == 0 and height % 1 == 0):
        raise InputError(
            "wrong-content",
            f"{where}: expected width and height in whole pixels, got {width:g} and {height:g}.",
        )
    return int(width), int(height)


def _first(entries: Camera, names: tuple[str, ...]) -> Any:
    return next((entries[name] for name in names if entries.get(name) is not None), None)


def _numbers(value: Any, what: str, count: int | None = None) -> np.ndarray:
    """(N,) float64 of a number, a text of numbers, lists within lists, or OpenCV's matrix, whose numbers are `data`."""
    if isinstance(value, dict):
        value = value.get("data")
    if isinstance(value, str):
        value = value.split()
    try:
        numbers = np.array(value, dtype=np.float64).ravel()
    except (ValueError, TypeError, OverflowError):
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all() or (count is not None and len(numbers) != count):
        expected = "finite numbers" if count is None else f"{count} finite number{'s' * (count > 1)}"
        raise InputError("wrong-content", f"{what}: expected {expected}, got {str(value)[:200]}.")
    return numbers
