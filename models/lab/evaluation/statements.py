"""What a finished take states, each with its error against the truth: of every frame up, BODY's rotation, joints,
angles and their rates, where the person is, how wrists and ankles move, how large the body is, and how long the lens;
and each figure of its measures.

The run's rows name a figure and its error. What is true comes from the bed: the captured feet for walks (gait.py),
captured flights for jumps (jumps.py), the same rows of a run on the captured joints for repeated movements, and the
true angles over the same frames for ranges of motion and for repetitions of an angle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90, Measure, Measures
from ....pipeline.core.rotations import angle_deg, geodesic_deg, is_finite, rotate, transpose, unit
from ....pipeline.signals.angles import ANGLES, FINE, MIDLINE, continuous, near, of_both
from ....pipeline.signals.filters import derivative
from ...angle_error.joint_covariance import levers, turns_of
from ...angle_error.joint_noise import read_noise, shipped_noise
from ...angle_error.posture import FEATURES, arms_of
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import angle_rates, angle_series, smoothed
from ..common.cases import Cases, grouped, joined
from ..common.metrics import scale_of
from .gait import true_gait, walks
from .jumps import compared
from .runs import BINS, Finished
from .testbed import accelerations

Stated = tuple[str, Cases]  # the name of a statement, and what a take has of it
_MEAN_OF_RMS = np.sqrt(np.pi) / 2
_UP_90, _HEADING_90 = 1.712, 2.062  # 90 % over mean of Rayleigh, of half a Gaussian
_PELVIS = H36M17.index("pelvis")
_AWAY = H36M17.indices([name for name in H36M17.joints if name != "pelvis"])  # which is the origin
# Roots of the 90 % quantiles of chi square, three and two degrees of freedom.
_CHI_90, _RAYLEIGH_90 = 2.5003, 2.1460
_QUANTITIES = {"": "position, m", "v": "velocity, m/s", "a": "acceleration, m/s2"}  # by prefix of the columns
_VISIBLE = 0.95  # of the frames of a found range, whose truth is known
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
_MOVEMENTS = {("knee_bends",): "knee bends"} | {
    ("arm_raises", side): "arm raises" for side in ("right", "left")
}
_DRIVES = {"arm_raises.right": "r_shoulder_elevation", "arm_raises.left": "l_shoulder_elevation"}


def statements(run: Finished) -> dict[str, Cases]:
    """Everything that is judged of one take, by name; nothing of one that a run refuses."""
    return together(chain(of_frames(run), of_figures(run)))


def together(stated: Iterable[Stated]) -> dict[str, Cases]:
    """What a take states by name, several of one name, such as both sides, as one; without those of no case."""
    parts = grouped((name, cases) for name, cases in stated if len(cases))
    return {name: joined(of) for name, of in parts.items()}


def of_frames(run: Finished) -> Iterator[Stated]:
    """Everything that is judged of one take's frames. One that is not levelled has joints, where all are known, and a
    place."""
    if run.take is None:
        return
    if run.lifted and is_finite(run.truth.truth).all():
        yield from joints(run)
    if run.levelled:
        yield "up", up(run)
        yield "BODY's rotation", rotation(run)
        if run.lifted and run.take.kinematics:
            yield from angles(run)
    if run.lifted:
        yield from paths(run)


def up(run: Finished) -> Cases:
    """One case a take before a static camera, one a frame before a moving one."""
    rectified = run.done.need("rectified")
    found = np.broadcast_to(rectified.R_source_from_level[..., :, 2], (len(run.rows), 3))
    true = np.broadcast_to(run.truth.up, (len(run.truth.lying), 3))[run.rows]
    error, half = angle_deg(found, true), rectified.up_bound_deg
    if run.static:
        return run.stated(error[:1], half[:1], **run.reached())
    return run.stated(error, half)


def rotation(run: Finished) -> Cases:
    """BODY's rotation."""
    rectified = run.done.need("rectified")
    error = geodesic_deg(rectified.R_source_from_body, run.truth.R_camera_from_body[run.rows])
    of_up = np.minimum(_MEAN_OF_RMS * rectified.up_error_deg, rectified.error_deg)
    half = np.hypot(_UP_90 * of_up, _HEADING_90 * np.sqrt(rectified.error_deg**2 - of_up**2))
    return run.stated(error, half)


def joints(run: Finished) -> Iterator[Stated]:
    """Joints relative to the pelvis, in the camera's axes: the length of their error in standard deviations of their
    covariance; and what it is fitted by, their errors along the ray to the body and across it. None of a take without
    such a covariance."""
    filtered, rectified = run.done.need("filtered"), run.done.need("rectified")
    own, turning = rectified.level.covariance, turns_of(run.done)
    if filtered.covariance is None or own is None or turning is None:
        return
    R = transpose(rectified.R_source_from_level)
    found, true = filtered.joints.astype(np.float64), rotate(R, run.truth.truth[run.rows])
    size = scale_of(found, true, "take").item()
    error = size * found[:, _AWAY] - true[:, _AWAY]
    covariance = size**2 * filtered.covariance[:, _AWAY].astype(np.float64)
    fine = is_finite(covariance.reshape(*error.shape[:2], 9)) & is_finite(error)

    def of_each(values: np.ndarray) -> np.ndarray:
        """Those of the fine joints, of values of frames (T,)."""
        return np.broadcast_to(values[:, None], fine.shape)[fine]

    ray = np.broadcast_to(turning.ray[:, None], error.shape)[fine]
    reach = np.linalg.norm(found[:, _AWAY], axis=-1) / implied_stature(filtered.joints)
    bins = {name: of_each(run.stances[name]) for name in BINS}
    pitch, focal = of_each(turning.pitch), of_each(turning.focal)
    known = {
        "stated": np.sqrt(np.einsum("tjii->tj", covariance))[fine],
        "reach": reach[fine],
        "pitch": pitch,
        "off the axis": focal,
        **bins,
    }
    error, covariance = error[fine], covariance[fine]
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    distance = np.sqrt(np.maximum((solved * error).sum(-1), 0))
    yield "joints", run.stated(distance, np.full(len(distance), _CHI_90), **bins)
    lever = size**2 * levers(filtered.joints, turning.ray)[:, _AWAY][fine]
    own = size**2 * own[:, _AWAY][fine]
    along = (error * ray).sum(-1)
    off = np.sqrt(np.maximum((error**2).sum(-1) - along**2, 0))
    for statement, miss, factor, part in (
        ("joints in depth", along, SD_90, _along),
        ("joints across", off, _RAYLEIGH_90, _across),
    ):
        square = part(lever, ray)
        parts = {"own": part(own, ray), "by focal": square * focal**2, "by pitch": square * pitch**2}
        squares = {name: factor**2 * each for name, each in parts.items()}
        yield statement, run.stated(miss, factor * np.sqrt(part(covariance, ray)), **known, **squares)


def _along(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) the variance of covariances (N, 3, 3) along rays (N, 3)."""
    return np.einsum("ni,nij,nj->n", ray, covariance, ray)


def _across(covariance: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """(N,) that of either axis across."""
    return (np.einsum("nii->n", covariance) - _along(covariance, ray)) / 2


def angles(run: Finished) -> Iterator[Stated]:
    """Every angle and its rate, both sides together; `noise`, `tilt` and `model` are what their errors are made of,
    before their factors (JointNoise.whole, of_rate), the posture what angles' grow with."""
    take, of, rows = run.done, run.stances, run.rows
    noise = shipped_noise() if run.asked.errors is None else read_noise(run.asked.errors)
    plain = replace(noise, factors={}, tilts={}, more={}, postures={})
    parts_of, _, faster = angle_series(
        take.need("poses"), take.need("rectified"), take.need("filtered"), plain
    )
    true_rates = angle_rates(run.true_angles, run.truth.time_s)
    columns = take.need("kinematics")
    for name in ANGLES:
        value, sd = columns[f"{name}_deg"], columns[f"{name}_sd_deg"]
        rate, rate_sd = columns[f"{name}_degps"], columns[f"{name}_sd_degps"]
        true, raw, both = run.true_angles[name], parts_of[name], of_both(name)
        use = (true.reason[rows] == FINE) & (columns[f"{name}_reason"] == FINE) & np.isfinite(raw.noise_deg)
        error = np.where(use, near(value - true.value_deg[rows], 0.0), np.nan)
        known = {"found": value, "stated": sd, "noise": raw.noise_deg, "tilt": raw.tilt_deg}
        known |= {each: of[each] for each in FEATURES} | {"arms": of[arms_of(name)]}
        yield both, run.stated(error, SD_90 * sd, **known)
        error = np.where(use, rate - true_rates[name][0][rows], np.nan)
        model = noise.of_model(name, rate_sd, rate, faster)
        yield (
            f"rate of {both}",
            run.stated(error, SD_90 * rate_sd, rate=np.abs(rate), model=model, faster=faster),
        )


def paths(run: Finished) -> Iterator[Stated]:
    """Everything of lifted poses in metres; motions before a static camera, for one that pans turns them."""
    camera = run.done.need("camera")
    if camera.focal_source != "told":
        off = np.array([1 - run.truth.focal_px / camera.focal_px])
        half = np.array([SD_90 * camera.focal_sd_px / camera.focal_px])
        yield "focal length, %", run.stated(100 * off, 100 * half, **run.reached())
    root = run.done.need("poses").root
    if root is not None:
        yield from place(run)
        for each in run.done.notices:
            if each.code == "placed":
                off = frame_by_frame(root, run.truth.joints_camera[run.rows, _PELVIS])
                half = np.full(len(off), each.values["within"])
                yield "pelvis from frame to frame, m", run.stated(off, half)
    if run.levelled and run.static:
        yield from motions(run)


def place(run: Finished) -> Iterator[Stated]:
    """The pelvis from the camera along the ray to it and across, frame by frame, and the size of the body, which moves
    it all."""
    poses, truth = run.done.need("poses"), run.truth
    path, true = poses.path, truth.joints_camera[run.rows, _PELVIS]
    assert path is not None
    assert path.covariance is not None
    along = unit(true)
    right = unit(np.cross(along, [0.0, 1.0, 0.0]))
    for way, axes in {"along": [along], "across": [right, np.cross(right, along)]}.items():
        for axis in axes:
            sd = np.sqrt(np.einsum("tj,tjk,tk->t", axis, path.covariance, axis))
            off = ((path.points - true) * axis).sum(axis=1)
            yield f"pelvis {way} the ray, m", run.stated(off, SD_90 * sd)
    if path.shared is not None:
        scale = scale_of(poses.joints.astype(np.float64), truth.truth[run.rows], "take").item()
        off, half = np.array([100 * (1 / scale - 1)]), np.array([100 * SD_90 * path.shared[0]])
        yield "body's size, %", run.stated(off, half, **run.reached())


def frame_by_frame(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(T,) metres by which pelvises (T, 3) are off, but for the whole path's size and what the focal length does to all
    depths, of which a run says how wrong they are beside; NaN of frames without one."""
    there = is_finite(found)
    parts = np.stack([found, found * [0.0, 0.0, 1.0]], axis=-1)
    best = np.linalg.lstsq(parts[there].reshape(-1, 2), true[there].ravel(), rcond=None)[0]
    return np.linalg.norm(parts @ best - true, axis=1)


def motions(run: Finished) -> Iterator[Stated]:
    """Positions, velocities and accelerations of wrists and ankles from the pelvis, each axis of LEVEL a case, of
    upright frames. The truth is turned into the LEVEL that was found: how wrong its up is has an error of its own."""
    columns, rows = run.done.need("kinematics"), run.rows
    R = transpose(run.done.need("rectified").R_source_from_level)
    true = rotate(R, run.truth.truth)[rows]
    time_s, upright = run.truth.time_s[rows], ~run.truth.lying[rows]
    if not is_finite(true).all():
        return
    signals = {"": true, "v": derivative(smoothed(true, time_s), time_s), "a": accelerations(true, time_s)}
    for part in ("wrist", "ankle"):
        for prefix, quantity in _QUANTITIES.items():
            for joint in (f"r_{part}", f"l_{part}"):
                for i, axis in enumerate("xyz"):
                    column = f"{joint}_{prefix}{axis}"
                    error = columns[column] - signals[prefix][:, H36M17.index(joint), i]
                    half = SD_90 * columns.get(f"{column}_sd", np.full(len(rows), np.nan))
                    yield f"{part} {quantity}", run.stated(np.where(upright, error, np.nan), half)


def of_figures(run: Finished) -> Iterator[Stated]:
    """Every figure with an error whose truth is known; nothing of a take that a run refuses or cannot level."""
    if not run.levelled:
        return
    every = [(name, of) for name, of in compared(run) if isinstance(of, Cases)]
    if run.static:
        of_walks = dict(walks(run, true_gait(run.truth)))
        every += [(name, of_walks[figure]) for name, figure in _OF_WALKS.items() if figure in of_walks]
    if run.lifted and run.static:
        every += movements(run)
    if run.lifted and run.done.kinematics:
        every += within(run)
    whole = run.reached()
    for name, cases in every:
        yield name, Cases(cases.person, {**whole, **cases.values}).judged()


def movements(run: Finished) -> Iterator[Stated]:
    """Peaks of repetitions that are true ones too, and means where each true one is found, and no other. Of static
    cameras, for nobody knows the true figures of others."""
    if not any(run.done.figures.group(*names).spans for names in _MOVEMENTS):
        return
    true = run.captured().figures
    for names, movement in _MOVEMENTS.items():
        found = run.done.figures.group(*names)
        for figure, row, truth in same_rows(found, true.group(*names)):
            known = {} if row.number is None else run.reached(found.spans[row.number])
            yield f"{movement}: {figure}", run.figure(row.value, truth.value, row.error, **known)


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


class Compared(NamedTuple):
    """A figure in degrees, found and true, and its stated standard deviation. ends: of a range, the standard deviation
    that independent errors of its ends would give it."""

    found: float
    true: float
    error: float
    ends: float = float("nan")

    def less(self, other: Compared) -> tuple[float, float, float]:
        """By how much it is larger, found and true, and the standard deviation that independent errors would give."""
        return self.found - other.found, self.true - other.true, float(np.hypot(self.error, other.error))


class Repeated(NamedTuple):
    """The peaks of two repetitions of an angle in a take, and the stated minimal detectable change."""

    angle: str
    first: Compared
    second: Compared
    mdc90: float


def within(run: Finished) -> Iterator[Stated]:
    """Ranges of motion, right less left, and one repetition less another."""
    every = ranges(run)
    for both in dict.fromkeys(of_both(name) for name in every):
        of = [every[name] for name in (both, f"r_{both}", f"l_{both}") if name in every]
        for side in of:
            yield f"range of {both}", run.figure(side.found, side.true, side.error)
        index = run.done.figures.group("symmetry", both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            right, left = of
            size = (right.found + left.found) / 2  # an index in degrees, for that of small ranges has none
            found, true, _ = right.less(left)
            yield f"right less left range of {both}", run.figure(found, true, index.error / 100 * size)
    for two in repetitions(run):
        found, true, _ = two.first.less(two.second)
        yield "peak less peak", run.figure(float(near(np.array(found - true), 0.0)), 0.0, two.mdc90 / SD_90)


def ranges(run: Finished) -> dict[str, Compared]:
    """Those of each angle that states one with its error; nothing where the truth lacks frames of it."""
    columns, every = run.done.kinematics or {}, {}
    for name in ANGLES:
        row = run.done.figures.group("range_of_motion", name).figure("p05_p95")
        if row is None or row.error is None:
            continue
        values, centre = continuous(columns[f"{name}_deg"], ANGLES[name].centre_deg), ANGLES[name].centre_deg
        visible = np.isfinite(values)
        true = run.true_angles[name].value_deg[run.rows]
        beside = continuous(np.where(visible, true, np.nan), centre)
        if np.isfinite(beside).sum() >= _VISIBLE * visible.sum():
            _, sds = ends(values, columns[f"{name}_sd_deg"])
            (low, high), _ = ends(beside, np.full(len(beside), np.nan))
            every[name] = Compared(row.value, high - low, row.error, float(np.hypot(*sds)))
    return every


def repetitions(run: Finished) -> Iterator[Repeated]:
    """Every two repetitions of an angle, each peak against the highest true value of that repetition."""
    times, measures = run.times, run.done.figures
    groups = {angle: measures.group(*place.split(".")) for place, angle in _DRIVES.items()}
    groups |= measures.group("repetitions").groups
    for angle, group in groups.items():
        mdc90 = group.value("peak_mdc90")
        if mdc90 is None:
            continue
        true = run.true_angles[angle].value_deg[run.rows]
        at = [true[(times >= start) & (times <= stop)] for start, stop in group.spans]
        highest = [float(np.max(values)) if len(values) else np.nan for values in at]  # NaN where one is
        peaks = [
            Compared(peak.value, highest[peak.number or 0], peak.error)
            for peak in group.repetitions("peak")
            if peak.error is not None and np.isfinite(highest[peak.number or 0])
        ]
        yield from (Repeated(angle, first, second, mdc90) for first, second in combinations(peaks, 2))
