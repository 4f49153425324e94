"""Motion capture of many formats as one person's joints in a world whose up is known."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from ....pipeline.core.anthropometry import STATURES_M, implied_stature
from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.frames import Z_UP, change_frame
from ....pipeline.core.layouts import H36M17, remap
from ....pipeline.core.pose import PoseSequence
from ....pipeline.files.arrays import keys
from ....pipeline.files.markers import Markers, Up, by_subject, read_c3d, read_joints, read_trc, z_up
from ....pipeline.files.skeletons import UNITS, h36m17_named, h36m17_of_limbs, upright_share
from ....pipeline.plugins.options import call
from ....pipeline.reading.bounds import check_fps
from ....pipeline.reading.find import adapters, recognises


def read_truth(
    path: Path,
    up: Up | None = None,
    unit: str | None = None,
    fps: float | None = None,
) -> PoseSequence:
    """One person of a TRC, C3D, BVH or .npz file, or of one that an adapter reads in a world (FreeMoCap's): H36M17,
    metres, Z-up world, with time stamps from the file's own beginning. Joints that a TRC, C3D or .npz file lacks are
    NaN; it has to have hips, knees and ankles.

    up, unit, fps: of files that do not state them, or state them wrongly. InputError if the file is damaged or of
    another form, has no joints of these names, or its person does not stand upright or has an impossible size; and for
    an option that the format leaves no room for.
    """
    if not path.is_file():
        raise InputError("cannot-open", f"Expected motion capture at {path}, found no file there.")
    if unit is not None and unit not in UNITS:
        raise InputError("bad-value", f"Expected a unit of {', '.join(UNITS)}; got '{unit}'.")
    if fps is not None:
        check_fps(fps, "--rate")
    kind = path.suffix.lower()
    with naming(path):
        poses = _read(path, kind, up, unit, fps)
    _check_person(poses, path, unit)
    return poses


def _read(path: Path, kind: str, up: Up | None, unit: str | None, fps: float | None) -> PoseSequence:
    if kind in (".trc", ".c3d"):
        return _of_markers(read_trc(path) if kind == ".trc" else read_c3d(path), up, unit, fps)
    if kind == ".npz":
        if "clip_start" in keys(path):
            raise InputError(
                "wrong-content",
                "it holds several clips, as pcnet3d lab mocap writes them; save one as joints, joint_names and fps.",
            )
        return _of_markers(read_joints(path, fps), up, unit, None)
    return _adapted(path, up, unit, fps)


def _check_person(poses: PoseSequence, path: Path, unit: str | None) -> None:
    """InputError if the person does not stand upright, or has an impossible size."""
    share = upright_share(poses.joints)
    if np.isnan(share):
        raise InputError(
            "nothing-usable",
            f"{path}: expected frames with both legs, and the head where the file has it; got none.",
        )
    if share < 0.5:
        raise InputError(
            "wrong-axes",
            f"{path}: the head or the hips are above the feet in only {100 * share:.0f} % of the frames; give the "
            "vertical axis with --up.",
        )
    stature_m = implied_stature(poses.joints)
    if stature_m < STATURES_M[0] or stature_m > STATURES_M[1]:
        raise InputError(
            "wrong-axes",
            f"{path}: expected a person's limbs, got those of a stature of {stature_m:.3g} m if lengths are in "
            f"{unit or 'the unit that it says'}; give its unit with --unit.",
        )


def _of_markers(markers: Markers, up: Up | None, unit: str | None, fps: float | None) -> PoseSequence:
    unit = unit or markers.unit
    if unit not in UNITS:
        raise InputError(
            "needs-input", f"expected a unit of {', '.join(UNITS)}, got '{unit}'; give it with --unit."
        )
    bodies: dict[str, np.ndarray] = {}
    for body in (h36m17_named, h36m17_of_limbs):
        for subject, points in by_subject(markers).items():
            with suppress(InputError):
                bodies.setdefault(subject, body(points.points * UNITS[unit], points.names))
    if len(bodies) > 1:
        raise InputError(
            "choose-person",
            f"expected one person's points, got those of {', '.join(bodies)}; keep one of them in the file.",
        )
    if not bodies:
        raise InputError(
            "wrong-content",
            "expected points at the joint centres (hips, knees and ankles at least, under common names), got "
            f"{', '.join(markers.names[:30])}; markers on the skin must be turned into joint centres first.",
        )
    (joints,) = bodies.values()
    joints = z_up(joints, up or markers.up)
    return _poses(joints, markers.time_s if fps is None else np.arange(len(joints)) / fps)


def _adapted(path: Path, up: Up | None, unit: str | None, fps: float | None) -> PoseSequence:
    given = {name: value for name, value in {"up": up, "unit": unit}.items() if value is not None}
    people = [
        poses
        for adapter in adapters("poses").values()
        if recognises(adapter, path)
        for poses in call(adapter.read, path, what=f"Adapter '{adapter.name}'", options=given)
        if poses.frame.family == "world" and poses.frame.metric
    ]
    if len(people) != 1:
        raise InputError(
            "format-unknown",
            "expected one person's motion capture: TRC, C3D, BVH, .npz, or a file that FreeMoCap writes.",
        )
    poses = remap(people[0], H36M17)
    if fps is not None:
        rows = poses.frame_index if poses.time_s is None else poses.time_s * poses.fps
        poses = poses.with_(time_s=rows / fps)
    if poses.time_s is None:
        raise InputError("needs-rate", "it does not say its frame rate; give it with --rate.")
    return change_frame(poses, Z_UP.with_(origin=poses.frame.origin))


def _poses(joints: np.ndarray, time_s: np.ndarray) -> PoseSequence:
    return PoseSequence(
        joints, H36M17, Z_UP, time_s=time_s, frame_index=np.arange(len(joints)), person="motion capture"
    )
