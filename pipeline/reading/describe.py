"""What a file holds, in words, for a user whose file no adapter recognises. Nothing is unpickled."""

from __future__ import annotations

import json
import re
import zipfile
from collections import Counter
from pathlib import Path
from typing import IO

import numpy as np

from ..core.errors import InputError
from ..files.arrays import DAMAGE, arrays_in, damage_reported, header, load, opened
from ..files.atomic import read_summary
from ..files.names import KEYPOINTS, RECORDING

_NPY, _ZIP = b"\x93NUMPY", b"PK"
_KINDS = {  # by how files begin, some behind their length
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"WEBP": "a WebP image; save the recording itself as a video",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "compressed with gzip, and neither a table nor JSON that is known here",
    b"7z\xbc\xaf": "a 7z archive; unpack it first",
    b"MATLAB": "a file of MATLAB; load it with scipy.io or h5py and save the joints as .npy",
    b"Kaydara FBX": "an FBX; export BVH, which Blender does",
    b"<?xml": "XML; of Xsens MVN (.mvnx) export BVH or C3D",
    b"Format Version,": "a CSV of Motive; export BVH, C3D or TRC",
    b"NO_OF_FRAMES": "a table of Qualisys; export C3D",
    b"\x89HDF": "an HDF5 file; give DeepLabCut's CSV (save_as_csv=True), or save the joints as .npy (h5py)",
}
_OF_TRAINING = {"testbed": {"take_start", "lifted", "truth"}, "mocap": {"clip_start", "joints"}}
_MILLIMETRES = (500.0, 2500.0)  # how far a body's joints lie apart along an axis, crouching to standing
_LISTED = 6  # entries of an archive or kinds of files in a folder that are named
_SHOWN = 60  # characters of a text
_UNKNOWN = "no text, and of no kind of file that is known here"
_BROKEN = "JSON that is incomplete or damaged"
_WORD, _READ = re.compile(rb"[A-Za-z][A-Za-z0-9_]*"), 1 << 16  # in the first 64 KB of a text
_READ_JSON = 1 << 24  # a longer file is not read to find out whether it is whole


def in_words(path: Path) -> str:
    """A clause such as "an array of shape (30, 16, 3), float32", to be read after "it is". Never raises."""
    try:
        if path.is_dir():
            return _folder(path)
        with path.open("rb") as file:
            start = file.read(1 << 12)
            file.seek(0)
            if start.startswith(_NPY):
                return _array(file)
        if start.startswith(_ZIP) and path.suffix == ".npz":
            return _archive(path)
        if path.suffix.lower() == ".json":
            return _json(path, start)
    except OSError as error:
        return f"unreadable ({error.strerror or error})"
    except DAMAGE:
        return "damaged or cut short"
    kinds = (kind for begins, kind in _KINDS.items() if begins in (start[: len(begins)], start[8:12]))
    text = start.decode("utf-8-sig", "replace")[:16]
    is_text = text.translate(dict.fromkeys(b"\t\n\r")).isprintable() and "\ufffd" not in text
    return next(kinds, f"a file that begins with {text!r}" if is_text else _UNKNOWN)


def names_in(path: Path) -> set[str]:
    """Names of an .npz's arrays, or the words at the beginning of a text, or of a folder's first file. Never raises."""
    if path.is_dir():
        path = next((file for file in sorted(path.iterdir()) if file.is_file()), path)
    if arrays := arrays_in(path):
        return arrays
    try:
        with path.open("rb") as file:
            words = {word.decode() for word in _WORD.findall(file.read(_READ))}
        return words | {part for word in words for part in word.split("_")}
    except OSError:
        return set()


def shapes_in(path: Path) -> list[tuple[int, ...]]:
    """The shapes of an .npy's array, or of those of an .npz. Never raises."""
    shapes = []
    for key in arrays_in(path) or {None}:
        try:
            with damage_reported(path), opened(path, key) as (stream, _):
                shapes.append(header(stream, str(path))[0])
        except InputError:
            continue
    return shapes


def why_no_joints(path: Path) -> str:
    """A sentence on an array of joints that no format has, such as one in millimetres; "" for anything else. Never
    raises."""
    try:
        if not path.is_file():
            return ""
        joints = load(path)
    except InputError:
        return ""
    if joints.ndim != 3 or joints.shape[2] not in (2, 3):
        return ""
    if not np.isfinite(joints).any():
        return "Every coordinate in it is NaN: there are no poses in it."
    size = float(np.nanmedian(np.ptp(joints, axis=1).max(axis=-1)))
    if joints.shape[2] == 3 and _MILLIMETRES[0] < size < _MILLIMETRES[1]:
        return (
            f"A body in it measures {size:.0f}, as in millimetres: read it with --adapter arrays -O layout=H36M17 -O "
            "frame=CAMERA -O unit=mm, or whichever layout and axes it has."
        )
    return ""


def refuse_damaged(path: Path) -> None:
    """InputError for a file that no program can read, or that would run code: empty, cut short, damaged, or pickled."""
    try:
        load(path)
    except InputError as error:
        if error.code in ("file-damaged", "nothing-usable", "unsafe"):
            raise
    if path.suffix.lower() == ".json" and (words := in_words(path)).startswith(_BROKEN):
        raise InputError("file-damaged", f"{path} is {words}; write or copy it again.")


def why_no_input(path: Path, gives: str | None) -> str:
    """A sentence on a folder of results of ours, or a file in it, that no adapter reads, or on a file of many takes for
    training, and what to give instead; "" for anything else. gives: what was expected, as an adapter says it. Never
    raises."""
    if of := next((command for command, arrays in _OF_TRAINING.items() if arrays <= arrays_in(path)), ""):
        return f"{path} is a file of many takes for training (pcnet3d {of}); give a file of one take."
    folder = path if path.is_dir() else path.parent
    summary, keypoints = read_summary(folder), folder / KEYPOINTS
    files = summary.get("files")
    if "pcnet3d" not in summary or not isinstance(files, list) or path == keypoints:
        return ""
    if path != folder and path.name not in files:
        return ""
    shown = f" (pcnet3d view {folder} shows it)" if (folder / RECORDING).is_file() else ""
    flag = "" if gives in (None, "keypoints") else "--keypoints "
    also = f", or its 2D keypoints: {flag}{keypoints}" if keypoints.is_file() else ""
    return f"{path} is a result of pcnet3d{shown}; give the file that it was made from{also}."


def _folder(path: Path) -> str:
    kinds = Counter(file.suffix or "no suffix" for file in path.iterdir() if file.is_file())
    listed = ", ".join(f"{count} of {kind}" for kind, count in kinds.most_common(_LISTED))
    return f"a folder of {listed}" if listed else "a folder without files"


def _array(file: IO[bytes]) -> str:
    version = np.lib.format.read_magic(file)
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = header(file)
    what = "Python objects, which would have to be unpickled," if dtype.hasobject else str(dtype)
    return f"an array of shape {shape}, {what}".rstrip(",")


def _archive(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        arrays = [name for name in archive.namelist() if name.endswith(".npy")]
        listed = []
        for name in arrays[:_LISTED]:
            with archive.open(name) as file:
                listed.append(f"'{name.removesuffix('.npy')}' ({_array(file)})")
    more = f" and {len(arrays) - _LISTED} more" if len(arrays) > _LISTED else ""
    return f"an archive with {', '.join(listed) or 'no arrays'}{more}"


def _json(path: Path, start: bytes) -> str:
    if path.stat().st_size <= _READ_JSON:
        try:
            json.loads(path.read_bytes().decode("utf-8-sig"))
        except json.JSONDecodeError as error:
            return f"{_BROKEN} at line {error.lineno}, column {error.colno}"
        except (ValueError, RecursionError):
            return "JSON of another kind than detectors and lifters write"
    return f"JSON that begins with {start.decode('utf-8', 'replace')[:_SHOWN]!r}"
