"""Files of calibrated cameras.

They are told by content: YAML or JSON of OpenCV and of scripts that follow its tutorials, camera_info of ROS in YAML,
TOML with a section for each camera (Pose2Sim, Caliscope, FreeMoCap, Anipose). Only what is within a camera is read:
Pose2Sim's and Caliscope's files know its orientation as well, but in the axes of whatever lay in the scene, a board or
a set of points. A wrong vertical that a file vouches for would be worse than none, so gravity is never taken from it.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, naming, readable
from ..core.intrinsics import Intrinsics
from ..core.messages import how_many

_LARGEST = 1 << 20  # bytes of a file; a camera takes some hundred
_FORMATS = (
    "a camera's calibration: OpenCV's YAML or JSON, ROS's camera_info, or Pose2Sim's or Caliscope's .toml; of other "
    "programs write one with K, dist and image_size"
)
# Names of entries, in lower case and without underscores, of which one is used.
_ENTRIES = {
    "matrix": ("cameramatrix", "intrinsicmatrix", "matrix", "k", "mtx"),
    "distortion": (
        "distortioncoefficients",
        "distcoeffs",
        "distcoeff",
        "distortions",
        "distortion",
        "d",
        "dist",
    ),
    "size": ("imagesize", "size", "resolution"),
    "width": ("imagewidth", "width"),
    "height": ("imageheight", "height"),
    "fisheye": ("fisheye", "fisheyemodel"),
    "model": ("distortionmodel",),
    "name": ("name", "cameraname"),
}
_MODELS = {  # of ROS and others: whether each is a fisheye's
    "plumb_bob": False, "rational_polynomial": False, "radtan": False, "opencv": False, "none": False, "": False,
    "equidistant": True, "fisheye": True, "kannala_brandt": True,
}  # fmt: skip
_SKEW = 0.01  # of the focal length; what calibrations that fit it find, and OpenCV's models leave out


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
    names = ", ".join(cameras)
    if name is None and len(cameras) > 1:
        raise InputError("choose-entry", f"{path} holds {len(cameras)} cameras; name one: {names}.")
    if name is not None and name not in cameras:
        raise InputError("name-unknown", f"{path} holds no camera '{name}', but {names}.")
    chosen = name or next(iter(cameras))
    with naming(f"{path}: camera '{chosen}'"):
        intrinsics = _camera(cameras[chosen], chosen, str(path))
    return intrinsics if image_size is None else intrinsics.at_size(image_size)


def _cameras(path: Path) -> dict[str, dict[str, Any]]:
    """Every camera of a file by name, as entries of _ENTRIES; never none."""
    with readable(path, _FORMATS):
        if path.stat().st_size > _LARGEST:
            raise InputError("unsafe", f"Expected {_FORMATS}; {path} is larger than {_LARGEST} bytes.")
        text = path.read_text(encoding="utf-8-sig")
    try:
        named = list(_in_tree(_parsed(text), path.stem))
    except ValueError as error:
        raise InputError(
            "format-unknown", f"Expected {_FORMATS}; {path} is not one, or is damaged ({error})."
        ) from None
    except RecursionError:
        raise InputError("unsafe", f"Expected {_FORMATS}; {path} nests its values too deeply.") from None
    if not named:
        raise InputError("wrong-content", f"Expected {_FORMATS}; {path} has no camera matrix.")
    cameras = dict(named)
    if len(cameras) < len(named):
        names = ", ".join(name for name, _ in named)
        raise InputError("wrong-content", f"{path}: expected cameras with different names, got {names}.")
    return cameras


def _parsed(text: str) -> Any:
    """What JSON, TOML or YAML holds, of YAML the first document as text, lists and mappings, whatever its tags say.
    ValueError for damaged ones. OpenCV's own parser ends the process on deeply nested text and does not read what
    PyYAML writes; it begins its files with a directive that YAML writes otherwise."""
    import yaml

    for parse in (json.loads, tomllib.loads):
        with suppress(ValueError):
            return parse(text)
    text = text.replace("%YAML:", "%YAML ", 1)
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # in C, ten times as fast, where PyYAML has it
    try:
        # By aliases a short text could stand for one without end.
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, loader)):
            raise ValueError("it has an alias")
        tree = next(yaml.load_all(text, loader), None)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    if isinstance(tree, str):
        raise ValueError("it has no entries by name")
    return tree


def _in_tree(tree: Any, name: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every mapping with a camera matrix, as entries of _ENTRIES, by the name that it states or has where it lies."""
    if not isinstance(tree, dict):
        return
    plain = {str(key).lower().replace("_", ""): value for key, value in tree.items() if value is not None}
    entries = {
        entry: plain[key] for entry, keys in _ENTRIES.items() for key in reversed(keys) if key in plain
    }
    if "matrix" in entries:
        stated = entries.get("name")
        yield (stated if isinstance(stated, str) and stated else name), entries
        return
    for key, value in tree.items():
        yield from _in_tree(value, str(key))


def _camera(entries: dict[str, Any], name: str, source: str) -> Intrinsics:
    matrix = _numbers(entries["matrix"], "a camera matrix", 9)
    fx, skew, cx, zero, fy, cy, *last = matrix.tolist()
    if zero != 0 or last != [0, 0, 1] or not abs(skew) <= _SKEW * abs(fx):
        raise InputError(
            "wrong-content",
            f"expected a camera matrix fx 0 cx, 0 fy cy, 0 0 1, got {' '.join(f'{number:g}' for number in matrix)}.",
        )
    model = entries.get("model", "")
    if model not in _MODELS:
        raise InputError(
            "wrong-content",
            f"expected one of the distortion models {', '.join(filter(None, _MODELS))}, got {model!r}.",
        )
    mark = str(entries.get("fisheye", 0)).lower()
    marked = _numbers({"true": 1, "false": 0}.get(mark, mark), "a fisheye mark, 0 or 1,", 1)[0] != 0
    sides = entries.get("size", [entries.get("width"), entries.get("height")])
    size = None
    if sides != [None, None]:
        width, height = _numbers(sides, "an image size", 2)
        if not (1 <= width < 1e6 and 1 <= height < 1e6 and width % 1 == 0 and height % 1 == 0):
            raise InputError(
                "wrong-content", f"expected width and height in whole pixels, got {width:g} and {height:g}."
            )
        size = int(width), int(height)
    return Intrinsics(
        focal_px=(fx, fy),
        principal_point_px=(cx, cy),
        distortion=tuple(_numbers(entries.get("distortion", []), "distortion coefficients").tolist()),
        fisheye=_MODELS[model] or marked,
        image_size=size,
        name=name,
        source=source,
    )


def _numbers(value: Any, what: str, count: int | None = None) -> np.ndarray:
    """(N,) float64 of a number, a text of numbers, lists within lists, or OpenCV's matrix, whose numbers are `data`."""
    value = value.get("data") if isinstance(value, dict) else value
    try:
        numbers = np.array(value.split() if isinstance(value, str) else value, dtype=np.float64).ravel()
    except (ValueError, TypeError, OverflowError):
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all() or count not in (None, len(numbers)):
        finite = "finite numbers" if count is None else how_many(count, "finite number")
        raise InputError("wrong-content", f"expected {what} of {finite}, got {str(value)[:200]}.")
    return numbers
