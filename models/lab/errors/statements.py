"""What a finished take states, each with its error against the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite
from ....pipeline.signals.angles import ANGLES, FINE, near, of_both
from ...angle_error.joint_noise import shipped_noise
from ...angle_error.rates import angle_rates
from ...angle_error.take_angles import smoothed, take_angles
from ...common.metrics import SD_90, scaled
from ...common.spread import stated_spread
from ...gravity import why_not
from .configurations import Finished
from .judge import Stated

_MEAN_90 = 1.75  # 90 % over mean of a rotation's error, three Gaussian axes of which two are alike
_CHI_90 = 2.5003  # root of the 90 % quantile of chi square of three degrees of freedom


def statements(take: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take; nothing of one that is not levelled but its joints."""
    yield from (joints(take),)
    if why_not(take.level):
        return
    yield from (up(take), rotation(take))
    yield from angles(take)


def up(take: Finished) -> Stated:
    """One case a take before a static camera, one a frame before a moving one."""
    true = take.R_camera_from_world[:, :, 2]
    found = np.broadcast_to(take.level.up.up, true.shape)
    rows = slice(None) if take.level.up.up.ndim > 1 else slice(0, 1)
    pitch = np.degrees(np.arcsin(np.clip(-found[:, 2], -1, 1)))
    facing = take.level.R_camera_from_body[
        :, 2, 0
    ]  # along the viewing direction: 1 shows the face or the back
    behind = np.full(len(true), np.nanmean(facing) if np.isfinite(facing).any() else np.nan)
    known = {"pitch": pitch, "facing": behind, "stated": take.level.up_bound_deg}
    return _stated("up", take, angle_deg(found, true), take.level.up_bound_deg, known, rows)


def rotation(take: Finished) -> Stated:
    """BODY's rotation."""
    error = geodesic_deg(take.level.R_camera_from_body, take.seen.R_camera_from_body)
    return _stated(
        "BODY's rotation", take, error, _MEAN_90 * take.level.error_deg, {"stated": take.level.error_deg}
    )


def joints(take: Finished) -> Stated:
    """Joints relative to the pelvis: the Mahalanobis distance by their covariance against that of 90 %."""
    if take.lifted.covariance is None:
        return _stated("joints", take, np.zeros(0), np.zeros(0), {})
    truth = take.seen.truth
    size = _scale(take)
    error = (size * take.lifted.joints.astype(np.float64) - truth)[:, 1:]
    covariance = size**2 * take.lifted.covariance.astype(np.float64)[:, 1:]
    fine = is_finite(covariance.reshape(*covariance.shape[:2], 9)) & is_finite(error)
    distance = np.full(fine.shape, np.nan)
    solved = np.linalg.solve(covariance[fine], error[fine][..., None])[..., 0]
    distance[fine] = np.sqrt(np.maximum((solved * error[fine]).sum(-1), 0))
    return _stated("joints", take, distance.ravel(), np.full(distance.size, _CHI_90), {})


def angles(take: Finished) -> Iterator[Stated]:
    """Every angle and its rate, both sides together, of upright frames."""
    seen, level, time_s = take.seen, take.level, take.seen.keypoints.times
    lifted = take.lifted.joints.astype(np.float64)
    found = take_angles(
        lifted,
        smoothed(lifted, time_s),
        level.R_camera_from_body,
        error_deg=level.error_deg,
        up_error_deg=level.up_error_deg,
        stated=stated_spread(take.lifted),
    )
    truth = take_angles(seen.truth, smoothed(seen.truth, time_s), seen.R_camera_from_body, lifted=False)
    noise = shipped_noise()
    rates = angle_rates(found, time_s, noise=replace(noise, rates={}))
    true_rates = angle_rates(truth, time_s)
    parts: dict[str, list[Stated]] = {}
    for name in ANGLES:
        value, true = found[name], truth[name]
        use = ~seen.lying & (true.reason == FINE) & (value.reason == FINE)
        error = np.where(use, near(value.value_deg - true.value_deg, 0.0), np.nan)
        known = {"found": value.value_deg, "stated": value.sd_deg, "noise": value.noise_deg}
        one = Stated(of_both(name), seen.subject, error, SD_90 * value.sd_deg, known)
        parts.setdefault(of_both(name), []).append(one)
        rate, model = rates[name]
        sd = noise.of_rate(name, model, rate)
        error = np.where(use, rate - true_rates[name][0], np.nan)
        parts.setdefault(f"rate of {of_both(name)}", []).append(
            Stated(
                f"rate of {of_both(name)}",
                seen.subject,
                error,
                SD_90 * sd,
                {"rate": np.abs(rate), "model": model},
            )
        )
    for both in parts.values():
        yield _joined(both).judged()


def _stated(
    statement: str,
    take: Finished,
    error: np.ndarray,
    half: np.ndarray,
    known: dict[str, np.ndarray],
    rows: slice = slice(None),
) -> Stated:
    known = {name: values[rows] for name, values in known.items()}
    return Stated(statement, take.seen.subject, error[rows], half[rows], known).judged()


def _joined(parts: list[Stated]) -> Stated:
    first = parts[0]
    return replace(
        first,
        error=np.concatenate([part.error for part in parts]),
        half=np.concatenate([part.half for part in parts]),
        known={name: np.concatenate([part.known[name] for part in parts]) for name in first.known},
    )


def _scale(take: Finished) -> float:
    lifted = take.lifted.joints.astype(np.float64)
    brought = scaled(lifted, take.seen.truth, "take")
    return float(
        np.nanmedian(np.linalg.norm(brought[:, 1:], axis=-1) / np.linalg.norm(lifted[:, 1:], axis=-1))
    )
