"""The 70 keypoints of Meta's Momentum Human Rig out of SAM 3D Body and InstantHMR (formats.md section 6).

Neither program has a file of its own: SAM 3D Body's process_one_image returns a list with a dict for each person of an
image, and people save these dicts, or stack their arrays. Read are an .npz of stacked arrays, (frames, 70, 3) or
(frames, people, 70, 3), or (70, 3) of one person in one image; an .npz whose Python objects are the lists of dicts; a
folder of .npz, one a frame, numbered in its name, or one a person of an image, as in "img_0012_subj03.npz"; and JSON, a
list with the list of each frame or an object of lists by image; and the CSV of SAM3DBody-cpp, columns "left_knee_3DX,
_3DY, _3DZ" of one person, 0 where there is none. Keypoints are metres in camera axes about the body; the
translation beside them says where before the camera the body is, as far as the focal length is right that the program
assumed or estimated. Nobody is followed from frame to frame.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import MHR70
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import arrays_in, begins, keys, load
from .kit.clock import frame_number
from .kit.json import beginning, each, numbers
from .kit.people import People
from .kit.pickles import load_objects
from .kit.tables import header_of, read_points

name = "mhr70"
gives = "poses"
made_by = MadeBy("estimated", "SAM 3D Body or InstantHMR")
reads = ".npz, folder of .npz or JSON of SAM 3D Body or InstantHMR: 70 keypoints in camera axes, metres"

_KEYPOINTS = {  # the keypoints, and the translation that belongs to them
    "pred_keypoints_3d": "pred_cam_t",  # SAM 3D Body
    "joints_3d_local": "cam_trans",  # InstantHMR in Python
    "joints_3d": "cam_trans",  # InstantHMR's ONNX network
}
_SPELLED = {"l": "left", "r": "right", "toe": "toe_tip"} | {
    n: f"{n}_joint" for n in ("first", "second", "third")
}
_NAMES = [
    "_".join(_SPELLED.get(word, word) for word in joint.split("_")) for joint in MHR70.joints
]  # SAM3DBody-cpp's
_NUMBERS = ("frame_indices", "frame_index")  # the rows' video frames
_SHAPE = (len(MHR70), 3)
# Behind an image's name: one of its people.
_PERSON = re.compile(r"[_-](subj|subject|person|pid)[_-]?\d+$", re.IGNORECASE)


def sniff(path: Path) -> bool:
    if path.is_dir():
        first = next(iter(_files(path)), None)
        return first is not None and _is_archive(first)
    if _is_archive(path):
        return True
    if _is_table(path):
        return True
    content = beginning(path)
    frames = list(content.values()) if isinstance(content, dict) else content
    listed = (frame for frame in frames if isinstance(frame, list)) if isinstance(frames, list) else ()
    person = next((person for frame in listed for person in frame), None)
    return isinstance(person, dict) and _key(person) is not None


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by their boxes, else by nearness: MHR70 in CAMERA, metres.

    With translations the origin is the camera, else the body model. frame_index counts from 0; stacked arrays without
    `frame_indices` leave it unknown. A person of NaN was not found. The focal length that the program used is in
    the history. InputError when the file is not of this form, or has the translations of some people only.
    """
    sightings, placed, focal_px = People(str(path)), [], []
    known, frames = _frames(path)
    for number, held in frames:
        where = f"{path}, frame {number}"
        for person in _of_one_frame(held, where):
            key = _key(person) or ""
            keypoints = _array(person, key, _SHAPE, where)
            if np.isnan(keypoints).all():
                continue
            translation = _array(person, _KEYPOINTS[key], (3,), where)
            placed.append(bool(np.isfinite(translation).all()))
            focal_px.append(_array(person, "focal_length", (-1,), where)[0])
            box = _array(person, "bbox", (4,), where)
            sightings.add(number, keypoints + np.nan_to_num(translation), box=box)
    if any(placed) and not all(placed):
        raise InputError(
            "wrong-content",
            f"{path}: expected a translation (pred_cam_t, cam_trans) beside the keypoints of everybody or of nobody, "
            f"got {sum(placed)} of {len(placed)}; save them all again.",
        )
    frame = CAMERA.with_(origin="camera" if any(placed) else "body model")
    people = sightings.poses(MHR70, frame, placed=any(placed))
    people = tuple(poses.with_(frames_known=known) for poses in people)
    if np.isfinite(focal_px).any():
        people = tuple(poses.noted("estimator", focal_px=float(np.nanmedian(focal_px))) for poses in people)
    return people


def _array(person: Mapping[str, Any], name: str, shape: tuple[int, ...], where: str) -> np.ndarray:
    """A person's values of that name in this shape; NaN without them."""
    if person.get(name) is None:
        return np.full(np.abs(shape), np.nan)
    values = numbers(person[name], f"{where}, {name}")
    if values.size == 0 or (-1 not in shape and values.size != np.prod(shape)):
        raise InputError(
            "wrong-content", f"{where}: expected {name} of shape {shape} for each person, got {values.shape}."
        )
    return values.reshape(shape)


def _files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.glob("*.npz") if not file.name.startswith("."))


def _key(held: Iterable[str]) -> str | None:
    """The keypoints' name among those held; InstantHMR's only beside their translation, for the name is anybody's."""
    held = set(held)
    fits = (
        key
        for key, beside in _KEYPOINTS.items()
        if key in held and (beside in held or beside == "pred_cam_t")
    )
    return next(fits, None)


def _object_key(path: Path) -> str | None:
    """The array of Python objects in an .npz that begins as SAM 3D Body's dicts do."""
    return next(
        (key for key in sorted(arrays_in(path)) if b"pred_keypoints_3d" in begins(path, key)[1]), None
    )


def _is_table(path: Path) -> bool:
    header = header_of(path)
    return header is not None and set(_NAMES) <= header.points and header.dims == 3


def _is_archive(path: Path) -> bool:
    """Of stacked arrays or of one frame's, or of the dicts themselves."""
    key = _key(arrays_in(path))
    if key is None:
        return _object_key(path) is not None
    return begins(path, key)[0][-2:] == _SHAPE


def _frames(path: Path) -> tuple[bool, Iterable[tuple[int, Any]]]:
    """Whether the video frames are known, and number and people, in lists and dicts as the file holds them, of each."""
    if path.is_dir():
        return True, _of_folder(path)
    if (header := header_of(path)) is not None:
        if not _is_table(path):
            raise InputError(
                "wrong-content",
                f"{path}: expected the 70 keypoints of MHR, got {', '.join(sorted(header.points)[:8])}.",
            )
        table = read_points(path, "SAM3DBody-cpp's table")
        points = table.values[:, [table.names.index(name) for name in _NAMES], :3]
        points[(points == 0).all(axis=-1)] = np.nan
        return False, enumerate({"pred_keypoints_3d": row} for row in points)
    if not arrays_in(path):
        listed = enumerate(each(path, "SAM 3D Body's people of each frame"))
        return True, ((frame_number(image, str(path)) if image else i, held) for i, (image, held) in listed)
    held = _of_archive(path)
    if isinstance(held, list):
        return True, enumerate(held)
    if (key := _key(held)) is None:
        return True, [(0, held)]
    keypoints = held[key]
    several = keypoints.ndim in (3, 4)
    rows = _split(held, len(keypoints)) if several else [held]
    given = next((held[key] for key in _NUMBERS if several and key in held), None)
    frames = np.arange(len(rows)) if given is None else given
    whole = frames.shape == (len(rows),) and not ((frames % 1 != 0) | (frames < 0)).any()
    if not (several or keypoints.shape == _SHAPE) or not whole:
        raise InputError(
            "wrong-content",
            f"{path}: expected keypoints of shape (frames, 70, 3) or (frames, people, 70, 3), and the whole number of "
            f"its video frame for each row, from 0, got {keypoints.shape}.",
        )
    return given is not None, zip(frames.astype(np.int64).tolist(), rows, strict=True)


def _of_folder(path: Path) -> Iterator[tuple[int, Any]]:
    images: dict[int, str] = {}  # by frame
    for file in _files(path):
        image = _PERSON.sub("", file.stem)
        one_image = image != file.stem and not re.search(r"\d", image)  # its people alone are numbered
        frame = 0 if one_image else frame_number(image, str(file))
        if images.setdefault(frame, image) != image:
            raise InputError(
                "wrong-content",
                f"{path}: expected one .npz a frame, got {images[frame]} and {image} of frame {frame}; put everybody "
                "of a frame into one file, or name the files IMAGE_subj00.npz, IMAGE_subj01.npz, and put each video "
                "into a folder of its own.",
            )
        yield frame, _of_archive(file)


def _of_archive(path: Path) -> Any:
    """What an .npz holds: the lists and dicts of its Python objects, or its arrays by name."""
    if key := _object_key(path):
        return load_objects(path, key)
    key = _key(keys(path)) or ""
    wanted = (key, _KEYPOINTS.get(key), "focal_length", "bbox", *_NUMBERS)
    return {name: load(path, key=name) for name in keys(path) if name in wanted}


def _of_one_frame(held: Any, where: str) -> Iterator[Mapping[str, Any]]:
    if isinstance(held, list):
        for person in held:
            yield from _of_one_frame(person, where)
        return
    key = _key(held) if isinstance(held, Mapping) else None
    if key is None:
        raise InputError(
            "wrong-content",
            f"{where}: expected pred_keypoints_3d of each person, or joints_3d beside cam_trans, got another entry.",
        )
    several = isinstance(held[key], np.ndarray) and held[key].ndim > len(_SHAPE)
    yield from _split(held, len(held[key])) if several else [held]


def _split(held: Mapping[str, Any], count: int) -> list[dict[str, Any]]:
    """Arrays along their first axis, as far as it has this length; what has another is the same for all."""
    return [
        {name: values[i] if np.shape(values)[:1] == (count,) else values for name, values in held.items()}
        for i in range(count)
    ]
