"""What may be wrong with 3D poses, looked for without knowing what the estimator was or what the person did; and the
look at them before anything is made of them: whether left and right, and up and down, are right. Files, arrays, takes
made by hand and live frames go through it alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..core.anthropometry import LIMBS, STATURES_M, implied_stature
from ..core.errors import InputError
from ..core.figures import label_of
from ..core.layouts import FEET, H36M17, LEG
from ..core.limits import limit
from ..core.messages import first_few
from ..core.notices import Notice, Weight, grave, notice
from ..core.pose import PoseSequence
from ..core.take import Check, Handedness, Take
from ..signals.altered import alterations, weighed
from ..signals.checks import (
    bone_spread,
    chirality,
    empty_rows,
    leaps,
    moves,
    on_its_side,
    spread_of_bones,
    trunk_of,
    upside_down,
    whole_rows,
)
from ..signals.swaps import Swap, find_swaps, notices_of, wrong_rows

_ENOUGH = limit("rows.tell")
_SIDES = {"wrong": "mirrored", "legs against arms": "legs-against-arms", "doubtful": "left-and-right"}
UNNUMBERED = (
    "which video frames its rows belong to; they are counted from 0"  # of a file that does not say it
)


def findings_of(
    poses: PoseSequence, unit: str = "m", swaps: tuple[Swap, ...] | None = None
) -> tuple[Notice, ...]:
    """All that `pcnet3d inspect` would find in poses as a run has them. poses: as pose_findings takes them; unit: of
    their file; swaps: of find_swaps in these poses, where it was asked already."""
    poses = poses.without_feet
    swaps = find_swaps(poses) if swaps is None else swaps
    return (*row_findings(poses), *pose_findings(poses, unit), *swap_findings(poses, swaps))


def row_findings(source: PoseSequence) -> list[Notice]:
    """Gaps, unknown numbers and rates, what was done to the points, the adapter's own warnings.

    source: as the adapter gives it, 2D or 3D.
    """
    notices = []
    # Of every second frame none is missing between.
    stride = int(np.gcd.reduce(np.diff(source.frame_index))) or 1
    span = int(source.frame_index[-1] - source.frame_index[0]) // stride + 1
    # In 2D a row without a pose has nothing but NaN.
    without = ~whole_rows(source) if source.frame.dims == 3 else np.isnan(source.joints).all(axis=(1, 2))
    at_one_point = empty_rows(source)
    absent, gone, empty = span - len(source), int((without & ~at_one_point).sum()), int(at_one_point.sum())
    if lost := absent + gone + empty:
        longest = int(np.diff(source.frame_index).max(initial=stride)) // stride - 1
        counts: dict[str, Any] = {"absent": absent, "longest": longest, "incomplete": gone, "empty": empty}
        ways = (
            f"{absent} left out (at most {longest} in a row)" * bool(absent),
            f"{gone} without some coordinates" * bool(gone),
            f"{empty} with all joints at one point" * bool(empty),
        )
        how, weight = ", ".join(filter(None, ways)), weighed(lost / span, limit("gaps.weight"))
        notices.append(notice("gaps", weight=weight, lost=lost, frames=span, how=how, **counts))
    if not source.frames_known:
        notices.append(notice("not-stated", what=UNNUMBERED))
    if source.time_s is None:
        notices.append(notice("not-stated", what="its frame rate"))
    if not source.made_by.in_run:  # of what this run has made, that which it was made from is looked at
        notices += alterations(source)
    return [*notices, *source.notices]


def swap_findings(source: PoseSequence, swaps: tuple[Swap, ...]) -> list[Notice]:
    """Limbs that are wrong for some rows. Those that are not certain are notes."""
    weight = weighed(float(wrong_rows(source, swaps).mean()), limit("swaps-found.weight"))
    return [
        replace(each, weight="note" if each.code == "swaps-doubtful" else weight)
        for each in notices_of(source, swaps, "poses")
    ]


def pose_findings(poses: PoseSequence, unit: str = "m") -> list[Notice]:
    """What the body shows. poses: H36M17 relative to the pelvis, in CAMERA or a world's axes. unit: of their file."""
    found = [notice("too-few-frames")] if len(_complete(poses)) < limit("too-few-frames.rows") else []
    found += [*_depth(poses), *_averaged(poses), *_bones(poses)]
    if (sides := chirality(poses)).verdict != "good":
        found.append(notice(_SIDES[sides.verdict], evidence=str(sides)))
    found += [*_stature(poses, unit), *(upside_down(poses) or on_its_side(poses))]
    if len(rows := leaps(poses)):
        found.append(notice("leaps", count=len(rows), first=int(poses.frame_index[rows[0]])))
    if poses.seams:
        found.append(notice("seam", weight="note", where=f"at row {first_few(poses.seams)}"))
    return found


def _complete(poses: PoseSequence) -> np.ndarray:
    """(N, J, 3) float64: the whole rows (`whole_rows`); joints that the source lacks are NaN in all of them."""
    return poses.joints[whole_rows(poses) & ~empty_rows(poses)].astype(np.float64)


def _depth(poses: PoseSequence) -> list[Notice]:
    joints = _complete(poses)
    if len(joints) < limit("depth-scaled.rows"):
        return []
    points, size = joints[np.isfinite(joints).all(axis=-1)], trunk_of(poses)
    thickness = np.sqrt(max(float(np.linalg.eigvalsh(np.cov(points.T))[0]), 0)) / size
    if thickness < limit("flat.thickness"):
        return [notice("flat", thickness_percent=float(100 * thickness))]
    movement = np.nanmean(joints.std(axis=0), axis=0) / size
    still = np.flatnonzero(movement < limit("axis-invented.still"))
    moving = len(still) and movement.max() > limit("axis-invented.moves")
    if moving and bone_spread(poses) > limit("axis-invented.bones"):
        return [notice("axis-invented", axis="xyz"[still[0]])]
    least, most = depth_factors(poses) if moves(poses) else (np.nan, np.nan)
    if least > limit("depth-scaled.small"):
        return [notice("depth-scaled", way="shorter", times=least, size="small")]
    if most < 1 / limit("depth-scaled.large"):
        return [notice("depth-scaled", way="longer", times=1 / most, size="large")]
    return []


def depth_factors(poses: PoseSequence) -> tuple[float, float]:
    """By what depth must be multiplied at least, and at most, for limb bones to keep their length; NaN where the take
    does not tell.

    A bone of length L shows xy^2 = L^2 - (factor z)^2 whichever way it points: the slope of xy^2 over z^2, each
    bone's own mean taken out. Noise in depth makes it too small, noise in x and y that of z^2 over xy^2: the true one
    lies between the two (Frisch 1934). Only for CAMERA axes.
    """
    joints = _complete(poses)
    if poses.frame.family != "camera" or len(joints) < limit("depth-scaled.rows"):
        return float("nan"), float("nan")
    bones = _vectors(joints)
    bones = bones / np.maximum(np.linalg.norm(bones, axis=-1).sum(axis=1), 1e-12)[:, None, None]
    across, deep = (bones[..., :2] ** 2).sum(axis=-1), bones[..., 2] ** 2
    across, deep = across - across.mean(axis=0), deep - deep.mean(axis=0)
    together = -float((across * deep).sum())
    if together <= 0:
        return float("nan"), float("nan")
    return float(np.sqrt(together / (deep**2).sum())), float(np.sqrt((across**2).sum() / together))


def _vectors(joints: np.ndarray) -> np.ndarray:
    """(N, 8, 3) limb bones."""
    starts, ends = zip(*LIMBS, strict=True)
    return joints[:, H36M17.indices(ends)] - joints[:, H36M17.indices(starts)]


def _averaged(poses: PoseSequence) -> list[Notice]:
    """Whether joints were averaged over some time, which makes a bone shorter the faster it turns: a mean over w
    seconds of one that turns by some rate is shorter by (rate w)^2 / 24. w is that of three in four limb bones, and
    less where hardly anything turns."""
    if len(poses) < _ENOUGH or poses.time_s is None or poses.made_by.in_run:
        return []
    bones = _vectors(poses.joints.astype(np.float64))
    length = np.linalg.norm(bones, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.linalg.norm(np.gradient(bones / length[..., None], poses.time_s, axis=0), axis=-1)
        longer = np.log(length)
    windows_s = []
    for turns, longer_then in zip((rate**2).T, longer.T, strict=True):
        comparable = np.isfinite(turns) & np.isfinite(longer_then)
        if comparable.sum() < _ENOUGH:
            continue
        calmest = np.percentile(turns[comparable], limit("poses-smooth.calmest"))
        comparable[comparable] = turns[comparable] <= calmest
        covariance = np.cov(turns[comparable], longer_then[comparable])
        square = -24 * covariance[0, 1] / max(covariance[0, 0], 1e-12)
        windows_s.append(
            np.sqrt(max(square, 0.0)) * min(covariance[0, 0] ** 0.25 / limit("poses-smooth.turns"), 1.0)
        )
    window_s = float(np.percentile(windows_s, limit("poses-smooth.bones"))) if windows_s else 0.0
    return [notice("poses-smooth", window_s=window_s)] if window_s > limit("poses-smooth.window") else []


def _bones(poses: PoseSequence) -> list[Notice]:
    spread = bone_spread(poses)
    weight = weighed(spread, limit("bones.weight"))
    if weight == "note":
        return []
    spreads = spread_of_bones(poses)
    worst = max(spreads, key=spreads.__getitem__)
    percent: dict[str, Any] = {"spread_percent": 100 * spread, "worst_percent": 100 * spreads[worst]}
    return [notice("bones", weight=weight, worst=" to ".join(map(label_of, worst.split("-"))), **percent)]


def _stature(poses: PoseSequence, unit: str) -> list[Notice]:
    stature = implied_stature(poses.joints)
    least_m, most_m = limit("stature.adults")
    if not poses.frame.metric or np.isnan(stature) or least_m <= stature <= most_m:
        return []
    weight: Weight = "suspicious" if STATURES_M[0] < stature < STATURES_M[1] else "unusable"
    return [notice("stature", weight=weight, stature_m=stature, unit=unit)]


_ASKED = "sides-wrong-as-asked"
# By the verdict on left and right: what is wrong, and what to ask for.
_WRONG_SIDES = {
    "legs against arms": (
        "left and right of the legs contradict those of the arms",
        "swap-legs if the legs are in SPIN's order, or =ignore",
    ),
    "wrong": (
        "the body is mirrored or its left and right are exchanged",
        "mirror if the coordinates are mirrored, =swap if the names are, or =ignore",
    ),
}


def looked_at(take: Take) -> Take:
    """A take whose poses somebody else has put into it, with what is found in them; any other as it is. InputError as
    of `guarded`, by what the take is told."""
    poses = take.poses
    if poses is None or take.findings is not None or not _judged(poses):
        return take
    poses = guarded(poses, take.told.handedness, f"The poses of take {take.name}", take.told.check)
    return take.with_(poses=poses, findings=findings_of(poses)).saying(*poses.notices)


def doubts(poses: PoseSequence) -> tuple[Notice, ...]:
    """What is grave of all that is found in several poses of H36M17, but limbs that are exchanged for some rows."""
    return grave(findings_of(poses, swaps=())) if _judged(poses) and len(poses) > 1 else ()


def _judged(poses: PoseSequence) -> bool:
    return poses.layout.is_body and poses.frame.family in ("camera", "world")


def guarded(poses: PoseSequence, handedness: Handedness, where: str, check: Check = "refuse") -> PoseSequence:
    """The poses with left and right put right as asked; InputError when these, or up and down, are wrong.

    poses: H36M17 in 3D. where: what they come from, for the error. check: "off" takes both as they are. A doubt is a
    notice of theirs. Of a lift in the run the image may be upside down, which is told later.
    """
    if check == "off" and handedness == "refuse":
        handedness = "ignore"
    if any(each.code == _ASKED for each in poses.notices):  # whoever read them has looked
        return poses
    if handedness not in ("refuse", "ignore"):
        poses = repaired(poses, handedness).saying(notice("sides-put-right", repair=handedness))
    evidence = chirality(poses)
    if handedness != "refuse" and evidence.verdict != "good":
        poses = poses.saying(notice(_ASKED, verdict=evidence.verdict, evidence=str(evidence)))
    elif handedness == "refuse" and evidence.verdict in _WRONG_SIDES:
        what, how = _WRONG_SIDES[evidence.verdict]
        raise InputError("sides-swapped", f"{where}: {what}: {evidence}; pass --set read.handedness={how}.")
    for doubt in upside_down(poses) if check == "refuse" else ():
        if doubt.code == "upside-down":
            how = f'{doubt.text[:-1]}; for one pass --set read.check=off (check="off").'
            raise InputError("wrong-axes", f"{where}: {how}")
    return poses


def repaired(poses: PoseSequence, handedness: Handedness) -> PoseSequence:
    """Left and right put right as asked: "mirror" negates x, "swap" and "swap-legs" exchange joints' names."""
    if handedness == "mirror":
        return poses.moved(np.diag([-1.0, 1.0, 1.0])).noted("handedness", repair=handedness)
    order = np.arange(len(poses.layout))
    legs = [i for i, joint in enumerate(poses.layout.joints) if joint[2:] in LEG or joint in FEET]
    swapped = legs if handedness == "swap-legs" else order
    order[swapped] = poses.layout.mirror[swapped]
    covariance = poses.covariance
    return poses.with_(
        joints=poses.joints[:, order],
        confidence=poses.confidence[:, order],
        covariance=None if covariance is None else covariance[:, order],
    ).noted("handedness", repair=handedness)
