"""What a finished take states, each with its error against the truth: of every frame up, BODY's rotation, joints,
angles and their rates, where the person is, how wrists and ankles move, how large the body is, and how long the lens;
and each figure of its measures.

The run's rows name a figure and its error. What is true comes from the bed: the captured feet for walks (gait.py),
captured flights for jumps (jumps.py), the same rows of a run on the captured joints for repeated movements, and the
true angles over the same frames for ranges of motion and for repetitions of an angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90, Measure, Measures
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite, rotate, transpose, unit
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, FINE, MIDLINE, continuous, near, of_both
from ....pipeline.signals.filters import derivative
from ...angle_error.joint_covariance import levers, turns_of
from ...angle_error.joint_noise import JointNoise, read_noise, shipped_noise
from ...angle_error.posture import FEATURES, arms_of, features, posture
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import TakeJoints, angle_rates, angle_series, smoothed, take_angles
from ..common.metrics import person_size, scaled
from .gait import true_gait, walks
from .judge import BINS, Case, Stated, joined, of_cases
from .jumps import compared
from .runs import Finished
from .testbed import SeenTake, accelerations, filtered

_MEAN_OF_RMS = np.sqrt(np.pi) / 2
_UP_90, _HEADING_90 = 1.712, 2.062  # 90 % over mean of Rayleigh, of half a Gaussian
_AWAY = H36M17.indices([name for name in H36M17.joints if name != "pelvis"])  # which is the origin
# Roots of the 90 % quantiles of chi square, three and two degrees of freedom.
_CHI_90, _RAYLEIGH_90 = 2.5003, 2.1460
_QUANTITIES = {"": "position, m", "v": "velocity, m/s", "a": "acceleration, m/s2"}  # by prefix of the columns
_REACHED = 0.8  # share of a figure's frames below the posture and the speed that it is judged by
_SEEN = 0.95  # of the frames of a found range, whose truth is known
# Of walks, by the names of gait.walks.
_OF_WALKS = {
    "stance, %": "stance_percent",
    "double support, %": "double_support_percent",
    "single support, %": "single_support_percent",
    "step time, s": "step_time_s",
    "step length, m": "step_length",
    "walking speed, m/s": "walking_speed",
    "cadence, steps/min": "cadence",
}
_OF_MOVEMENTS = {"mean_rise": "mean rise, deg", "mean_duration": "mean duration, s"}
_MOVEMENTS = {
    "knee bends": [("knee_bends",)],
    "arm raises": [("arm_raises", side) for side in ("right", "left")],
}
_DRIVES = {"arm_raises.right": "r_shoulder_elevation", "arm_raises.left": "l_shoulder_elevation"}


def statements(finished: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take."""
    yield from of_frames(finished)
    yield from of_figures(finished)


def of_frames(finished: Finished) -> Iterator[Stated]:
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


def stances(take: Take) -> dict[str, np.ndarray]:
    """{name of FEATURES, "r_arm", "l_arm", "posture": (T,)} of each frame's body, as the run has it (posture.py), NaN
    of a body that is not turned."""
    rectified = take.need("rectified")
    R_body_from_level = transpose(rectified.R_source_from_body) @ rectified.R_source_from_level
    of = features(rotate(R_body_from_level, take.need("filtered").joints), take.need("poses").times)
    return {**of, "posture": np.where(np.isfinite(of["lean"]), posture(of), np.nan)}


def bins(take: Take) -> dict[str, np.ndarray]:
    """What cases are judged apart by: (T,) each frame's place in POSTURES and its speed."""
    of = stances(take)
    return {name: of[name] for name in BINS}


def reached(of: Mapping[str, np.ndarray], use: np.ndarray | slice = slice(None)) -> dict[str, float]:
    """What a figure of many frames is judged by: the posture and the speed that a fifth of them reach, in the order of
    POSTURES. of: of `bins`; use: which frames, (T,) bool."""
    known = {name: values[use][np.isfinite(values[use])] for name, values in of.items()}
    return {
        name: float(np.quantile(values, _REACHED, method="nearest")) if len(values) else np.nan
        for name, values in known.items()
    }


def of_take(of: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """`reached` in the whole take, {name: (1,)}: of one case a take."""
    return {name: np.array([value]) for name, value in reached(of).items()}


def up(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """One case a take before a static camera, one a frame before a moving one. rows: (T,) of the truth that the take
    has."""
    rectified, known = take.need("rectified"), bins(take)
    found = np.broadcast_to(rectified.R_source_from_level[..., :, 2], (len(rows), 3))
    true = np.broadcast_to(truth.up, (len(truth.lying), 3))[rows]
    error, half = angle_deg(found, true), rectified.up_bound_deg
    if truth.up.ndim == 1:
        error, half = error[:1], half[:1]
        known = of_take(known)
    return Stated("up", truth.subject, error, half, known).judged()


def rotation(take: Take, truth: SeenTake, rows: np.ndarray) -> Stated:
    """BODY's rotation. rows: (T,) as of `up`."""
    rectified = take.need("rectified")
    error = geodesic_deg(rectified.R_source_from_body, truth.R_camera_from_body[rows])
    up = np.minimum(_MEAN_OF_RMS * rectified.up_error_deg, rectified.error_deg)
    half = np.hypot(_UP_90 * up, _HEADING_90 * np.sqrt(rectified.error_deg**2 - up**2))
    return Stated("BODY's rotation", truth.subject, error, half, bins(take)).judged()


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
            for name, values in (
                ("pitch", turning.pitch),
                ("off the axis", turning.focal),
                *bins(take).items(),
            )
        },
    }
    error, covariance = error[fine], covariance[fine]
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    distance = np.sqrt(np.maximum((solved * error).sum(-1), 0))
    stands = {name: known[name] for name in BINS}
    yield Stated("joints", truth.subject, distance, np.full(len(distance), _CHI_90), stands).judged()
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
    of = stances(take)
    stands = {name: of[name] for name in (*FEATURES, "posture")}
    parts_of, _, faster = angle_series(
        take.need("poses"), take.need("rectified"), take.need("filtered"), plain
    )
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
        known["arms"] = of[arms_of(name)]
        parts.setdefault(both, []).append(Stated(both, truth.subject, error, SD_90 * sd, known))
        error = np.where(use, rate - true_rates[name][0][rows], np.nan)
        known = {"rate": np.abs(rate), "model": noise.of_model(name, rate_sd, rate, faster)}
        known |= {"faster": faster, **{name: of[name] for name in BINS}}
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
        yield Stated("focal length, %", truth.subject, 100 * off, 100 * half, of_take(bins(take)))
    poses = take.need("poses")
    if poses.root is not None:
        yield from place(poses, truth, rows, bins(take))
        for each in take.notices:
            if each.code == "placed":
                yield frame_by_frame(poses, truth, rows, each.values["within"], bins(take))
    if take.need("rectified").level_ok and truth.up.ndim == 1:
        yield from motions(take, truth, rows)


def place(
    poses: PoseSequence, truth: SeenTake, rows: np.ndarray, known: Mapping[str, np.ndarray]
) -> Iterator[Stated]:
    """The pelvis from the camera along the ray to it and across, frame by frame, and the size of the body, which moves
    it all. rows: (T,) as of `up`; known: of `bins`."""
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
                known,
            )
            for axis in directions
        ]
        yield joined(parts).judged()
    if path.shared is not None:
        lifted = poses.joints.astype(np.float64)
        size = person_size(lifted) / person_size(scaled(lifted, truth.truth[rows], "take"))
        half = np.array([100 * SD_90 * path.shared[0]])
        yield Stated(
            "body's size, %", truth.subject, np.array([100 * (size - 1)]), half, of_take(known)
        ).judged()


def frame_by_frame(
    poses: PoseSequence, truth: SeenTake, rows: np.ndarray, within: float, known: Mapping[str, np.ndarray]
) -> Stated:
    """What a run says of its frames: that each is so near to the true place but for the whole path's size and what the
    focal length does to all depths, of which it says how wrong they are beside. rows: (T,) as of `up`; known: of
    `bins`."""
    assert poses.root is not None
    there = is_finite(poses.root)
    found, true = poses.root[there], truth.joints_camera[rows, H36M17.index("pelvis")][there]
    parts = np.stack([found, found * [0.0, 0.0, 1.0]], axis=-1)
    best = np.linalg.lstsq(parts.reshape(-1, 2), true.ravel(), rcond=None)[0]
    off = np.linalg.norm(parts @ best - true, axis=1)
    known = {name: values[there] for name, values in known.items()}
    return Stated("pelvis from frame to frame, m", truth.subject, off, np.full(len(off), within), known)


def motions(take: Take, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """Positions, velocities and accelerations of wrists and ankles from the pelvis, each axis of LEVEL a case, of
    upright frames. The truth is turned into the LEVEL that was found: how wrong its up is has an error of its own.
    rows: (T,) as of `up`."""
    columns, known = take.need("kinematics"), bins(take)
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
                    parts.append(Stated(f"{part} {quantity}", truth.subject, error, half, known))
            yield joined(parts).judged()


def of_figures(finished: Finished) -> Iterator[Stated]:
    """Every figure with an error whose truth is known; nothing of a take that a run refuses or cannot level."""
    take, truth = finished.take, finished.truth
    if take is None or not take.need("rectified").level_ok:
        return
    lifted, static = take.need("poses").made_by.kind == "estimated", truth.up.ndim == 1
    cases = [*compared(take, truth).cases]
    if static:
        of_walks = {case.statement: case for case in walks(take, truth, true_gait(truth))}
        found = {statement: of_walks.get(name) for statement, name in _OF_WALKS.items()}
        cases += [
            case._replace(statement=statement)
            for statement, case in found.items()
            if case is not None and np.isfinite(case.half)
        ]
    if lifted and static:
        cases += movements(finished, take)
    if lifted and take.kinematics:
        cases += within(take, true_angles(truth, take.need("poses").frame_index))
    yield from of_cases(cases, truth.subject, partial(during, bins(take), take.need("poses").times))


def during(
    of: Mapping[str, np.ndarray], time_s: np.ndarray, span: tuple[float, float] | None
) -> dict[str, float]:
    """`reached` in these seconds at times (T,), or in the whole take."""
    start, stop = span or (-np.inf, np.inf)
    return reached(of, (time_s >= start) & (time_s <= stop))


def movements(finished: Finished, take: Take) -> Iterator[Case]:
    """Peaks of repetitions that are true ones too, and means where each true one is found, and no other. Of static
    cameras, for nobody knows the true figures of others."""
    every = [(movement, names) for movement, groups in _MOVEMENTS.items() for names in groups]
    if not any(take.figures.group(*names).spans for _, names in every):
        return
    true = finished.captured().figures
    for movement, names in every:
        found = take.figures.group(*names)
        for figure, row, truth in same_rows(found, true.group(*names)):
            half = np.nan if row.error is None else SD_90 * row.error
            span = found.spans[row.number] if row.number is not None else None
            yield Case(f"{movement}: {figure}", row.value, truth.value, half, span)


def same_rows(found: Measures, true: Measures) -> Iterator[tuple[str, Measure, Measure]]:
    """(figure, row found, the true one) of the repetitions of one movement; a peak is that of the repetition that
    shares the most time with it."""
    spans, true_spans = (np.array(of.spans) for of in (found, true))
    if not len(spans) or not len(true_spans):
        return
    shared = np.minimum(spans[:, None, 1], true_spans[:, 1]) - np.maximum(spans[:, None, 0], true_spans[:, 0])
    true_peaks = {peak.number: peak for peak in true.repetitions("peak")}  # one that a gap hides has none
    for peak in found.repetitions("peak"):
        of = shared[peak.number or 0]
        if of.max() > 0 and int(of.argmax()) in true_peaks:
            yield "peak, deg", peak, true_peaks[int(of.argmax())]
    same = shared.max(axis=1).min() > 0 and np.array_equal(shared.argmax(axis=1), np.arange(len(true_spans)))
    for name, figure in _OF_MOVEMENTS.items():
        row, truth = found.figure(name), true.figure(name)
        if same and row is not None and truth is not None:
            yield figure, row, truth


class Ranged(NamedTuple):
    """An angle's range in degrees, found and true over the same frames. ends: the standard deviation that independent
    errors of its ends would give it; error: the stated one."""

    found: float
    true: float
    ends: float
    error: float


class Repeated(NamedTuple):
    """Two repetitions of an angle in a take: their peaks in degrees, found and true, their errors, and the stated
    minimal detectable change."""

    angle: str
    found: tuple[float, float]
    true: tuple[float, float]
    errors: tuple[float, float]
    mdc90: float


def true_angles(truth: SeenTake, rows: np.ndarray) -> dict[str, np.ndarray]:
    """{angle: (T,) degrees} of the truth at these rows (T,) of it, NaN where there is none."""
    joints = smoothed(truth.truth, truth.keypoints.times)
    series = take_angles(TakeJoints(truth.truth, joints, truth.R_camera_from_body))
    return {name: series[name].value_deg[rows] for name in ANGLES}


def within(take: Take, true: Mapping[str, np.ndarray]) -> Iterator[Case]:
    """Ranges of motion, right less left, and one repetition less another. true: (T,) of `true_angles`."""
    every = ranges(take, true)
    for both in dict.fromkeys(of_both(name) for name in every):
        of = [every[name] for name in (both, f"r_{both}", f"l_{both}") if name in every]
        for side in of:
            yield Case(f"range of {both}", side.found, side.true, SD_90 * side.error)
        index = take.figures.group("symmetry", both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            right, left = of
            size = (right.found + left.found) / 2  # an index in degrees, for that of small ranges has none
            off, true_off = right.found - left.found, right.true - left.true
            half = SD_90 * index.error / 100 * size
            yield Case(f"right less left range of {both}", off, true_off, half)
    for pair in repetitions(take, true):
        off = float(near(np.array(pair.found[0] - pair.found[1] - pair.true[0] + pair.true[1]), 0.0))
        yield Case("peak less peak", off, 0.0, pair.mdc90)


def ranges(take: Take, true: Mapping[str, np.ndarray]) -> dict[str, Ranged]:
    """{angle: Ranged} of those that state a range with its error; nothing where the truth lacks frames of it. true:
    (T,) of `true_angles`."""
    columns, every = take.kinematics or {}, {}
    for name in ANGLES:
        row = take.figures.group("range_of_motion", name).figure("p05_p95")
        if row is None or row.error is None:
            continue
        values, centre = continuous(columns[f"{name}_deg"], ANGLES[name].centre_deg), ANGLES[name].centre_deg
        visible = np.isfinite(values)
        beside = continuous(np.where(visible, true[name], np.nan), centre)
        if np.isfinite(beside).sum() >= _SEEN * visible.sum():
            _, sds = ends(values, columns[f"{name}_sd_deg"])
            (low, high), _ = ends(beside, np.full(len(beside), np.nan))
            every[name] = Ranged(row.value, high - low, float(np.hypot(*sds)), row.error)
    return every


def repetitions(take: Take, true: Mapping[str, np.ndarray]) -> Iterator[Repeated]:
    """Every two repetitions of an angle, each peak against the highest true value of that repetition. true: (T,) of
    `true_angles`."""
    times, measures = take.need("poses").times, take.figures
    groups = {angle: measures.group(*place.split(".")) for place, angle in _DRIVES.items()}
    groups |= measures.group("repetitions").groups
    for angle, group in groups.items():
        mdc90 = group.value("peak_mdc90")
        if mdc90 is None:
            continue
        at = [true[angle][(times >= start) & (times <= stop)] for start, stop in group.spans]
        peaks = [float(np.max(values)) if len(values) else np.nan for values in at]  # NaN where one is
        both = [(peak, peaks[peak.number or 0]) for peak in group.repetitions("peak")]
        for (row, first), (later, second) in combinations(both, 2):
            if np.isfinite(first + second) and row.error is not None and later.error is not None:
                errors = (row.error, later.error)
                yield Repeated(angle, (row.value, later.value), (first, second), errors, mdc90)
