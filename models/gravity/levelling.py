"""From a rectifier's frames to a take: one `up` for a camera that stands still, a smooth one for a camera that moves.

Given up, each frame keeps only its heading, smoothed in time; LEVEL is one upright frame for the take. A lift may rest
on an up that is known from elsewhere, and not contradicted by the skeletons (`known_up`). Several people before one
static camera have one gravity: what each of them says about it is pooled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...pipeline.core.camera import Look
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import angle_deg, from_columns, is_finite, unit
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.signals.filters import nearest_row
from ..common.canonical import R_world_from_body
from ..common.residuals import stated_spread
from .evidence import FRAMES, IMAGE, KNOWN_DEG, RAYLEIGH_90, Evidence, TakeUp, about, fuse, fused_up, settled
from .votes import (
    USUAL_SPREAD,
    PersonFrames,
    bodies_covariance,
    expected_deg,
    lean_square,
    leaning,
    of_feet,
    of_frames,
    own_lean,
    smoothed,
    take_rotation,
    trust,
)

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
_WINDOW_S = 2.0  # standard deviation of the Gaussian in which frames vote on up
_VOTE_DEG = 10.0  # votes this far from their neighbours' mean count half
_LOST_DEG_PER_S = 12.0  # how fast a camera's up may go elsewhere where no image says anything
_LOOK_DEG = 4.0  # looks this far from the middle of their neighbours count half
_CONTRADICTION = 3.0  # combined errors, median over the frames


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
    # Each person's own up rests on frames, feet or floor, so that none is taken on trust.
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


def times_of(poses: PoseSequence) -> np.ndarray:
    """(T,) seconds; poses without time stamps count as 30 frames a second."""
    return np.arange(len(poses)) / 30 if poses.time_s is None else poses.time_s


def timed(looks: Sequence[Look], poses: PoseSequence) -> list[tuple[float, Look]]:
    """What the images of the poses' video say while the person is there, each with its time in the take."""
    times = times_of(poses)
    first, last = poses.frame_index[[0, -1]]
    return [
        (float(np.interp(look.frame, poses.frame_index, times)), look)
        for look in looks
        if first <= look.frame <= last
    ]


def known_moving_up(poses: PoseSequence, rectifier: Rectifier, looks: Sequence[Look]) -> np.ndarray | None:
    """(T, 3) unit, the smooth up of a camera that moves, or None as of known_up. poses: as there; looks: what its
    images say.

    Between two clip boundaries it is there throughout or nowhere (NaN), for a lift that is told up in some frames only
    jumps where that begins: it is there where images tell up well in most frames, and in the others it is what images
    further away and the skeletons say."""
    said = timed(looks, poses)
    if not said:
        return None
    poses = poses.without_feet
    R, error_deg = take_rotation(rectifier, poses.joints, poses.times, poses.seams)
    person = PersonFrames(poses.joints, R, error_deg, poses.times, poses.seams, spread=stated_spread(poses))
    bodies = sliding_up(person)
    up = with_looks(bodies, person, said)
    # What images leave of the skeletons' error: below this as by_bodies below 0.5.
    left, half = up.error_deg / np.nan_to_num(bodies.error_deg, nan=np.inf), np.sqrt(0.5)
    sure_up = np.full((len(poses), 3), np.nan)
    for start, end in pairwise([0, *poses.seams, len(poses)]):
        part = slice(start, end)
        looked_at = any(poses.times[start] <= at <= poses.times[end - 1] for at, _ in said)
        sure = np.median(np.asarray(up.error_deg)[part]) < KNOWN_DEG
        if looked_at and sure and np.median(left[part]) < half:
            sure_up[part] = up.up[part]
    return sure_up if np.isfinite(sure_up).any() else None


def sliding_up(person: PersonFrames) -> TakeUp:
    """The bodies' up, (T, 3), from each frame's neighbours in time; two passes, the second with less weight for votes
    that are far from the first's answer."""
    fine = is_finite(person.votes)
    votes = np.where(fine[:, None], person.votes, 0.0)
    trusted = np.where(fine, trust(person.error_deg), 0.0)
    up, _, _ = _local_line(votes, trusted, person)
    apart = np.where(fine, np.nan_to_num(angle_deg(votes, up)), 0.0)
    weights = trusted / (1 + (apart / _VOTE_DEG) ** 2)
    up, looks, lag_deg = _local_line(votes, weights, person)
    expected = expected_deg(person.error_deg)
    square = np.stack([np.where(fine, expected**2, 0.0), apart**2], axis=-1)
    mean, scatter = np.moveaxis(smoothed(square, trusted, person, _WINDOW_S), -1, 0)
    spread = np.full(len(votes), np.nan)
    if person.spread is not None:
        has_spread = np.isfinite(person.spread)
        stated = np.where(has_spread, person.spread, 0.0)[:, None]
        spread = smoothed(stated, np.where(has_spread, trusted, 0.0), person, _WINDOW_S)[:, 0]
    shared = lean_square(mean, scatter, spread)
    lean = own_lean(smoothed(leaning(person, up), weights, person, _WINDOW_S))
    lag = (np.radians(lag_deg) ** 2 / 2)[:, None, None] * (np.eye(3) - up[:, :, None] * up[:, None])
    covariance = bodies_covariance(up, np.sqrt(shared + scatter / looks), lean) + lag
    error_deg = np.degrees(np.sqrt(np.trace(covariance, axis1=1, axis2=2)))
    return TakeUp(up, error_deg, {FRAMES: 1.0}, covariance=covariance)


def _local_line(
    votes: np.ndarray, weights: np.ndarray, person: PersonFrames
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T, 3) unit, at each frame the straight line in time through the votes (T, 3) around it, so that a camera that
    turns evenly is followed without lag up to the take's ends; (T,) how many independent votes that is worth; and (T,)
    how far in degrees it may lag after all.

    A line through few votes that scatter swings at its ends, so its slope counts as far as it exceeds its own error
    (shrunk by Wiener's factor, signal over signal and noise); what is left out of it is the lag. The normalised line
    follows an arc to the second order of its angle.
    """
    # From the take's beginning: squares of seconds since 1970 have no digits left for the spread.
    times = (person.time_s - person.time_s[:1])[:, None]
    square = (votes**2).sum(-1, keepdims=True)
    columns = np.concatenate([votes, times * votes, times, times**2, square], axis=-1)
    means = smoothed(columns, weights, person, _WINDOW_S)
    vote, vote_time, middle, time_square, square = np.split(means, (3, 6, 7, 8), axis=-1)
    spread = np.maximum(time_square - middle**2, 1e-6)  # of the window's frames in time, square seconds
    slope = (vote_time - middle * vote) / spread
    steep = (slope**2).sum(-1, keepdims=True)
    scatter = np.maximum(square - (vote**2).sum(-1, keepdims=True) - steep * spread, 0)  # about the line
    independent = 1 + np.sqrt(spread)  # votes within the window
    error = scatter / independent / spread  # of the slope, squared
    share = steep / np.maximum(steep + error, 1e-12)
    off = times - middle
    looks = independent / (1 + share**2 * off**2 / spread)
    lag_deg = np.degrees((1 - share) * np.sqrt(steep) * np.abs(off))
    return unit(vote + share * slope * off), looks[:, 0], lag_deg[:, 0]


def with_looks(bodies: TakeUp, person: PersonFrames, looks: Sequence[tuple[float, Look]]) -> TakeUp:
    """The bodies' up (T, 3) together with the images', each by 1 / error^2; no look is carried over a clip boundary.
    Where they contradict each other, the loser only speaks where the winner does not; an image's voice fades away
    from it, until it may be lost by as much as the bodies err. looks: what images say, each with its time in
    seconds."""
    if not looks:
        return bodies
    ups = np.stack([bodies.up, np.full(bodies.up.shape, np.nan)])
    errors = np.stack([np.maximum(bodies.error_deg, 0.1), np.full(len(bodies.up), np.inf)])
    lost_deg = np.full(len(bodies.up), np.inf)
    for start, end in pairwise([0, *person.seams, len(bodies.up)]):
        part = slice(start, end)
        times = person.time_s[part]
        inside = [(at, look) for at, look in looks if len(times) and times[0] - 0.2 <= at <= times[-1] + 0.2]
        if inside:
            ups[1, part], errors[1, part], lost_deg[part] = _between(inside, times)
    fine = is_finite(ups)
    weights = np.where(fine, 1 / errors**2, 0.0)
    both = fine.all(axis=0)
    notices: tuple[Notice, ...] = ()
    close = False
    near = both & (lost_deg < errors[0])  # where images speak of what they saw
    apart = angle_deg(*ups)[near] / np.hypot(bodies.error_deg, errors[1])[near]
    if near.any() and np.median(apart) > _CONTRADICTION:
        theirs, its = unit(ups[:, near].mean(axis=1))
        usual = TakeUp(theirs, float(np.median(errors[0, near])))
        believed = settled(usual, replace(looks[len(looks) // 2][1], up=its))
        fades = np.minimum(lost_deg / errors[0], 1.0)[both] if believed.image else 0.0
        weights[0 if believed.image else 1, both] *= fades
        notices, close = (believed.said,), believed.close
    total = weights.sum(axis=0)
    heard = total > 0
    up = np.where(heard[:, None], unit((weights[..., None] * np.nan_to_num(ups)).sum(axis=0)), np.nan)
    error_deg = np.sqrt(1 / np.where(heard, total, np.nan))
    if close:  # the bound reaches the other answer, as that of a camera that stands still does
        error_deg[both] = np.hypot(error_deg, angle_deg(*ups) / RAYLEIGH_90)[both]
    share = float(np.mean(weights[1, heard] / total[heard])) if heard.any() else 0.0
    return TakeUp(up, error_deg, {FRAMES: 1 - share, IMAGE: share}, notices=notices)


def _between(
    looks: Sequence[tuple[float, Look]], time_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T, 3) the images' up between their times, on a line; (T,) its error in degrees, and (T,) what of that is because
    the camera may have gone elsewhere where no image was looked at."""
    at = np.array([time for time, _ in looks])
    ups = np.array([look.up for _, look in looks])
    errors_deg = np.array([look.error_deg for _, look in looks])
    unsteady = 1.0
    if len(at) > 2:  # a look that is quite another than its neighbours' middle is taken for less
        near = np.clip(np.arange(len(at))[:, None] + np.arange(-2, 3), 0, len(at) - 1)
        usual = unit(np.median(ups[near], axis=1))
        off = angle_deg(ups, usual)
        believed = 1 / (1 + (off / _LOOK_DEG) ** 4)[:, None]
        ups = unit(believed * ups + (1 - believed) * usual)
        unsteady = float(np.median(off))
    up = unit(np.stack([np.interp(time_s, at, ups[:, axis]) for axis in range(3)], axis=-1))
    nearest = np.abs(time_s - at[nearest_row(at, time_s)])
    outside = np.maximum(np.maximum(at[0] - time_s, time_s - at[-1]), 0.0)
    gap = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    beyond = np.maximum(nearest - gap, 0.0)
    wander = unsteady * np.minimum(nearest / max(gap, 1e-3), 1.0) + _LOST_DEG_PER_S * beyond
    error_deg = np.sqrt(np.interp(time_s, at, errors_deg) ** 2 + wander**2 + (_LOST_DEG_PER_S * outside) ** 2)
    return up, error_deg, _LOST_DEG_PER_S * np.maximum(beyond, outside)
