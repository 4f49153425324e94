"""What a finished take states of every frame, each with its error against the truth: up, BODY's rotation, joints,
angles and their rates, where the person is, how wrists and ankles move, how large the body is, and how long the
lens."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite, rotate, transpose, unit
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, FINE, near, of_both
from ....pipeline.signals.filters import derivative
from ...angle_error.joint_covariance import levers, turns_of
from ...angle_error.joint_noise import JointNoise, read_noise, shipped_noise
from ...angle_error.posture import features, posture
from ...angle_error.take_angles import TakeJoints, angle_rates, angle_series, smoothed, take_angles
from ..common.metrics import person_size, scaled
from .judge import Stated, joined
from .runs import Finished
from .testbed import SeenTake, accelerations, filtered

_MEAN_OF_RMS = np.sqrt(np.pi) / 2
_UP_90, _HEADING_90 = 1.712, 2.062  # 90 % over mean of Rayleigh, of half a Gaussian
_AWAY = H36M17.indices([name for name in H36M17.joints if name != "pelvis"])  # which is the origin
# Roots of the 90 % quantiles of chi square, three and two degrees of freedom.
_CHI_90, _RAYLEIGH_90 = 2.5003, 2.1460
_QUANTITIES = {"": "position, m", "v": "velocity, m/s", "a": "acceleration, m/s2"}  # by prefix of the columns


def statements(finished: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take's frames; nothing of one that a run refuses. One that is not levelled has
    joints, where all are known, and a place."""
    take, truth = finished.take, finished.truth
    if take is None:
        return
    rows = take.need("poses").frame_index
    if take.need("poses").made_by.kind == "estimated" and is_finite(truth.truth).all():
        yield from joints(take, truth, rows)
    if take.need("rectified").level_ok:
        yield up(take, truth, rows)
        yield rotation(take, truth, rows)
        if take.kinematics and take.need("poses").made_by.kind == "estimated":
            errors = finished.configuration.errors
            yield from angles(take, truth, rows, None if errors is None else read_noise(errors))
    if take.need("poses").made_by.kind == "estimated":
        yield from paths(take, truth, rows)


def up(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """One case a take before a static camera, one a frame before a moving one. rows: (T,) of the truth that the take
    has."""
    rectified = take.need("rectified")
    found = np.broadcast_to(rectified.R_source_from_level[..., :, 2], (len(rows), 3))
    true = np.broadcast_to(truth.up, (len(truth.lying), 3))[rows]
    of = slice(None) if truth.up.ndim > 1 else slice(0, 1)
    return Stated("up", truth.subject, angle_deg(found, true)[of], rectified.up_bound_deg[of]).judged()


def rotation(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """BODY's rotation. rows: (T,) as of `up`."""
    rectified = take.need("rectified")
    error = geodesic_deg(rectified.R_source_from_body, truth.R_camera_from_body[rows])
    up = np.minimum(_MEAN_OF_RMS * rectified.up_error_deg, rectified.error_deg)
    half = np.hypot(_UP_90 * up, _HEADING_90 * np.sqrt(rectified.error_deg**2 - up**2))
    return Stated("BODY's rotation", truth.subject, error, half).judged()


def joints(take: Take, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """Joints relative to the pelvis, in the camera's axes: the length of their error in standard deviations of their
    covariance; and what it is fitted by, their errors along the ray to the body and across it. rows: (T,) as of `up`;
    none of a take without such a covariance."""
    filtered, R = take.need("filtered"), take.need("rectified").R_source_from_level
    own, turning = take.need("rectified").level.covariance, turns_of(take)
    if filtered.covariance is None or own is None or turning is None:
        return
    found, true = filtered.joints.astype(np.float64), rotate(transpose(R), truth.truth[rows])
    lengths = (np.linalg.norm(x[:, _AWAY], axis=-1) for x in (scaled(found, true, "take"), found))
    size = float(np.nanmedian(np.divide(*lengths)))
    error = size * found[:, _AWAY] - true[:, _AWAY]
    covariance = size**2 * filtered.covariance[:, _AWAY].astype(np.float64)
    fine = is_finite(covariance.reshape(*error.shape[:2], 9)) & is_finite(error)
    ray = np.broadcast_to(turning.ray[:, None], error.shape)[fine]
    reach = np.linalg.norm(found[:, _AWAY], axis=-1) / implied_stature(filtered.joints)
    known = {
        "stated": np.sqrt(np.einsum("tjii->tj", covariance))[fine],
        "reach": reach[fine],
        **{
            name: np.broadcast_to(values[:, None], fine.shape)[fine]
            for name, values in (("pitch", turning.pitch), ("off the axis", turning.focal))
        },
    }
    error, covariance = error[fine], covariance[fine]
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    distance = np.sqrt(np.maximum((solved * error).sum(-1), 0))
    yield Stated("joints", truth.subject, distance, np.full(len(distance), _CHI_90)).judged()
    lever = size**2 * levers(filtered.joints, turning.ray)[:, _AWAY][fine]
    along = (error * ray).sum(-1)
    off = np.sqrt(np.maximum((error**2).sum(-1) - along**2, 0))
    for statement, miss, factor, part in (
        ("joints in depth", along, SD_90, _along),
        ("joints across", off, _RAYLEIGH_90, _across),
    ):
        square = part(lever, ray)
        parts = {
            "own": part(size**2 * own[:, _AWAY][fine], ray),
            "by focal": square * known["off the axis"] ** 2,
            "by pitch": square * known["pitch"] ** 2,
        }
        half = factor * np.sqrt(part(covariance, ray))
        squares = {name: factor**2 * each for name, each in parts.items()}
        yield Stated(statement, truth.subject, miss, half, {**known, **squares}).judged()


def _along(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) the variance of covariances (N, 3, 3) along rays (N, 3)."""
    return np.einsum("ni,nij,nj->n", ray, covariance, ray)


def _across(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) that of either axis across."""
    return (np.einsum("nii->n", covariance) - _along(covariance, ray)) / 2


def angles(
    take: Take, truth: SeenTake, rows: np.ndarray, noise: JointNoise | None = None
) -> Iterator[Stated]:
    """Every angle and its rate, both sides together; `noise`, `tilt` and `model` are what their errors are made of,
    before their factors (JointNoise.whole, of_rate), the posture what angles' grow with. rows: (T,) as of `up`; noise:
    by which they are stated."""
    noise = shipped_noise() if noise is None else noise
    columns, time_s = take.kinematics or {}, truth.keypoints.times
    plain = replace(noise, factors={}, tilts={}, more={}, postures={})
    rectified = take.need("rectified")
    body = rotate(
        transpose(rectified.R_source_from_body) @ rectified.R_source_from_level, take.need("filtered").joints
    )
    of = features(body, take.need("poses").times)
    stands = {**of, "posture": posture(of)}
    parts_of = angle_series(take.need("poses"), take.need("rectified"), take.need("filtered"), plain)[0]
    R = truth.R_camera_from_body
    true = take_angles(TakeJoints(truth.truth, smoothed(truth.truth, time_s), R))
    true_rates = angle_rates(true, time_s)
    parts: dict[str, list[Stated]] = {}
    for name in ANGLES:
        value, sd = columns[f"{name}_deg"], columns[f"{name}_sd_deg"]
        rate, rate_sd = columns[f"{name}_degps"], columns[f"{name}_sd_degps"]
        use = (true[name].reason[rows] == FINE) & (columns[f"{name}_reason"] == FINE)
        both, raw = of_both(name), parts_of[name]
        use &= np.isfinite(raw.noise_deg)
        error = np.where(use, near(value - true[name].value_deg[rows], 0.0), np.nan)
        known = {"found": value, "stated": sd, "noise": raw.noise_deg, "tilt": raw.tilt_deg, **stands}
        parts.setdefault(both, []).append(Stated(both, truth.subject, error, SD_90 * sd, known))
        error = np.where(use, rate - true_rates[name][0][rows], np.nan)
        known = {"rate": np.abs(rate), "model": noise.of_model(name, rate_sd, rate)}
        of_rate = f"rate of {both}"
        parts.setdefault(of_rate, []).append(Stated(of_rate, truth.subject, error, SD_90 * rate_sd, known))
    for sides in parts.values():
        yield joined(sides).judged()


def paths(take: Take, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """Everything of lifted poses in metres; motions before a static camera, for one that pans turns them. rows: (T,) as
    of `up`."""
    camera = take.need("camera")
    if camera.focal_source != "told":
        off = np.array([1 - truth.focal_px / camera.focal_px])
        half = np.array([SD_90 * camera.focal_sd_px / camera.focal_px])
        yield Stated("focal length, %", truth.subject, 100 * off, 100 * half)
    poses = take.need("poses")
    if poses.root is not None:
        yield from place(poses, truth, rows)
        for each in take.notices:
            if each.code == "placed":
                yield frame_by_frame(poses, truth, rows, each.values["within"])
    if take.need("rectified").level_ok and truth.up.ndim == 1:
        yield from motions(take, truth, rows)


def place(poses: PoseSequence, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """The pelvis from the camera along the ray to it and across, frame by frame, and the size of the body, which moves
    it all. rows: (T,) as of `up`."""
    path = poses.path
    assert path is not None
    assert path.covariance is not None
    true = truth.joints_camera[rows, H36M17.index("pelvis")]
    along = unit(true)
    right = unit(np.cross(along, [0.0, 1.0, 0.0]))
    axes = {"along": [along], "across": [right, np.cross(right, along)]}
    for way, directions in axes.items():
        parts = [
            Stated(
                f"pelvis {way} the ray, m",
                truth.subject,
                ((path.points - true) * axis).sum(axis=1),
                SD_90 * np.sqrt(np.einsum("tj,tjk,tk->t", axis, path.covariance, axis)),
            )
            for axis in directions
        ]
        yield joined(parts).judged()
    if path.shared is not None:
        lifted = poses.joints.astype(np.float64)
        size = person_size(lifted) / person_size(scaled(lifted, truth.truth[rows], "take"))
        half = np.array([100 * SD_90 * path.shared[0]])
        yield Stated("body's size, %", truth.subject, np.array([100 * (size - 1)]), half).judged()


def frame_by_frame(poses: PoseSequence, truth: SeenTake, rows: np.ndarray, within: float) -> Stated:
    """What a run says of its frames: that each is so near to the true place but for the whole path's size and what the
    focal length does to all depths, of which it says how wrong they are beside. rows: (T,) as of `up`."""
    assert poses.root is not None
    there = is_finite(poses.root)
    found, true = poses.root[there], truth.joints_camera[rows, H36M17.index("pelvis")][there]
    parts = np.stack([found, found * [0.0, 0.0, 1.0]], axis=-1)
    best = np.linalg.lstsq(parts.reshape(-1, 2), true.ravel(), rcond=None)[0]
    off = np.linalg.norm(parts @ best - true, axis=1)
    return Stated("pelvis from frame to frame, m", truth.subject, off, np.full(len(off), within))


def motions(take: Take, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """Positions, velocities and accelerations of wrists and ankles from the pelvis, each axis of LEVEL a case, of
    upright frames. The truth is turned into the LEVEL that was found: how wrong its up is has an error of its own.
    rows: (T,) as of `up`."""
    columns = take.need("kinematics")
    true = rotate(transpose(take.need("rectified").R_source_from_level), truth.truth)[rows]
    time_s, upright = truth.keypoints.times[rows], ~truth.lying[rows]
    if not is_finite(true).all():
        return
    signals = {"": true, "v": derivative(filtered(true, time_s), time_s), "a": accelerations(true, time_s)}
    for part in ("wrist", "ankle"):
        for prefix, quantity in _QUANTITIES.items():
            parts = []
            for joint in (f"r_{part}", f"l_{part}"):
                for i, axis in enumerate("xyz"):
                    column = f"{joint}_{prefix}{axis}"
                    error = columns[column] - signals[prefix][:, H36M17.index(joint), i]
                    half = SD_90 * columns.get(f"{column}_sd", np.full(len(rows), np.nan))
                    error = np.where(upright, error, np.nan)
                    parts.append(Stated(f"{part} {quantity}", truth.subject, error, half))
            yield joined(parts).judged()
