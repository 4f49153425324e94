"""A take's motion, made once after its angles: joints, columns, and in which frames what of it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose, unit
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import BRIDGED_S, breaks, ranked, stretches
from .residuals import LIMBS, Residuals, residuals_of, unsure_joints

# Of the take's usual residual, within which a limb agrees with its keypoints: what is usual tells how good these are,
# 0.026 statures with the noisy keypoints of the test bed, 0.012 with exact ones.
_USUAL = 3.0
_FRAMES = 5  # median over so many: an error of one frame is the keypoint's, which the lifter has not followed


@dataclass(frozen=True, eq=False)
class Motion:
    """source: the poses that were rectified. filtered: joints in LEVEL after the low-pass, relative to the pelvis, with
    its path where that is known. body: (T, 17, 3) the same joints in BODY. columns: the take's kinematics (T,). seams:
    rows at which something new begins. known: (T, 17) which joints of H36M17 were visible and are where they belong:
    not where nobody saw them, their limb may be exchanged or contradicts its keypoints. unsure: {joint: (T,)} where the
    detector may have guessed it. lean_deg: (T,) of the trunk from upright, NaN where up is not known. against:
    {limb: (T,)} where it contradicts its keypoints; empty where nothing tells that."""

    source: PoseSequence
    filtered: PoseSequence
    rectified: Rectified
    body: np.ndarray
    columns: Mapping[str, np.ndarray]
    seams: tuple[int, ...]
    known: np.ndarray
    unsure: Mapping[str, np.ndarray]
    lean_deg: np.ndarray
    against: Mapping[str, np.ndarray]

    @property
    def times(self) -> np.ndarray:
        """(T,) seconds."""
        return self.filtered.times

    @property
    def duration_s(self) -> float:
        """From the first frame to the last."""
        return float(np.ptp(self.times)) if len(self.times) else 0.0

    @property
    def moving_camera(self) -> bool:
        """Whether the camera moves, so that nobody knows where in the room the person is."""
        return self.rectified.camera == "moving"

    @property
    def unjudged(self) -> bool:
        """Whether angles without a stated error come from a lifter whose errors were not measured, not from capture."""
        return self.source.made_by.kind != "measured" and not self.rectified.in_world

    def angle(self, name: str) -> np.ndarray:
        """(T,) degrees; NaN throughout where it is not among the columns."""
        return self.columns.get(f"{name}_deg", np.full(len(self.times), np.nan))

    def sd(self, name: str) -> np.ndarray:
        """(T,) its stated standard deviation, NaN where none is."""
        return self.columns.get(f"{name}_sd_deg", np.full(len(self.times), np.nan))

    def has(self, joints: Sequence[str]) -> np.ndarray:
        """(T,) where all these joints are known."""
        return np.asarray(self.known[:, H36M17.indices(joints)].all(axis=1))


def motion_of(take: Take) -> Motion:
    """Of a take that is rectified, filtered and has its kinematics; InputError for another."""
    poses, rectified, filtered = take.need("poses"), take.need("rectified"), take.need("filtered")
    against, unsure = contradicted(residuals_of(take), poses.times), unsure_joints(take)
    joints = filtered.without_feet.joints
    known = np.asarray(is_finite(joints)).copy()
    for joint, rows in unsure.items():
        known[rows, H36M17.index(joint)] = False
    for limb, rows in against.items():
        known[np.ix_(rows, np.array(H36M17.indices(LIMBS[limb][1:])))] = False
    for limb, rows in in_doubt(take).items():
        for side in "rl":
            known[np.ix_(rows, np.array(H36M17.indices(LIMBS[f"{side}_{limb}"][1:])))] = False
    R_body_from_level = transpose(rectified.R_source_from_body) @ rectified.R_source_from_level
    trunk = unit(filtered.joint("thorax").astype(np.float64) - filtered.joint("pelvis"))
    lean_deg = np.degrees(np.arccos(np.clip(trunk[:, 2], -1, 1)))
    return Motion(
        source=poses,
        filtered=filtered,
        rectified=rectified,
        body=rotate(R_body_from_level, joints),  # in double precision, as the rotations are
        columns=take.need("kinematics"),
        seams=breaks(filtered),
        known=known,
        unsure=unsure,
        lean_deg=lean_deg if rectified.level_ok else np.full(len(lean_deg), np.nan),
        against=against,
    )


def agrees(residuals: Residuals) -> float:
    """Up to which residual, in statures, a limb of the take agrees with its keypoints; NaN where none is known."""
    every = np.concatenate([residuals.limb(limb) for limb in LIMBS])
    every = every[np.isfinite(every)]
    return _USUAL * float(np.median(every)) if len(every) else float("nan")


def steady(residual: np.ndarray) -> np.ndarray:
    """(T,) a limb's residual without what lasts for a frame or two; NaN where it is not known."""
    finite = np.isfinite(residual)
    return np.where(finite, ranked(np.where(finite, residual, 0.0), _FRAMES, _FRAMES // 2, "edge"), np.nan)


def contradicted(residuals: Residuals | None, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """{limb: (T,)} in which rows it contradicts its keypoints: beyond what agrees with them for longer than BRIDGED_S.
    time_s: (T,)."""
    if residuals is None:
        return {}
    against = {limb: steady(residuals.limb(limb)) > agrees(residuals) for limb in LIMBS}
    for rows in against.values():
        for start, stop in stretches(rows):
            rows[start:stop] = time_s[stop - 1] - time_s[start] >= BRIDGED_S
    return against


def in_doubt(take: Take) -> dict[str, np.ndarray]:
    """{"leg" or "arm": (T,) bool} in which rows of the poses these limbs may be exchanged
    (signals.swaps.swaps_of_take), their own and those of the keypoints if this run has lifted them."""
    poses = take.need("poses")
    doubt: dict[str, np.ndarray] = {}
    rests_on = ("poses", "keypoints") if poses.made_by.in_run else ("poses",)
    for said in take.said:
        if said.code in ("swaps-found", "swaps-doubtful") and said.values.get("what") in rests_on:
            for limb, first, last in said.values.get("exchanged", ()):
                rows = (first <= poses.frame_index) & (poses.frame_index <= last)
                doubt[limb] = doubt.get(limb, False) | rows
    return doubt
