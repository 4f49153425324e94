"""One up from bodies, images and what the user says: fused where they agree, decided and said where they do not.

Two sources contradict each other when their ups are further apart than their stated errors allow (chi-square with two
degrees of freedom). Then one of them is quite wrong, and which is decided by odds: how often such a source is quite
wrong, and how cameras are held. The loser has no say, and the user is told both answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.camera import Look, pitch_roll_deg
from ...pipeline.errors import InputError
from ...pipeline.rotations import angle_deg, unit
from .held import held
from .votes import Evidence, TakeUp, error_of, take_up

IMAGE = "image"
_CONTRADICTION = 13.8  # chi-square of two degrees of freedom that chance exceeds once in a thousand
_BODY_FAILURE = (
    0.10  # takes whose skeletons all lean by far more than they state: unusual poses, backs, bad lifts
)
_TOLD_WIDEST_DEG = (
    60.0  # told gravity further than this from everything else is a mistake of the one who tells
)
_TOLD_ERRORS = 3.0


@dataclass(frozen=True)
class Decision:
    """others: the evidence that takes part besides the bodies. bodies: whether they do. warnings: in words."""

    others: tuple[Evidence, ...]
    bodies: bool
    warnings: tuple[str, ...] = ()


def fused_up(
    votes: np.ndarray,
    error_deg: np.ndarray,
    time_s: np.ndarray,
    others: Sequence[Evidence] = (),
    look: Look | None = None,
    told: Sequence[Evidence] = (),
) -> tuple[TakeUp, tuple[str, ...]]:
    """A static camera's up, and warnings in words. votes (T, 3), error_deg (T,), time_s (T,): the frames' own, as of
    `votes.take_up`; others: what else the bodies tell (feet, floor). Raises InputError as `decide`."""
    bodies = take_up(votes, error_deg, time_s, others)
    if look is None and not told:
        return bodies, ()
    decision = decide(bodies, look, told)
    if decision.bodies:
        found = take_up(votes, error_deg, time_s, [*others, *decision.others])
    else:
        found = replace(alone(decision.others), votes=bodies.votes)
    heard = {IMAGE: (look.up, look.error_deg)} if look else {}
    return replace(found, own=bodies.own | heard | found.own), decision.warnings


def alone(evidence: Sequence[Evidence]) -> TakeUp:
    """The up of evidence without any frames."""
    return take_up(np.empty((0, 3)), np.empty(0), np.empty(0), evidence)


def from_look(look: Look) -> Evidence:
    """An image's answer as evidence on up."""
    information = np.linalg.pinv(look.covariance, hermitian=True, rcond=1e-9)
    # Along up itself nothing can be wrong; a finite number there keeps the fused direction a unit vector.
    information = information + np.outer(look.up, look.up) * np.trace(information)
    return Evidence(IMAGE, information, information @ look.up)


def decide(bodies: TakeUp | None, look: Look | None, told: Sequence[Evidence] = ()) -> Decision:
    """Who takes part in a take's up. bodies: what frames, feet and floor say together; None or without an up where they
    say nothing. look: what the image says. told: what the user says.

    InputError when the user tells a gravity more than 60 degrees from everything else.
    """
    known_bodies = bodies if bodies is not None and np.isfinite(bodies.up).all() else None
    warnings = _checked_against_told(known_bodies, look, told)
    if look is None:
        return Decision(tuple(told), True, tuple(warnings))
    image = from_look(look)
    if told:
        apart = float(angle_deg(_up_of(told), look.up))
        if apart > _TOLD_ERRORS * np.hypot(look.error_deg, _error_of(told)):
            return Decision(tuple(told), True, tuple(warnings))
    if known_bodies is None or chi_square(known_bodies, look) <= _CONTRADICTION:
        return Decision((*told, image), True, tuple(warnings))
    wins = image_wins(look, known_bodies.up) or bool(told)
    apart = float(angle_deg(known_bodies.up, look.up))
    warnings.append(
        f"The image's {'lines' if look.source == 'lines' else 'network'} and the skeletons contradict each other about "
        f"up by {apart:.0f} degrees: {_camera(look.up)} by the image (within {_bound(look.error_deg)}), "
        f"{_camera(known_bodies.up)} by the skeletons (within {_bound(known_bodies.error_deg)}). "
        + ("The image is believed." if wins else "The skeletons are believed.")
    )
    if wins:
        return Decision((*told, image), bool(told), tuple(warnings))
    return Decision(tuple(told), True, tuple(warnings))


def image_wins(look: Look, bodies_up: np.ndarray) -> bool:
    """Whether the image is likelier right than bodies of another up (3,), one of the two being quite wrong."""
    odds_image = _BODY_FAILURE * (1 - look.failure) * held(look.up)
    odds_bodies = look.failure * (1 - _BODY_FAILURE) * held(bodies_up)
    return odds_image > odds_bodies


def chi_square(bodies: TakeUp, look: Look) -> float:
    """Squared distance of both answers in their errors, on the plane across the image's up."""
    per_axis = np.radians(bodies.error_deg) ** 2 / 2
    across = np.linalg.svd(look.up[None])[2][1:]
    apart = across @ (unit(bodies.up) - look.up)
    # A chord is shorter than its arc; far apart this matters.
    angle = np.radians(angle_deg(bodies.up, look.up))
    apart = apart * (angle / max(float(np.linalg.norm(apart)), 1e-12))
    return float(apart @ np.linalg.solve(across @ look.covariance @ across.T + per_axis * np.eye(2), apart))


def _checked_against_told(bodies: TakeUp | None, look: Look | None, told: Sequence[Evidence]) -> list[str]:
    """Warnings where the user's gravity and the rest disagree."""
    if not told:
        return []
    up, error = _up_of(told), _error_of(told)
    others = [("the skeletons", bodies.up, bodies.error_deg)] if bodies is not None else []
    others += [("the image", look.up, look.error_deg)] if look is not None else []
    apart = {name: float(angle_deg(up, other)) for name, other, _ in others}
    if apart and min(apart.values()) > _TOLD_WIDEST_DEG:
        said = " and ".join(f"{name} by {angle:.0f} degrees" for name, angle in apart.items())
        upside_down = min(apart.values()) > 180 - _TOLD_WIDEST_DEG
        raise InputError(
            f"The gravity that was told contradicts {said}"
            + (
                "; an accelerometer at rest reads the reaction, which points up: negate it."
                if upside_down
                else "; expected which way things fall in the camera's axes (x right, y down, z away), or the camera's "
                "pitch and roll in degrees; leave it out to have it estimated."
            )
        )
    return [
        f"What was told about gravity and {name} are {apart[name]:.0f} degrees apart, more than their errors explain; "
        "what was told is believed."
        for name, _, theirs in others
        if apart[name] > _TOLD_ERRORS * np.hypot(error, theirs)
    ]


def _up_of(told: Sequence[Evidence]) -> np.ndarray:
    return unit(np.linalg.lstsq(sum(e.information for e in told), sum(e.vector for e in told), rcond=None)[0])


def _error_of(told: Sequence[Evidence]) -> float:
    return error_of(np.sum([e.information for e in told], axis=0), _up_of(told))


def _camera(up: np.ndarray) -> str:
    pitch, roll = pitch_roll_deg(np.asarray(up, dtype=np.float64))
    return f"pitch {pitch:.0f}, roll {roll:.0f}"


def _bound(error_deg: float) -> str:
    return f"{max(1.5 * error_deg, 1):.0f}"
