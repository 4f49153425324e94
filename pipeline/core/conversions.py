"""The same poses in another frame, and in another joint layout by name."""

from __future__ import annotations

import numpy as np

from .errors import InputError
from .frames import METRES, Frame
from .layouts import FEET, H36M17, Layout, body_of
from .pose import PoseSequence, RootPath

_NEAREST_M = 0.5  # a pelvis less far ahead of the camera is a lifter's, which leaves it about the origin

# A joint that a source lacks: the mean of joints that it has, the first rule that fits. The nose and the
# head are defined differently by every estimator (formats.md section 1): never use them as rigid landmarks.
_RULES: dict[str, tuple[tuple[str, ...], ...]] = {
    "pelvis": (("l_hip", "r_hip"),),
    "thorax": (("neck",), ("l_shoulder", "r_shoulder")),
    "spine": (("pelvis", "thorax"), ("pelvis", "neck"), ("l_hip", "r_hip", "l_shoulder", "r_shoulder")),
    "head": (("head_top",), ("l_ear", "r_ear"), ("l_eye", "r_eye")),
    "nose": (("head_centre",), ("l_eye", "r_eye")),
    # BlazePose's foot index is the tip of the foot's middle; it has no small toe (formats.md section 5).
    "l_big_toe": (("l_foot_index",),),
    "r_big_toe": (("r_foot_index",),),
}
# Joints that are the same point under another name; everything else a rule makes is called derived.
_ALIASES = {("thorax", ("neck",)), ("head", ("head_top",))}
_MAY_LACK = ("nose", "head", *FEET.joints)  # joints that a body may lack throughout


def change_frame(poses: PoseSequence, to: Frame, R_to_from_source: np.ndarray | None = None) -> PoseSequence:
    """The same points expressed in another frame.

    Inside a family the axes follow from the frames' words. Between families `R_to_from_source`, (3, 3) or
    (T, 3, 3), must be given. Units convert among lengths; the origin changes only to "pelvis", by
    subtracting the pelvis, which becomes the poses' `path` where the source truly knows its place. A rotation of
    each frame's own leaves no path. Raises InputError, naming both frames, for anything else.
    """
    source = poses.frame
    if source == to and R_to_from_source is None:
        return poses
    if source.family == to.family:
        matrix = to.basis @ source.basis.T
        if R_to_from_source is not None:
            raise InputError(
                "option-conflict", f"{source} and {to} differ by fixed axes only; do not give a rotation."
            )
    elif R_to_from_source is not None:
        matrix = np.asarray(R_to_from_source)
    else:
        raise InputError(
            "needs-input", f"No fixed map leads from {source} to {to}; give the rotation between them."
        )
    lengths = source.unit == to.unit or (source.metric and to.metric)
    if not lengths or to.origin not in (source.origin, "pelvis"):
        lacks = "offset between their origins" if lengths else "scale between their units"
        raise InputError("wrong-axes", f"Points in {source} cannot become {to}: the {lacks} is not known.")
    factor = 1.0 if source.unit == to.unit else METRES[source.unit] / METRES[to.unit]
    if source.origin != to.origin:
        path, pelvis = _place(poses), poses.joint("pelvis").astype(np.float64)[:, None]
        poses = poses.with_(joints=poses.joints - pelvis, covariance=poses.covariance, path=path)
    return poses.moved(matrix * factor, frame=to).noted("change_frame", source=source.name, to=to.name)


def _place(poses: PoseSequence) -> RootPath | None:
    """The pelvis from the frame's origin, or None when that says nothing: the origin is no fixed place, the
    pelvis never moves, or is not ahead of the camera, where without a scale nobody can tell how far it is."""
    frame = poses.frame
    if frame.origin not in ("camera", "world"):
        return None
    place = poses.joint("pelvis").astype(np.float64)
    visible = place[np.isfinite(place).all(axis=1)]
    if len(visible) == 0 or np.ptp(visible, axis=0).max() == 0:
        return None
    if frame.origin == "camera":
        ahead = np.median(visible @ frame.basis[:, 2]) * METRES.get(frame.unit, 0.0)
        return RootPath(place) if ahead > _NEAREST_M else None
    return RootPath(place)


def remap(poses: PoseSequence, to: Layout = H36M17) -> PoseSequence:
    """The same skeleton in another layout, by joint name; `body_in` is H36M17 with heels and toes.

    A joint that the source lacks is the mean of joints that it has, by the rules at the head of this file.
    Its confidence is the least of theirs; a NaN among them makes it NaN. `derived` names such joints; the history says
    how they were made.
    InputError when no rule gives a joint; but bodies without head or nose have these missing throughout, and those
    with some of the heels and toes the others.
    """
    source = poses.layout
    if source.joints == to.joints:
        return poses if source == to else poses.with_(layout=to)
    columns, confidences, derived = [], [], {}
    for joint in to.joints:
        parts = _sources(joint, source)
        if not parts and joint in _MAY_LACK:
            columns.append(np.full_like(poses.joints[:, 0], np.nan))
            confidences.append(np.full_like(poses.confidence[:, 0], np.nan))
            continue
        if not parts:
            raise InputError(
                "wrong-content",
                f"Layout {source.name} has no joint from which '{joint}' of {to.name} could be made.",
            )
        rows = source.indices(parts)
        # A mean of one costs as much as one of many, a thousand people in a file a second.
        alone = len(rows) == 1
        columns.append(poses.joints[:, rows[0]] if alone else poses.joints[:, rows].mean(axis=1))
        confidences.append(poses.confidence[:, rows[0]] if alone else poses.confidence[:, rows].min(axis=1))
        if parts != (joint,) and (joint, parts) not in _ALIASES:
            derived[joint] = parts[0] if alone else f"mean({', '.join(parts)})"
    return poses.with_(
        joints=np.stack(columns, axis=1), confidence=np.stack(confidences, axis=1), layout=to
    ).deriving("remap", derived, source=source.name, to=to.name)


def body_in(poses: PoseSequence) -> Layout:
    """H36M17, and behind it the heels and toes that are ever there."""
    sources = {point: _sources(point, poses.layout) for point in FEET.joints}
    return body_of(
        point for point, parts in sources.items() if parts and np.isfinite(poses.joint(parts[0])).any()
    )


def _sources(joint: str, source: Layout) -> tuple[str, ...]:
    """The joints that give this one, by the first rule that fits; () where none does."""
    if joint in source:
        return (joint,)
    rules = (parts for parts in _RULES.get(joint, ()) if all(part in source for part in parts))
    return next(rules, ())
