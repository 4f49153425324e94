"""Files in, checked pose sequences out: the adapter that reads a file, by name or by its content, or in words what the
file holds where none does; its people; their poses normalised, with left and right guarded. Nothing is unpickled."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.conversions import body_in, change_frame, remap
from ..core.errors import InputError
from ..core.frames import CAMERA
from ..core.layouts import layout_named
from ..core.messages import how_many, say
from ..core.notices import notice
from ..core.pose import UNSAID, PoseSequence, Step, package_version
from ..core.take import SILENT, Check, Handedness, Told, Video
from ..files.arrays import keys, opened
from ..files.arrays import load as load_array
from ..files.atomic import printable, read_summary
from ..files.names import KEYPOINTS, RECORDING
from ..plugins import registry
from ..plugins.options import call, did_you_mean, option_types
from ..plugins.protocols import Adapter
from ..signals.checks import empty_rows, whole_rows
from .bounds import check_size, check_times, timed
from .findings import guarded
from .joint_order import check_order
from .people import choose_person

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
    b"\xff\xfe": "text in UTF-16; save it as UTF-8",
    b"\xfe\xff": "text in UTF-16; save it as UTF-8",
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
        load_array(path)
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


@dataclass(frozen=True, eq=False)
class Source:
    """A file or folder, the name of its adapter, and everybody in it as the adapter gives them: in its own layout and
    frame. where: what it is, for errors. digest: SHA-256 of what was given in memory (reading/given.py)."""

    path: Path
    adapter: str
    people: tuple[PoseSequence, ...]
    where: str
    digest: str = ""

    def normalised(self, person: PoseSequence, fps: float | None = None, told: Told = SILENT) -> PoseSequence:
        """One of the people, as read_all gives them: 2D as it is; 3D in our joints and axes, relative to the pelvis,
        guarded. told: its handedness and check count. Raises InputError."""
        poses = person
        if not self.digest:
            options = {"adapter": self.adapter, "file": printable(self.path.name), "person": person.person}
            poses = poses.with_(history=(Step("read", package_version(), options), *poses.history))
        poses = poses if fps is None else timed(poses, fps)
        check_size(poses, self.where)
        if poses.frame.dims == 2:
            return poses
        poses = _missing(poses, self.where)
        poses = remap(poses, body_in(poses))
        own = CAMERA if poses.frame.family == "camera" else poses.frame
        unit = "m" if poses.frame.metric else poses.frame.unit
        poses = change_frame(poses, own.with_(origin="pelvis", unit=unit))
        return guarded(poses, told.handedness, self.where, told.check)


def _missing(poses: PoseSequence, where: str) -> PoseSequence:
    """Frames with NaN, and those of zeros as gaps, counted. InputError where no frame has a pose."""
    empty = empty_rows(poses)
    gone = ~whole_rows(poses) & ~empty
    if empty.all() or np.isnan(poses.joints).all():
        raise InputError(
            "nothing-usable",
            f"{where}: in each of {how_many(len(poses), 'frame')} all joints are NaN or at one point; there are no "
            "poses in it.",
        )
    if not (empty | gone).any():
        return poses
    counts = {"frames with NaN": int(gone.sum()), "frames with all joints at one point": int(empty.sum())}
    counted = ", ".join(
        how_many(count, what.replace("frames", "frame", 1), what) for what, count in counts.items() if count
    )
    poses = poses.with_(joints=np.where(empty[:, None, None], np.nan, poses.joints))
    return poses.noted("missing", **counts).saying(notice("frames-as-gaps", counts=counted))


def read_all(
    path: str | Path,
    adapter: str = "auto",
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    check: Check = "refuse",
    **options: Any,
) -> tuple[PoseSequence, ...]:
    """Every person in a file.

    adapter: a registered name, or "auto" to recognise the file by its content.
    gives: read only as "poses" (3D) or only as "keypoints" (2D).
    fps: frame rate, for files that do not know theirs.
    handedness: what to do when left and right contradict nose and knees: "refuse", "mirror" the coordinates,
        "swap" the names, "swap-legs" only, or "ignore".
    check: "off" reads a body that is mirrored or upside down as it is.
    options: the adapter's own.

    3D comes back as H36M17 in CAMERA axes (or in the source's own frame, when that is no camera's) relative
    to the pelvis, whose own way is `root` where the source knows it; 2D in IMAGE, in the detector's layout. Raises
    InputError.
    """
    source, told = load(Path(path), adapter, gives, options), Told(handedness=handedness, check=check)
    return tuple(_clocked(source, person, fps, told) for person in source.people)


def read(
    path: str | Path,
    adapter: str = "auto",
    person: str | None = None,
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    check: Check = "refuse",
    **options: Any,
) -> PoseSequence:
    """One person from a file: by the file's own name, "longest", "largest" (see choose_person), or the only one.

    Other arguments are those of read_all. What is wrong with the others does not matter. InputError when there are
    several and none is named.
    """
    source, told = load(Path(path), adapter, gives, options), Told(handedness=handedness, check=check)
    return _clocked(source, choose_person(source.people, person, str(path)), fps, told)


def _clocked(source: Source, person: PoseSequence, fps: float | None, told: Told) -> PoseSequence:
    """One of the people, `normalised`; InputError for times that no recording has."""
    poses = source.normalised(person, fps, told)
    if poses.time_s is not None:
        check_times(poses.time_s, str(source.path))
    return poses


def load(
    path: Path,
    adapter: str,
    gives: Gives | None,
    options: dict[str, Any],
    image_size: tuple[int, int] | None = None,
) -> Source:
    """What is in a file, read by the adapter of that name, or with "auto" by the only one that recognises it.

    options: the adapter's own, and for any 2D keypoints `layout`, the order of their joints if it is not the one that
    the format has. image_size: of the video, or as told, for an adapter that needs it. InputError as for read_all, and
    for 2D joints whose bones are those of a body in another order only.
    """
    chosen = find_adapter(path, adapter, gives)
    if chosen.gives not in ("poses", "keypoints"):
        raise InputError(
            "format-unknown", f"{path} is a file of {chosen.gives}; expected one of poses or keypoints."
        )
    try:
        people = _people(chosen, path, options, image_size)
        where = str(path) if chosen.gives == "keypoints" else f"{path} (adapter {chosen.name})"
        return Source(path, chosen.name, people, where)
    except InputError as error:
        sentence = str(error) if str(path) in str(error) else f"{path}: {error}"
        others = [other for other in adapters().values() if other is not chosen and recognises(other, path)]
        alike = [other.name for other in others if gives in (None, other.gives)]
        if adapter != "auto" and alike:
            sentence += f" It looks like a file for adapter {' or '.join(alike)}."
        elif adapter != "auto" and others:
            sentence += f" {exchanged(path, gives)}"
        raise InputError(error.code, sentence) from None


def _people(
    adapter: Adapter, path: Path, options: dict[str, Any], image_size: tuple[int, int] | None
) -> tuple[PoseSequence, ...]:
    """Everybody whom an adapter reads, 2D keypoints in the order of joints that is said, or that their bones show to be
    right. InputError for nobody, and for anything but people."""
    takes, own = option_types(adapter.read), dict(options)
    layout = own.pop("layout", None) if adapter.gives == "keypoints" and "layout" not in takes else None
    if "image_size" in takes and image_size is not None:
        own.setdefault("image_size", image_size)
    people: Any = call(adapter.read, path, what=f"Adapter '{adapter.name}'", options=own)
    if not isinstance(people, tuple | list) or {type(person) for person in people} != {PoseSequence}:
        raise InputError(
            "plugin-broken",
            f"Expected a tuple of people (PoseSequence) from adapter '{adapter.name}', got {people!r:.60}; repair its "
            "package (docs/python.md), or name another adapter.",
        )
    made_by = getattr(adapter, "made_by", UNSAID)
    people = tuple(each.with_(made_by=made_by) if each.made_by == UNSAID else each for each in people)
    usual = people[0].layout
    if adapter.gives == "poses":
        return people
    if layout is not None:
        said = layout_named(layout)
        if len(said) != len(usual):
            raise InputError(
                "bad-value",
                f"Expected a layout of {how_many(len(usual), 'joint')}, as the file has, got {layout}.",
            )
        return tuple(each.with_(layout=said) for each in people)
    points = np.concatenate([each.joints for each in people])
    way_out = (
        f"--set keypoints.layout={{0}} (-O layout={{0}}), and with layout={usual.name} that they are not"
    )
    check_order(points, usual, "", way_out)
    return people


def read_video(path: Path) -> Video:
    """The video's description. InputError when it cannot be opened."""
    adapter = find_adapter(path, "video", "video")
    if not recognises(adapter, path) and (why := exchanged(path, "video") or why_no_input(path, "video")):
        raise InputError("format-unknown", why)
    if path.is_dir():
        raise InputError(
            "cannot-open",
            f"Expected a video file at {path}, found a folder there; of images make a video first (ffmpeg -framerate "
            "FPS -pattern_type glob -i 'FOLDER/*.png' video.mp4).",
        )
    return call(adapter.read, path, what="Adapter 'video'", options={})[0]
