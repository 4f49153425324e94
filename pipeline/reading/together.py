"""Whether 3D poses and 2D keypoints are of the same person and the same frames, and if not, which would be.

Each pose is placed where its joints lie best on the rays of the keypoints (signals/reprojection.py); how far they are
off then is least for the frames that belong together: as they are numbered, some frames earlier or later, or by another
rate. A numbering that is right betters every part of a take; by chance one betters some.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera
from ..core.layouts import H36M17
from ..core.limits import limit
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..signals.reprojection import FEWEST, JOINTS, keypoint_rays, off_rays

_USUAL_RATES = limit("keypoints-not-of-poses.rates")
RATES = sorted({a / b for a in _USUAL_RATES for b in _USUAL_RATES})  # of one video that was made into another
# Without the image's size the camera is taken to be far away.
_FAR_SIZE, _FAR_PX = (200_000, 200_000), 1e6


def together(
    poses: PoseSequence,
    keypoints: PoseSequence,
    image_size: tuple[int, int] | None,
    focal_px: float | None = None,
) -> Notice | None:
    """What is said where poses, H36M17 in CAMERA axes, and keypoints of the same frame numbers are not of the same
    frames or person, with the shift or the rate by which they would be; None where they are, and where nothing tells:
    for too few frames or joints in common."""
    stature = implied_stature(poses.joints)
    if not stature > 0:
        return None
    size = image_size or _FAR_SIZE
    focal = (focal_px or PRIOR_FOCAL * max(size)) if image_size else _FAR_PX
    if image_size is None:
        keypoints = _centred(keypoints)
    camera = Camera(size, focal, focal * PRIOR_FOCAL_SPREAD, "told" if focal_px else "prior")
    common = np.flatnonzero(np.isin(poses.frame_index, keypoints.frame_index))
    enough = limit("keypoints-not-of-poses.enough")
    if len(common) < enough:
        return None
    spread = np.linspace(0, len(common) - 1, limit("keypoints-not-of-poses.rows"))
    common = common[np.unique(spread.astype(int))]
    at = poses.frame_index[common].astype(np.float64)
    joints = (poses.joints[common][:, H36M17.indices(JOINTS)] / stature).astype(np.float64)
    off_at = partial(_off, joints, keypoints.frame_index.astype(np.float64), *_rays(poses, keypoints, camera))
    most = limit("keypoints-not-of-poses.lags")
    ways = [(lag, 1.0) for lag in range(-most, most + 1)] + [(0, rate) for rate in RATES if rate != 1]
    frames = np.stack([at[0] + (at - at[0]) * rate + lag for lag, rate in ways])
    by_way = dict(zip(ways, off_at(frames), strict=True))
    offs = {way: _median(off) for way, off in by_way.items() if np.isfinite(off).sum() >= enough}
    if (0, 1.0) not in offs:
        return None
    lag, rate = min(offs, key=lambda way: (offs[way], abs(way[1] - 1), abs(way[0])))
    off, least = offs[0, 1.0], offs[lag, rate]
    better = off > limit("keypoints-not-of-poses.better") * least
    elsewhere = (abs(lag) > 1 or rate != 1) and better and _throughout(by_way[0, 1.0] - by_way[lag, rate])
    usual = limit("keypoints-not-of-poses.off" if image_size else "keypoints-not-of-poses.off-unsized")
    anybodys = _median(off_at(np.roll(at, len(at) // 2)))  # of the keypoints half a take later
    if not elsewhere and off <= max(usual, limit("keypoints-not-of-poses.anybodys") * anybodys):
        return None
    how = f"{abs(lag)} frames {'later' if lag > 0 else 'earlier'} they fit"
    if rate != 1:
        how = f"with numbers that grow {rate:.3g} times as fast they fit"
    how = f"; {how} within {100 * least:.1f} %" if elsewhere else ""
    return notice("keypoints-not-of-poses", off_percent=100 * off, how=how)


def _throughout(gain: np.ndarray) -> bool:
    """Whether something is gained (N,) in nearly every part of the take."""
    fewest, count = limit("keypoints-not-of-poses.parts")
    parts = np.array_split(gain[np.isfinite(gain)], count)
    return sum(bool(part.mean() > 0) for part in parts if len(part)) >= fewest


def _median(off: np.ndarray) -> float:
    return float(np.median(off[np.isfinite(off)])) if np.isfinite(off).any() else np.inf


def _centred(keypoints: PoseSequence) -> PoseSequence:
    """The keypoints of each row about the middle of a large image."""
    there = np.asarray(is_finite(keypoints.joints))[..., None]
    total = np.where(there, keypoints.joints, 0.0).sum(axis=1, keepdims=True)
    middle = total / np.maximum(there.sum(axis=1, keepdims=True), 1)
    return keypoints.with_(joints=keypoints.joints - middle + np.array(_FAR_SIZE) / 2)


def _rays(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """(S, J, 2) rays of all keypoints, of JOINTS, and (S, J) the trust in them."""
    times = keypoints.frame_index if keypoints.time_s is None else keypoints.time_s
    every = poses.without_feet.rows(0, 1).with_(  # a pose in each row of the keypoints, for their rays
        joints=np.zeros((len(keypoints), len(H36M17), 3), np.float32), time_s=times.astype(np.float64),
        frame_index=keypoints.frame_index, confidence=None, path=None, seams=(),
    )  # fmt: skip
    rays, trust = keypoint_rays(every, keypoints, camera)
    use = H36M17.indices(JOINTS)
    return rays[:, use].astype(np.float64), trust[:, use]


def _off(
    joints: np.ndarray, known: np.ndarray, rays: np.ndarray, trust: np.ndarray, frames: np.ndarray
) -> np.ndarray:
    """(..., N) how far joints (N, J, 3), in statures, are off the rays of frames (..., N), in statures; of a pose that
    fits nowhere before the camera a whole stature, NaN for too few joints.

    known: (S,) frames of the rays (S, J, 2) and the trust (S, J) in them. Between two of them rays are on a line, and
    NaN where there are none.
    """
    every = frames.ravel()
    after = np.searchsorted(known, every).clip(1, len(known) - 1)
    before = after - 1
    share = (every - known[before]) / (known[after] - known[before])
    inside = (share >= -1e-9) & (share <= 1 + 1e-9)
    share = share.clip(0, 1)[:, None, None]
    there = np.where(share == 0, rays[before], np.where(share == 1, rays[after], np.nan))
    there = np.where(np.isnan(there), (1 - share) * rays[before] + share * rays[after], there)
    there[~inside] = np.nan
    poses = np.tile(joints, (len(every) // len(joints), 1, 1))
    compared = (is_finite(there) & is_finite(poses)).sum(axis=1) >= FEWEST
    square = (off_rays(there, poses, np.minimum(trust[before], trust[after])) ** 2).sum(axis=-1)
    count = np.isfinite(square).sum(axis=1)
    off = np.where(count > 0, np.sqrt(np.nansum(square, axis=1) / np.maximum(count, 1)), 1.0)
    return np.where(compared, off, np.nan).reshape(frames.shape)
