"""From a rectifier's frames to a take: one `up` for a camera that stands still, a smooth one for a camera that moves.

Given up, each frame keeps only its heading, smoothed in time; LEVEL is one upright frame for the take. A lift may rest
on an up that is known from elsewhere, and not contradicted by the skeletons (`known_up`). Several people before one
static camera have one gravity: what each of them says about it is pooled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.core.camera import Look
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import angle_deg, from_columns, is_finite, unit
from ...pipeline.plugins.protocols import Rectifier
from ..common.canonical import R_world_from_body
from ..common.residuals import stated_spread
from .evidence import KNOWN_DEG, Evidence, TakeUp, about, fuse, fused_up
from .floor import of_feet
from .moving import sliding_up, with_looks
from .votes import USUAL_SPREAD, PersonFrames, of_frames, smoothed, trust

# Standard deviation of the Gaussian that smooths headings on the circle (val: longer lags on turns).
HEADING_S = 0.07
HEADING_SHARE = 0.83  # of a frame's expected rotation error, what is heading (lifted takes of val subjects)
# Mean error of a smoothed heading where the lifter states the usual spread, and how it grows with that (lifted takes of
# val subjects; `needed` of BODY's rotation in docs/accuracy/errors.json says whether it holds).
STATED_HEADING_DEG, HEADING_POWER = 3.45, 2
# Mean over root mean square of a direction's error in two dimensions.
_MEAN_OF_RMS = float(np.sqrt(np.pi) / 2)
_TURNING = 0.5  # mean resultant of the headings below which a take has no middle heading (design.md)
_FEWEST_FRAMES = 10
_FROM_IMAGE_DEG = 60.0  # a take's up further from the image's up than this is not believed
_SCATTER_DEG = 35.0  # median deviation of the frames' up from the take's up beyond which no up is stated
_WIDEST_BOUND_DEG = 30.0  # 90 % bound of up beyond which no take is called level
_VOTES = 300  # frames are enough to see a contradiction
_VERTICAL_DEG = 1.0  # a camera that looks so steeply has no horizontal direction of view


@dataclass(frozen=True, eq=False)
class Levelled:
    """A take's rotations, in the camera's axes.

    R_camera_from_body: (T, 3, 3), NaN where a frame has no heading. R_camera_from_level: (3, 3), or (T, 3, 3) for a
    moving camera. error_deg: (T,) expected rotation error of BODY. up: the take's, and what it rests on. votes: (T, 3)
    the frames' own ups. heading: how LEVEL's was chosen, "median", "first second", "camera" or "world".
    """

    R_camera_from_body: np.ndarray
    R_camera_from_level: np.ndarray
    error_deg: np.ndarray
    up: TakeUp
    votes: np.ndarray
    heading: str

    @property
    def up_error_deg(self) -> np.ndarray:
        """(T,) root mean square error of up."""
        return np.full(len(self.votes), self.up.error_deg)

    @property
    def up_bound_deg(self) -> np.ndarray:
        """(T,) 90 % bound of up's error."""
        return np.full(len(self.votes), self.up.bound_deg)


def level_static(person: PersonFrames, told: Sequence[Evidence] = (), look: Look | None = None) -> Levelled:
    """One gravity for the whole take, and the person's heading (level_frame). told: what the user tells; look: what
    the image says."""
    up = static_up(person, told, look)
    levelled = level(person, up)
    R_camera_from_level, heading = level_frame(levelled.R_camera_from_body, up.up, person.time_s)
    return replace(levelled, R_camera_from_level=R_camera_from_level, heading=heading)


def static_up(person: PersonFrames, told: Sequence[Evidence] = (), look: Look | None = None) -> TakeUp:
    """What the frames, the feet, the image and the user say about a static camera's up. Arguments of level_static."""
    frames = of_frames(person)
    first = fused_up(frames, told, look)
    feet = of_feet(person, first.up)
    return fused_up([feet, *frames], told, look) if feet else first


def known_up(
    poses: PoseSequence, rectifier: Rectifier, told: Sequence[Evidence] = (), look: Look | None = None
) -> np.ndarray | None:
    """(3,) unit, which way is up in a camera that stands still; None where it is known badly, or by the skeletons more
    than by anything else, as where an image is not believed. poses: a first lift, H36M17 in CAMERA, that knew nothing
    of up. told: what the user tells; look: what the image says. InputError as of fused_up."""
    rows = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), _VOTES)).astype(int))
    poses = poses.without_feet
    R, error_deg = rectifier.rotation(poses.joints[rows])
    person = PersonFrames(
        poses.joints[rows], R, error_deg, poses.times[rows], spread=stated_spread(poses)[rows]
    )
    up = static_up(person, told, look)
    return up.up if float(up.error_deg) < KNOWN_DEG and up.by_bodies < 0.5 else None


def level_moving(person: PersonFrames, looks: Sequence[tuple[float, Look]] = ()) -> Levelled:
    """A smooth gravity for a camera that pans or is carried. LEVEL's heading is the camera's: how the camera turned
    about the vertical cannot be seen from the body alone. looks: what images say, each with its time in seconds."""
    return level(person, with_looks(sliding_up(person), person, looks))


def level(person: PersonFrames, up: TakeUp) -> Levelled:
    """With an up that is decided, for the take or each frame, and the camera's heading: -X against its viewing
    direction, made horizontal."""
    R = upright(person, np.broadcast_to(up.up, person.votes.shape))
    return Levelled(
        R,
        camera_frame(up.up),
        rotation_error_deg(
            R, person.R_camera_from_body, heading_error_deg(person.error_deg, person.spread), up.error_deg
        ),
        up,
        person.votes,
        "camera",
    )


def level_world(
    joints: np.ndarray, time_s: np.ndarray, together: bool = False, measured: bool = True
) -> Levelled:
    """Of joints (T, 17, 3) in axes whose +z is known to be up, which stand for the camera's: nothing votes. together:
    LEVEL's heading is the world's, not the person's. measured: by motion capture; of others the error of up is not
    known, for an estimator's world may lean."""
    error_deg = 0.0 if measured else float("nan")
    up = TakeUp(np.array([0.0, 0.0, 1.0]), error_deg, {"the source's own axes": 1.0})
    R = R_world_from_body(joints)
    R_level, heading = (np.eye(3), "world") if together else level_frame(R, up.up, time_s)
    unknown = np.full(len(joints), np.nan)
    return Levelled(R, R_level, unknown, up, np.full((len(joints), 3), np.nan), heading)


def camera_frame(up: np.ndarray) -> np.ndarray:
    """R_camera_from_level (..., 3, 3) of the given up (..., 3) whose -X is the camera's horizontal viewing direction
    reversed, so that a person who faces the camera faces -X as in BODY (design.md section 4). Of one that looks
    straight down or up it is where the image's top, or its bottom, points, which is what it comes to without roll."""
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), up.shape)
    image_up = np.array([0.0, -1.0, 0.0])
    looks_up = (up * view).sum(-1, keepdims=True)
    vertical = np.abs(looks_up) > np.cos(np.radians(_VERTICAL_DEG))
    ahead = np.where(vertical, -np.sign(looks_up) * image_up, view)
    back = unit(ahead - (ahead * up).sum(-1, keepdims=True) * up)
    return from_columns(back, np.cross(up, back), up)


def why_not(levelled: Levelled) -> str:
    """In words why a take could not be levelled, or "". Where up is known from elsewhere, only the heading can fail,
    and how well it is known; that counts in frames that have a rotation."""
    fine = is_finite(levelled.R_camera_from_body).all(axis=1)
    if not fine.any():
        return "no frame has the torso joints that a rotation needs"
    if fine.sum() < _FEWEST_FRAMES:
        shows = "frame shows" if fine.sum() == 1 else "frames show"
        return f"only {fine.sum()} {shows} how the torso is turned, of {_FEWEST_FRAMES} that are needed"
    bound = float(levelled.up_bound_deg[fine].max())
    wide = f"its up is known only to within {bound:.0f} degrees" if bound > _WIDEST_BOUND_DEG else ""
    if levelled.up.by_bodies < 0.5:
        return wide
    voted = fine & is_finite(levelled.votes)
    ups = levelled.R_camera_from_body[:, :, 2]
    leans = float(angle_deg(unit(ups[fine].mean(axis=0)), np.array([0.0, -1.0, 0.0])))
    if leans > _FROM_IMAGE_DEG:
        return f"its up is {leans:.0f} degrees from the image's: the person lies or hangs, or the camera is turned"
    scatter = float(np.median(angle_deg(levelled.votes[voted], ups[voted])))
    if not scatter < _SCATTER_DEG:
        return f"the frames' up directions scatter by {scatter:.0f} degrees about their mean"
    return wide


def upright(person: PersonFrames, up: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations with the given up (T, 3) and the frames' own headings, smoothed on the circle by a Gaussian
    of HEADING_S, weighted by 1 / error^2, never across a clip boundary. NaN stays NaN."""
    left = level_left(person.R_camera_from_body, up)
    fine = is_finite(left) & is_finite(up)
    weights = np.where(fine, trust(person.error_deg), 0.0)
    R = standing(smoothed(np.where(fine[:, None], left, 0.0), weights, person, HEADING_S), up)
    return np.where((fine & is_finite(R[:, :, 1]))[:, None, None], R, np.nan)


def level_left(R_camera_from_body: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3) where the left of bodies (..., 3, 3) points, made horizontal for up (..., 3), unit."""
    left = -R_camera_from_body[..., :, 1]
    return unit(left - (left * up).sum(-1, keepdims=True) * up)


def standing(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3, 3) R_camera_from_body with the given up (..., 3) and a left as near to left (..., 3) as it allows."""
    left = unit(left - (left * up).sum(-1, keepdims=True) * up)
    return from_columns(-np.cross(left, up), -left, up)


def level_frame(R_camera_from_body: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, str]:
    """R_camera_from_level (3, 3): up (3,), and the circular median of the frames' headings, or of the first second's
    for a person who turns around (design.md section 4); and which. NaN without a heading."""
    fine = is_finite(R_camera_from_body).all(axis=1)
    if not fine.any() or not is_finite(up):
        return np.full((3, 3), np.nan), "none"
    side = unit(np.cross(up, np.eye(3)[np.argmin(np.abs(up))]))
    facing = -R_camera_from_body[fine, :, 0]
    heading = facing @ side + 1j * (facing @ np.cross(up, side))
    heading = heading / np.maximum(np.abs(heading), 1e-12)
    how = "median"
    if np.abs(heading.mean()) < _TURNING:
        how = "first second"
        heading = heading[time_s[fine] - time_s[fine][0] <= 1.0]
    centre = np.angle(heading.mean())
    angle = centre + np.median(np.angle(heading * np.exp(-1j * centre)))
    back = -(np.cos(angle) * side + np.sin(angle) * np.cross(up, side))
    return from_columns(back, np.cross(up, back), up), how


def heading_error_deg(error_deg: np.ndarray | float, spread: np.ndarray | None = None) -> np.ndarray:
    """(...,) expected error of a frame's heading, from error_deg (...,), its expected rotation error, or from spread
    (...,), what the lifter states, where it does."""
    share = np.asarray(HEADING_SHARE * error_deg)
    if spread is None:
        return share
    return np.where(np.isfinite(spread), STATED_HEADING_DEG * (spread / USUAL_SPREAD) ** HEADING_POWER, share)


def rotation_error_deg(
    R: np.ndarray, R_frame: np.ndarray, heading_deg: np.ndarray, up_error_deg: np.ndarray | float
) -> np.ndarray:
    """(...,) expected error of R (..., 3, 3): that of up, and heading_deg (...,), the frame's own heading's.

    Where the heading is further than that from the one of R_frame (..., 3, 3), the rectifier's, that counts: the poses
    of two people in one take, or a turn quicker than the smoothing.
    """
    off = angle_deg(level_left(R_frame, R[..., :, 2]), -R[..., :, 1])
    return np.hypot(_MEAN_OF_RMS * up_error_deg, np.maximum(heading_deg, off))


def level_people(
    people: Sequence[PersonFrames], told: Sequence[Evidence] = (), look: Look | None = None
) -> list[Levelled]:
    """One up for all, and the camera's heading, so that who faces whom can be read off: one R_camera_from_level (3, 3).

    Each person's up counts by 1 / error^2; who could not be levelled alone (lies, is hardly seen) has no say and takes
    the others' up. Lifted by the same network, people may lean alike: the pooled error is stated as no less than the
    best person's own. told: what the user tells; look: what the image says. Where nobody can be levelled alone and
    nothing else is told, everybody keeps an up of their own, and the reason why it is none. People of one name are
    numbered in the shares, in the order given."""
    alone = [level(person, static_up(person)) for person in people]
    # The alone have shares of frames, feet or floor, so that nothing is taken on trust.
    heard = [not why_not(levelled) for levelled in alone]
    if not any(heard) and not told and look is None:
        return alone
    names = _numbered([person.name for person in people])
    own = {name: levelled.up for name, levelled, use in zip(names, alone, heard, strict=True) if use}

    def said(wider: float) -> list[Evidence]:
        return [
            about(name, up.up, wider**2 * up.covariance)
            for name, up in own.items()
            if up.covariance is not None
        ]

    errors = {name: float(up.error_deg) for name, up in own.items()}
    wider = max(1.0, min(errors.values()) / float(fuse(said(1.0)).error_deg)) if own else 1.0
    fused = fused_up(said(wider), told, look)
    shared = replace(fused, own=fused.own | {name: (up.up, errors[name]) for name, up in own.items()})
    return [level(person, shared) for person in people]


def _numbered(names: Sequence[str]) -> list[str]:
    """The names, those that are not the only ones with a number behind them."""
    return [
        f"{name} ({names[: row + 1].count(name)})" if names.count(name) > 1 else name
        for row, name in enumerate(names)
    ]
