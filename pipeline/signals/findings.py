"""What may be wrong with 3D poses, looked for without knowing what the estimator was or what the person did."""

from __future__ import annotations

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.layouts import H36M17
from ..core.messages import how_many
from ..core.pose import PoseSequence
from ..core.verdict import Finding, Weight
from .checks import (
    STATURES_M,
    UNSTEADY,
    bone_spread,
    chirality,
    empty_rows,
    leaps,
    movement,
    upside_down,
)
from .swap_repair import settled, told, wrong_rows
from .swaps import Swap, find_swaps

# Shares of rows from which a fault is suspicious, and from which nothing can be made of the take.
_LOST = (0.1, 0.5)
_REPEATED = (0.02, 0.5)
_SWAPPED = (0.02, 1.0)
_POOR_SPREAD = 0.09  # boxing 0.05, cycling 0.10
_ADULTS_M = (1.0, 2.2)
_SIDES = 1.4  # a right limb bone over the left one; monocular lifts of sound takes reach 1.24
_PLANE = 0.03  # thickness of a body over its trunk
_STILL, _MOVING = 1e-3, 0.02  # movement along an axis over the trunk
_DEPTH = 1.5  # how many times too small depth is
_ENOUGH_ROWS = 10
_LIMBS = tuple(bone for bone in H36M17.bones if bone[1].endswith(("knee", "ankle", "elbow", "wrist")))
_AXES = "xyz"


def weighed(share: float, limits: tuple[float, float]) -> Weight:
    """How grave a finding about this share of rows is. limits: above the first it is suspicious, above the second
    unusable."""
    return "unusable" if share > limits[1] else "suspicious" if share > limits[0] else "note"


def findings_of(
    poses: PoseSequence, source: PoseSequence | None = None, swaps: tuple[Swap, ...] | None = None
) -> tuple[Finding, ...]:
    """All that `pcnet3d inspect` would find in poses as a run has them. poses: as pose_findings takes them; source: the
    same person as the adapter gives it, where there was a file; swaps: of find_swaps in these poses, where it was asked
    already."""
    before = [] if source is None else source_findings(source)
    swaps = find_swaps(poses) if swaps is None else swaps
    return (*row_findings(poses), *before, *pose_findings(poses), *swap_findings(poses, swaps))


def row_findings(source: PoseSequence) -> list[Finding]:
    """Gaps, repeated frames, unknown numbers and rates, the adapter's own warnings.

    source: as the adapter gives it, 2D or 3D.
    """
    found = []
    span = int(source.frame_index[-1] - source.frame_index[0]) + 1
    absent, gone, empty = span - len(source), _incomplete(source), int(empty_rows(source).sum())
    if lost := absent + gone + empty:
        longest = int(np.diff(source.frame_index).max(initial=1)) - 1
        found.append(
            Finding(
                weighed(lost / span, _LOST),
                "gaps",
                f"{lost} of {how_many(span, 'frame')} {'is' if lost == 1 else 'are'} not there: "
                f"{absent} without a row (at most {longest} in a row), "
                f"{gone} with NaN, {empty} with all joints on one point.",
            )
        )
    repeated = repeated_rows(source)
    if len(repeated):
        found.append(
            Finding(
                weighed(len(repeated) / len(source), _REPEATED),
                "duplicates",
                f"{how_many(len(repeated), 'row repeats', 'rows repeat')} the one before exactly, "
                f"the first is row {repeated[0]}; speeds are wrong "
                "there.",
            )
        )
    if not source.frames_known:
        found.append(
            Finding("note", "frame numbers", "The file does not say which video frames its rows are.")
        )
    if source.time_s is None:
        found.append(Finding("note", "fps", "The file does not say its frame rate."))
    warnings = [str(step.options["warning"]) for step in source.history if "warning" in step.options]
    return found + [Finding("note", "adapter", warning) for warning in warnings]


def swap_findings(source: PoseSequence, swaps: tuple[Swap, ...]) -> list[Finding]:
    """Limbs that are exchanged, or mirrored in depth, for some rows. Those that a run would not repair are notes."""
    swaps, doubts = settled(source, swaps)
    found = [Finding("note", "swaps", f"Some rows look wrong: {doubt}.") for doubt in doubts]
    if swaps:
        rows = int(wrong_rows(source, swaps).sum())
        text = (
            f"{rows} of {how_many(len(source), 'row')} look{'s' * (rows == 1)} wrong: {told(source, swaps)}."
        )
        found.insert(0, Finding(weighed(rows / len(source), _SWAPPED), "swaps", text))
    return found


def _incomplete(source: PoseSequence) -> int:
    """Rows without a pose: any NaN in 3D, where all joints count; nothing but NaN in 2D. Not those of one point."""
    absent = np.isnan(source.joints)
    lost = absent.any(axis=(1, 2)) if source.frame.dims == 3 else absent.all(axis=(1, 2))
    return int((lost & ~empty_rows(source)).sum())


def repeated_rows(source: PoseSequence) -> np.ndarray:
    """Rows (N,) that are, digit for digit, the row before; failed rows, of zeros or of two joints at most, as where a
    pelvis that is always 0 is all that there is, do not count."""
    before, after = source.joints[:-1], source.joints[1:]
    absent = np.isnan(before) & np.isnan(after)
    there = (~absent.any(axis=-1)).sum(axis=1) > 2
    same = ((before == after) | absent).all(axis=(1, 2)) & there
    return np.flatnonzero(same & ~empty_rows(source)[1:]) + 1


def source_findings(source: PoseSequence) -> list[Finding]:
    """What shows only before the pelvis is subtracted: each frame put on the floor by itself (formats.md 11.4)."""
    joints = _complete(source)
    if len(joints) < _ENOUGH_ROWS:
        return []
    size = float(np.median(np.ptp(joints, axis=1).max(axis=-1)))
    pelvis = _pelvis(source, joints)
    for axis in range(3):
        for extreme in (joints[..., axis].min(axis=1), joints[..., axis].max(axis=1)):
            if np.abs(extreme).max() <= 1e-6 * size and np.ptp(extreme - pelvis[:, axis]) > 0.01 * size:
                text = (
                    f"In every frame the outermost joint lies at {_AXES[axis]} = 0 exactly: each frame was moved "
                    "onto the floor by itself, so the pelvis' way along that axis is lost, and speeds with it."
                )
                return [Finding("suspicious", "rebase", text)]
    return []


def _pelvis(source: PoseSequence, joints: np.ndarray) -> np.ndarray:
    names = ("pelvis",) if "pelvis" in source.layout else ("l_hip", "r_hip")
    return joints[:, source.layout.indices(names)].mean(axis=1)


def pose_findings(poses: PoseSequence) -> list[Finding]:
    """What the body shows. poses: H36M17 relative to the pelvis, in CAMERA or a world's axes."""
    return [
        *_depth(poses),
        *_bones(poses),
        *_sides(poses),
        *_handedness(poses),
        *_stature(poses),
        *_turned_over(poses),
        *_leaps(poses),
        *_seams(poses),
    ]


def _complete(poses: PoseSequence) -> np.ndarray:
    """(N, J, 3) float64: the rows in which nothing is missing."""
    whole = np.isfinite(poses.joints).all(axis=(1, 2)) & ~empty_rows(poses)
    return poses.joints[whole].astype(np.float64)


def _trunk(joints: np.ndarray) -> float:
    top, bottom = H36M17.index("thorax"), H36M17.index("pelvis")
    return float(np.median(np.linalg.norm(joints[:, top] - joints[:, bottom], axis=-1)))


def _depth(poses: PoseSequence) -> list[Finding]:
    joints = _complete(poses)
    if len(joints) < _ENOUGH_ROWS:
        return []
    trunk = max(_trunk(joints), 1e-12)
    points = joints.reshape(-1, 3)
    thickness = np.sqrt(max(float(np.linalg.eigvalsh(np.cov(points.T))[0]), 0)) / trunk
    if thickness < _PLANE:
        text = f"All joints lie in one plane (thickness {100 * thickness:.1f} % of the trunk); there is no depth in it."
        return [Finding("unusable", "flat", text)]
    movement = joints.std(axis=0).mean(axis=0) / trunk
    still = np.flatnonzero(movement < _STILL)
    if len(still) and movement.max() > _MOVING:
        text = f"Nothing moves along {_AXES[still[0]]} while the body moves along other axes; that axis is invented."
        return [Finding("unusable", "flat", text)]
    factor = depth_factor(poses)
    if factor > _DEPTH:
        text = (
            f"Bones shorten when they turn towards the camera as if depth were {factor:.1f} times too small; it is "
            "flattened."
        )
        return [Finding("suspicious", "flattened depth", text)]
    return []


def depth_factor(poses: PoseSequence) -> float:
    """By what depth must be multiplied for limb bones to keep their length; NaN where the take does not tell.

    A bone of length L shows xy^2 = L^2 - (factor z)^2 whichever way it points: the slope of xy^2 over z^2, each
    bone's own mean taken out. Only for CAMERA axes; noise in depth makes the factor smaller, never larger.
    """
    joints = _complete(poses)
    if poses.frame.family != "camera" or len(joints) < _ENOUGH_ROWS:
        return float("nan")
    bones = _vectors(joints)
    bones = bones / np.maximum(np.linalg.norm(bones, axis=-1).sum(axis=1), 1e-12)[:, None, None]
    across, deep = (bones[..., :2] ** 2).sum(axis=-1), bones[..., 2] ** 2
    across, deep = across - across.mean(axis=0), deep - deep.mean(axis=0)
    together, spread = float((across * deep).sum()), float((deep**2).sum())
    if together > -0.5 * np.sqrt(float((across**2).sum()) * spread) or spread == 0:
        return float("nan")
    return float(np.sqrt(-together / spread))


def _vectors(joints: np.ndarray) -> np.ndarray:
    """(N, 8, 3) limb bones."""
    starts, ends = zip(*_LIMBS, strict=True)
    return joints[:, H36M17.indices(ends)] - joints[:, H36M17.indices(starts)]


def spread_of_bones(poses: PoseSequence) -> dict[str, float]:
    """Relative spread of each bone's length, by "from-to", each frame over its own size, as `checks.bone_spread`."""
    joints = _complete(poses)
    pairs = np.array([H36M17.indices(bone) for bone in H36M17.bones])
    length = np.linalg.norm(joints[:, pairs[:, 1]] - joints[:, pairs[:, 0]], axis=-1)
    if len(length) < 2:
        return {}
    length = length / np.maximum(length.sum(axis=1, keepdims=True), 1e-12)
    spread = length.std(axis=0) / np.maximum(length.mean(axis=0), 1e-12)
    return {f"{a}-{b}": float(value) for (a, b), value in zip(H36M17.bones, spread, strict=True)}


def _bones(poses: PoseSequence) -> list[Finding]:
    spread = bone_spread(poses)
    weight = weighed(spread, (_POOR_SPREAD, UNSTEADY))
    if weight == "note":
        return []
    of = spread_of_bones(poses)
    worst = max(of, key=of.__getitem__)
    text = f"Bone lengths vary by {100 * spread:.0f} % (5 % is usual, 9 % poor), {worst} by {100 * of[worst]:.0f} %."
    return [Finding(weight, "bones", text)]


def _sides(poses: PoseSequence) -> list[Finding]:
    joints = _complete(poses)
    if not len(joints):
        return []
    length = dict(zip(_LIMBS, np.median(np.linalg.norm(_vectors(joints), axis=-1), axis=0), strict=True))
    for (start, end), right in length.items():
        left = length.get((start.replace("r_", "l_"), end.replace("r_", "l_")), 0.0)
        if end.startswith("r_") and max(right, left) > _SIDES * min(right, left):
            text = f"{start}-{end} is {right / max(left, 1e-12):.2f} times as long as the left one."
            return [Finding("suspicious", "sides", text)]
    return []


def _handedness(poses: PoseSequence) -> list[Finding]:
    evidence = chirality(poses)
    if evidence.verdict == "good":
        return []
    texts = {
        "wrong": "The body is mirrored or its left and right are exchanged (--handedness mirror or swap)",
        "legs against arms": "Left and right of the legs contradict those of the arms (--handedness swap-legs)",
        "doubtful": "Left and right are doubtful",
    }
    weight: Weight = "suspicious" if evidence.verdict == "doubtful" else "unusable"
    return [Finding(weight, "left and right", f"{texts[evidence.verdict]}: {evidence}.")]


def _stature(poses: PoseSequence) -> list[Finding]:
    stature = implied_stature(poses.joints)
    if not poses.frame.metric or np.isnan(stature) or _ADULTS_M[0] <= stature <= _ADULTS_M[1]:
        return []
    weight: Weight = "suspicious" if STATURES_M[0] < stature < STATURES_M[1] else "unusable"
    text = f"The limbs imply a stature of {stature:.3g} m; is the unit of the file really metres?"
    return [Finding(weight, "stature", text)]


def _turned_over(poses: PoseSequence) -> list[Finding]:
    return [Finding("suspicious", "upside down", text) for text in upside_down(poses)]


def _leaps(poses: PoseSequence) -> list[Finding]:
    rows = leaps(poses)
    if not len(rows):
        return []
    text = (
        f"The whole pose leaps from one frame to the next at {how_many(len(rows), 'row')}, the "
        f"first is row {rows[0]}."
    )
    return [Finding("suspicious", "leaps", text)]


def _seams(poses: PoseSequence) -> list[Finding]:
    if not poses.seams:
        return []
    rows = ", ".join(map(str, poses.seams[:5])) + (", ..." if len(poses.seams) > 5 else "")
    text = f"The estimator began a new clip at row {rows}"
    moved = movement(poses)
    steps = moved[np.array(poses.seams) - 1]
    if np.isfinite(steps).any():
        usual = max(float(np.nanmedian(moved)), 1e-12)
        text += f"; the pose steps there by up to {np.nanmax(steps) / usual:.1f} times its usual movement"
    return [Finding("note", "seams", f"{text}.")]
