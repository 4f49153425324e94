"""What a file holds, in words, for a user whose file no adapter recognises. Nothing is unpickled."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

from ..core.errors import InputError
from ..files.arrays import damage_reported, header, keys, load, opened
from ..files.atomic import read_summary
from ..files.names import KEYPOINTS, RECORDING

_KINDS = {  # by how files begin, some behind their length
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"WEBP": "a WebP image; save the recording itself as a video",
    b"%PDF": "a PDF document",
    b"PK": "a zip archive; unpack it, but of PyTorch's (.pt of GVHMR and GEM-X), which holds parameters of a body "
    "model, run the model on them and save its joints with a frame rate as .npz for adapter amass, or write a BVH",
    b"\x1f\x8b": "compressed with gzip, and neither a table nor JSON that is known here",
    b"7z\xbc\xaf": "a 7z archive; unpack it first",
    b"MATLAB": "a file of MATLAB; load it with scipy.io or h5py and save the joints as .npy",
    b"Kaydara FBX": "an FBX; export BVH, which Blender does",
    b"<?xml": "XML; of Xsens MVN (.mvnx) export BVH or C3D",
    b"Format Version,": "a CSV of Motive; export BVH, C3D or TRC",
    b"NO_OF_FRAMES": "a table of Qualisys; export C3D",
    b"\x89HDF": "an HDF5 file; give DeepLabCut's CSV (save_as_csv=True), or save the joints as .npy (h5py)",
}
_LISTED = 6  # entries of an archive or kinds of files in a folder that are named
_SHOWN = 60  # characters of a text
_UNKNOWN = "no text, and of no kind of file that is known here"
_BROKEN = "JSON that is incomplete or damaged"
_READ_JSON = 1 << 24  # a longer file is not read to find out whether it is whole


def in_words(path: Path) -> str:
    """A clause such as "an array of shape (30, 16, 3), float32", to be read after "it is". Never raises."""
    try:
        if path.is_dir():
            return _folder(path)
        with path.open("rb") as file:
            start = file.read(1 << 12)
        if start.startswith(b"\x93NUMPY") or (start.startswith(b"PK") and path.suffix == ".npz"):
            return _arrays(path)
        if path.suffix.lower() == ".json":
            return _json(path, start)
    except OSError as error:
        return f"unreadable ({error.strerror or error})"
    except InputError:
        return "damaged or cut short"
    kinds = (kind for begins, kind in _KINDS.items() if begins in (start[: len(begins)], start[8:12]))
    text = start.decode("utf-8-sig", "replace")[:16]
    is_text = text.translate(dict.fromkeys(b"\t\n\r")).isprintable() and "\ufffd" not in text
    return next(kinds, f"a file that begins with {text!r}" if is_text else _UNKNOWN)


def refuse_damaged(path: Path) -> None:
    """InputError for a file that no program can read, or that would run code: empty, cut short, damaged, or pickled."""
    try:
        load(path)
    except InputError as error:
        if error.code in ("file-damaged", "nothing-usable", "unsafe"):
            raise
    if path.suffix.lower() == ".json" and (reason := in_words(path)).startswith(_BROKEN):
        raise InputError("file-damaged", f"{path} is {reason}; write or copy it again.")


def why_no_input(path: Path, gives: str | None) -> str:
    """A sentence on a folder of results of ours, or a file in it, that no adapter reads, and what to give instead; ""
    for anything else. gives: what was expected, as an adapter says it. Never raises."""
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


def _arrays(path: Path) -> str:
    """InputError for a damaged file."""
    names = keys(path)
    listed = []
    for name in names[:_LISTED] or [None]:
        with damage_reported(path), opened(path, name) as (stream, _):
            shape, _, dtype = header(stream, str(path))
        kind = "Python objects, which would have to be unpickled" if dtype.hasobject else str(dtype)
        listed.append(f"'{name}' ({shape}, {kind})" if name else f"an array of shape {shape}, {kind}")
    if not names:
        return listed[0]
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return f"an archive with {', '.join(listed)}{more}"


def _json(path: Path, start: bytes) -> str:
    if path.stat().st_size <= _READ_JSON:
        try:
            json.loads(path.read_bytes().decode("utf-8-sig"))
        except json.JSONDecodeError as error:
            return f"{_BROKEN} at line {error.lineno}, column {error.colno}"
        except (ValueError, RecursionError):
            return "JSON of another kind than detectors and lifters write"
    return f"JSON that begins with {start.decode('utf-8', 'replace')[:_SHOWN]!r}"
