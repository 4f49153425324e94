"""Joint and segment angles that 17 joints can give, and those of ankle and foot where the source gives heels and toes:
conventions and values. What each is: angles.toml; images: docs/angles.md.

Every angle is a function of one frame's joints in BODY (x back, y right, z up; design.md section 4). Angles between
segments do not change when the whole body is turned; those with `needs_gravity` do.

- A segment's two angles against a trunk frame are the first two of the Cardan sequence flexion, abduction, rotation,
  which its long axis alone gives (hip: the joint coordinate system of Grood & Suntay 1983 and ISB, Wu et al. 2002).
  The pelvis frame is the hip line and the trunk line (pelvis to thorax), the thorax frame the shoulder line and the
  trunk line: 17 joints give no tilt of pelvis or thorax of their own.
- Knee and elbow flexion are signed about an axis across the limb: the mediolateral reference where the limb is nearly
  straight, the limb's own plane where it is clearly bent (_STRAIGHT). An unsigned angle of noisy joints never reads 0;
  a plain projection reads too little when the thigh or upper arm is turned about itself.
- The foot's line runs from the heel to the middle of big and small toe, or to the big toe where the source never gives
  a small one. BlazePose's foot index, the tip of the foot's middle, stands for the big toe.
- Ankle dorsiflexion follows the ISB's ankle (Wu et al., J Biomech 35, 2002) in sign and plane as far as a line can: the
  angle in the plane of shank and foot, without the rotation of the foot about itself. It is 0 where the foot's line is
  square to the shank. Heel and toes lie at other heights with every estimator, which shifts it by a constant of some
  degrees: compare changes.
- Foot progression is taken against where the person faces (BODY), not against the path, which most sources do not know.
  For somebody who walks the way they face it is the clinical angle, toe-out positive.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.layouts import H36M17, TRUNK_CORNERS, Layout
from ..core.limits import limit

REASONS = {
    0: "fine",
    1: "a joint is missing",
    2: "the limb is hyperextended by about 20 degrees, or lies along the axis that the angle is measured about",
    3: "the frame is not levelled, or the angle's error is too large",
    4: "a gap, a clip boundary, or a stretch too short for the filter",
    5: "a joint is not in the image, or the detector does not see it",
    7: "its limbs may be exchanged, or both lie on one",
}
FINE, MISSING, UNDEFINED, UNTRUSTED, TOO_SHORT, UNSEEN, EXCHANGED = REASONS

_STRAIGHT = np.sin(np.radians(limit("angles.bent")))
_ALONG = np.sin(np.radians(limit("angles.along")))


@dataclass(frozen=True)
class Angle:
    """One angle, with the fields of angles.toml, which says what they are."""

    group: str
    definition: str
    positive: str
    joints: tuple[str, ...]
    needs_gravity: bool = False
    centre_deg: float = 0.0
    anatomy_deg: tuple[float, float] = (-np.inf, np.inf)


@cache
def _definitions() -> dict[str, dict[str, dict[str, Any]]]:
    return tomllib.loads(Path(__file__).with_name("angles.toml").read_text(encoding="utf-8"))


def defined(part: Literal["sides", "middle", "feet"]) -> dict[str, Angle]:
    """The angles of this part of angles.toml by name, all of the right side before those of the left."""
    angles = {}
    for side in ("",) if part == "middle" else ("r_", "l_"):
        for name, fields in _definitions()[part].items():
            joints = tuple(dict.fromkeys(joint.replace("own_", side) for joint in fields["joints"]))
            own = {"joints": joints, "anatomy_deg": tuple(fields.get("anatomy_deg", Angle.anatomy_deg))}
            angles[side + name] = Angle(**{**fields, **own})
    return angles


ANGLES = defined("sides") | defined("middle")
FOOT_ANGLES = defined("feet")
ALL_ANGLES = ANGLES | FOOT_ANGLES
MIDLINE = tuple(name for name in ANGLES if name[1] != "_")  # those without a side
# Change sign in a mirror.
MIRRORED_SIGN = ("trunk_lean_frontal", "pelvis_obliquity", "thorax_pelvis_rotation")


def of_both(name: str) -> str:
    """An angle's name without its side."""
    return name if name in MIDLINE else name[2:]


def sides_of(both: str) -> tuple[str, ...]:
    """The angles, right and left, that `of_both` gives one name; one of MIDLINE by itself."""
    return (both,) if both in MIDLINE else (f"r_{both}", f"l_{both}")


OF_BOTH, ALL_OF_BOTH = (
    tuple(dict.fromkeys(map(of_both, names))) for names in (ANGLES, ALL_ANGLES)
)  # without sides


def angles(body: np.ndarray) -> dict[str, np.ndarray]:
    """(...,) degrees by name of ANGLES. body: (..., J, 3), H36M17 in BODY, any unit and origin; what stands behind its
    joints is not looked at.

    NaN where a joint is missing, or where the angle is not defined: a limb along its own axis of measurement.
    Where only angles without `needs_gravity` matter the joints may be in any right-handed axes.
    """
    # Joints and their axes first, (17, 3, ...): whole arrays of x, y and z are many times as quick as three at a time.
    points = np.moveaxis(np.asarray(body, dtype=np.float64), (-2, -1), (0, 1))
    at = dict(zip(H36M17.joints, np.ascontiguousarray(points[: len(H36M17)]), strict=True))
    trunk = _unit(at["thorax"] - at["pelvis"])
    hips, shoulders = (_unit(at[f"r_{part}"] - at[f"l_{part}"]) for part in ("hip", "shoulder"))
    thorax_forward, thorax_up = trunk_axes(shoulders, trunk)
    pelvis_forward, pelvis_up = trunk_axes(hips, trunk)
    facing = np.isfinite(hips + shoulders).all(axis=0)  # what BODY's heading rests on
    degrees = {}
    for side, out in (("r", 1.0), ("l", -1.0)):
        thigh, shank = (
            _unit(at[f"{side}_{b}"] - at[f"{side}_{a}"]) for a, b in (("hip", "knee"), ("knee", "ankle"))
        )
        arm, forearm = (
            _unit(at[f"{side}_{b}"] - at[f"{side}_{a}"])
            for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))
        )
        degrees[f"{side}_knee_flexion"] = _hinge(thigh, shank, -hips)
        degrees[f"{side}_elbow_flexion"] = _hinge(
            arm, forearm, arm_reference(arm, shoulders, thorax_forward, thorax_up, out)
        )
        for joint, flexion, segment, frame in (
            ("hip", "thigh_trunk_flexion", thigh, (pelvis_forward, hips, pelvis_up)),
            ("shoulder", "shoulder_flexion", arm, (thorax_forward, shoulders, thorax_up)),
        ):
            forward, right, up = (_dot(segment, axis) for axis in frame)
            degrees[f"{side}_{flexion}"] = _turn(forward, -up)
            degrees[f"{side}_{joint}_abduction"] = _lift(out * right)
            if joint == "shoulder":
                degrees[f"{side}_shoulder_elevation"] = _degrees(np.hypot(forward, right), -up)
        for name, segment in (("thigh", thigh), ("shank", shank), ("upper_arm", arm)):
            degrees[f"{side}_{name}_sagittal"] = np.where(facing, _turn(-segment[0], -segment[2]), np.nan)
    degrees["trunk_lean_sagittal"] = np.where(facing, _turn(-trunk[0], trunk[2]), np.nan)
    degrees["trunk_lean_frontal"] = np.where(facing, _lift(trunk[1]), np.nan)
    degrees["pelvis_obliquity"] = _lift(hips[2])
    degrees["thorax_pelvis_rotation"] = _degrees(
        _dot(_cross(pelvis_forward, thorax_forward), trunk), _dot(pelvis_forward, thorax_forward)
    )
    return {name: near(degrees[name], angle.centre_deg) for name, angle in ANGLES.items()}


def has_foot_angles(layout: Layout) -> bool:
    """Whether it has the points that every angle of the feet needs."""
    return all(f"{side}_{point}" in layout for side in "rl" for point in ("heel", "big_toe"))


def foot_angles(body: np.ndarray, layout: Layout) -> dict[str, np.ndarray]:
    """(T,) degrees by name of FOOT_ANGLES. body: (T, J, 3) in BODY. layout: one with `has_foot_angles`.

    NaN where a point is missing, and the progression of a foot that stands upright. Where only the ankles matter they
    may be in any axes.
    """
    at = dict(zip(layout.joints, np.moveaxis(body.astype(np.float64), (-2, -1), (0, 1)), strict=True))
    facing = np.isfinite(sum(at[joint] for joint in TRUNK_CORNERS)).all(axis=0)
    degrees, least = {}, np.sin(np.radians(limit("angles.foot-flat")))
    for side, out in (("r", 1.0), ("l", -1.0)):
        shank, big = _unit(at[f"{side}_knee"] - at[f"{side}_ankle"]), at[f"{side}_big_toe"]
        foot = _unit((big + at.get(f"{side}_small_toe", big)) / 2 - at[f"{side}_heel"])
        # The sine of 90 degrees less the angle between the two is their cosine.
        degrees[f"{side}_ankle_dorsiflexion"] = _lift(_dot(shank, foot))
        turned = np.where(np.hypot(foot[0], foot[1]) > least, _degrees(out * foot[1], -foot[0]), np.nan)
        degrees[f"{side}_foot_progression"] = np.where(facing, turned, np.nan)
    return degrees


def near(angle_deg: np.ndarray, centre_deg: np.ndarray | float) -> np.ndarray:
    """The same directions (...,) as angles within 180 degrees of centre_deg."""
    return angle_deg + 360.0 * np.floor((centre_deg - angle_deg + 180.0) / 360.0)


def unwrapped(angle_deg: np.ndarray) -> np.ndarray:
    """An angle (T,) without steps from one end of its range to the other. A step by about half a turn, as across the
    frames in which an arm raised sideways has no flexion, may go either way, and stays as it is."""
    finite = np.isfinite(angle_deg)
    result = angle_deg.copy()
    result[finite] = np.unwrap(angle_deg[finite], discont=limit("angles.around"), period=360.0)
    return result


def continuous(angle_deg: np.ndarray, centre_deg: float) -> np.ndarray:
    """An angle (T,) `unwrapped`, about the middle of its range, which lies within 180 degrees of centre_deg; as it is
    where it turns all the way round."""
    values = unwrapped(angle_deg)
    finite = values[np.isfinite(values)]
    if not len(finite) or np.ptp(finite) > 360:
        return angle_deg
    middle = (finite.min() + finite.max()) / 2
    return values + near(middle, centre_deg) - middle


def hinge_axis(upper: np.ndarray, lower: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(3, ...) the axis about which a knee or an elbow turns `lower` from `upper`, all unit vectors (3, ...); NaN where
    it is not defined.

    It is the normal of the limb's plane, as long as the sine of its bend, plus the reference made square to `upper`,
    times _STRAIGHT: so the reference decides for a straight limb, the limb itself for a bent one.
    """
    square = reference - _dot(reference, upper) * upper
    return _unit(_cross(upper, lower) + _STRAIGHT * square, limit("angles.no-axis"))


def arm_reference(
    arm: np.ndarray, shoulders: np.ndarray, forward: np.ndarray, up: np.ndarray, out: float
) -> np.ndarray:
    """(3, ...) the reference of an elbow's hinge axis: the shoulder line, carried along with the upper arm.

    arm: shoulder to elbow; shoulders: left to right; forward, up: of the thorax; unit vectors (3, ...). out: 1 for the
    right arm, -1 for the left.
    """
    lateral = np.maximum(out * _dot(arm, shoulders), 0.0)
    # Seen from the front, the arm's axis points to the right; out at the side, where that is the arm itself, to where
    # the forearm of a raised arm turns about (for the left arm the mirror image: the opposite of up-back).
    return shoulders + out * limit("angles.arm-turn") * lateral * (up - forward) / np.sqrt(2)


def trunk_axes(across: np.ndarray, trunk: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3, ...) where the front and the top point, of the thorax by its shoulder line and of the pelvis by its hip line.

    across: that line, left to right; trunk: pelvis to thorax; unit vectors (3, ...). NaN where both are nearly
    parallel."""
    forward = _unit(_cross(trunk, across), _ALONG)
    return forward, _cross(across, forward)


def _hinge(upper: np.ndarray, lower: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(...,) degrees that `lower` is turned from `upper` about hinge_axis; unit vectors (3, ...)."""
    sine = _dot(_cross(upper, lower), hinge_axis(upper, lower, reference))
    return _degrees(sine, _dot(upper, lower))


def _turn(ahead: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(...,) degrees of a unit vector's part in a plane; NaN when that part is short."""
    return np.where(np.hypot(ahead, along) > _ALONG, _degrees(ahead, along), np.nan)


def _lift(across: np.ndarray) -> np.ndarray:
    """(...,) degrees of a unit vector out of a plane, by its part across that."""
    return np.degrees(np.arcsin(np.clip(across, -1.0, 1.0)))


def _unit(v: np.ndarray, least: float = 1e-12) -> np.ndarray:
    """v (3, ...) over its length; NaN where that is not more than `least`."""
    length = np.sqrt(_dot(v, v))
    return v / np.where(length > least, length, np.nan)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _degrees(sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(sine, cosine))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
