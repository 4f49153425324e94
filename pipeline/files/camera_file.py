"""Files of calibrated cameras, recognised by content:

| program | file |
|---|---|
| OpenCV, and scripts that follow its tutorials | YAML, JSON or XML with a camera matrix and distortion coefficients |
| ROS | camera_info in YAML |
| COLMAP | cameras.txt |
| Pose2Sim, Caliscope, FreeMoCap, Anipose | TOML with a section for each camera |
| Qualisys Track Manager | .qca.txt, which is XML |

Only what is within a camera is read. Pose2Sim's, Caliscope's and Qualisys' files know its orientation as well, in a
world that often has z up; but none of them promises that: Pose2Sim and Caliscope take the axes of whatever lay in the
scene, a board or a set of points, and the first camera's where nothing did, and Qualisys lets its user turn them. A
wrong vertical that a file vouches for would be worse than none, so gravity is never taken from it.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..core.errors import InputError, readable
from ..core.intrinsics import Intrinsics
from ..plugins.options import did_you_mean
from .number_yaml import number_yaml

_LARGEST = 1 << 20  # bytes; a camera takes some hundred
_SKEW = 0.01  # of the focal length; what calibrations that fit it find, and OpenCV's models leave out
_FORMATS = (
    "a camera's calibration: OpenCV's YAML, JSON or XML, ROS's camera_info, COLMAP's cameras.txt, Pose2Sim's or "
    "Caliscope's .toml or Qualisys' .qca.txt"
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

# COLMAP's camera models by their parameters (src/colmap/sensor/models.h).
_COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
}
_COLMAP_LINE = re.compile(r"[ \t]*\d+[ \t]+[A-Z][A-Z_]+[ \t]+\d")

Camera = dict[str, Any]


def read_camera(
    path: str | Path, name: str | None = None, image_size: tuple[int, int] | None = None
) -> Intrinsics:
    """The intrinsics of one camera of a calibration file.

    name: of the camera, where the file holds several: COLMAP's number, Pose2Sim's name, Qualisys' serial number.
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
    parse, damage = _parser(text)
    try:
        found = [(name or path.stem, camera) for name, camera in parse(text)]
    except damage as error:
        said = f" ({str(error).strip().splitlines()[-1]})" if str(error).strip() else ""
        raise InputError(
            "format-unknown", f"Expected {_FORMATS}; {path} is not one, or is damaged{said}."
        ) from None
    except RecursionError:
        raise InputError("unsafe", f"Expected {_FORMATS}; {path} nests its values too deeply.") from None
    except InputError as error:
        raise InputError(error.code, f"{path}: {error}") from None
    if not found:
        raise InputError("wrong-content", f"Expected {_FORMATS}; {path} has no camera matrix.")
    cameras = dict(found)
    if len(cameras) < len(found):
        raise InputError(
            "wrong-content",
            f"{path}: expected cameras with different names, got {', '.join(name for name, _ in found)}.",
        )
    return cameras


def _text(path: Path) -> str:
    with readable(path, _FORMATS):
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise InputError("unsafe", f"Expected {_FORMATS}; {path} is larger than {_LARGEST} bytes.")
        return content.decode("utf-8-sig")


def _parser(text: str) -> tuple[Callable[[str], Iterable[tuple[str, Camera]]], type[Exception]]:
    """What reads a text that begins like this one, and what it raises for a damaged one."""
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "").lstrip()
    if first.startswith("<"):
        return _of_xml, ElementTree.ParseError
    if first.startswith("{"):
        return lambda text: _in_tree(json.loads(text)), ValueError
    if _COLMAP_LINE.match(first):
        return _of_colmap, ValueError
    if re.match(r"\[|[\w.\"'-]+[ \t]*=", first):
        return lambda text: _in_tree(tomllib.loads(text)), ValueError
    return lambda text: _in_tree(number_yaml(text)), ValueError


def _in_tree(tree: Any, name: str = "") -> Iterator[tuple[str, Camera]]:
    """Every mapping with a camera matrix, by the name that it states or has where it lies; "" for the whole file."""
    if not isinstance(tree, dict):
        return
    entries = {str(key).lower().replace("_", ""): value for key, value in tree.items()}
    if _first(entries, _MATRIX) is not None:
        own = _first(entries, _NAME)
        yield (own if isinstance(own, str) and own else name), entries
        return
    for key, value in tree.items():
        yield from _in_tree(value, str(key))


def _of_xml(text: str) -> Iterator[tuple[str, Camera]]:
    """OpenCV's or Qualisys'."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(
            "unsafe", "expected a calibration without a document type of its own, got XML with one."
        )
    root = ElementTree.fromstring(text)
    found = root.findall("cameras/camera")
    for number, camera in enumerate(found):
        intrinsic = camera.find("intrinsic")
        if intrinsic is not None:
            yield camera.get("serial", str(number)), _of_qualisys(intrinsic, camera.find("fov_video"))
    if not found:
        yield from _in_tree(_branch(root))


def _branch(element: ElementTree.Element) -> Any:
    return {child.tag: _branch(child) for child in element} if len(element) else (element.text or "")


def _of_qualisys(intrinsic: ElementTree.Element, shown: ElementTree.Element | None) -> Camera:
    """Lengths are in 1/64 of the sensor's pixels, of which the video shows the part `fov_video`, borders included.

    Distortion coefficients have no unit: Pose2Sim 0.10 divides them by 64 as well, but OpenCV's calibration of the same
    cameras in its demonstration (Calib_scene.toml) finds k1, k2 = -0.053, 0.151 where Qualisys wrote -0.046, 0.140.
    """
    unit = 64

    def of(element: ElementTree.Element, key: str, otherwise: str | None = None) -> float:
        return float(_numbers(element.get(key, otherwise), f"{element.tag} {key}", 1)[0])

    if shown is None:
        left, top = (of(intrinsic, f"sensorMin{axis}", "0") / unit for axis in "UV")
        right, bottom = ((of(intrinsic, f"sensorMax{axis}") + 1) / unit - 1 for axis in "UV")
    else:
        left, top, right, bottom = (of(shown, side) for side in ("left", "top", "right", "bottom"))
    fx, fy, cx, cy = (
        of(intrinsic, f"{what}{axis}") / unit for what in ("focalLength", "centerPoint") for axis in "UV"
    )
    skew = of(intrinsic, "skew", "0") / unit
    # In their spelling.
    keys = ("radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2")
    return {
        "matrix": [fx, skew, cx - left, 0, fy, cy - top, 0, 0, 1],
        "distortion": [*(of(intrinsic, key) for key in keys), of(intrinsic, "radialDistortion3", "0")],
        "size": [right - left + 1, bottom - top + 1],
    }


def _of_colmap(text: str) -> Iterator[tuple[str, Camera]]:
    for line in text.splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 4 or words[1] not in _COLMAP:
            known = f"number, model, width, height and parameters of one of the models {', '.join(_COLMAP)}"
            raise InputError("wrong-content", f"expected {known}, got '{line.strip()}'.")
        keys = _COLMAP[words[1]].split()
        what = f"{words[1]} with the parameters {' '.join(keys)}"
        given = dict(zip(keys, _numbers(words[4:], what, len(keys)).tolist(), strict=True))
        fx, fy = (given.get(key, given.get("f")) for key in ("fx", "fy"))
        # COLMAP's first pixel begins at 0, OpenCV's has its centre there.
        cx, cy = given["cx"] - 0.5, given["cy"] - 0.5
        bent = [key for key in keys if key[0] in "kp"]
        order = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
        fisheye = words[1] == "OPENCV_FISHEYE"
        padded = bent if fisheye or not bent else order[: max(4, len(bent))]
        yield (
            words[0],
            {
                "matrix": [fx, 0, cx, 0, fy, cy, 0, 0, 1],
                "distortion": [given.get(key, 0.0) for key in padded],
                "size": words[2:4],
                "fisheye": fisheye,
            },
        )


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
    given, model = _first(camera, _DISTORTION), _first(camera, _MODEL)
    if model not in (None, *_FISHEYE_MODELS, *_POLYNOMIAL_MODELS):
        raise InputError(
            "wrong-content",
            f"{where}: expected one of the distortion models {', '.join(filter(None, _POLYNOMIAL_MODELS))} and "
            f"{', '.join(_FISHEYE_MODELS)}, got {model!r}.",
        )
    marked = _first(camera, _FISHEYE) or 0
    return Intrinsics(
        focal_px=(fx, fy),
        principal_point_px=(cx, cy),
        distortion=() if given is None else tuple(_numbers(given, f"{where}: distortion").tolist()),
        fisheye=model in _FISHEYE_MODELS or bool(_numbers(marked, f"{where}: fisheye", 1)[0]),
        image_size=_size(camera, where),
        name=name,
        source=source,
    )


def _size(camera: Camera, where: str) -> tuple[int, int] | None:
    given = _first(camera, _SIZE)
    if given is None:
        sides = [_first(camera, _WIDTH), _first(camera, _HEIGHT)]
        if None in sides:
            return None
        given = sides
    width, height = _numbers(given, f"{where}: image size", 2)
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
