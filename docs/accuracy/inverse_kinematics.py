"""Angles of lifted takes by inverse kinematics and by the run itself, against those of the motion capture:

    PYTHONPATH=tests python docs/accuracy/inverse_kinematics.py [MODEL.osim]

Two takes of every validation person, the shortest of two seconds and more, before usual cameras; five seconds of each.
The model, a small one of our own without a file, is scaled to the lift and to the capture, each by itself. Printed are
degrees: means over takes of the root mean square of an angle's difference, of both sides.
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

from golden.musculoskeletal import write_small_model
from pcnet3d.models.lab.beds import Configuration, finished
from pcnet3d.models.lab.clips import Clip, person
from pcnet3d.pipeline import Take
from pcnet3d.stages.export.markers import COORDINATES, OPENSIM, markers
from pcnet3d.stages.opensim import Solved, follow, opensim, with_path

OF_A_PERSON, BRIEFEST_S, FRAMES = 2, 2.0, 150


def main(model: Path) -> None:
    asked = Configuration(bed="typical")
    clips: dict[str, list[Clip]] = defaultdict(list)
    for clip in (clip for of in asked.sets for clip in of.clips()):
        if len(clip) >= BRIEFEST_S * clip.fps:
            clips[person(clip) or clip.name].append(clip)
    chosen = {clip.name for of in clips.values() for clip in sorted(of, key=len)[:OF_A_PERSON]}
    apart: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for each in finished(asked, only=lambda clip: clip.name in chosen):
        takes = each.captured(), each.done
        solved = [_followed(take, model) for take in takes]
        for ours, (coordinate, _) in COORDINATES.items():
            if coordinate in solved[0].names and coordinate not in solved[0].fixed:
                own = [take.kinematics[f"{ours}_deg"][:FRAMES] for take in takes]
                by_model = [of.coordinates[:, of.names.index(coordinate)] for of in solved]
                apart[ours[2:]].append((_rms(*by_model), _rms(*own)))
    print(f"{'':<20}{'IK':>8}{'run':>8}  (degrees, {len(chosen)} takes of {len(clips)} people)")
    for angle, differences in apart.items():
        print(f"{angle:<20}" + "".join(f"{each:8.1f}" for each in np.nanmean(differences, axis=0)))


def _followed(take: Take, model: Path) -> Solved:
    points = markers(with_path(take), OPENSIM)
    with opensim() as package:
        return follow(package, model, points.joints[:FRAMES], points.names, points.time_s[:FRAMES], None)


def _rms(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(((second - first + 180) % 360 - 180) ** 2)))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        main(Path(sys.argv[1]) if sys.argv[1:] else write_small_model(Path(folder)))
