"""`pcnet3d opensim`: a finished run as a scaled model of OpenSim and its inverse kinematics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ...models.common.metrics import plain
from ...pipeline.core.messages import how_many
from ...pipeline.core.path import RootPath
from ...pipeline.core.pose import package_version
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import add_to_list, whole_folder, write_json
from ...pipeline.files.digest import sha256
from ...pipeline.files.finished import read_run
from ...pipeline.reading.settings import Force
from ...pipeline.running.sentences import trusted
from ..export.markers import OPENSIM, markers, write_motion, write_trc
from .model import Solved, follow, opensim

_FOLDER = "opensim"  # in the run's, by default
_AXIAL = (
    "axial: hip_rotation, arm_rot and pro_sup turn a limb about its own length, which joints tell only while the knee "
    "or the elbow is bent"
)


def command(
    folder: Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder of a finished run, in metres.")],
    model: Annotated[
        Path,
        typer.Option(
            help="Model to scale, .osim: gait2392, Rajagopal, of Pose2Sim or OpenCap, or named alike."
        ),
    ],
    mass: Annotated[
        float | None,
        typer.Option(min=1, max=500, help="The person's mass in kilograms; by default the model's."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the results; by default `opensim` in RESULTS."),
    ] = None,
    force: Force = False,
) -> None:
    """Scale an OpenSim model to the person of a run, and find its joint angles by inverse kinematics.

    Writes scaled.osim, markers.trc, ik.mot, and how far each marker is from its joint."""
    take = read_run(folder)
    target = folder / _FOLDER if output is None else output
    with opensim() as package, whole_folder(target, force, (folder, model)) as partial:
        solved = solve(take, model, mass)
        write_trc(with_path(take), partial / "markers.trc")
        coordinates = dict(zip(solved.names, solved.coordinates.T, strict=True))
        write_motion(
            with_path(take), partial / "ik.mot", solved.time_s, coordinates, [_AXIAL, *_fixed(solved)]
        )
        solved.model.setName(f"{solved.model.getName()}_scaled")
        solved.model.printToXML(str(partial / "scaled.osim"))
        write_json(partial / "opensim.json", plain(_content(model, package.GetVersion(), solved)))
    if output is None:
        add_to_list(folder, _FOLDER)
    print("\n".join([trusted(take), *_summary(solved)]))
    print(f"results in {target}: {', '.join(sorted(path.name for path in target.iterdir()))}")


def solve(take: Take, model: Path, mass_kg: float | None = None) -> Solved:
    """A take in metres whose filtered joints are known, followed by the model of a file. InputError as `follow` and
    `markers` raise it, and where the package opensim is not installed."""
    with opensim() as package:
        points = markers(with_path(take), OPENSIM)
        return follow(package, model, points.joints, points.names, points.time_s, mass_kg)


def with_path(take: Take) -> Take:
    """The take of a finished run with the smoothed path of its pelvis, which the kinematics hold."""
    columns = [(take.kinematics or {}).get(f"root_{axis}") for axis in "xyz"]
    if take.filtered is None or any(column is None for column in columns):
        return take
    path = np.stack([np.asarray(column, np.float64) for column in columns], axis=-1)
    return take.with_(filtered=take.filtered.with_(path=RootPath(path)))


def _fixed(solved: Solved) -> list[str]:
    """Which coordinates the joints do not tell."""
    names = ", ".join(solved.fixed)
    return [f"not told by the joints, left at the model's default: {names}"] if names else []


def _content(model: Path, version: str, solved: Solved) -> dict[str, Any]:
    """opensim.json."""
    return {
        "pcnet3d": package_version(),
        "opensim": version,
        "model": {"file": model.name, "sha256": sha256(model)},
        "frames": len(solved.time_s),
        "segments_m": {
            name: {"person": person, "model": other} for name, (person, other) in solved.lengths_m.items()
        },
        "scale_factors": {body: factors.tolist() for body, factors in solved.scales.items()},
        "fixed_coordinates": list(solved.fixed),
        "residuals_m": {
            name: {"rms": rms, "max": largest} for name, rms, largest in solved.residuals_by_marker()
        },
    }


def _summary(solved: Solved) -> list[str]:
    every = solved.residuals_m[np.isfinite(solved.residuals_m)]
    worst, rms, _ = max(solved.residuals_by_marker(), key=lambda each: each[1])
    return [
        f"{how_many(len(solved.time_s), 'frame')}; markers {1000 * np.sqrt(np.mean(every**2)):.0f} mm from the joints "
        f"(root mean square), {worst} most, {1000 * rms:.0f} mm",
        *_fixed(solved),
    ]
