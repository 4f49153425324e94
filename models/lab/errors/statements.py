"""What a finished take states, each with its error against the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....pipeline.core.camera import pitch_roll_deg
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, FINE, near, of_both
from ...angle_error.joint_noise import JointNoise, shipped_noise
from ...angle_error.rates import angle_rates
from ...angle_error.take_angles import smoothed, take_angles
from ...common.metrics import SD_90, scaled
from ..evaluation.finished import Finished
from ..evaluation.jumps import compared
from ..evaluation.testbed import SeenTake
from .judge import Stated

_MEAN_90 = 1.9  # 90 % over mean of a rotation's error: a heading's is 2.06, that of an up 1.71
_AWAY = H36M17.indices([name for name in H36M17.joints if name != "pelvis"])  # which is the origin
_CHI_90 = 2.5003  # root of the 90 % quantile of chi square of three degrees of freedom


def statements(finished: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take; nothing of one that a run refuses or cannot level but its joints."""
    take, truth = finished.take, finished.truth
    if take is None:
        return
    rows = take.need("poses").frame_index
    if take.need("poses").made_by.kind == "estimated":
        yield joints(take, truth, rows)
    if take.need("rectified").level_ok:
        yield up(take, truth, rows)
        yield rotation(take, truth, rows)
        if take.kinematics and take.need("poses").made_by.kind == "estimated":
            yield from angles(take, truth, rows)
        yield from jumps(take, truth)


def up(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """One case a take before a static camera, one a frame before a moving one. rows: (T,) of the truth that the take
    has."""
    rectified = take.need("rectified")
    found = np.broadcast_to(rectified.R_source_from_level[..., :, 2], (len(rows), 3))
    true = np.broadcast_to(truth.up, (len(truth.lying), 3))[rows]
    facing = rectified.R_source_from_body[:, 2, 0]  # 1: the face is towards the camera, -1: the back
    known = {
        "pitch": pitch_roll_deg(found)[:, 0],
        "facing": np.full(len(rows), np.nanmean(facing) if np.isfinite(facing).any() else np.nan),
        "stated": rectified.up_bound_deg,
    }
    of = slice(None) if truth.up.ndim > 1 else slice(0, 1)
    known = {name: values[of] for name, values in known.items()}
    error = angle_deg(found, true)[of]
    return Stated("up", truth.subject, error, rectified.up_bound_deg[of], known).judged()


def rotation(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """BODY's rotation. rows: (T,) as of `up`."""
    rectified = take.need("rectified")
    error = geodesic_deg(rectified.R_source_from_body, truth.R_camera_from_body[rows])
    half, known = _MEAN_90 * rectified.error_deg, {"stated": rectified.error_deg}
    return Stated("BODY's rotation", truth.subject, error, half, known).judged()


def joints(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """Joints relative to the pelvis: the length of their error in standard deviations of their covariance.
    rows: (T,) as of `up`."""
    poses = take.need("poses")
    lifted, true = poses.joints.astype(np.float64), truth.truth[rows]
    brought = scaled(lifted, true, "take")
    lengths = (np.linalg.norm(joints[:, _AWAY], axis=-1) for joints in (brought, lifted))
    size = float(np.nanmedian(np.divide(*lengths)))
    error = (brought - true)[:, _AWAY]
    distance = np.full(error.shape[:2], np.nan)
    if poses.covariance is not None:
        covariance = size**2 * poses.covariance.astype(np.float64)[:, _AWAY]
        fine = is_finite(covariance.reshape(*covariance.shape[:2], 9)) & is_finite(error)
        solved = np.linalg.solve(covariance[fine], error[fine][..., None])[..., 0]
        distance[fine] = np.sqrt(np.maximum((solved * error[fine]).sum(-1), 0))
    return Stated("joints", truth.subject, distance.ravel(), np.full(distance.size, _CHI_90)).judged()


def angles(
    take: Take, truth: SeenTake, rows: np.ndarray, noise: JointNoise | None = None
) -> Iterator[Stated]:
    """Every angle and its rate, both sides together, of upright frames; `noise` and `model` are what their errors are
    made of (JointNoise.whole, of_rate). rows: (T,) as of `up`; noise: by which they are stated."""
    noise = shipped_noise() if noise is None else noise
    columns, time_s = take.kinematics or {}, truth.keypoints.times
    R = truth.R_camera_from_body
    true = take_angles(truth.truth, smoothed(truth.truth, time_s), R, lifted=False)
    true_rates = angle_rates(true, time_s)
    parts: dict[str, list[Stated]] = {}
    for name in ANGLES:
        value, sd = columns[f"{name}_deg"], columns[f"{name}_sd_deg"]
        rate, rate_sd = columns[f"{name}_degps"], columns[f"{name}_sd_degps"]
        use = ~truth.lying[rows] & (true[name].reason[rows] == FINE) & (columns[f"{name}_reason"] == FINE)
        both = of_both(name)
        error = np.where(use, near(value - true[name].value_deg[rows], 0.0), np.nan)
        known = {"found": value, "stated": sd, "noise": noise.of_noise(name, sd, value)}
        parts.setdefault(both, []).append(Stated(both, truth.subject, error, SD_90 * sd, known))
        error = np.where(use, rate - true_rates[name][0][rows], np.nan)
        known = {"rate": np.abs(rate), "model": noise.of_model(name, rate_sd, rate)}
        of_rate = f"rate of {both}"
        parts.setdefault(of_rate, []).append(Stated(of_rate, truth.subject, error, SD_90 * rate_sd, known))
    for sides in parts.values():
        yield _joined(sides).judged()


def jumps(take: Take, truth: SeenTake) -> Iterator[Stated]:
    """Figures of the flights that are true, in ms and cm."""
    for name, pairs in compared(take, truth).pairs.items():
        found, true, half = np.array([(pair.found, pair.true, pair.half) for pair in pairs]).T
        yield Stated(name, truth.subject, found - true, half, {"size": found}).judged()


def _joined(parts: list[Stated]) -> Stated:
    first = parts[0]
    return replace(
        first,
        error=np.concatenate([part.error for part in parts]),
        half=np.concatenate([part.half for part in parts]),
        known={name: np.concatenate([part.known[name] for part in parts]) for name in first.known},
    )
