"""Where a finished take says that the person is, how wrists and ankles move, how large the body is and how long the
lens, each with its error against the truth."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import is_finite, rotate, transpose, unit
from ....pipeline.core.take import Take
from ...common.metrics import SD_90, person_size, scaled
from ..evaluation.acceleration import accelerations, velocities
from ..evaluation.finished import Finished
from ..evaluation.testbed import SeenTake
from .judge import Stated, joined

_QUANTITIES = {"": "position, m", "v": "velocity, m/s", "a": "acceleration, m/s2"}  # by prefix of the columns


def paths(finished: Finished) -> Iterator[Stated]:
    """Everything of lifted poses in metres; motions before a static camera, for one that pans turns them."""
    take, truth = finished.take, finished.truth
    if take is None or take.need("poses").made_by.kind != "estimated":
        return
    rows = take.need("poses").frame_index
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
    it all. rows: (T,) of the truth that the poses have."""
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
                {"distance": np.linalg.norm(path.points, axis=1)},
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
    focal length does to all depths, of which it says how wrong they are beside. rows: (T,) as of `place`."""
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
    rows: (T,) as of `place`."""
    columns = take.need("kinematics")
    true = rotate(transpose(take.need("rectified").R_source_from_level), truth.truth)[rows]
    time_s, upright = truth.keypoints.times[rows], ~truth.lying[rows]
    if not is_finite(true).all():
        return
    signals = {"": true, "v": velocities(true, time_s), "a": accelerations(true, time_s)}
    for part in ("wrist", "ankle"):
        for prefix, quantity in _QUANTITIES.items():
            parts = []
            for joint in (f"r_{part}", f"l_{part}"):
                speed = np.linalg.norm([columns[f"{joint}_v{axis}"] for axis in "xyz"], axis=0)
                for i, axis in enumerate("xyz"):
                    column = f"{joint}_{prefix}{axis}"
                    error = columns[column] - signals[prefix][:, H36M17.index(joint), i]
                    half = SD_90 * columns.get(f"{column}_sd", np.full(len(rows), np.nan))
                    known = {"speed": speed, "stated": half}
                    parts.append(
                        Stated(
                            f"{part} {quantity}", truth.subject, np.where(upright, error, np.nan), half, known
                        )
                    )
            yield joined(parts).judged()
