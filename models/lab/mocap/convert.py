"""Motion capture of several formats into the one file that training and evaluation read:

pcnet3d lab mocap FOLDER -o clips.npz

Here are who is in a file, whether its limbs are a person's, and the one frame rate.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Argument, Option

from ....pipeline.core.errors import InputError, naming, readable
from ....pipeline.core.frames import Z_UP
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many, say
from ....pipeline.core.pose import PoseSequence
from ....pipeline.files.arrays import write_arrays
from ....pipeline.files.atomic import refuse_unwritable
from ....pipeline.files.bvh import read_motion
from ....pipeline.files.markers import read_joints, z_up
from ....pipeline.files.skeletons import LEG_M, UNITS, h36m17_named, leg_length, upright_share
from ....pipeline.running.progress import each
from ....pipeline.signals.checks import chirality
from . import asfamc
from .clips import FPS, Clip

_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in "lr"
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_MIN_VOTES = 20  # bent knees, before they say anything
_BACKWARD = 0.2  # share of knees bent forward at or below which left and right are not what the file says
_LIMB_SPREAD = 0.15  # of optical capture it is below 0.01, of markerless capture up to 0.1


def mocap(
    folder: Annotated[Path, Argument(help="Motion capture: ASF/AMC, BVH, or .npz with joints.")],
    output: Annotated[Path, Option("-o", "--output", help="The .npz file to write.")],
) -> None:
    """Convert a folder of motion capture for training and evaluation.

    It lists the subjects: a split needs to know them.
    """
    refuse_unwritable(output.parent)
    if output.is_dir():
        raise InputError(
            "cannot-write", f"Expected a file to write, but {output} is a folder; choose another -o."
        )
    clips = read_folder(folder)
    output.parent.mkdir(parents=True, exist_ok=True)
    write_mocap(output, clips)
    frames, people = sum(map(len, clips)), Counter(clip.subject for clip in clips)
    print(f"{output}: {how_many(len(clips), 'clip')}, {frames:,} frames, {frames / FPS / 60:.1f} min")
    of_each = ", ".join(f"{who} ({number})" for who, number in sorted(people.items()))
    print(f"{how_many(len(people), 'subject')} (clips): {of_each}")


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
        joints, owner = asfamc.read(path)
        source, fps = "asfamc", asfamc.FPS
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
