"""Up of a camera that pans or is carried, from what the bodies say all the time and its images now and then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...pipeline.core.camera import Look
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import angle_deg, is_finite, unit
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.signals.filters import nearest_row
from ..common.metrics import RAYLEIGH_90
from ..common.residuals import stated_spread
from .evidence import FRAMES, IMAGE, KNOWN_DEG, TakeUp, settled
from .votes import (
    PersonFrames,
    bodies_covariance,
    expected_deg,
    lean_square,
    leaning,
    own_lean,
    smoothed,
    take_rotation,
    trust,
)

_WINDOW_S = 2.0  # standard deviation of the Gaussian in which frames vote on up
_VOTE_DEG = 10.0  # votes this far from their neighbours' mean count half
_LOST_DEG_PER_S = 12.0  # how fast a camera's up may go elsewhere where no image says anything
_LOOK_DEG = 4.0  # looks this far from the middle of their neighbours count half
_CONTRADICTION = 3.0  # combined errors, median over the frames


def timed(looks: Sequence[Look], poses: PoseSequence) -> list[tuple[float, Look]]:
    """What the images of the poses' video say while the person is there, each with its time in the take; without time
    stamps the poses count as 30 frames a second."""
    times = np.arange(len(poses)) / 30 if poses.time_s is None else poses.time_s
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
    if close:  # the bound reaches the other answer, as fusion's does
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
        trust = 1 / (1 + (off / _LOOK_DEG) ** 4)[:, None]
        ups = unit(trust * ups + (1 - trust) * usual)
        unsteady = float(np.median(off))
    up = unit(np.stack([np.interp(time_s, at, ups[:, axis]) for axis in range(3)], axis=-1))
    nearest = np.abs(time_s - at[nearest_row(at, time_s)])
    outside = np.maximum(np.maximum(at[0] - time_s, time_s - at[-1]), 0.0)
    gap = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    beyond = np.maximum(nearest - gap, 0.0)
    wander = unsteady * np.minimum(nearest / max(gap, 1e-3), 1.0) + _LOST_DEG_PER_S * beyond
    error_deg = np.sqrt(np.interp(time_s, at, errors_deg) ** 2 + wander**2 + (_LOST_DEG_PER_S * outside) ** 2)
    return up, error_deg, _LOST_DEG_PER_S * np.maximum(beyond, outside)
