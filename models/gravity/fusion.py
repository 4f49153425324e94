"""One up from bodies, images and what the user says: fused where they agree, decided and said where they do not.

Two sources contradict each other when their ups are further apart than their stated errors allow (chi-square with two
degrees of freedom). Then one of them is quite wrong, and which is told by how often such a source is. How cameras are
usually held has no say in that: it has been weighed with the lines already, in the search for their best fit, and with
the bodies, in what their network was trained on; they are drawn towards usual cameras, lines that are right are not.
The loser has no say, and the user is told both answers. Where it is right in more than one of ten such takes, the
stated error covers it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.core.camera import Look, pitch_roll_deg
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import SD_90
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.rotations import angle_deg, is_finite, shortest_turn, unit
from .evidence import IMAGE, Evidence, TakeUp, about, fuse

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
