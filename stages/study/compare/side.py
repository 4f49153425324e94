"""What a comparison knows of each side: a finished run, or motion capture brought to the same form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ....models.angle_error.take_angles import AngleSeries, TakeJoints, smoothed, take_angles
from ....models.common.canonical import R_world_from_body
from ....models.gravity.levelling import level_frame
from ....pipeline.core.anthropometry import STATURES_M, implied_stature
from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.frames import Z_UP
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many, rate_in_words
from ....pipeline.core.notices import Notice, notice
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.core.take import Take
from ....pipeline.files.arrays import keys
from ....pipeline.files.digest import sha256
from ....pipeline.files.finished import read_run
from ....pipeline.files.markers import Markers, Up, by_subject, read_c3d, read_joints, read_trc, z_up
from ....pipeline.files.skeletons import UNITS, h36m17_named, h36m17_of_limbs, upright_share
from ....pipeline.reading.bounds import check_fps
from ....pipeline.signals.angles import ANGLES, angles, near, unwrapped
from ....pipeline.signals.filters import breaks, resample

TRUTH = "motion capture"
_SHOULDERS = ("r_shoulder", "l_shoulder")
LEAST_S = 1.0  # of motion that both sides know, for them to be compared moment by moment


@dataclass(frozen=True, eq=False)
class Side:
    """One side of a comparison.

    level: (T, 17, 3) relative to the pelvis, +z up, one heading for the take. angles, sd: (T,) degrees by name of
    pipeline.signals.angles.ANGLES, NaN for an angle that the run lacks; sd is the stated standard error.
    sources: what was read, for telling takes of one recording. run: what the run's folder holds, None for motion
    capture.
    """

    name: str
    about: str
    time_s: np.ndarray
    seams: tuple[int, ...]
    level: np.ndarray
    angles: dict[str, np.ndarray]
    sd: dict[str, np.ndarray]
    metric: bool
    cutoff_hz: float | None
    sources: tuple[dict[str, Any], ...] = ()
    run: Take | None = None
    notices: tuple[Notice, ...] = ()

    def at(self, name: str, time_s: np.ndarray) -> np.ndarray:
        """An angle (N,) at other times (N,) of this side's clock, NaN in gaps and outside."""
        return near(self.resampled(unwrapped(self.angles[name]), time_s), ANGLES[name].centre_deg)

    def resampled(self, values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """A series (T,) of this side's rows as (N,) at other times (N,) of its clock, NaN in gaps and outside."""
        return resample(values, self.time_s, time_s, self.seams)


def load_side(folder: Path) -> Side:
    """The run in a folder. InputError when there is none that finished, or when it has no joint angles."""
    run = read_run(folder)
    poses, rectified = run.need("poses"), run.need("rectified")
    columns = {
        name: values.astype(np.float64) for name, values in run.need("kinematics").items() if "_deg" in name
    }
    if not any(f"{name}_deg" in columns for name in ANGLES):
        raise InputError(
            "needs-stage",
            f"Expected a run with joint angles in {folder}, found none; run it again with the stage 'angles'.",
        )
    unknown = np.full(len(poses), np.nan)
    return Side(
        name=folder.resolve().name,
        about=_about(run),
        time_s=poses.times,
        seams=breaks(poses),
        level=rectified.level.without_feet.joints.astype(np.float64),
        angles={name: columns.get(f"{name}_deg", unknown) for name in ANGLES},
        sd={name: columns.get(f"{name}_sd_deg", unknown) for name in ANGLES},
        metric=poses.frame.metric,
        cutoff_hz=run.cutoff_hz,
        sources=run.inputs,
        run=run,
        notices=tuple(doubts_of_level(run, folder.name)),
    )


def doubts_of_level(run: Take, name: str) -> Iterator[Notice]:
    """What makes the vertical or the heading of a run by that name unsure."""
    if not run.need("rectified").level_ok:
        yield notice("run-not-levelled", run=name)
    if run.need("rectified").camera == "moving":
        yield notice("run-of-moving-camera", run=name)


def _about(run: Take) -> str:
    """What was told of the session, if anything, the recording and its length."""
    session = run.session
    person = f"person {session.person_id}" if session.person_id else ""
    poses = run.need("poses")
    rate = rate_in_words(poses.fps, "")
    parts = (session.title, person, session.date, run.name, how_many(len(poses), "frame"), rate)
    return ", ".join(part for part in parts if part)


def with_truth(
    sides: Sequence[Side], path: Path, up: Up | None, unit: str | None, rate: float | None
) -> list[Side]:
    """Motion capture (`read_truth`), its joints low-passed as those of the runs, and the runs, with its trunk.
    InputError for runs of several cut-offs."""
    cutoffs = {side.cutoff_hz for side in sides}
    if len(cutoffs) > 1:
        raise InputError(
            "files-apart",
            f"Expected runs with one cut-off to compare with motion capture, got "
            f"{', '.join(map(str, cutoffs))} Hz; compare them one by one.",
        )
    poses, cutoff_hz = read_truth(path, up, unit, rate), cutoffs.pop()
    joints = poses.joints.astype(np.float64) - poses.joint("pelvis")[:, None]
    filtered = joints if cutoff_hz is None else smoothed(joints, poses.times, cutoff_hz)
    R = _facing(joints)
    series = take_angles(TakeJoints(_trunk_by_shoulders(joints), _trunk_by_shoulders(filtered), R))
    R_world_from_level, _ = level_frame(R, np.array([0.0, 0.0, 1.0]), poses.times)
    truth = Side(
        name=TRUTH,
        about=f"{path.name}, {how_many(len(poses), 'frame')}, {poses.fps:.4g} a second",
        time_s=poses.times,
        seams=breaks(poses),
        level=rotate(transpose(R_world_from_level), joints),
        angles={name: angle.value_deg for name, angle in series.items()},
        sd={name: angle.sd_deg for name, angle in series.items()},
        metric=True,
        cutoff_hz=cutoff_hz,
        sources=({"role": TRUTH, "file": path.name, "sha256": sha256(path)},),
        notices=tuple(_lacking(joints, series)),
    )
    return [truth, *(_with_trunk_of(side, truth) for side in sides)]


def _with_trunk_of(side: Side, truth: Side) -> Side:
    """The side of a run with a trunk line that ends between the shoulders, where that of motion capture does so for
    lack of a thorax; as it is where motion capture has one, or the run no filtered joints."""
    if _has(truth.level, "thorax") or not _has(truth.level, *_SHOULDERS):
        return side
    run = side.run
    if run is None or run.filtered is None:
        return side
    filtered = run.filtered.without_feet.joints.astype(np.float64)
    values = angles(
        rotate(transpose(R_world_from_body(filtered)), _trunk_by_shoulders(filtered, always=True))
    )
    given = {name: np.isfinite(degrees) for name, degrees in side.angles.items()}  # withheld stays withheld
    return replace(side, angles={name: np.where(given[name], values[name], np.nan) for name in side.angles})


def _facing(joints: np.ndarray) -> np.ndarray:
    """R_world_from_body (T, 3, 3); of joints (T, 17, 3) that never have shoulders, by the hips alone."""
    if not _has(joints, *_SHOULDERS):
        joints = joints.copy()
        joints[:, H36M17.indices(_SHOULDERS)] = joints[:, H36M17.indices(("r_hip", "l_hip"))]
    return R_world_from_body(joints)


def _trunk_by_shoulders(joints: np.ndarray, always: bool = False) -> np.ndarray:
    """joints (T, 17, 3) with a thorax between the shoulders: where no frame has a thorax, or always."""
    if _has(joints, "thorax") and not always:
        return joints
    joints = joints.copy()
    joints[:, H36M17.index("thorax")] = joints[:, H36M17.indices(_SHOULDERS)].mean(axis=1)
    return joints


def _has(joints: np.ndarray, *names: str) -> bool:
    """Whether any frame of joints (T, 17, 3) has all of these."""
    return bool(np.isfinite(joints[:, H36M17.indices(names)]).all(axis=(1, 2)).any())


def _lacking(joints: np.ndarray, series: Mapping[str, AngleSeries]) -> Iterator[Notice]:
    """What motion capture of part of the joints does not have, and how its trunk is then defined."""
    joints_without = [name for name in H36M17.joints if not _has(joints, name)]
    if not joints_without:
        return
    without = [name for name, angle in series.items() if not np.isfinite(angle.value_deg).any()]
    trunk = ""
    if "thorax" in joints_without and _has(joints, *_SHOULDERS):
        trunk = " For both the trunk line goes from the middle of the hips to the middle of the shoulders."
    angles = ", ".join(without) or "none"
    yield notice("truth-lacks-joints", joints=", ".join(joints_without), angles=angles, trunk=trunk)


def named_apart(sides: Sequence[Side]) -> list[Side]:
    """The same with a number behind names that several have."""
    names = [side.name for side in sides]
    return [
        replace(side, name=f"{side.name} ({names[:i].count(side.name) + 1})")
        if names.count(side.name) > 1
        else side
        for i, side in enumerate(sides)
    ]


def one_clock(side: Side, reference: Side) -> bool:
    """Whether both are runs that read the same file of video or keypoints, and share a second of its time at least."""
    read = [
        {entry["sha256"] for entry in each.sources if entry.get("role") != "poses"}
        for each in (side, reference)
    ]
    begin, end = max(side.time_s[0], reference.time_s[0]), min(side.time_s[-1], reference.time_s[-1])
    return bool(read[0] & read[1]) and bool(end - begin >= LEAST_S)


def read_truth(
    path: Path,
    up: Up | None = None,
    unit: str | None = None,
    fps: float | None = None,
) -> PoseSequence:
    """One person of a TRC, C3D or .npz file: H36M17, metres, Z-up world, with time stamps from the file's own
    beginning. Joints that the file lacks are NaN; it has to have hips, knees and ankles.

    up, unit, fps: of files that do not state them, or state them wrongly. InputError if the file is damaged or of
    another form, has no joints of these names, or its person does not stand upright or has an impossible size.
    """
    if not path.is_file():
        raise InputError("cannot-open", f"Expected motion capture at {path}, found no file there.")
    if unit is not None and unit not in UNITS:
        raise InputError("bad-value", f"Expected a unit of {', '.join(UNITS)}; got '{unit}'.")
    if fps is not None:
        check_fps(fps, "--rate")
    readers = {".trc": read_trc, ".c3d": read_c3d, ".npz": partial(_one_clip, fps=fps)}
    with naming(path):
        read = readers.get(path.suffix.lower())
        if read is None:
            raise InputError(
                "format-unknown",
                f"expected motion capture of {', '.join(readers)}; process other files with pcnet3d run --poses, and "
                "compare the two runs.",
            )
        poses = _of_markers(read(path), up, unit, fps)
    _check_person(poses, path, unit)
    return poses


def _one_clip(path: Path, fps: float | None) -> Markers:
    if "clip_start" in keys(path):
        raise InputError(
            "wrong-content",
            "it holds several clips, as pcnet3d lab data writes them; save one as joints, joint_names and fps.",
        )
    return read_joints(path, fps)


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
    return PoseSequence(
        z_up(joints, up or markers.up),
        H36M17,
        Z_UP,
        time_s=markers.time_s if fps is None else np.arange(len(joints)) / fps,
        frame_index=np.arange(len(joints)),
        person=TRUTH,
    )
