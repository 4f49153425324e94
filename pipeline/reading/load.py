"""Files in, checked pose sequences out: adapter chosen by content, joints remapped, left and right guarded."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from ..errors import InputError
from ..files.atomic import printable
from ..frames import CAMERA, change_frame
from ..layouts import H36M17, remap
from ..messages import say
from ..motion.checks import chirality, empty_rows
from ..motion.rates import timed
from ..plugins import registry
from ..plugins.options import call, did_you_mean
from ..plugins.protocols import Adapter
from ..pose import PoseSequence, Step, package_version
from ..rotations import known, rotate
from .describe import in_words, why_no_joints

Parity = Literal["refuse", "mirror", "swap", "swap-legs", "ignore"]
Missing = Literal["refuse", "gap"]
_WORDS = {  # what it is, and how a run is given it
    "poses": ("3D poses", "give them with --poses"),
    "keypoints": ("2D keypoints", "give them with --keypoints"),
    "video": ("a video", "give it by itself, without an option's name before it"),
    "imu": ("an inertial sensor's recording", "compare a finished run with it by pcnet3d imu"),
}
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
    if not path.exists():
        raise InputError(f"Expected a file or folder at {path}, found nothing there.")
    known = adapters(gives)
    if name != "auto":
        if name not in known:
            if name in registry.registered("adapters") and name not in adapters():
                registry.load("adapters", name)  # says what is wrong with it
            raise InputError(
                f"There is no adapter '{name}' for {gives or 'files'}; {did_you_mean(name, known)}"
            )
        return known[name]
    fits = [adapter for adapter in known.values() if recognises(adapter, path)]
    if gives is None:  # a folder of a vis.py holds both its 2D input and its 3D output
        fits = [adapter for adapter in fits if adapter.gives == "poses"] or fits
    if len(fits) == 1:
        return fits[0]
    flag = "--set read.keypoints_adapter" if gives == "keypoints" else "--adapter"
    if why := why_no_joints(path):
        raise InputError(f"{path} is {in_words(path)}. {why}")
    if fits:
        names = ", ".join(adapter.name for adapter in fits)
        raise InputError(f"{path} fits several adapters: {names}; name the right one with {flag}.")
    if others := exchanged(path, gives):
        raise InputError(others)
    raise InputError(
        f"No adapter recognises {path} as {gives or 'poses'}: it is {in_words(path)}. If it is one of "
        f"{', '.join(known)}, name it with {flag}."
    )


def exchanged(path: Path, gives: str | None) -> str:
    """A sentence that names what the file is when it is not what was expected, and how to give it; "" when unknown."""
    others = [one for one in adapters().values() if one.gives != gives and recognises(one, path)]
    if gives is None or not others:
        return ""
    what, how = _WORDS[others[0].gives]
    return f"Expected {_WORDS[gives][0]} in {path}, got {what} ({others[0].name}); {how}."


def recognises(adapter: Adapter, path: Path) -> bool:
    """Whether the adapter takes the file for one of its own. One that fails, which it never should, does not, with a
    warning on stderr: somebody's faulty package must not keep the others from reading."""
    try:
        return adapter.sniff(path)
    except Exception as error:
        say("warning", f"adapter '{adapter.name}' failed at {path}: {error!r}")
        return False


def read_all(
    path: str | Path,
    adapter: str = "auto",
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    parity: Parity = "refuse",
    missing: Missing = "refuse",
    **options: Any,
) -> tuple[PoseSequence, ...]:
    """Every person in a file.

    adapter: a registered name, or "auto" to recognise the file by its content.
    gives: read only as "poses" (3D) or only as "keypoints" (2D).
    fps: frame rate, for files that do not know theirs.
    parity: what to do when left and right contradict nose and knees: "refuse", "mirror" the coordinates,
        "swap" the names, "swap-legs" only, or "ignore".
    missing: what to do with 3D frames that are NaN or all zero: "refuse", or take them for a "gap".
    options: the adapter's own.

    3D comes back as H36M17 in CAMERA axes (or in the source's own frame, when that is no camera's) relative
    to the pelvis, whose own way is `root` where the source knows it; 2D in IMAGE, in the detector's layout. Raises
    InputError.
    """
    check_guards(parity, missing)
    chosen, people = read_sources(Path(path), adapter, gives, options)
    return tuple(finished(person, chosen, Path(path), fps, parity, missing) for person in people)


def check_guards(parity: str, missing: str) -> None:
    """InputError for a guard that there is not."""
    for name, value, allowed in (
        ("parity", parity, get_args(Parity)),
        ("missing", missing, get_args(Missing)),
    ):
        if value not in allowed:
            raise InputError(f"Expected {name} to be one of {', '.join(allowed)}; got '{value}'.")


def read_sources(
    path: Path, adapter: str, gives: Gives | None, options: dict[str, Any]
) -> tuple[Adapter, tuple[PoseSequence, ...]]:
    """The adapter and what it gives, in the source's own layout and frame. InputError as for read_all."""
    chosen = find_adapter(path, adapter, gives)
    if chosen.gives not in ("poses", "keypoints"):
        raise InputError(f"{path} is a file of {chosen.gives}; expected one of poses or keypoints.")
    try:
        return chosen, call(chosen.read, path, what=f"Adapter '{chosen.name}'", options=options)
    except InputError as error:
        said = str(error) if str(path) in str(error) else f"{path}: {error}"
        others = [other for other in adapters().values() if other is not chosen and recognises(other, path)]
        alike = [other.name for other in others if gives in (None, other.gives)]
        if adapter != "auto" and alike:
            said += f" It looks like a file for adapter {' or '.join(alike)}."
        elif adapter != "auto" and others:
            said += f" {exchanged(path, gives)}"
        raise InputError(said) from None


def read(
    path: str | Path,
    adapter: str = "auto",
    person: str | None = None,
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    parity: Parity = "refuse",
    missing: Missing = "refuse",
    **options: Any,
) -> PoseSequence:
    """One person from a file: by the file's own name, "longest", "largest" (see choose_person), or the only one.

    Other arguments are those of read_all. What is wrong with the others does not matter. InputError when there are
    several and none is named.
    """
    check_guards(parity, missing)
    chosen, people = read_sources(Path(path), adapter, gives, options)
    return finished(choose_person(people, person, str(path)), chosen, Path(path), fps, parity, missing)


def choose_person(people: tuple[PoseSequence, ...], person: str | None, where: str) -> PoseSequence:
    """The one of that name, or the only one; otherwise InputError.

    people: as an adapter gives them. "longest": the one with the most frames. "largest": the one who takes the most of
    the picture, by the mean area of the box around the joints of each frame, in pixels for 2D; 3D poses of a camera
    count as a camera far away would see them, in their own unit, whatever their distance.
    """
    if person in RANKS:
        ranks = [RANKS[person](poses, where) for poses in people]
        people = tuple(poses for poses, rank in zip(people, ranks, strict=True) if rank == max(ranks))
        person = None
    if person is None and len(people) == 1:
        return people[0]
    names = {poses.person: poses for poses in people}
    listed = ", ".join(f"{name} ({len(poses)} frames)" for name, poses in names.items())
    if person is None:
        raise InputError(
            f"{where} holds {len(people)} people: {listed}; choose one with --person, or 'longest' or 'largest'."
        )
    if person not in names:
        raise InputError(f"{where} has no person '{person}'; it holds {listed}.")
    return names[person]


def _area(poses: PoseSequence, where: str) -> float:
    """Mean area of the box around the joints in the plane of the picture; -1 for a person without a joint."""
    if poses.frame.family not in ("image", "camera"):
        raise InputError(
            f"{where} holds poses in a world's axes ({poses.frame}), so nobody is the largest in a picture; choose by "
            "name, or 'longest'."
        )
    picture = poses.frame.basis.T[:2]  # right and down, from the file's axes
    seen = rotate(picture, poses.joints)[known(poses.joints).any(axis=1)]
    sides = np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)
    return float(np.prod(sides, axis=1).mean()) if len(seen) else -1.0


RANKS = {"longest": lambda poses, where: len(poses), "largest": _area}


def finished(
    poses: PoseSequence, adapter: Adapter, path: Path, fps: float | None, parity: Parity, missing: Missing
) -> PoseSequence:
    """What an adapter read, as read_all gives it: remapped, relative to the pelvis, guarded. Raises InputError."""
    options = {"adapter": adapter.name, "file": printable(path.name), "person": poses.person}
    poses = poses.with_(history=(Step("read", package_version(), options), *poses.history))
    if fps is not None:
        poses = timed(poses, fps)
    if adapter.gives == "keypoints":
        return poses
    poses = remap(_missing(poses, path, missing), H36M17)
    own = CAMERA if poses.frame.family == "camera" else poses.frame
    poses = change_frame(
        poses, own.with_(origin="pelvis", unit="m" if poses.frame.metric else poses.frame.unit)
    )
    return guarded(poses, parity, f"{path} (adapter {adapter.name})")


def _missing(poses: PoseSequence, path: Path, missing: Missing) -> PoseSequence:
    empty, gone = empty_rows(poses), np.isnan(poses.joints).any(axis=(1, 2))
    if empty.all():
        raise InputError(
            f"{path}: all {len(poses)} frames have every joint on one point; there are no poses in it."
        )
    if np.isnan(poses.joints).all():
        raise InputError(f"{path}: every coordinate is NaN; there are no poses in it.")
    if not (empty | gone).any():
        return poses
    counts = {"frames with NaN": int(gone.sum()), "frames with all joints on one point": int(empty.sum())}
    if missing == "refuse":
        first = int(np.argmax(empty | gone))
        said = " and ".join(f"{count} {what}" for what, count in counts.items() if count)
        raise InputError(
            f"{path}: expected a pose in each of {len(poses)} frames, got {said} (first at row {first}); "
            "pass --set read.missing=gap to take them for gaps."
        )
    return poses.with_(joints=np.where(empty[:, None, None], np.nan, poses.joints)).noted("missing", **counts)


def guarded(poses: PoseSequence, parity: Parity, where: str) -> PoseSequence:
    """The poses with left and right put right as asked; with "refuse", InputError when they are wrong.

    poses: H36M17 in 3D. where: what they come from, for the error. A doubt goes into the history as a warning.
    """
    if parity != "refuse":
        poses = repaired(poses, parity)
        evidence = chirality(poses)
        if evidence.verdict != "good":
            poses = poses.noted(
                "parity", warning=f"left and right are {evidence.verdict} as asked for: {evidence}"
            )
        return poses
    evidence = chirality(poses)
    if evidence.verdict == "legs against arms":
        raise InputError(
            f"{where}: left and right of the legs contradict those of the arms: {evidence}; "
            "pass --left-right swap-legs if the legs are in SPIN's order, or --left-right ignore."
        )
    if evidence.verdict == "wrong":
        raise InputError(
            f"{where}: the body is mirrored or its left and right are exchanged: {evidence}; "
            "pass --left-right mirror if the coordinates are mirrored, --left-right swap if the names are, or "
            "--left-right ignore."
        )
    if evidence.verdict == "doubtful":
        return poses.noted("parity", warning=f"left and right are doubtful: {evidence}")
    return poses


def repaired(poses: PoseSequence, parity: Parity) -> PoseSequence:
    """Left and right put right as asked: "mirror" negates x, "swap" and "swap-legs" exchange joints' names."""
    joints, root = poses.joints, poses.root
    order = np.arange(len(poses.layout))
    if parity == "ignore":
        return poses
    if parity == "mirror":
        mirror = np.array([-1.0, 1.0, 1.0])
        joints, root = joints * mirror, root if root is None else root * mirror
    else:
        legs = poses.layout.indices([f"{side}_{part}" for side in "lr" for part in ("hip", "knee", "ankle")])
        swapped = legs if parity == "swap-legs" else order
        order[swapped] = poses.layout.mirror[swapped]
    return poses.with_(joints=joints[:, order], confidence=poses.confidence[:, order], root=root).noted(
        "parity", repair=parity
    )
