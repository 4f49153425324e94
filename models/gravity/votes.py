"""The body as evidence on up: every frame of a person votes, and so do feet that stand.

A camera that stands still has one up. A rectifier's answers are votes: their scatter averages out, what they share (the
lifter's lean, the posture) does not. Both enter the stated error. Before a camera that moves votes are means over
neighbouring frames: a Gaussian in time, weighted by trust, within a clip. Everything works in one camera's axes.

A rectifier is asked about as many frames as inform: neighbouring frames' ups are the same vote, and how a body turns
from one frame to the next its hips and shoulders tell as well as the network. So of a long take the network sees a
frame now and then; the frames between have the up of their neighbours, and the heading of their own joints, moved by
what the network's differs from it there.

A foot that stands does not move, so the places where feet stood over a take lie on the floor, and the normal of a level
floor is up. That needs the root's true path: in poses relative to the pelvis feet that stand do move. Without it two
feet that stand at the same time are level with each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.camera import pitch_roll_deg
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import angle_deg, is_finite, known_median, unit
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.signals.filters import gaussian, on_lines, rate, runs
from ..common.canonical import body_axes
from .evidence import FEET, FLOOR, FRAMES, Evidence, TakeUp, about

# Root mean square tilt over the rotation error that is expected in a frame; and what a lifter leans with all its frames
# at least. Both fitted on lifted takes of train and validation subjects, cut to 0.5 s and longer (docs/up.md).
TILT_SHARE = 0.81
LEAN_DEG = 4.5
# Where the lifter states its own error, that tells a take's lean better: in degrees, of a take with the usual stated
# spread and the usual expected error. Fitted by its likelihood on lifted takes of validation subjects; `needed` of `up`
# in docs/accuracy/errors.json says whether it holds.
STATED_LEAN_DEG = 6.1
USUAL_SPREAD, USUAL_DEG = 0.0155, 9.0
# Those are errors of equal size in pitch and roll. What a body shows of the camera's pitch is its lean towards or away
# from the camera, which is depth, and it is drawn towards the level: of each degree by PER_PITCH, the root mean square
# of what was found on validation subjects (0.07), on CMU's and HDM05's test subjects (0.11) and on people of two more
# laboratories (0.18). A person's own lean stays, however long the take is. It is to the front or the back: the camera's
# pitch of who is seen from there, its roll of who is seen from the side; and larger under raised arms. Chosen by
# hand on six draws of lifted takes of validation subjects, wider than quantile regression of pitch and roll asks for:
# with less than 0.79 of those seen from the side or from behind under 80 % lie inside the stated 90 %.
PITCH_SHARE, PER_PITCH = 0.79, 0.13
ROLL_SHARE, PER_PITCH_OF_ROLL = 0.28, 0.043
OWN_LEAN_DEG, RAISED_LEAN_DEG = 2.0, 7.0  # the second of a take throughout which both arms are raised
# The network hardly knows cameras that are rolled by 20 degrees and more, and takes their people for leaning. Who
# stands or walks is above the feet. By how much more than BESIDE, in radians, a body's middle is beside them in the
# image all the time, this share of it is the standard deviation of the roll. Chosen on 168 lifted takes of 9 validation
# people whose images were turned: of those rolled by 26 degrees and more 88 % lie inside their 90 % bound, 4 % did
# without it; of 16 to 26 degrees 76 %, 43 % without; of less 95 %.
BESIDE, BESIDE_SHARE = 0.04, 1.0
# Sine of 50 degrees, by which nobody turns a camera: whose middle is further beside the feet lies, crawls or is held up
# by the hands, as people do of whom the network has seen many.
LIES = 0.77
UNKNOWN_DEG = 12.0  # expected error of a frame whose rectifier does not say
SUREST_DEG = 0.5  # a frame counts as no surer, whatever it states: one of error 0 would be the only one heard

VIEW = np.array([0.0, 0.0, 1.0])  # where the camera looks
_OUTLIER_DEG = 5.0  # votes this far off count half
_TURNS = 30  # of the reweighting, at most; it ends when the mean moves by less than
_STILL = 1e-6
CORRELATED_S = 0.3  # votes nearer in time than this are never independent
_BALANCED = H36M17.indices(["pelvis", "thorax", "r_ankle", "l_ankle"])
_WRISTS, _SHOULDERS = (
    H36M17.indices([f"{side}_{joint}" for side in "rl"]) for joint in ("wrist", "shoulder")
)
_ENOUGH = 600  # frames: so many are always asked

_STANDS_SPEED = 0.15  # statures per second below which an ankle stands
_STANCE_S = 0.1  # the least that a stance lasts
_BELOW = 0.3  # statures that a foot is below the pelvis when it carries the body
_HEIGHT = 0.015  # statures, scatter of ankles' heights above the floor from stance to stance, at least
_SPREAD = 3.0  # times that scatter must feet have stood apart in a direction before they say how it rises
_STEEP_DEG = 15.0  # what rises by more against the first idea of up is a flight of stairs
_UNEVEN_DEG = 2.0  # a floor's slope, and a calibration's error, along either direction

_FEET_DEG = 12.0  # scatter of the line between lifted ankles about the level, one independent stance,
_FEET_LEAN_DEG = 7.0  # and what all stances of a take share: the lifter's error in depth, uneven ground
_STANCE_SPEED = 0.12  # statures per second that the ankles may move against each other in double support
_STANCE_APART = 0.12  # statures that they must be apart, and
_STANCE_LEVEL = 0.10  # that one may be higher than the other,
_UNDER = -0.35  # and both well below the pelvis


def pitch_roll_error_deg(up: np.ndarray, error_deg: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """(...,) standard deviations of the pitch and the roll of an up (..., 3) that bodies tell, of the error (...,) that
    their votes and spread ask for, degrees, without what a person leans by itself."""
    pitch = np.abs(pitch_roll_deg(up)[..., 0])
    return np.hypot(PITCH_SHARE * error_deg, PER_PITCH * pitch), np.hypot(
        ROLL_SHARE * error_deg, PER_PITCH_OF_ROLL * pitch
    )


def bodies_covariance(
    up: np.ndarray, error_deg: np.ndarray | float, lean: np.ndarray | None = None
) -> np.ndarray:
    """(..., 3, 3) square radians, of the error of bodies' up (..., 3), who are surer of the camera's roll than of its
    pitch. error_deg: (...,) of pitch_roll_error_deg. lean: (..., 3, 3) of what the person leans by itself
    (`own_lean`); None of who may face anywhere."""
    pitch, roll = (np.radians(sd)[..., None, None] ** 2 for sd in pitch_roll_error_deg(up, error_deg))
    across = np.eye(3) - up[..., None] * up[..., None, :]
    right = unit(np.cross(up, VIEW))  # a tilt of up along it is roll
    straight = ~is_finite(right)[..., None, None]  # a camera that looks straight up or down has neither
    roll_way = np.where(straight, across / 2, right[..., None] * right[..., None, :])
    own = np.radians(OWN_LEAN_DEG) ** 2 / 2 * across if lean is None else across @ lean @ across
    return pitch * (across - roll_way) + roll * roll_way + own


def of_votes(votes: TakeUp, lean: np.ndarray | None = None) -> list[Evidence]:
    """The one piece of evidence that the votes are together; none without votes. lean: (3, 3) of
    bodies_covariance."""
    if not is_finite(votes.up):
        return []
    return [about(FRAMES, votes.up, bodies_covariance(votes.up, votes.error_deg, lean))]


def expected_deg(error_deg: np.ndarray | float) -> np.ndarray:
    """(...,) what rotation error counts as a frame's, of what its rectifier states: UNKNOWN_DEG where that is NaN, and
    SUREST_DEG at least."""
    return np.maximum(np.where(np.isfinite(error_deg), error_deg, UNKNOWN_DEG), SUREST_DEG)


def lean_square(
    expected_square: np.ndarray | float, scatter_square: np.ndarray | float, spread: np.ndarray | float
) -> np.ndarray:
    """(...,) square of the error in degrees that votes on one up share. expected_square, scatter_square: mean squares
    of their expected rotation errors and of their scatter, square degrees; spread: the lifter's stated error, NaN where
    it states none: then what is expected beyond the scatter is shared, and LEAN_DEG at least."""
    beyond = np.maximum(TILT_SHARE**2 * expected_square - scatter_square, LEAN_DEG**2)
    stated = STATED_LEAN_DEG**2 * (spread / USUAL_SPREAD) ** 3 * expected_square / USUAL_DEG**2
    return np.where(np.isfinite(spread), stated, beyond)


def pool(
    up: np.ndarray, error_deg: np.ndarray, time_s: np.ndarray, spread: np.ndarray | None = None
) -> TakeUp:
    """Weighted robust mean on the sphere, NaN without votes: weights 1 / error^2, votes further than a few degrees off
    count less (Cauchy's weights about the current mean). The error is what all votes share plus what is left of their
    scatter.

    A frame's expected tilt error has two parts: the scatter that the take shows, which averages out over its
    independent votes, and the rest, which all its frames share. The scatter's part is no less than how far the votes
    that were outvoted would move the mean: of a body that stands for one half and lies for the other, either may be
    right.

    up (T, 3), unit vectors; error_deg and time_s (T,); spread: (T,) of PersonFrames.
    """
    fine = is_finite(up)
    if not fine.any():
        return TakeUp(np.full(3, np.nan), float("nan"))
    votes = unit(up[fine].astype(np.float64))
    weights = trust(error_deg[fine])
    centre, robust = robust_mean(votes, weights)
    # Degrees from the centre along two directions across it.
    plane = votes @ np.linalg.svd(centre[None])[2][1:].T
    sine = np.linalg.norm(plane, axis=-1)
    apart = plane * (np.degrees(np.arctan2(sine, votes @ centre)) / np.maximum(sine, 1e-12))[:, None]
    scatter = float(np.sqrt(np.average((apart**2).sum(-1), weights=weights)))
    effective = effective_number(apart, time_s[fine], robust)
    usual = float("nan") if spread is None else known_median(spread[fine])
    expected_square = float(np.average(1 / weights, weights=weights))
    shared = lean_square(expected_square, scatter**2, usual)
    outvoted = float(np.nan_to_num(angle_deg(weights @ votes, centre), nan=90.0))
    return TakeUp(centre, float(np.sqrt(shared + max(scatter**2 / effective, outvoted**2))))


def robust_mean(votes: np.ndarray, trusted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3,) mean of unit vectors (N, 3), and the weights (N,) that it came to: `trusted` (N,) times Cauchy's."""
    weights = trusted
    centre = unit(weights @ votes)
    for _ in range(_TURNS):
        if not np.isfinite(centre).all():  # votes that cancel
            centre = votes[np.argmax(weights)]
        chord = 2 - 2 * votes @ centre  # squared; near the squared angle, and cheaper
        weights = trusted / (1 + chord / np.radians(_OUTLIER_DEG) ** 2)
        before, centre = centre, unit(weights @ votes)
        if np.abs(centre - before).max() < _STILL:
            break
    return centre, weights


def effective_number(apart: np.ndarray, time_s: np.ndarray, weights: np.ndarray) -> float:
    """Independent votes among N correlated ones: Kish's number for the weights, divided by the integrated
    autocorrelation time of apart (N, D), summed while positive (Geyer 1992), and at most one every 0.3 s."""
    kish = float(weights.sum() ** 2 / (weights**2).sum())
    count = len(apart)
    if count < 3:
        return 1.0
    centred = (apart - np.average(apart, axis=0, weights=weights)) * np.sqrt(weights / weights.max())[:, None]
    size = 2 ** int(np.ceil(np.log2(2 * count)))
    spectrum = np.fft.rfft(centred, size, axis=0)
    covariance = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), size)[:count]
    if covariance[0] <= 1e-12:
        return 1.0  # identical frames are one vote
    correlation = covariance / covariance[0]
    negative = np.flatnonzero(correlation <= 0)
    until = negative[0] if len(negative) else count
    inflation = 1 + 2 * float(correlation[1:until].sum())
    seconds = float(time_s[-1] - time_s[0])
    return float(max(min(kish / inflation, 1 + seconds / CORRELATED_S), 1.0))


@dataclass(frozen=True, eq=False)
class PersonFrames:
    """One person before a camera, as a rectifier sees them, in the camera's axes.

    joints: (T, 17, 3) relative to the pelvis, any unit. R_camera_from_body: (T, 3, 3), NaN where a frame has too few
    torso joints. error_deg: (T,) expected rotation error of each, NaN where unknown. time_s: (T,) increasing. seams:
    rows that no smoothing crosses. root: (T, 3) the pelvis's own path where it is known, in the same unit. name: how
    shares name the person among several. spread: (T,) the lifter's stated error (`stated_spread`), NaN or None where it
    states none.
    """

    joints: np.ndarray
    R_camera_from_body: np.ndarray
    error_deg: np.ndarray
    time_s: np.ndarray
    seams: tuple[int, ...] = ()
    root: np.ndarray | None = None
    name: str = "person"
    spread: np.ndarray | None = None

    @property
    def votes(self) -> np.ndarray:
        """(T, 3) unit, each frame's own up; NaN where it has none."""
        return self.R_camera_from_body[:, :, 2]


def trust(error_deg: np.ndarray | float) -> np.ndarray:
    """(...,) a frame's weight, 1 / error^2."""
    return 1 / expected_deg(error_deg) ** 2


def of_frames(person: PersonFrames) -> list[Evidence]:
    """The one piece of evidence that a take's frames are together; none without votes."""
    votes, fine = pool(person.votes, person.error_deg, person.time_s, person.spread), is_finite(person.votes)
    return of_votes(votes, own_lean(np.mean(leaning(person, votes.up)[fine], axis=0))) if fine.any() else []


def leaning(person: PersonFrames, up: np.ndarray) -> np.ndarray:
    """(T, 13) of each frame, where the body faces or turns its back, level for up (3,) or (T, 3): the outer product of
    that direction with itself, (9,), and whether both arms are raised; and how far, and in which direction, the middle
    of the trunk is beside the feet in the image, over its height, (3,); 0 of who lies. Zeros of frames without a
    rotation."""
    facing = person.R_camera_from_body[..., 0]
    facing = np.nan_to_num(unit(facing - (facing * up).sum(-1, keepdims=True) * up))
    rise = ((person.joints[:, _WRISTS] - person.joints[:, _SHOULDERS]) * up[..., None, :]).sum(-1)
    raised = (rise > 0).all(-1, keepdims=True)
    pelvis, thorax, *ankles = np.moveaxis(person.joints[:, _BALANCED], 1, 0)
    over_feet = unit((pelvis + thorax - sum(ankles)).astype(np.float64))
    right = unit(np.cross(up, VIEW))
    share = (over_feet * right).sum(-1, keepdims=True)
    beside = np.nan_to_num(np.where(abs(share) < LIES, share, 0.0) * right)
    square = (facing[:, :, None] * facing[:, None]).reshape(-1, 9)
    return np.concatenate([square, raised, beside], axis=-1)


def own_lean(mean: np.ndarray) -> np.ndarray:
    """(..., 3, 3) square radians, what a person leans to the front or the back by itself, and by how much a body that
    is not above its feet all the time shows that up is another. mean: (..., 13) of leaning, over the frames that tell
    up."""
    lean_deg = np.hypot(OWN_LEAN_DEG, RAISED_LEAN_DEG * mean[..., 9])[..., None, None]
    own = np.radians(lean_deg) ** 2 * mean[..., :9].reshape(*mean.shape[:-1], 3, 3)
    beside = mean[..., 10:]
    far = np.linalg.norm(beside, axis=-1, keepdims=True)
    beside = beside * np.maximum(1 - BESIDE / np.maximum(far, 1e-9), 0)
    return own + BESIDE_SHARE**2 * beside[..., :, None] * beside[..., None, :]


def smoothed(values: np.ndarray, weights: np.ndarray, person: PersonFrames, std_s: float) -> np.ndarray:
    """(T, D) mean of values (T, D) of a person's frames, with weights (T,) times a Gaussian in time, within each part
    between clip boundaries; NaN where no weight is near."""
    out = np.full(values.shape, np.nan)
    for start, end in pairwise([0, *person.seams, len(values)]):
        x, weight, time_s = values[start:end], weights[start:end], person.time_s[start:end]
        mass, total = weight.copy(), weight[:, None] * x
        for shift in range(1, len(x)):
            near = np.exp(-(((time_s[shift:] - time_s[:-shift]) / std_s) ** 2) / 2)
            if near.max() < 1e-3:
                break
            back, ahead = slice(None, -shift), slice(shift, None)
            for here, there in ((ahead, back), (back, ahead)):
                mass[here] += near * weight[there]
                total[here] += (near * weight[there])[:, None] * x[there]
        out[start:end] = total / np.where(mass > 1e-9, mass, np.nan)[:, None]
    return out


def take_rotation(
    rectifier: Rectifier, joints: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """R_camera_from_body (T, 3, 3) and error_deg (T,), as of rectifier.rotation, of one person's take.

    joints: (T, 17, 3) in CAMERA axes; time_s: (T,); seams: rows at which another clip begins. The rectifier answers
    every frame of a take of up to 1,200 frames, and of a longer one 600 of them or one every 0.3 s, whichever are more;
    besides all of those that lack a hip or a shoulder. Tilts and headings of lifted and of clean takes of validation
    subjects are as good as with every frame asked.
    """
    rows = len(joints)
    usual_s = float(np.median(np.diff(time_s))) if rows > 1 else 0.0
    every = min(rows // _ENOUGH, int(CORRELATED_S / usual_s) if usual_s > 0 else 1)
    if every < 2:
        return rectifier.rotation(joints)
    R, error_deg = np.full((rows, 3, 3), np.nan), np.full(rows, np.nan)

    def ask(asked: np.ndarray) -> None:
        R[asked], error_deg[asked] = rectifier.rotation(joints[asked])

    asked = np.asarray(~np.isfinite(body_axes(joints, np.array([0.0, -1.0, 0.0]))).all(axis=(1, 2)))
    edges = [0, *seams, rows]
    for first, end in pairwise(edges):
        asked[first:end:every] = True
        asked[end - 1] = True
    ask(asked)
    for first, end in pairwise(edges):
        clip = slice(first, end)
        R[clip], error_deg[clip] = _between(R[clip], error_deg[clip], asked[clip], joints[clip], time_s[clip])
    left = ~asked & ~np.isfinite(R).all(axis=(1, 2))
    if left.any():
        ask(left)
    return R, error_deg


def _between(
    R: np.ndarray, error_deg: np.ndarray, asked: np.ndarray, joints: np.ndarray, time_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One clip's rotations (T, 3, 3) and errors (T,), completed where they were not asked for; NaN where nobody near
    was."""
    body = body_axes(joints, R[..., 2])  # the joints' own heading, under the rectifier's up
    use = asked & (np.isfinite(R) & np.isfinite(body)).all(axis=(1, 2))
    if not use.any():
        return R, error_deg

    up = unit(on_lines(R[..., 2], time_s, use))
    # The rectifier's left in the joints' axes: forward and left.
    turn = np.stack([(R[..., 1] * body[..., axis]).sum(-1) for axis in (0, 1)], axis=-1)
    turn = on_lines(turn, time_s, use)
    body = body_axes(joints, up)
    right = unit(turn[:, :1] * body[..., 0] + turn[:, 1:] * body[..., 1])
    filled = np.stack([np.cross(right, up), right, up], axis=-1)
    return (
        np.where(asked[:, None, None], R, filled),
        np.where(asked, error_deg, on_lines(error_deg, time_s, use)),
    )


def of_feet(person: PersonFrames, up: np.ndarray) -> Evidence | None:
    """Of the floor that feet stood on where the root's path is known, else of feet against each other; None where
    neither tells. up: (3,) a first idea."""
    if not is_finite(up):
        return None
    world = None if person.root is None else person.joints + person.root[:, None]
    floor = None if world is None else floor_plane(world, up, person.time_s)
    return floor or level_feet(person.joints, up, person.time_s)


def floor_plane(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> Evidence | None:
    """The two directions along the floor, each across up. None when feet stood in too few places to tell, or on stairs.

    joints: (T, 17, 3) in the camera's axes with the camera or another fixed point for the origin, any unit; up: (3,) a
    first idea, to tell a floor from stairs; time_s: (T,).

    A walk along a straight line tells one direction only, that of the walk: up is then level across it for all that
    the floor knows, and the evidence says nothing about it. Each direction's error comes from how far apart feet stood
    along it, and how far from one plane (stairs, a ladder) they were.
    """
    stature = implied_stature(joints)
    if not np.isfinite(stature):
        return None
    places = stances(joints.astype(np.float64) / stature, up, time_s)
    count = len(places)
    if count < 3:
        return None
    # Along the floor, the widest direction first; the last is across it.
    values, axes = np.linalg.eigh(np.cov(places.T, bias=True))
    widths, axes = values[::-1], axes[:, ::-1].T
    off = widths[2] * count / (count - 3) if count > 3 else 0.0
    height = max(_HEIGHT, float(np.sqrt(max(off, 0.0))))
    information = np.zeros((3, 3))
    for width, axis in zip(widths[:2], axes[:2], strict=True):
        if width > (_SPREAD * height) ** 2:
            if abs(axis @ up) > np.sin(np.radians(_STEEP_DEG)):
                return None
            error = height**2 / (count * width) + np.radians(_UNEVEN_DEG) ** 2
            information += np.outer(axis, axis) / error
    return Evidence(FLOOR, information, np.zeros(3)) if information.any() else None


def stances(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(N, 3) where ankles stood: the mean of each unbroken piece of at least 0.1 s in which one did not move.

    joints: (T, 17, 3) in statures, at rest where the floor is; up: (3,)."""
    if len(joints) < 3:
        return np.zeros((0, 3))
    fps = rate(time_s)
    places = []
    for side in "rl":
        ankle = joints[:, H36M17.index(f"{side}_ankle")]
        below = (ankle - joints[:, H36M17.index("pelvis")]) @ up < -_BELOW
        speed = np.full(len(ankle), np.inf)
        for piece in runs(is_finite(ankle), time_s):
            if piece.stop - piece.start > 2:
                smooth = gaussian(ankle[piece], 0.05 * fps)
                speed[piece] = np.linalg.norm(np.gradient(smooth, time_s[piece], axis=0), axis=-1)
        for piece in runs(below & (speed < _STANDS_SPEED), time_s):
            if piece.stop - piece.start >= max(_STANCE_S * fps, 2):
                places.append(ankle[piece].mean(axis=0))
    return np.array(places).reshape(-1, 3)


def level_feet(joints: np.ndarray, up: np.ndarray, time_s: np.ndarray) -> Evidence | None:
    """In double support the line between the ankles is level: (right - left) . up = 0. None without such frames.

    joints: (T, 17, 3) relative to the pelvis, any unit; up: (3,) a first idea, to tell stance from a kick;
    time_s: (T,). Needs no path of the root: two feet on the ground do not move against each other.
    """
    stature = implied_stature(joints)
    if not stature > 0:  # nor when it is NaN
        return None
    right, left = (joints[:, H36M17.index(f"{side}_ankle")].astype(np.float64) / stature for side in "rl")
    across = right - left
    fine = is_finite(across)
    if fine.sum() < 5:
        return None
    speed = np.full(len(joints), np.inf)
    speed[fine] = np.linalg.norm(np.gradient(gaussian(across[fine], 1.5), time_s[fine], axis=0), axis=-1)
    under = np.maximum(right @ up, left @ up) < _UNDER
    apart, rise = np.linalg.norm(across, axis=-1), np.abs(across @ up)
    use = fine & under & (speed < _STANCE_SPEED) & (apart > _STANCE_APART) & (rise < _STANCE_LEVEL)
    if use.sum() < 5:
        return None
    lines = unit(across[use])
    stances = 1 + np.count_nonzero(np.diff(np.flatnonzero(use)) > 1)
    seconds = use.sum() * float(np.median(np.diff(time_s)))
    # Another stance, or another second, is another look, unless it shows the same.
    rise = np.degrees(lines @ up)[:, None]
    count = min(stances + seconds, effective_number(rise, time_s[use], np.ones(len(lines))))
    error = np.radians(np.sqrt(_FEET_LEAN_DEG**2 + _FEET_DEG**2 / count))
    information = lines.T @ lines / use.sum() / error**2
    return Evidence(FEET, information, np.zeros(3))
