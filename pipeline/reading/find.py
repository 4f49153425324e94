"""Which adapter reads a file: the one that is named, or the only one that recognises its content; and what a file
holds, in words, where none does. Nothing is unpickled."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Literal

import numpy as np

from ..core.errors import InputError
from ..core.messages import say
from ..files.arrays import keys, load, opened
from ..files.atomic import read_summary
from ..files.names import KEYPOINTS, RECORDING
from ..plugins import registry
from ..plugins.options import did_you_mean
from ..plugins.protocols import Adapter

_WORDS = {  # what it is, and how a run is given it
    "poses": ("3D poses", "give them with --poses"),
    "keypoints": ("2D keypoints", "give them with --keypoints"),
    "video": ("a video", "give it by itself, without an option's name before it"),
    "imu": (
        "an inertial sensor's recording",
        "compare a finished run with it by pcnet3d compare RESULTS --imu FILE",
    ),
}
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
_READ_JSON = 1 << 24  # a longer file is not read to find out whether it is whole
Gives = Literal["poses", "keypoints", "video", "imu"]


def adapters(gives: str | None = None) -> dict[str, Adapter]:
    """The registered adapters by name, those that give "poses", "keypoints", "video" or "imu" when asked."""
    loaded = registry.load_all("adapters")
    return {name: adapter for name, adapter in loaded.items() if gives in (None, adapter.gives)}


def find_adapter(path: Path, name: str = "auto", gives: str | None = None) -> Adapter:
    """The adapter of that name, or with "auto" the only one that recognises the file's content.

    gives: "poses", "keypoints", "video" or "imu"; without it, 3D poses come before anything else that fits.
    InputError when the name is unknown, when no adapter fits, or when several do.
    """
    if not (path.is_file() or path.is_dir()):
        there = "a device or a pipe" if path.exists() else "nothing"
        raise InputError("cannot-open", f"Expected a file or folder at {path}, found {there} there.")
    candidates = adapters(gives)
    if name in candidates:
        return candidates[name]
    if name != "auto":
        registry.load("adapters", name)  # says that there is none, or what is wrong with it
        raise InputError(
            "name-unknown", f"There is no adapter '{name}' for {gives}; {did_you_mean(name, candidates)}"
        )
    fits = [adapter for adapter in candidates.values() if recognises(adapter, path)]
    if gives is None:  # a folder of a vis.py holds both its 2D input and its 3D output
        fits = [adapter for adapter in fits if adapter.gives == "poses"] or fits
    fits = [adapter for adapter in fits if not getattr(adapter, "general", False)] or fits
    if len(fits) == 1:
        return fits[0]
    flag = "--set read.keypoints_adapter" if gives == "keypoints" else "--adapter"
    if fits:
        names = "; ".join(f"{adapter.name} ({adapter.reads})" for adapter in fits)
        raise InputError(
            "format-ambiguous",
            f"{path} fits several adapters, whose files look alike: {names}. Name the right one with {flag}.",
        )
    if reason := exchanged(path, gives) or why_no_input(path, gives):
        raise InputError("format-unknown", reason)
    refuse_damaged(path)
    reasons = [
        f" Adapter {adapter.name} does not take it: {lacking}."
        for adapter in candidates.values()
        if (lacking := getattr(adapter, "lacks", lambda path: "")(path))
    ]
    raise InputError(
        "format-unknown",
        f"No adapter recognises {path}: it is {in_words(path)}.{''.join(reasons)} `pcnet3d list adapters` says what "
        f"each reads; name one with {flag}.",
    )


def exchanged(path: Path, gives: str | None) -> str:
    """A sentence that names what the file is when it is not what was expected, and how to give it; "" when unknown."""
    others = [
        adapter for adapter in adapters().values() if adapter.gives != gives and recognises(adapter, path)
    ]
    if gives is None or not others:
        return ""
    what, how = _WORDS[others[0].gives]
    return f"Expected {_WORDS[gives][0]} in {path}, got {what} ({others[0].name}); {how}."


def recognises(adapter: Adapter, path: Path) -> bool:
    """Whether the adapter takes the file for one of its own. One that fails, which it never should, does not, with a
    warning on stderr: somebody's faulty package must not keep the others from reading."""
    try:
        with np.errstate(all="ignore"):  # whatever numbers a stranger's file has
            return adapter.sniff(path)
    except Exception as error:
        say("warning", f"adapter '{adapter.name}' failed at {path}: {error!r}")
        return False


def in_words(path: Path) -> str:
    """A clause such as "an array of shape (30, 16, 3), float32", to be read after "it is". Never raises."""
    try:
        if path.is_dir():
            kinds = Counter(file.suffix or "no suffix" for file in path.iterdir() if file.is_file())
            listed = ", ".join(f"{count} of {kind}" for kind, count in kinds.most_common(_LISTED))
            return f"a folder of {listed}" if listed else "a folder without files"
        with path.open("rb") as file:
            start = file.read(1 << 12)
        if start.startswith(b"\x93NUMPY") or (start.startswith(b"PK") and path.suffix == ".npz"):
            return _arrays(path)
        if path.suffix.lower() == ".json":
            return f"JSON that begins with {start.decode('utf-8', 'replace')[:_SHOWN]!r}"
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
    if path.suffix.lower() == ".json" and path.is_file() and path.stat().st_size <= _READ_JSON:
        try:
            json.loads(path.read_bytes().decode("utf-8-sig"))
        except json.JSONDecodeError as error:
            raise InputError(
                "file-damaged",
                f"{path} is JSON that is incomplete or damaged at line {error.lineno}, column {error.colno}; write or "
                "copy it again.",
            ) from None
        except (OSError, ValueError, RecursionError):
            pass  # unreadable, or of another kind than detectors and lifters write


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


def _arrays(path: Path) -> str:
    """InputError for a damaged file."""
    names = keys(path)
    listed = []
    for name in names[:_LISTED] or [None]:
        with opened(path, name) as (shape, _, dtype, *_):
            kind = "Python objects, which would have to be unpickled" if dtype.hasobject else str(dtype)
        listed.append(f"'{name}' ({shape}, {kind})" if name else f"an array of shape {shape}, {kind}")
    if not names:
        return listed[0]
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return f"an archive with {', '.join(listed)}{more}"
