"""Which of several lifters is better for people whom no network saw:  pcnet3d evaluate lifters A.onnx B.onnx -o DIR

Whole validation takes before virtual cameras, and the real take (real_take.py), under three conditions. A person's value
is the mean over frames of each take, then over the person's takes, so that every person has one weight. Networks are
compared person by person.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.errors import InputError
from ...pipeline.files.atomic import read_object, whole_file
from ...pipeline.files.video_frames import shown_size
from ...pipeline.layouts import H36M17
from ...pipeline.messages import how_many
from ...pipeline.motion.angles import angles, near, sides_of
from ...pipeline.motion.visibility import seen_only
from ...pipeline.plugins.protocols import Lifter
from ...pipeline.pose import PoseSequence, package_version
from ...pipeline.reading.take import read_video
from ...pipeline.rotations import is_finite, rotate, transpose
from ...pipeline.running.progress import each
from ..angle_error.take_angles import smoothed
from ..common.metrics import joint_error, plain, procrustes_error, scaled
from ..lifter.features import ray_rotation
from ..lifter.images import ImageLifter
from ..lifter.load import load_lifter
from ..mocap.clips import Clip, data_folder
from ..synthetic.keypoint_noise import Noise
from .real_data import (
    LIMBS,
    MOVING,
    exact_keypoints,
    found_keypoints,
    openpose_keypoints,
    read_cameras,
    read_truth,
)
from .real_take import whole_body
from .sets import EvaluationSet, evaluation_sets
from .tables import Table, page
from .testbed import BEDS, MIN_FRAMES, Bed, see

CONDITIONS = PUBLISHED, FOCAL_KNOWN, EXACT = (
    "noisy keypoints, focal unknown", "noisy keypoints, focal known", "exact keypoints, focal known",
)  # fmt: skip
EXACT_KEYPOINTS = Noise(std=0.0, outliers=0.0, swap_rate=0.0, missing_rate=0.0, absent_rate=0.0)
POSTURES = ("upright", "lying")
REAL = "real take"
FIGURES = {  # of a take, with their units; all but the last are errors
    "MPJPE": "mm", "PA-MPJPE": "mm", "along the ray": "mm", "across the ray": "mm", "constant": "mm",
    "velocity": "mm/s", "knee_flexion": "deg", "elbow_flexion": "deg", "lifted": "%",
}  # fmt: skip
_ANGLES = ("knee_flexion", "elbow_flexion")
_DRAWS = 10_000
_SEED = 0  # of the bootstrap
_BOTH = {"wild and typical": tuple(BEDS)}  # views that are judged together too

# {part: {person: (F,) of FIGURES}}
People = dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class JudgedTake:
    """A take to lift, and its truth.

    inputs: by condition, keypoints in IMAGE and the focal length in pixels, None where it is not told.
    truth: (F, 17, 3) metres, CAMERA axes, of the frames that the keypoints' frame_index counts; joints: those that are
    known. R_camera_from_ray: (F, 3, 3). lying: (F,).
    """

    name: str
    person: str
    inputs: Mapping[str, tuple[PoseSequence, float | None]]
    image_size: tuple[int, int]
    truth: np.ndarray
    R_camera_from_ray: np.ndarray
    lying: np.ndarray
    joints: tuple[str, ...] = H36M17.joints


@dataclass(frozen=True, eq=False)
class Material:
    """Takes that are judged, and kept, together. part: the set's name in tables. views: the cameras' name. key: changes
    when the takes do."""

    part: str
    views: str
    seed: int
    count: int
    key: str

    def takes(self) -> Iterator[JudgedTake]:
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class VirtualTakes(Material):
    clips: tuple[Clip, ...]
    bed: Bed

    @classmethod
    def of(cls, one: EvaluationSet, bed: Bed, seed: int) -> VirtualTakes:
        clips = tuple(clip for clip in one.clips() if len(clip) >= MIN_FRAMES)
        # The shortest take stands for the way in which takes are drawn.
        drawn = see(min(clips, key=len), seed, views=BEDS[bed])
        parts = [drawn.keypoints.joints, drawn.joints_camera]
        for clip in clips:
            parts += [np.frombuffer(clip.name.encode(), np.uint8), clip.joints]
        return cls(one.label, bed, seed, len(clips), _digest(parts), clips, bed)

    def takes(self) -> Iterator[JudgedTake]:
        for clip in self.clips:
            noisy, exact = (
                see(clip, self.seed, noise=noise, views=BEDS[self.bed]) for noise in (None, EXACT_KEYPOINTS)
            )
            yield JudgedTake(
                name=clip.name,
                person=clip.subject,
                inputs={
                    PUBLISHED: (noisy.keypoints, None),
                    FOCAL_KNOWN: (noisy.keypoints, noisy.focal_px),
                    EXACT: (exact.keypoints, noisy.focal_px),
                },
                image_size=noisy.image_size,
                truth=noisy.truth,
                R_camera_from_ray=noisy.R_camera_from_ray,
                lying=noisy.lying,
            )


@dataclass(frozen=True, eq=False)
class RealTakes(Material):
    """The real take, a camera at a time; keypoints as MoveNet finds them in the video, and the true limbs with
    OpenPose's face. Twelve joints are known, which count from the middle of the hips; nobody lies."""

    @classmethod
    def of_data(cls) -> RealTakes:
        folder = data_folder() / "real" / MOVING
        truth = read_truth(folder, list(read_cameras(folder)))
        return cls(
            REAL, "real video", 0, len(truth.openpose), _digest([truth.limbs, *truth.openpose.values()])
        )

    def takes(self) -> Iterator[JudgedTake]:
        folder = data_folder() / "real" / MOVING
        cameras = read_cameras(folder)
        truth = read_truth(folder, list(cameras))
        for name, camera in cameras.items():
            video = read_video(camera.video)
            size, focal = shown_size(video), float(camera.focal_px.mean())
            found = seen_only(found_keypoints(video), size)
            exact = exact_keypoints(
                camera, truth.limbs, openpose_keypoints(truth.openpose[name], video.time_s)
            )
            assert camera.R_camera_from_world is not None
            assert camera.t_m is not None
            hips = truth.limbs[:, [LIMBS.index("r_hip"), LIMBS.index("l_hip")]].mean(axis=1)
            before = rotate(camera.R_camera_from_world, hips) + camera.t_m
            yield JudgedTake(
                name=name,
                person=REAL,
                inputs={PUBLISHED: (found, None), FOCAL_KNOWN: (found, focal), EXACT: (exact, focal)},
                image_size=size,
                truth=rotate(camera.R_camera_from_world, whole_body(truth.limbs)),
                R_camera_from_ray=ray_rotation(before[:, :2] / before[:, 2:]),
                lying=np.zeros(len(truth.limbs), dtype=bool),
                joints=LIMBS,
            )


def lifter_tables(
    names: Sequence[str], kept: Path, seeds: int = 3, only: Sequence[str] = ()
) -> dict[str, Any]:
    """Everything the report says. names: of load_lifter. kept: the folder in which errors are kept by network, so that
    the same work goes on where it was left. only: labels of the parts to judge; all without any.

    {"seeds", "networks": [method], "rows": [{"condition", "views", "posture", "part", "people", "network", FIGURES}],
    "differences": [{"condition", "views", "posture", "people", "networks": [A, B], figure: {"mean", "low", "high"}}],
    "people": {part: [person]}}; the differences are A less B, with a 90 % interval.
    InputError for a network that is no lifter, one that looks at images, one twice, and a part that there is not.
    """
    lifters = opened(names)
    judged = materials(seeds, only)
    values: dict[tuple[str, str, str, str], People] = {}
    for network, posture, condition, views, people in _collected(lifters, judged, kept):
        for group in (views, *(both for both, those in _BOTH.items() if views in those)):
            at = values.setdefault((condition, group, posture, network), {})
            for part, takes in people.items():
                for person, rows in takes.items():
                    at.setdefault(part, {}).setdefault(person, []).extend(rows)  # type: ignore[union-attr]
    weighed = {key: of_people(takes) for key, takes in values.items()}
    return {
        "pcnet3d": package_version(),
        "seeds": seeds,
        "networks": list(lifters),
        "people": {
            part: sorted(people)
            for (condition, _, posture, _), parts in weighed.items()
            if (condition, posture) == (PUBLISHED, POSTURES[0])
            for part, people in parts.items()
        },
        "rows": [row for key, parts in weighed.items() for row in rows_of(key, parts)],
        "differences": [
            {
                "condition": condition, "views": views, "posture": posture, "networks": [one, other],
                **difference(weighed[condition, views, posture, one], weighed[condition, views, posture, other]),
            }
            for condition, views, posture in dict.fromkeys(key[:3] for key in weighed)
            for one, other in combinations(lifters, 2)
        ],
    }  # fmt: skip


def opened(names: Sequence[str]) -> dict[str, Lifter]:
    """{method: lifter}. InputError as of lifter_tables."""
    lifters: dict[str, Lifter] = {}
    for name in names:
        lifter = load_lifter(name)
        if isinstance(lifter, ImageLifter):
            raise InputError(f"{name} looks at images, which motion capture has none of; leave it out.")
        if lifter.method in lifters:
            raise InputError(f"{name} is given twice, as {lifter.method}; give each network once.")
        lifters[lifter.method] = lifter
    return lifters


def materials(seeds: int, only: Sequence[str] = ()) -> list[Material]:
    """Everything to lift: each part before each kind of camera with each seed; then the real take."""
    sets = {one.label: one for one in evaluation_sets("val")}
    labels = (*sets, REAL)
    if unknown := [label for label in only if label not in labels]:
        raise InputError(f"There is no part '{unknown[0]}' of the validation; expected {', '.join(labels)}.")
    wanted = [label for label in labels if label in only or not only]
    found: list[Material] = [
        VirtualTakes.of(sets[label], bed, seed)
        for label in wanted
        if label in sets
        for bed in BEDS
        for seed in range(seeds)
    ]
    return [*found, RealTakes.of_data()] if REAL in wanted else found


def _collected(
    lifters: Mapping[str, Lifter], judged: Sequence[Material], kept: Path
) -> Iterator[tuple[str, str, str, str, dict[str, dict[str, list[np.ndarray]]]]]:
    """(network, posture, condition, views, {part: {person: [(F,) a take]}})."""
    for material in judged:
        for (network, condition), takes in errors_of(lifters, material, kept).items():
            for posture in POSTURES:
                people: dict[str, list[np.ndarray]] = {}
                for take in takes:
                    if take[posture] is not None:
                        people.setdefault(take["person"], []).append(np.array(take[posture], dtype=float))
                yield network, posture, condition, material.views, {material.part: people}


def errors_of(
    lifters: Mapping[str, Lifter], material: Material, kept: Path
) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """{(network, condition): [{"take", "person", posture: (F,) figures, or None without such frames}]}, out of the
    folder where they are kept there, else lifted and kept."""
    stem = f"{material.part}-{material.views}-{material.seed}".replace(" ", "_")
    files = {
        (network, condition): kept / network.rpartition("@")[2] / f"{stem}-{CONDITIONS.index(condition)}.json"
        for network in lifters
        for condition in CONDITIONS
    }
    of = {"key": material.key, "figures": list(FIGURES)}
    found = {}
    for key, path in files.items():
        content = read_object(path)
        if content.get("of") == of:
            found[key] = content["takes"]
    missing = [key for key in files if key not in found]
    if not missing:
        return found
    made: dict[tuple[str, str], list[dict[str, Any]]] = {key: [] for key in missing}
    words = f"{material.part}, {material.views}, seed {material.seed}"
    for take in each(material.takes(), words, material.count):
        for network, condition in missing:
            keypoints, focal_px = take.inputs[condition]
            poses = lifters[network].lift(keypoints, take.image_size, focal_px)
            made[network, condition].append(plain(judge(take, poses)))
    for key, takes in made.items():
        files[key].parent.mkdir(parents=True, exist_ok=True)
        with whole_file(files[key]) as partial:
            partial.write_text(json.dumps({"of": of, "takes": takes}), encoding="utf-8")
    return found | {key: json.loads(json.dumps(takes)) for key, takes in made.items()}


def judge(take: JudgedTake, poses: PoseSequence) -> dict[str, Any]:
    """{"take", "person", posture: [figures], or None without frames of that posture}."""
    frames = poses.frame_index
    lying = take.lying[frames]
    lifted, truth = poses.joints.astype(np.float64), take.truth[frames]
    if take.joints != H36M17.joints:
        lifted = whole_body(lifted[:, H36M17.indices(take.joints)])
    rows = H36M17.indices(take.joints)
    judged = {
        posture: take_figures(lifted, truth, take.R_camera_from_ray[frames], use, poses.times, rows)
        for posture, use in zip(POSTURES, (~lying, lying), strict=True)
        if use.any()
    }
    return {
        "take": take.name, "person": take.person, **{posture: judged.get(posture) for posture in POSTURES}
    }  # fmt: skip


def take_figures(
    lifted: np.ndarray,
    truth: np.ndarray,
    R_camera_from_ray: np.ndarray,
    use: np.ndarray,
    time_s: np.ndarray,
    rows: Sequence[int],
) -> list[float]:
    """FIGURES of the frames (T,) in use of lifted and true joints (T, 17, 3), CAMERA axes, metres and any unit; of the
    joints in `rows`.

    MPJPE and what lies along and across the ray: one scale a frame. constant: how much smaller the MPJPE is when the
    mean error of each joint over the take is taken off it. velocity: mean distance of velocities between neighbouring
    frames, one scale a take. Angles: root mean square, both sides, after the low-pass that runs have.
    """
    there = use & np.asarray(is_finite(lifted[:, rows]).all(axis=1))
    lifted_share = 100 * there.sum() / use.sum()
    if not there.any():
        return [*[np.nan] * (len(FIGURES) - 1), float(lifted_share)]
    one, other = lifted[there][:, rows], truth[there][:, rows]
    off = scaled(one, other) - other
    mpjpe = np.linalg.norm(off, axis=-1).mean()
    in_ray = np.abs(rotate(transpose(R_camera_from_ray[there]), off))
    of_a_take = scaled(one, other, "take")
    next_to = np.diff(np.flatnonzero(there)) == 1
    step_s = np.diff(time_s[there])[next_to]
    speed = np.diff(of_a_take - other, axis=0)[next_to] / step_s[:, None, None]
    bent, true = (angles(smoothed(joints, time_s)) for joints in (lifted, truth))
    figures = [
        1000 * mpjpe,
        1000 * procrustes_error(one, other).mean(),
        1000 * in_ray[..., 2].mean(),
        1000 * np.linalg.norm(in_ray[..., :2], axis=-1).mean(),
        1000 * (mpjpe - joint_error(off, off.mean(axis=0)).mean()),
        1000 * _mean(np.linalg.norm(speed, axis=-1)),
    ]
    for name in _ANGLES:
        error = np.stack([near(bent[side] - true[side], 0.0)[there] for side in sides_of(name)])
        figures.append(_mean(error**2) ** 0.5)
    return [*map(float, figures), float(lifted_share)]


def of_people(takes: Mapping[str, Mapping[str, Sequence[np.ndarray]]]) -> People:
    """The mean over each person's takes."""
    return {
        part: {person: _means(np.stack(rows)) for person, rows in people.items()}
        for part, people in takes.items()
        if people
    }


def rows_of(key: tuple[str, str, str, str], parts: People) -> list[dict[str, Any]]:
    """Means over people, of each part and, where there are several, of all."""
    condition, views, posture, network = key
    groups = {part: list(people.values()) for part, people in parts.items()}
    if len(groups) > 1:
        groups["all"] = [person for people in groups.values() for person in people]
    return [
        {
            "condition": condition, "views": views, "posture": posture, "part": part, "people": len(people),
            "network": network, **dict(zip(FIGURES, _means(np.stack(people)).tolist(), strict=True)),
        }
        for part, people in groups.items()
    ]  # fmt: skip


def difference(one: People, other: People) -> dict[str, Any]:
    """{"people", figure: {"mean", "low", "high"}} of one less other, person by person; low and high hold 90 % of the
    means of people drawn anew from these, NaN of a single one."""
    pairs = [
        people[person] - other[part][person]
        for part, people in one.items()
        for person in people
        if person in other.get(part, {})
    ]
    found: dict[str, Any] = {"people": len(pairs)}
    for figure, values in zip(FIGURES, np.array(pairs).reshape(-1, len(FIGURES)).T, strict=True):
        low, high = interval(values[np.isfinite(values)])
        found[figure] = {"mean": _mean(values), "low": low, "high": high}
    return found


def interval(values: np.ndarray) -> tuple[float, float]:
    """The 5th and 95th percentile of the mean of values (N,) drawn N at a time with replacement (bootstrap); NaN of
    fewer than two."""
    if len(values) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(_SEED).integers(len(values), size=(_DRAWS, len(values)))
    low, high = np.quantile(values[drawn].mean(axis=1), (0.05, 0.95))
    return float(low), float(high)


def as_markdown(results: dict[str, Any]) -> str:
    """The report as a page of tables."""
    people = results["people"]
    many = "; ".join(f"{part} {len(those)}" for part, those in people.items())
    head = ["views", "posture", "part", "people", "network"]
    units = [f"{name.removesuffix('_flexion')}, {unit}" for name, unit in FIGURES.items()]
    tables = [
        Table(
            condition.capitalize(),
            [*head, *units],
            [
                [*(str(row[key]) for key in head), *(f"{row[figure]:.1f}" for figure in FIGURES)]
                for row in results["rows"]
                if row["condition"] == condition
            ],
        )
        for condition in CONDITIONS
    ]
    for one, other in combinations(results["networks"], 2):
        rows = [
            [row["condition"], row["views"], row["posture"], str(row["people"])]
            + [_signed(row[figure]) for figure in FIGURES]
            for row in results["differences"]
            if row["networks"] == [one, other]
        ]
        title = f"{one} less {other}"
        note = "The mean over people and its 90 % interval; negative errors: the first network is better."
        tables.append(Table(title, ["condition", "views", "posture", "people", *units], rows, note))
    return page(
        "Lifters",
        f"pcnet3d {results['pcnet3d']}, {how_many(results['seeds'], 'seed')} of cameras, whole validation takes. Every "
        f"person has one weight; people: {many}. So few people stand for few others: intervals are rather too narrow. "
        "One scale a frame, velocity one a take; angles are RMSE, 6 Hz. Constant: how much smaller the MPJPE is without "
        "each joint's mean error over a take. Whether a network that was trained elsewhere saw these people nobody "
        "knows. The real take: 12 joints from the middle of the hips, one person, no interval, in no other row.",
        tables,
    )


def _signed(found: Mapping[str, float]) -> str:
    if not np.isfinite(found["mean"]):
        return ""
    mean = f"{found['mean']:+.1f}"
    return f"{mean} ({found['low']:+.1f} to {found['high']:+.1f})" if np.isfinite(found["low"]) else mean


def _means(values: np.ndarray) -> np.ndarray:
    """(F,) means of (N, F), missing ones left out."""
    return np.array([_mean(column) for column in values.T])


def _mean(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def _digest(parts: Sequence[np.ndarray]) -> str:
    found = hashlib.sha256()
    for part in parts:
        found.update(np.ascontiguousarray(part).tobytes())
    return found.hexdigest()[:12]
