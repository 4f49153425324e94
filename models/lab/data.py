"""A data folder, as PCNET3D_DATA names it, out of motion capture that anybody may download, and of one's own:

pcnet3d lab data --cmu allasfamc --accad BVH --hdm05 HDM05 --own RECORDINGS -o data

The people of each part are those of splits.json beside this module, as the shipped networks know them. Here is also who
is in a recording, whether its limbs are a person's, the one frame rate, and how Acclaim's files are read.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from ...pipeline.core.errors import InputError, naming, readable
from ...pipeline.core.frames import Z_UP
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.messages import how_many, say
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import transpose
from ...pipeline.files.arrays import write_arrays
from ...pipeline.files.atomic import refuse_unwritable, write_json
from ...pipeline.files.bvh import read_motion
from ...pipeline.files.digest import sha256
from ...pipeline.files.markers import read_joints, z_up
from ...pipeline.files.skeletons import (
    LEG_M,
    UNITS,
    Skeleton,
    h36m17_named,
    h36m17_of_skeleton,
    leg_length,
    place,
    upright_share,
)
from ...pipeline.running.progress import each
from ...pipeline.signals.checks import chirality
from .clips import FPS, Clip, read_mocap, subject_of

# The people of each part, by file.
SPLITS: dict[str, dict[str, list[str]]] = json.loads(
    Path(__file__).with_name("splits.json").read_text(encoding="utf-8")
)
# Acclaim's "radius" ends 19 cm from the elbow; the wrist markers of CMU's 01_01 are 29 away, and people's wrists 27.
_FOREARM = 1.38
# Arena's upper arm is 65 to 90 % of a real one, which is 1.05 forearms long (de Leva 1996).
_UPPER_ARM = 1.05


def with_whole_forearms(clip: Clip) -> Clip:
    """The wrists of an Acclaim skeleton, where people have them."""
    joints = clip.joints.copy()
    for side in "lr":
        elbow, wrist = H36M17.indices((f"{side}_elbow", f"{side}_wrist"))
        joints[:, wrist] = joints[:, elbow] + _FOREARM * (joints[:, wrist] - joints[:, elbow])
    return replace(clip, joints=joints)


def of_accad(clip: Clip) -> Clip:
    """As splits.json calls the person: m1 is Male1."""
    person, stroke = f"accad-{clip.subject[0]}{clip.subject[-1]}".lower(), clip.name.partition("_")[2]
    name = f"{person}_bvh-{stroke.lower().replace('_', '-')}"
    return replace(clip, name=name, subject=person, source="accad-bvh")


def of_tennis(clip: Clip) -> Clip:
    """As splits.json calls the player, with the upper arms of people, the forearms moved along."""
    joints = clip.joints.copy()
    for side in "lr":
        shoulder, elbow, wrist = H36M17.indices([f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")])
        upper, forearm = (
            clip.joints[:, b] - clip.joints[:, a] for a, b in ((shoulder, elbow), (elbow, wrist))
        )
        share = _UPPER_ARM * (forearm**2).sum(-1).mean() ** 0.5 / (upper**2).sum(-1).mean() ** 0.5
        joints[:, elbow] = joints[:, shoulder] + share * upper
        joints[:, wrist] = joints[:, elbow] + forearm
    person = f"tennis-{clip.subject.lower()}"
    name = f"{person}_{clip.name.partition('_')[2]}"
    return replace(clip, name=name, subject=person, source="arena", joints=joints)


@dataclass(frozen=True)
class Source:
    """file: in the data folder, without an ending. name, what, address, licence: in words, for who has to fetch it.
    made: what is changed in a clip as it was read."""

    file: str
    name: str
    what: str
    address: str
    licence: str
    made: Callable[[Clip], Clip]

    @property
    def way(self) -> str:
        fetched = f" ({self.licence}): download {self.what} from {self.address}, unpack it" * bool(self.what)
        return f"{self.name}{fetched}"


SOURCES = {
    "cmu": Source(
        "cmu_mocap", "CMU's motion capture", "all ASF/AMC files", "mocap.cs.cmu.edu",
        "free for all uses, the data itself not to be resold", with_whole_forearms,
    ),
    "accad": Source(
        "accad_mocap", "ACCAD's Open Motion Project", "the BVH files of Male1, Male2 and Female1",
        "accad.osu.edu (Motion Lab)", "CC BY 3.0", of_accad,
    ),
    "tennis": Source(
        "tennis_mocap", "Tennis-MoCap", "a folder of BVH files for each player",
        "the authors of LNCS 10125, pp. 309-317", "CC BY-SA 3.0", of_tennis,
    ),
    "hdm05": Source(
        "hdm05_subset", "HDM05", "the cut AMC files with their ASF skeletons", "resources.mpi-inf.mpg.de/HDM05",
        "CC BY-SA 3.0", with_whole_forearms,
    ),
    "own": Source("clips", "recordings of your own", "", "", "yours", lambda clip: clip),
}  # fmt: skip


def data(
    output: Annotated[Path, Option("-o", "--output", help="The data folder.")],
    cmu: Annotated[Path | None, Option(help="Folder of CMU's ASF/AMC files.")] = None,
    accad: Annotated[Path | None, Option(help="Folder of ACCAD's BVH files.")] = None,
    tennis: Annotated[Path | None, Option(help="Folder of Tennis-MoCap's BVH files.")] = None,
    hdm05: Annotated[Path | None, Option(help="Folder of HDM05's ASF/AMC files.")] = None,
    own: Annotated[Path | None, Option(help="Your own: ASF/AMC, BVH, or .npz with joints.")] = None,
) -> None:
    """Make a data folder for training and evaluation from motion capture: free sets that were downloaded, or your own.

    A folder that already has a file of the data folder gives that file. What is there is not made again. Without a
    folder it says what to download from where.
    """
    folders = {"cmu": cmu, "accad": accad, "tennis": tennis, "hdm05": hdm05, "own": own}
    given = {name: folder for name, folder in folders.items() if folder is not None}
    if not given:
        ways = "; ".join(
            f"{source.way}, and give its folder with --{name}" for name, source in SOURCES.items()
        )
        raise InputError("needs-input", f"Expected a folder of motion capture. {ways}.")
    refuse_unwritable(output)
    output.mkdir(parents=True, exist_ok=True)
    for name, folder in given.items():
        source = SOURCES[name]
        clips = made(source, folder, output)
        people, minutes = len({subject_of(clip.name) for clip in clips}), sum(map(len, clips)) / 1800
        print(
            f"{output / source.file}.npz: {how_many(len(clips), 'clip')} of {how_many(people, 'person', 'people')}, "
            f"{minutes:.1f} min; credit: {source.licence}"
        )
    write_json(output / "splits.json", splits_of(output))
    print(f"{output / 'splits.json'}: for training and evaluation set PCNET3D_DATA={output}")


def made(source: Source, folder: Path, output: Path) -> tuple[Clip, ...]:
    """The clips of a source's file, which is written unless it is there. InputError for a folder without recordings,
    and for a file that is not as it was made."""
    path, listing = output / f"{source.file}.npz", output / "data.json"  # digests of what was made
    digests = json.loads(listing.read_text(encoding="utf-8")) if listing.exists() else {}
    if not path.exists():
        ready = folder / path.name
        write_mocap(path, read_mocap(ready) if ready.exists() else converted(source, folder))
        write_json(listing, {**digests, source.file: sha256(path)})
    elif digests.get(source.file) != sha256(path):
        raise InputError(
            "file-damaged",
            f"Expected {path} as this command made it, but its digest is another one; remove it to make it anew.",
        )
    return read_mocap(path)


def converted(source: Source, folder: Path) -> list[Clip]:
    """The recordings of a folder as the data folder has them, of people who are in a part. InputError for a folder that
    is not there, and where nothing can be read."""
    if not folder.is_dir():
        raise InputError("cannot-open", f"Expected a folder at {folder}: {source.way}.")
    people = {person for of_part in SPLITS.get(source.file, {}).values() for person in of_part}
    # Of CMU's thousands of files only theirs are read.
    every = source is not SOURCES["cmu"]
    clips = read_folder(folder, only=lambda file: every or subject_of(file.stem) in people)
    kept = [clip for clip in map(source.made, clips) if not people or subject_of(clip.name) in people]
    if not kept:
        raise InputError("nothing-usable", f"Expected recordings of {', '.join(sorted(people))} in {folder}.")
    return kept


def splits_of(output: Path) -> dict[str, dict[str, list[str]]]:
    """What splits.json of the folder says: of every file the people of each part whom it has; of one's own as it says
    already, else every fifth for the test and every fifth for the validation."""
    listing, splits = output / "splits.json", {}
    file = SOURCES["own"].file
    if (own := output / f"{file}.npz").exists():
        people = sorted({subject_of(clip.name) for clip in read_mocap(own)})
        parts = {"test": people[::5], "val": people[1::5]}
        parts["train"] = [who for who in people if who not in (*parts["test"], *parts["val"])]
        said = json.loads(listing.read_text(encoding="utf-8")) if listing.exists() else {}
        splits[file] = said.get(file, parts)
    for file, parts in SPLITS.items():
        path = output / f"{file}.npz"
        there = {subject_of(clip.name) for clip in read_mocap(path)} if path.exists() else set()
        splits[file] = {part: [who for who in people if who in there] for part, people in parts.items()}
    return splits


_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in "lr"
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_MIN_VOTES = 20  # bent knees, before they say anything
_BACKWARD = 0.2  # share of knees bent forward at or below which left and right are not what the file says
_LIMB_SPREAD = 0.15  # of optical capture it is below 0.01, of markerless capture up to 0.1


def read_folder(folder: Path, only: Callable[[Path], bool] = lambda file: True) -> list[Clip]:
    """The clips of a folder (or one file) at one frame rate, everything that is left out said in a sentence; .npz
    files, which lie beside other data too, where there are no others. only: which of its files. InputError when
    nothing could be read, or most frames have the head no higher than the feet."""
    there = [folder] if folder.is_file() else sorted(folder.rglob("*"))
    files = [file for file in there if file.suffix.lower() in (".amc", ".bvh") and only(file)]
    files = files or [file for file in there if file.suffix.lower() == ".npz"]
    reason = "found nothing there."
    clips: dict[str, Clip] = {}
    for file in each(files, "files", len(files)):
        try:
            with naming(str(file)):
                clip = _clip(file, folder if folder.is_dir() else folder.parent)
                if clip.name in clips:
                    raise InputError("wrong-content", f"there is another clip named {clip.name}.")
            clips[clip.name] = clip
        except InputError as error:
            reason = f"left out {error}"
            say("note", reason)
    if not clips:
        raise InputError(
            "format-unknown",
            f"Expected motion capture in {folder}, .amc with .asf, .bvh, or .npz with joints; {reason}",
        )
    share = upright_share(np.concatenate([clip.joints for clip in clips.values()]))
    if share < 0.5:
        raise InputError(
            "wrong-axes",
            f"Only in {100 * share:.0f} % of the frames is the head above the feet; turn the recordings.",
        )
    return list(clips.values())


def _clip(path: Path, folder: Path) -> Clip:
    """The recording of a file; InputError for anything else."""
    owner = None
    if path.suffix.lower() == ".amc":
        joints, owner = read_amc(path)
        source, fps = "asfamc", ACCLAIM_FPS
    elif path.suffix.lower() == ".bvh":
        with readable(path, "a BVH file"):
            motion = read_motion(path.read_text(encoding="utf-8", errors="replace"))
        source, joints, fps = "bvh", z_up(motion.joints, "y"), motion.fps
    else:
        held = read_joints(path)
        joints = z_up(h36m17_named(held.points * UNITS[held.unit], held.names), held.up)
        source, fps = "joints", 1 / float(held.time_s[1]) if len(joints) > 1 else 1.0  # one frame has no rate
    joints = joints.astype(np.float32)
    require_plausible(joints)
    subject, name = label(path, folder, owner)
    return resampled(Clip(name, subject, source, fps, joints))


def label(path: Path, folder: Path, owner: str | None = None) -> tuple[str, str]:
    """Subject and clip name of a file; the name is the subject, "_" and the rest. The subject is the owner of the
    skeleton, where the file names one, or the file name up to the first "_", or else the name of the file's folder."""
    if owner is not None:
        subject = owner
    elif "_" in path.stem.strip("_"):
        subject = path.stem.partition("_")[0]
    else:
        subject = path.stem if path.parent == folder else path.parent.name
    plain = subject.replace("_", "-")
    return plain, f"{plain}_{path.stem.removeprefix(f'{subject}_')}"


def require_plausible(joints: np.ndarray) -> None:
    """InputError when joints (T, 17, 3), metres, lack one, or are not those of a person whose limbs keep their
    length."""
    if len(joints) == 0 or not np.isfinite(joints).all():
        raise InputError("nothing-usable", "expected frames with all joints, got none, or NaN among them.")
    leg = leg_length(joints)
    if not LEG_M[0] * 0.5 <= leg <= LEG_M[1] * 1.1:
        raise InputError(
            "wrong-axes", f"expected the legs of a person in metres, got {leg:.4g}; scale the recording."
        )
    for start, end in _LIMBS:
        length = np.linalg.norm(joints[:, H36M17.index(start)] - joints[:, H36M17.index(end)], axis=-1)
        if length.std() > _LIMB_SPREAD * length.mean():
            raise InputError(
                "wrong-content", f"the bone from {start} to {end} changes its length by more than 15 %."
            )
    require_sides(joints)


def require_sides(joints: np.ndarray) -> None:
    """InputError when left and right of joints (T, 17, 3), +Z up, contradict the way that knees bend, or each other."""
    sides = chirality(PoseSequence(joints, H36M17, Z_UP))
    # Not every verdict: where the nose is made from left and right, it agrees with them whatever they are.
    backward = sides.knee_votes >= _MIN_VOTES and sides.knees <= _BACKWARD
    if backward or sides.verdict == "legs against arms":
        raise InputError(
            "sides-swapped", f"left and right look exchanged, or the axes are left-handed: {sides}."
        )


def resampled(clip: Clip) -> Clip:
    """The clip at FPS: every n-th frame where n is whole, otherwise straight lines between frames. Nothing is filtered,
    as in the motion capture that the shipped networks were trained on."""
    ratio = clip.fps / FPS
    if abs(ratio - round(ratio)) < 1e-3 * ratio and ratio > 0.5:
        return replace(clip, fps=FPS, joints=clip.joints[:: round(ratio)])
    at = np.arange(int((len(clip) - 1) / ratio + 1e-6) + 1) * ratio
    paths = clip.joints.reshape(len(clip), -1).T
    joints = np.stack([np.interp(at, np.arange(len(clip)), path) for path in paths], axis=-1)
    return replace(clip, fps=FPS, joints=joints.reshape(-1, *clip.joints.shape[1:]).astype(np.float32))


def write_mocap(path: Path, clips: Sequence[Clip]) -> None:
    """What read_mocap reads, of clips at FPS, rounded to 0.1 mm."""
    world = np.concatenate([clip.joints for clip in clips]).astype(np.float64)
    root = world[:, H36M17.index("pelvis")]
    write_arrays(
        path,
        joints=(world - root[:, None]).round(4).astype(np.float32),
        root=root.round(4).astype(np.float32),
        clip_start=np.cumsum([0, *map(len, clips)]),
        clip_name=np.array([clip.name for clip in clips]),
        subject=np.array([clip.subject for clip in clips]),
        source=np.array([clip.source for clip in clips]),
        fps=np.array(FPS),
        joint_names=np.array(H36M17.joints),
    )


# Acclaim skeletons and motions (ASF/AMC), as CMU and HDM05 give them. A bone's motion M turns it about its own axes C,
# which `axis` turns from the skeleton's at rest: R = C M C^-1, behind its parent's R (Lander, Working with Motion
# Capture File Formats, Game Developer 1/1998). Angles are about fixed axes in the order written. Lengths are inches
# over the skeleton's `length` unit (CMU's FAQ: 0.45), +Y is up.
ACCLAIM_FPS = 120.0  # of CMU and HDM05; the files do not say it
_INCH_M = 0.0254
_BONE = re.compile(r"^\s*begin\s*$(.*?)^\s*end\s*$", re.M | re.S)


@dataclass(frozen=True, eq=False)
class Acclaim:
    """An ASF file. skeleton: joints where bones begin, the root first, metres. C: (J, 3, 3) each bone's own axes.
    dofs: by bone, what an AMC line says, for example ("rx", "rz"). metres: one unit of the file."""

    skeleton: Skeleton
    C: np.ndarray
    dofs: dict[str, tuple[str, ...]]
    metres: float


def read_amc(path: Path) -> tuple[np.ndarray, str]:
    """(T, 17, 3) joints of an AMC file, metres, +Z up, and the name of its skeleton: the ASF file beside it whose name
    its own begins with, or the only one. InputError without."""
    skeletons = sorted(path.parent.glob("*.[aA][sS][fF]"))
    named = [file for file in skeletons if path.stem.lower().startswith(file.stem.lower())]
    if not named and len(skeletons) != 1:
        raise InputError("needs-input", "expected its .asf skeleton in the same folder.")
    skeleton_file = max(named, key=lambda file: len(file.stem)) if named else skeletons[0]
    acclaim = parse_asf(_acclaim_text(skeleton_file))
    joints, R = pose(acclaim, parse_amc(_acclaim_text(path), acclaim))
    return z_up(h36m17_of_skeleton(acclaim.skeleton, joints, R)[0], "y"), skeleton_file.stem


def _acclaim_text(path: Path) -> str:
    """Without comments; InputError when the file cannot be read as text."""
    with readable(path, "motion capture"):
        return re.sub(r"^\s*#.*$", "", path.read_text(encoding="utf-8", errors="replace"), flags=re.M)


def parse_asf(text: str) -> Acclaim:
    """The skeleton of an ASF file. InputError for what is no ASF, and for bones that slide or turn in radians."""
    sections = {m[1]: m[2] for m in re.finditer(r"^:(\w+)(.*?)(?=^:|\Z)", text, re.M | re.S)}
    try:
        units, root = _records(sections["units"]), _records(sections["root"])
        metres = _INCH_M / float(units.get("length", ["1"])[0])
        bones = {bone["name"][0]: bone for bone in map(_records, _BONE.findall(sections["bonedata"]))}
        parent_of = {  # of whom each hangs on comes first
            child: words[0]
            for words in map(str.split, sections["hierarchy"].strip().splitlines())
            for child in words[1:]
        }
        names = ("root", *parent_of)
        parents = (-1, *(names.index(parent) for parent in parent_of.values()))
        own_axes = [root.get("orientation", ["0"] * 3) + root.get("axis", ["XYZ"])]
        own_axes += [bones[name].get("axis", ["0", "0", "0", "XYZ"]) for name in parent_of]
        C = np.stack([_turn(order, _numbers(angles)) for *angles, order in own_axes])
        offsets = metres * np.stack([_offset(bones.get(parent_of.get(name, ""))) for name in names])
        dofs = {name: tuple(map(str.lower, bone.get("dof", []))) for name, bone in bones.items()}
        if any(parent >= bone for bone, parent in enumerate(parents)):
            raise ValueError("a bone hangs on nothing")
        if not set().union(*dofs.values()) <= {"rx", "ry", "rz"}:
            raise ValueError("expected bones that turn only")
        if not units.get("angle", ["deg"])[0].lower().startswith("deg"):
            raise ValueError("expected angles in degrees")
        dofs["root"] = tuple(map(str.lower, root["order"]))
        if not {"tx", "ty", "tz"} <= {*dofs["root"]}:
            raise ValueError("expected a root that moves")
    except (ValueError, KeyError, IndexError) as error:
        raise InputError("file-damaged", f"the ASF skeleton is damaged: {error}.") from None
    return Acclaim(Skeleton(names, parents, offsets), C, dofs, metres)


def _records(section: str) -> dict[str, list[str]]:
    """{first word: the others} of every line."""
    return {words[0]: words[1:] for words in map(str.split, section.splitlines()) if words}


def _offset(parent: Mapping[str, list[str]] | None) -> np.ndarray:
    """(3,) from where a parent's bone begins to where it ends, which is where its children begin; 0 of the root."""
    if parent is None:
        return np.zeros(3)
    direction = _numbers(parent["direction"])
    return direction / np.linalg.norm(direction) * float(parent["length"][0])


def _numbers(words: Iterable[str]) -> np.ndarray:
    return np.array([float(word) for word in words])


def parse_amc(text: str, acclaim: Acclaim) -> dict[str, np.ndarray]:
    """By bone, (T, dofs) as the file has them, angles in degrees. InputError for what is no AMC of that skeleton."""
    lines: dict[str, list[list[str]]] = {}
    frames = 0
    for words in map(str.split, text.splitlines()):
        if len(words) == 1 and words[0].isdigit():
            frames += 1
        elif words and not words[0].startswith(":"):
            if len(words) - 1 != len(acclaim.dofs.get(words[0], ())):
                raise InputError(
                    "files-apart",
                    f"frame {frames}: '{words[0]}' does not fit its skeleton; another skeleton's file?",
                )
            lines.setdefault(words[0], []).append(words[1:])
    short = [name for name, rows in lines.items() if len(rows) != frames]
    if short or "root" not in lines:
        raise InputError(
            "file-damaged", f"expected {frames} frames of each bone: {', '.join(short) or 'root'}."
        )
    try:
        return {name: np.array(rows, dtype=float) for name, rows in lines.items()}
    except ValueError as error:
        raise InputError("file-damaged", f"the AMC file is damaged: {error}.") from None


def pose(acclaim: Acclaim, motion: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Joints (T, J, 3), metres, and R_world_from_joint (T, J, 3, 3)."""
    R = np.tile(np.eye(3), (len(motion["root"]), len(acclaim.skeleton.names), 1, 1))
    for i, name in enumerate(acclaim.skeleton.names):
        dofs = acclaim.dofs[name]
        if name in motion and (turns := [k for k, dof in enumerate(dofs) if dof[0] == "r"]):
            M = _turn("".join(dofs[k][1] for k in turns), motion[name][:, turns])
            R[:, i] = acclaim.C[i] @ M @ transpose(acclaim.C[i])
    moves = [acclaim.dofs["root"].index(f"t{axis}") for axis in "xyz"]
    return place(acclaim.skeleton, acclaim.metres * motion["root"][:, moves], R)


def _turn(order: str, angles: np.ndarray) -> np.ndarray:
    """(..., 3, 3) of angles (..., len(order)), degrees, about fixed axes, the first named one first."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler(order.lower(), angles, degrees=True).as_matrix()
