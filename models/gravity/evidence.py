"""Evidence on up: what any source says, as a Gaussian about it; fused where sources agree, decided and said where they
do not.

Each kind is made in one place: the body's by `votes.of_votes`, that of feet and floor by `votes.of_feet`, what the user
or a sensor tells by `told_up`; how cameras are `held` speaks before any of them.

Two sources contradict each other when their ups are further apart than their stated errors allow (chi-square with two
degrees of freedom). Then one of them is quite wrong, and which is told by how often such a source is. How cameras are
usually held has no say in that: it has been weighed with the lines already, in the search for their best fit, and with
the bodies, in what their network was trained on; they are drawn towards usual cameras, lines that are right are not.
The loser has no say, and the user is told both answers. Where it is right in more than one of ten such takes, the
stated error covers it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...pipeline.core.camera import Look, pitch_roll_deg, view_rotation
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import SD_90
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import TOLD_UP
from ...pipeline.core.rotations import angle_deg, is_finite, shortest_turn, unit
from ...pipeline.core.take import Told

FRAMES, FEET, FLOOR, IMAGE = "frames", "feet", "floor", "image"  # sources, beside people's and what is told
_GRAVITY, _ANGLES = TOLD_UP
_TOLD_DEG = 1.0  # error of a camera's pitch, roll or gravity vector that the user states
# Pitch about looking a little down, roll about none: middles and spreads in degrees; a few of them any way.
_USUAL_DEG = ((8.0, 14.0), (0.0, 5.0))
_ANYHOW_DEG, _ANYHOW = 35.0, 0.05
_WIDEST_DEG = 45.0  # off the image's own up, where lines are searched for one
_DOUBT = 0.5  # more likely wrong than right

# Of a direction whose error is Gaussian in two dimensions: what holds nine in ten, over the root mean square.
RAYLEIGH_90 = float(np.sqrt(np.log(10)))
# 90 % radius of a Gaussian with standard deviations 1 and 0, 0.2, ... 1, by numerical integration.
_RADII = (1.6449, 1.6573, 1.6992, 1.7915, 1.9472, 2.1460)
_CONTRADICTION = 13.8  # chi-square of two degrees of freedom that chance exceeds once in a thousand
# Takes whose skeletons all lean by far more than they state: unusual poses, backs, bad lifts.
_BODY_FAILURE = 0.10
# Of the loser's being right: above, a bound that nine of ten takes stay under has to reach as far as its answer.
_LOSER = 0.1
# Told gravity further than this from everything else is a mistake of the one who tells.
_TOLD_WIDEST_DEG = 60.0
_TOLD_ERRORS = 3.0
# Root mean square error up to which a lifter is told up (levelling.known_up), and gains by it.
KNOWN_DEG = 3.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """One source's word on up: information matrix (3, 3) and vector (3,) of a Gaussian about it, per square radian."""

    name: str
    information: np.ndarray
    vector: np.ndarray


@dataclass(frozen=True, eq=False)
class TakeUp:
    """A take's up. up: (3,), unit, or (T, 3) before a camera that moves; NaN where there is no evidence. error_deg:
    expected root mean square angle to the truth, of the take or (T,) of each frame. shares: by name, each source's part
    of the information in a direction across up, its mean over all such directions. own: the up that each source would
    have by itself, and its error in degrees, of those that know one. notices: about sources that contradict each other.
    covariance: (3, 3) of the error, square radians, where up may be surer along one direction than across it; None of
    an error that is alike in all directions; (T, 3, 3) of an up of each frame."""

    up: np.ndarray
    error_deg: float | np.ndarray
    shares: dict[str, float] = field(default_factory=dict)
    own: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()
    covariance: np.ndarray | None = None

    @property
    def bound_deg(self) -> float | np.ndarray:
        """The angle that nine in ten takes should stay under, as error_deg."""
        return self.error_deg * (RAYLEIGH_90 if self.covariance is None else radius_90(self.covariance))

    @property
    def by_bodies(self) -> float:
        """The share that is one person's frames', feet's and floor's."""
        return sum(self.shares.get(source, 0.0) for source in (FRAMES, FEET, FLOOR))


def about(name: str, up: np.ndarray, covariance: np.ndarray) -> Evidence:
    """A source that knows up (3,), surer of it along one direction than across. covariance: (3, 3) of its error, square
    radians."""
    information = np.linalg.pinv(covariance, hermitian=True, rcond=1e-9)
    # Along up itself nothing can be wrong; a finite number there keeps the fused direction a unit vector. It is that of
    # the direction known worst: the roll's would count as knowledge of the pitch once another source moved up there.
    information = information + np.outer(up, up) / np.linalg.eigvalsh(covariance)[-1]
    return Evidence(name, information, information @ up)


def direction(name: str, up: np.ndarray, error_deg: float) -> Evidence:
    """A source that knows up itself, as well in all directions: a gravity sensor, the camera's known pitch and roll.

    up: (3,), any length; error_deg: root mean square angle of its error."""
    up = unit(np.asarray(up, dtype=np.float64))
    per_axis = np.radians(error_deg) / np.sqrt(2)
    information = np.eye(3) / per_axis**2
    return Evidence(name, information, information @ up)


def told_up(told: Told) -> list[Evidence]:
    """What is told of gravity, or of the camera's pitch and roll, as evidence on up; none where nothing is."""
    if told.gravity is not None:
        return [direction(_GRAVITY, -np.array(told.gravity, dtype=np.float64), _TOLD_DEG)]
    if told.pitch_deg is None or told.roll_deg is None:
        return []
    angles = (np.array(angle, dtype=np.float64) for angle in (0.0, told.pitch_deg, told.roll_deg))
    return [direction(_ANGLES, view_rotation(*angles)[:, 2], _TOLD_DEG)]


def held(up: np.ndarray) -> np.ndarray:
    """(...) how usual a camera of that up (..., 3) is: a density in pitch and roll over that of the most usual one."""
    usual = anyhow = 1.0
    angles = np.moveaxis(pitch_roll_deg(np.asarray(up, dtype=np.float64)), -1, 0)
    for angle, (middle, spread) in zip(angles, _USUAL_DEG, strict=True):
        usual = usual * np.exp(-0.5 * ((angle - middle) / spread) ** 2)
        anyhow = anyhow * np.exp(-0.5 * ((angle - middle) / _ANYHOW_DEG) ** 2) * spread / _ANYHOW_DEG
    return np.asarray((1 - _ANYHOW) * usual + _ANYHOW * anyhow)


def doubtful(up: np.ndarray, failure: float) -> bool:
    """Of an image's up (3,) in which nobody's body can be seen, and which is quite wrong so often (failure), whether
    the pitch that it says is one that cameras have so seldom that it is likely to be wrong: what is quite wrong says
    any pitch."""
    pitch = pitch_roll_deg(np.asarray(up, dtype=np.float64))[0]
    level = view_rotation(np.array(0.0), np.asarray(pitch), np.array(0.0))[:, 2]
    # About its integral over pitch.
    right = (1 - failure) * held(level) / (np.sqrt(2 * np.pi) * _USUAL_DEG[0][1])
    wrong = failure / (2 * _WIDEST_DEG)
    return bool(wrong / (wrong + right) > _DOUBT)


def fuse(sources: Sequence[Evidence]) -> TakeUp:
    """The up of all sources together, NaN without any that knows more than a plane (feet on the ground do not)."""
    up = _up_of(sources)
    if not is_finite(up):
        return TakeUp(up, float("nan"))
    # How far up moves with each source's: who is very sure of the roll alone has no share in the pitch.
    across, covariance = _across(sources, up)
    parts = {source.name: np.trace(covariance @ across @ source.information @ across.T) for source in sources}
    own = {
        source.name: (alone, _error_of([source], alone))
        for source in sources
        if is_finite(alone := _up_of([source]))
    }
    shares = {name: float(part / sum(parts.values())) for name, part in parts.items()}
    return TakeUp(up, _error_of(sources, up), shares, own, covariance=across.T @ covariance @ across)


def radius_90(covariance: np.ndarray) -> np.ndarray:
    """(...,) of the circle that holds 90 % of a Gaussian error across up, of covariance (..., 3, 3), over its root mean
    square length; NaN where that is NaN."""
    fine = np.isfinite(covariance.sum(axis=(-2, -1)))
    variances = np.linalg.eigvalsh(np.where(fine[..., None, None], covariance, np.eye(3)))
    least, most = np.moveaxis(np.sqrt(np.maximum(variances[..., 1:], 0.0)), -1, 0)
    radius = np.interp(least / most, np.linspace(0, 1, len(_RADII)), _RADII) * most / np.hypot(least, most)
    return np.where(fine, radius, np.nan)


def _up_of(sources: Sequence[Evidence]) -> np.ndarray:
    """(3,), NaN where none knows more than a plane."""
    vector = sum(source.vector for source in sources)
    if not np.any(vector):
        return np.full(3, np.nan)
    return unit(np.linalg.lstsq(sum(source.information for source in sources), vector, rcond=None)[0])


def _error_of(sources: Sequence[Evidence], up: np.ndarray) -> float:
    """Degrees, root mean square, of their up (3,)."""
    return float(np.degrees(np.sqrt(np.trace(_across(sources, up)[1]))))


def _across(sources: Sequence[Evidence], up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2, 3) two directions across up (3,), and (2, 2) the covariance of the sources' up along them, square radians."""
    across = np.linalg.svd(up[None])[2][1:]
    information = np.sum([source.information for source in sources], axis=0)
    return across, np.linalg.pinv(across @ information @ across.T, hermitian=True)


@dataclass(frozen=True)
class Settled:
    """Of an image and bodies that contradict each other: image, whether it is the image that is believed; said, with
    both answers; close, whether the other one is right in more than one of ten such takes."""

    image: bool
    said: Notice
    close: bool


def fused_up(bodies: Sequence[Evidence], told: Sequence[Evidence] = (), look: Look | None = None) -> TakeUp:
    """A static camera's up. bodies: what frames, feet and floor say; told: what the user says; look: what the image
    says. InputError when the user tells a gravity more than 60 degrees from everything else."""
    alone, said = fuse(bodies), fuse(told)
    notices = _notices_of_told(alone, said, look) if told else ()
    # What is told is believed; who contradicts it has no say.
    heard = not (told and is_finite(alone.up) and _disagree(said, alone))
    others, loser = tuple(told), None
    if look is not None and not (told and _disagree(said, look)):
        believed = None
        if is_finite(alone.up) and chi_square(alone, look) > _CONTRADICTION:
            believed = settled(alone, look, told=bool(told))
            notices = (*notices, believed.said)
            heard = heard if told else not believed.image
            loser = (alone.up if believed.image else look.up) if believed.close else None
        if believed is None or believed.image:
            others = (*others, about(IMAGE, look.up, look.covariance))
    fused = alone
    if others:
        together = fuse(others)
        # A lift that was told up leans as it was told: its bodies would say the same a second time.
        twice = is_finite(together.up) and together.error_deg < KNOWN_DEG
        fused = fuse([*(bodies if heard and not twice else ()), *others])
    if loser is not None:
        fused = _reaching(fused, loser)
    image = {IMAGE: (look.up, look.error_deg)} if look else {}
    return replace(fused, own=alone.own | image | fused.own, notices=notices)


def settled(bodies: TakeUp, look: Look, told: bool = False) -> Settled:
    """Who is believed of an image and bodies that contradict each other: the likelier one, one of the two being quite
    wrong, or the image where the user's gravity agrees with it (told)."""
    odds_image = _BODY_FAILURE * (1 - look.failure)
    odds_bodies = look.failure * (1 - _BODY_FAILURE)
    image = told or odds_image > odds_bodies
    close = not told and min(odds_image, odds_bodies) > _LOSER * (odds_image + odds_bodies)
    answers = f"{_words(look, 'the image')}, {_words(bodies, 'the body')}"
    believed = "image is" if image else "body is"
    so = ": the person leans, or the poses and their angles to the vertical are tilted" if image else ""
    apart = float(angle_deg(bodies.up, look.up))
    pitch, roll = pitch_roll_deg(np.asarray(bodies.up if image else look.up, dtype=np.float64))
    values = {"apart_deg": apart, "answers": answers, "believed": believed, "so": so}
    said = notice("image-against-bodies", **values, pitch=float(pitch), roll=float(roll))
    return Settled(image, said, close)


def _reaching(fused: TakeUp, other: np.ndarray) -> TakeUp:
    """With an error so large along the way to another up (3,) that its 90 % bound reaches it."""
    apart_deg = float(angle_deg(fused.up, other))
    way = unit(other - (other @ fused.up) * fused.up)
    more = (np.radians(apart_deg) / SD_90) ** 2 * np.outer(way, way)
    assert fused.covariance is not None  # of a camera that stands still
    error_deg = float(np.hypot(fused.error_deg, apart_deg / SD_90))
    return replace(fused, error_deg=error_deg, covariance=fused.covariance + more)


def chi_square(bodies: TakeUp, look: Look) -> float:
    """Squared distance of both answers in their errors, on the plane across the image's up."""
    across = np.linalg.svd(look.up[None])[2][1:]
    own = np.radians(bodies.error_deg) ** 2 / 2 * np.eye(3)
    if bodies.covariance is not None:
        turn = shortest_turn(look.up, bodies.up)  # from one's plane to the other's
        own = turn @ bodies.covariance @ turn.T
    apart = across @ (unit(bodies.up) - look.up)
    # A chord is shorter than its arc; far apart this matters.
    angle = np.radians(angle_deg(bodies.up, look.up))
    apart = apart * (angle / max(float(np.linalg.norm(apart)), 1e-12))
    return float(apart @ np.linalg.solve(across @ (look.covariance + own) @ across.T, apart))


def _notices_of_told(bodies: TakeUp, said: TakeUp, look: Look | None) -> tuple[Notice, ...]:
    """Where the user's gravity and the rest disagree."""
    others: dict[str, TakeUp | Look] = {"the body": bodies} if is_finite(bodies.up) else {}
    if look is not None:
        others["the image"] = look
    apart = {name: float(angle_deg(said.up, other.up)) for name, other in others.items()}
    if apart and min(apart.values()) > _TOLD_WIDEST_DEG:
        contradicted = " and ".join(f"{name} by {angle:.0f} degrees" for name, angle in apart.items())
        upside_down = min(apart.values()) > 180 - _TOLD_WIDEST_DEG
        raise InputError(
            "wrong-axes",
            f"The gravity that you gave contradicts {contradicted}"
            + (
                "; an accelerometer at rest reads the reaction, which points up: negate it."
                if upside_down
                else "; expected which way things fall in the camera's axes (x right, y down, z away), or the camera's "
                "pitch and roll in degrees; leave it out to have it estimated."
            ),
        )
    return tuple(
        notice("told-up-contradicted", other=name, apart_deg=apart[name])
        for name, other in others.items()
        if _disagree(said, other)
    )


def _disagree(said: TakeUp, other: TakeUp | Look) -> bool:
    return bool(angle_deg(said.up, other.up) > _TOLD_ERRORS * np.hypot(said.error_deg, other.error_deg))


def _words(answer: TakeUp | Look, who: str) -> str:
    pitch, roll = pitch_roll_deg(np.asarray(answer.up, dtype=np.float64))
    return f"pitch {pitch:.0f}, roll {roll:.0f} by {who} (within {max(1.5 * answer.error_deg, 1):.0f})"
