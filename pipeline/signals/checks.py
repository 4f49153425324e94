"""Checks of a skeleton: left and right, bone lengths, missing frames. They look; they change nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.blocks import blocks
from ..core.layouts import H36M17, Layout
from ..core.limits import limit
from ..core.messages import how_many
from ..core.notices import Notice, Weight, notice
from ..core.pose import TOLD_UP, PoseSequence, Rectified
from ..core.rotations import angle_deg, is_finite, norm, unit

_OF_TRUNK = ("pelvis", "thorax", "l_hip", "r_hip", "l_shoulder", "r_shoulder")
_LEGS = (("l_hip", "l_knee", "l_ankle"), ("r_hip", "r_knee", "r_ankle"))
_UP = {"camera": (0.0, -1.0, 0.0), "world": (0.0, 0.0, 1.0)}  # in the families' reference axes
NEAR_S = limit("leaps.near")


@dataclass(frozen=True)
class Chirality:
    """Evidence on left and right (formats.md section 1), as shares of frames that agree.

    nose: the nose lies in front of the body, as named left and right say where front is.
    knees: bent knees point forward. arms_legs: the shoulders' left is the hips' left.
    *_votes: how many observations each share rests on.
    """

    nose: float
    knees: float
    arms_legs: float
    nose_votes: int
    knee_votes: int
    arms_legs_votes: int

    @property
    def verdict(self) -> str:
        """ "good", "doubtful" (one cue, few frames or none), "legs against arms", or "wrong" (both cues, or
        the knees alone where no nose is known)."""
        no_nose, strong, votes = self.nose_votes == 0, limit("sides.against"), limit("sides.votes")
        against = (no_nose or self.nose <= strong, self.knees <= strong)
        enough = (no_nose or self.nose_votes >= votes) and self.knee_votes >= votes
        if self.arms_legs <= strong and self.arms_legs_votes >= votes:
            return "legs against arms"
        if all(against) and enough:
            return "wrong"
        shares = np.array([self.nose, self.knees, self.arms_legs])
        unseen = no_nose and self.knee_votes == 0
        return "doubtful" if unseen or (shares <= strong).any() else "good"

    def __str__(self) -> str:
        votes_of = {
            "the nose points forward": (self.nose, self.nose_votes, "frame"),
            "a bent knee points forward": (self.knees, self.knee_votes, "case"),  # up to two a frame
            "hips and shoulders agree on left": (self.arms_legs, self.arms_legs_votes, "frame"),
        }
        return ", ".join(
            f"{cue} in {100 * share:.0f} % of {how_many(votes, what)}"
            if votes
            else f"no frame tells whether {cue}"
            for cue, (share, votes, what) in votes_of.items()
        )


def chirality(poses: PoseSequence) -> Chirality:
    """Does the named left and right fit the direction the nose and knees point at? poses: H36M17, 3D.

    Forward is left x up with left from right hip to left hip and up from pelvis to thorax; both cues use no
    left/right of their own. A mirrored skeleton and one with exchanged names contradict alike. A nose that was made
    out of other joints has no vote.
    """
    cues = np.concatenate(
        [handedness_cues(part, poses.layout) for part in _parts(without_made_nose(poses).joints)]
    )
    known = [values[np.isfinite(values)] for values in (cues[:, 0], cues[:, 1:3].ravel(), cues[:, 3])]
    nose, knees, trunk = (float((values > 0).mean()) if len(values) else float("nan") for values in known)
    return Chirality(nose, knees, trunk, *map(len, known))


def handedness_cues(joints: np.ndarray, layout: Layout) -> np.ndarray:
    """(..., 4) cosines that are positive when left and right are as named: nose, left knee and right knee against
    forward, left of the hips against left of the shoulders. NaN where they do not tell; 2D has the last one only.

    joints: (..., J, D), any axes, H36M17 when 3D. A knee that is nearly straight does not count.
    """

    def joint(name: str) -> np.ndarray:
        return joints[..., layout.index(name), :]

    hips, shoulders = joint("l_hip") - joint("r_hip"), joint("l_shoulder") - joint("r_shoulder")
    cues = np.full((*joints.shape[:-2], 4), np.nan)
    cues[..., 3] = (unit(hips) * unit(shoulders)).sum(-1)
    if joints.shape[-1] == 2:
        trunk = joint("l_shoulder") + joint("r_shoulder") - joint("l_hip") - joint("r_hip")
        short = limit("sides.end-on") * np.linalg.norm(trunk, axis=-1) / 2
        end_on = np.minimum(np.linalg.norm(hips, axis=-1), np.linalg.norm(shoulders, axis=-1)) < short
        cues[end_on] = np.nan
        return cues
    forward = unit(np.cross(hips, joint("thorax") - joint("pelvis")))
    nose = joint("nose") - (joint("thorax") + joint("head")) / 2
    cues[..., 0] = (unit(nose) * forward).sum(-1)
    for i, (hip, knee, ankle) in enumerate(tuple(map(joint, leg)) for leg in _LEGS):
        bend = knee - (hip + ankle) / 2
        length = np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)
        bent = np.linalg.norm(bend, axis=-1) > limit("sides.knee-bend") * length
        cues[..., 1 + i] = np.where(bent, (unit(bend) * forward).sum(-1), np.nan)
    return cues


def without_made_nose(poses: PoseSequence) -> PoseSequence:
    """The same, its nose missing where it was made out of other joints, and so tells nothing."""
    if "nose" not in poses.derived:
        return poses
    nose = np.arange(len(poses.layout)) == poses.layout.index("nose")
    return poses.with_(joints=np.where(nose[:, None], np.nan, poses.joints))


def _parts(joints: np.ndarray) -> Iterator[np.ndarray]:
    """joints (T, J, D) in float64, some minutes at a time: hours of video would take several times their memory."""
    return (joints[rows].astype(np.float64) for rows in blocks(len(joints)))


def spread_of_bones(poses: PoseSequence) -> dict[str, float]:
    """Relative spread (std / mean) of each bone's length, by "from-to", each frame over its own size, of the bones that
    the source has.

    A person who walks towards the camera grows in an estimator's image units, and that is fine; bones that
    change against each other are not.
    """
    pairs = np.array([poses.layout.indices(bone) for bone in H36M17.bones])
    parts = _parts(poses.joints[whole_rows(poses) & ~empty_rows(poses)])
    lengths = [np.linalg.norm(part[:, pairs[:, 0]] - part[:, pairs[:, 1]], axis=-1) for part in parts]
    length = np.concatenate([np.zeros((0, len(pairs))), *lengths])
    if len(length) < 2:
        return {}
    length = length / np.maximum(np.nansum(length, axis=1, keepdims=True), 1e-12)
    spread = length.std(axis=0) / np.maximum(length.mean(axis=0), 1e-12)
    spreads = zip(H36M17.bones, spread, strict=True)
    return {f"{a}-{b}": float(value) for (a, b), value in spreads if np.isfinite(value)}


def bone_spread(poses: PoseSequence) -> float:
    """Mean of `spread_of_bones`, NaN without any. 0.05 is usual, 0.09 is poor."""
    spreads = [*spread_of_bones(poses).values()]
    return float(np.mean(spreads)) if spreads else float("nan")


def empty_rows(poses: PoseSequence) -> np.ndarray:
    """(T,) True where all joints that are there, more than two, lie on one point, as failed frames do that were filled
    with zeros; a joint that the source never has stays NaN in these too."""
    joints = poses.without_feet.joints
    finite = is_finite(joints)
    alike = finite.sum(axis=1) > 2
    for axis in np.moveaxis(joints, -1, 0):
        alike &= np.where(finite, axis, np.inf).min(axis=1) == np.where(finite, axis, -np.inf).max(axis=1)
    return alike


def whole_rows(poses: PoseSequence) -> np.ndarray:
    """(T,) True where no joint is missing, but for those of head and limbs that no row has: the source lacks these."""
    poses = poses.without_feet
    finite = np.asarray(is_finite(poses.joints))
    lacks = ~finite.any(axis=0) & ~np.isin(poses.layout.joints, _OF_TRUNK)
    return np.asarray((finite | lacks).all(axis=1) & finite.any(axis=1))


def upside_down(poses: PoseSequence) -> list[Notice]:
    """A notice where the head is well below the feet nearly all the time. poses: H36M17 in 3D, any axes."""
    rows = np.flatnonzero(np.asarray(is_finite(poses.without_feet.joints)).all(axis=1))
    if not len(rows) or poses.frame.family not in _UP:
        return []
    up = (poses.frame.basis @ _UP[poses.frame.family]).astype(np.float32)
    at = {name: poses.joint(name)[rows] for name in ("pelvis", "thorax", "head", "l_ankle", "r_ankle")}
    below = (at["l_ankle"] + at["r_ankle"]) / 2 - at["head"]
    share = float((below @ up > np.linalg.norm(at["thorax"] - at["pelvis"], axis=-1)).mean())
    if share < limit("upside-down.share"):
        return []
    what = (
        "turn the image before the run"  # whose axes they have
        if poses.made_by.in_run
        else "the file's vertical axis seems to be upside down; if its y points up, say so with --adapter arrays -O "
        "frame=GL_CAMERA (or Y_UP) and its layout and unit, such as -O layout=H36M17 -O unit=mm (-O unit=arbitrary if "
        'it has no scale), or with axes="camera-y-up" or "y-up" in Python'
    )
    return [notice("upside-down", share_percent=100 * share, what=what)]


def nobody_upright(rectified: Rectified) -> list[Notice]:
    """A notice where the trunk is far off the up that a take was given nearly all the time: the lines of a picture
    that is turned by 90 or 180 degrees say the same as those of an upright one. Empty elsewhere, and where the source
    knows its own up or the user has told most of it. Suspicious unless the pelvis is known to stay where it is, as that
    of a person who lies does."""
    by_user = sum(rectified.up_shares.get(source, 0.0) for source in TOLD_UP)
    if not rectified.level_ok or rectified.in_world or by_user > 0.5:
        return []
    return _off_up(rectified.level, "nobody-upright")


def on_its_side(poses: PoseSequence) -> list[Notice]:
    """The same of a world's own up, which may be another axis than the one that was told: a walker moved along it, or
    kicked. poses: H36M17; joints alone do not tell a person who lies, but one whose pelvis travels hardly lies."""
    return _off_up(poses, "on-its-side") if poses.frame.family == "world" else []


def _off_up(poses: PoseSequence, code: str) -> list[Notice]:
    """A notice of that code where the trunk is far off up, in LEVEL's or a world's axes, nearly all the time."""
    least_deg = limit("nobody-upright.off")
    off_deg = angle_deg(poses.joint("thorax") - poses.joint("pelvis"), poses.frame.basis @ _UP["world"])
    off_deg = off_deg[np.isfinite(off_deg)]
    share = float((off_deg > least_deg).mean()) if len(off_deg) else 0.0
    if share < limit("upside-down.share"):
        return []
    weight: Weight = "warning" if _stays(poses) else "suspicious"
    return [notice(code, weight=weight, off_deg=least_deg, share_percent=100 * share)]


def _stays(level: PoseSequence) -> bool:
    """Whether the pelvis is known to stay where it is, as that of a person who lies does."""
    if level.root is None:
        return False
    root = level.root[np.isfinite(level.root).all(axis=1)]
    if not len(root):
        return False
    low, high = np.percentile(root, limit("nobody-upright.path"), axis=0)
    return bool((high - low).max() < limit("nobody-upright.travels") * implied_stature(level.joints))


def movement(poses: PoseSequence) -> np.ndarray:
    """Mean movement of the joints (T, 17, 3) relative to the pelvis, from row to row: (rows - 1,) trunk lengths, NaN
    where a row is not whole."""
    joints = poses.without_feet.joints
    joints = joints[:, np.isfinite(joints).any(axis=(0, 2))].astype(np.float64)
    moved = norm(np.diff(joints, axis=0))
    return moved.sum(axis=1) / max(moved.shape[1], 1) / trunk_of(poses)


def moves(poses: PoseSequence) -> bool:
    """Whether some joint goes further than those of lifts wander where nobody moves."""
    joints = poses.without_feet.joints[whole_rows(poses)].astype(np.float64)
    goes = np.linalg.norm(np.ptp(joints, axis=0), axis=-1) if len(joints) else np.zeros(1)
    return bool((goes > limit("depth-scaled.wanders") * trunk_of(poses)).any())


def trunk_of(poses: PoseSequence) -> float:
    """Median length of the trunk in whole rows; NaN without any."""
    length = np.linalg.norm(poses.joint("thorax") - poses.joint("pelvis"), axis=-1)[
        whole_rows(poses) & ~empty_rows(poses)
    ]
    return max(float(np.median(length)), 1e-12) if len(length) else np.nan


def leaps(poses: PoseSequence) -> np.ndarray:
    """Rows (N,) at which the whole pose is somewhere else than one video frame before, as no person moves. Frames whose
    times are unknown count as near. In a world's axes its path counts too."""
    step_s = NEAR_S if poses.time_s is None else np.diff(poses.time_s)
    most = limit("leaps.moves") * np.maximum(step_s / NEAR_S, 1.0)
    leapt = movement(poses) > most
    # Before a camera depth alone may be as far off from one frame to the next.
    if poses.root is not None and poses.frame.family == "world":
        went = np.linalg.norm(np.diff(poses.root.astype(np.float64), axis=0), axis=-1)
        went[np.array(poses.seams, dtype=int) - 1] = 0  # from one clip to the next
        leapt |= went > limit("leaps.path") * trunk_of(poses) * np.maximum(step_s, limit("leaps.shortest"))
    return np.flatnonzero(leapt & (np.diff(poses.frame_index) == 1)) + 1


def strays_of(poses: PoseSequence) -> np.ndarray:
    """(T,) True in pieces between leaps of the whole pose, or between one and a clip's end, that are so short; nowhere
    when they are many, for then nobody knows who is the person."""
    strays = np.zeros(len(poses), dtype=bool)
    leapt = set(leaps(poses).tolist())
    edges = sorted({0, len(poses), *poses.seams, *leapt}) if leapt else []
    for start, stop in pairwise(edges):
        alone = start in leapt or stop in leapt
        strays[start:stop] = alone and poses.times[stop - 1] - poses.times[start] < limit("strays.lasts")
    return strays if strays.mean() <= limit("strays.share") else np.zeros(len(poses), dtype=bool)
