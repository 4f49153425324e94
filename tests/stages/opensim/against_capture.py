"""Inverse kinematics and our own angles of lifted takes, against those of the motion capture that was filmed.

    pcnet3d lab testbed val --bed typical --keypoints -o TAKES
    PYTHONPATH=tests python tests/stages/opensim/against_capture.py TAKES MODEL.osim [HOW_MANY]

Each take is run from its keypoints, and its motion capture as it is; the model is scaled to each by itself. Printed are
errors in degrees, means over takes of each take's root mean square.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import pcnet3d
from pcnet3d.pipeline import H36M17, Z_UP, Pipeline, PoseSequence, Take
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.export.markers import COORDINATES
from pcnet3d.stages.opensim.command import solve
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

FRAMES = 150  # of each take


def main(folder: Path, model: Path, count: int) -> None:
    errors: dict[str, list[tuple[float, float]]] = {}
    paths = sorted(folder.glob("*.npz"))
    for path in paths[:: max(1, len(paths) // count)][:count]:
        with np.load(path) as arrays:
            of = {name: arrays[name] for name in arrays.files}
        fps, rows = float(of["fps"]), slice(0, FRAMES)
        stature = 1.75  # of every body, which is scaled below
        truth = of["joints"][rows]
        capture = PoseSequence(truth, H36M17, Z_UP, time_s=np.arange(len(truth)) / fps)
        captured = Pipeline((Rectify("geometric"), Trajectories(smoother="none"), Angles()))(
            Take("capture", poses=capture)
        )
        points = np.concatenate([of["keypoints"], of["confidence"][..., None]], axis=-1)[rows]
        keypoints = PoseSequence(
            points[..., :2],
            H36M17,
            pcnet3d.IMAGE,
            confidence=points[..., 2],
            time_s=np.arange(len(points)) / fps,
        )
        lifted = pcnet3d.process(
            keypoints=keypoints,
            stature=stature,
            settings={"read.image_size": tuple(map(int, of["image_size"]))},
        )
        both = solve(captured, model), solve(lifted, model)
        for ours, (coordinate, _) in COORDINATES.items():
            if coordinate in both[0].names and coordinate not in both[0].fixed:
                theirs = [each.coordinates[:, each.names.index(coordinate)] for each in both]
                own = [take.kinematics[f"{ours}_deg"] for take in (captured, lifted)]
                pair = tuple(_rms(second - first) for first, second in (own, theirs))
                errors.setdefault(ours.split("_", 1)[1], []).append(pair)
        print(path.name, flush=True)
    print(f"{'':<20}{'own angle':>12}{'IK':>8}  (degrees, {count} takes)")
    for name, pairs in errors.items():
        own, theirs = np.nanmean(pairs, axis=0)
        print(f"{name:<20}{own:>12.1f}{theirs:>8.1f}")


def _rms(apart: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(((apart + 180) % 360 - 180) ** 2)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int((sys.argv[3:] or ["6"])[0]))
