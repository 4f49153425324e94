"""In which posture a body is, and how fast it moves: what a lifter errs more in than its own spread says.

How much more stands in joint_noise.json (`postures`, degrees), fitted to 166 takes of 9 validation people,
by models/lab/evaluation/errors.py; of arms also, once, at commit ea79b40b, to arms that a program raised, for none of
these people raises them far.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import angle_deg
from ...pipeline.signals.angles import ANGLES

POSTURES = ("upright", "bent", "arms overhead", "crouched", "lying")
FEATURES = ("lean", "low", "arms", "speed")
_BENT_DEG, _LYING_DEG = 30.0, 60.0  # lean of the trunk
_OVERHEAD_DEG = 120.0
LOW, _STANDS = 0.38, 0.47  # statures of the pelvis over the lower ankle: somebody crouches, or stands
_EXTENDED = 0.44  # statures from the pelvis to the ankle of a leg that stands
FAST = 0.5  # statures a second; walks have 0.35
_SPEED_S = 0.1  # to either side, over which a speed is taken
_USUAL = 0.35  # speed that adds nothing of its own
_UNITS = {"lean": 45.0, "low": 0.25, "arms": 60.0, "speed": 1.0}


def features(body: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """{name of FEATURES: (T,)} of joints (T, 17, 3) in BODY, of any unit, at times (T,): lean of the trunk from upright
    and the higher upper arm's angle from the trunk, degrees; how high the pelvis is over the lower ankle, statures; and
    the mean speed of the joints about the pelvis, statures a second. NaN where it is not known. r_arm, l_arm: as arms,
    of either arm."""
    body = body.astype(np.float64)
    trunk, up = _way(body, "pelvis", "thorax"), np.broadcast_to([0.0, 0.0, 1.0], (len(body), 3))
    arms = _arms(body)
    reach = max(round(_SPEED_S / max(float(np.median(np.diff(time_s))), 1e-9)), 1) if len(body) > 1 else 0
    rows = np.arange(len(body))
    first, last = np.maximum(rows - reach, 0), np.minimum(rows + reach, len(rows) - 1)
    moved = np.linalg.norm(body[last] - body[first], axis=-1).mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "lean": angle_deg(trunk, up),
            "low": lowness(body),
            "arms": np.fmax(*arms.values()),
            **arms,
            "speed": moved / (time_s[last] - time_s[first]) / implied_stature(body),
        }


def _way(body: np.ndarray, start: str, end: str) -> np.ndarray:
    return body[:, H36M17.index(end)] - body[:, H36M17.index(start)]


def _arms(body: np.ndarray) -> dict[str, np.ndarray]:
    trunk = _way(body, "pelvis", "thorax")
    return {
        f"{side}_arm": angle_deg(_way(body, f"{side}_shoulder", f"{side}_elbow"), -trunk) for side in "rl"
    }


def folding(joints: np.ndarray) -> np.ndarray:
    """(T, 2) what is known of an unusual posture without up, of joints (T, 17, 3) in any axes, of any unit: how much
    nearer to the pelvis the nearer ankle is than of somebody who stands, and how far the higher arm is raised; in the
    units of `growth`, 0 where it is not, or not known."""
    joints = joints.astype(np.float64)
    legs = [np.linalg.norm(_way(joints, "pelvis", f"{side}_ankle"), axis=-1) for side in "rl"]
    beyond = _EXTENDED - np.fmin(*legs) / implied_stature(joints), np.fmax(*_arms(joints).values()) - 90.0
    units = _UNITS["low"], _UNITS["arms"]
    return np.fmax(np.nan_to_num(np.stack(beyond, axis=-1) / units), 0.0)


def lowness(body: np.ndarray) -> np.ndarray:
    """(T,) statures of the pelvis over the lower ankle, of joints (T, 17, 3) in BODY."""
    pelvis, *ankles = (body[:, H36M17.index(name), 2] for name in ("pelvis", "r_ankle", "l_ankle"))
    return (pelvis - np.fmin(*ankles)) / implied_stature(body)


def arms_of(angle: str) -> str:
    """Which of `features` says how far the arms are raised that an angle's errors grow with: its own arm, or the
    higher one."""
    joints = ANGLES[angle].joints if angle in ANGLES else ()
    return f"{angle[0]}_arm" if any(joint.endswith("_elbow") for joint in joints) else "arms"


def growth(body: Mapping[str, np.ndarray], arms: str = "arms") -> np.ndarray:
    """(T, 4) how far each feature is beyond a standing or walking person's, 0 where it is not, or not known; of lean
    1 is 45 degrees, of a low pelvis a quarter of the stature, of arms 60 degrees, of speed a stature a second. arms: of
    `arms_of`."""
    beyond = {
        "lean": body["lean"] - _BENT_DEG / 2,
        "low": _STANDS - body["low"],
        "arms": body[arms] - 90.0,
        "speed": body["speed"] - _USUAL,
    }
    return np.stack([np.fmax(np.nan_to_num(beyond[name]), 0.0) / _UNITS[name] for name in FEATURES], axis=-1)


def posture(body: Mapping[str, np.ndarray]) -> np.ndarray:
    """(T,) places in POSTURES."""
    return np.select(
        [
            body["lean"] > _LYING_DEG,
            body["low"] < LOW,
            body["arms"] > _OVERHEAD_DEG,
            body["lean"] > _BENT_DEG,
        ],
        [4, 3, 2, 1],
        0,
    )
