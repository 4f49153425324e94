"""`pcnet3d opensim`: a finished run as a musculoskeletal model of OpenSim that is scaled to the person and follows the
person's joints by inverse kinematics.

The markers are joint centres, and a body of a model has its origin in the joint that it turns in: the femur in the hip,
the tibia in the knee. So a model's markers are placed at these origins, and no table of skin markers is needed. The big
toe lies on the line from the heel through the joint of the toes, as far from the heel as the person's. Bodies are named
as in gait2392, Rajagopal 2016 and the models of Pose2Sim and OpenCap.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

from ..models.angle_error.joint_noise import JOINTS, shipped_noise
from ..pipeline.core.errors import InputError, needed_for
from ..pipeline.core.messages import how_many
from ..pipeline.core.pose import RootPath, package_version
from ..pipeline.core.take import Take
from ..pipeline.files.atomic import add_to_list, plain, whole_folder, write_json
from ..pipeline.files.digest import sha256
from ..pipeline.files.finished import read_run
from ..pipeline.reading.settings import Force
from ..pipeline.running.progress import each
from ..pipeline.running.sentences import trusted
from .export.markers import OPENSIM, markers, write_motion, write_trc

_FOLDER = "opensim"  # in the run's, by default
_AXIAL = (
    "axial: hip_rotation, arm_rot and pro_sup turn a limb about its own length, which joints tell only while the knee "
    "or the elbow is bent"
)
# The body whose origin is the joint.
_BODIES = {
    f"{side}_{joint}": f"{body}_{side}"
    for side in "rl"
    for joint, body in {
        "hip": "femur", "knee": "tibia", "ankle": "talus", "heel": "calcn",
        "shoulder": "humerus", "elbow": "ulna", "wrist": "hand",
    }.items()
}  # fmt: skip
# In the middle of two joints, as a part of a body.
_MIDDLES = {"pelvis": ("r_hip", "l_hip", "pelvis"), "thorax": ("r_shoulder", "l_shoulder", "torso")}
_TOES = {f"{side}_big_toe": (f"{side}_heel", f"toes_{side}") for side in "rl"}
_LEGS = tuple(f"{side}_{joint}" for side in "rl" for joint in ("hip", "knee", "ankle"))


class Segment(NamedTuple):
    """A length by which bodies are scaled. ends: of both sides their mean; axes: of these bodies, x forward, y along,
    z across."""

    name: str
    ends: tuple[tuple[str, str], ...]
    bodies: tuple[str, ...]
    axes: str


def _of_sides(name: str, near: str, far: str, *bodies: str) -> Segment:
    ends = tuple((f"{side}_{near}", f"{side}_{far}") for side in "rl")
    return Segment(name, ends, tuple(f"{body}_{side}" for body in bodies for side in "rl"), "xyz")


_SEGMENTS = (
    _of_sides("thigh", "hip", "knee", "femur", "patella"),
    _of_sides("shank", "knee", "ankle", "tibia"),
    _of_sides("upper arm", "shoulder", "elbow", "humerus"),
    _of_sides("forearm", "elbow", "wrist", "ulna", "radius"),
    Segment("trunk", (("pelvis", "thorax"),), ("torso",), "xy"),
    Segment("hips", (("r_hip", "l_hip"),), ("pelvis",), "xyz"),
    Segment("shoulders", (("r_shoulder", "l_shoulder"),), ("torso",), "z"),
)
# Degrees, the error of a coordinate by the joints' usual errors, from which on it is as good as guessed: it is then
# left at the model's default, the least certain first. Joints do not tell the pelvis's tilt from the bend of the back.
_GUESSED_DEG = 30.0
_STATURE_M = 1.75  # for the joints' errors, which are shares of it
_STEP = 0.01  # radians or metres
# Radians, of the posture in which that is judged, which is 0 otherwise: bent limbs tell turns about their own length.
_BENT = {f"{name}_{side}": 1.0 for name in ("knee_angle", "elbow_flex") for side in "rl"}
_ROTATIONAL = 1  # OpenSim's Coordinate.MotionType
_ACCURACY = 1e-5  # of the solver, OpenSim's own


@dataclass(frozen=True, eq=False)
class Solved:
    """A model that has followed a take. model: scaled, with its markers (opensim.Model). time_s: (T,). coordinates:
    (T, C) degrees, metres of translations, by `names`. residuals_m: (T, M) from the markers by `markers`; NaN where
    missing. scales: (3,) by body. lengths_m: of the person and the unscaled model, by segment. fixed: names of
    coordinates that no marker tells; they stay at the model's default."""

    model: Any
    time_s: np.ndarray
    names: tuple[str, ...]
    coordinates: np.ndarray
    markers: tuple[str, ...]
    residuals_m: np.ndarray
    scales: Mapping[str, np.ndarray]
    lengths_m: Mapping[str, tuple[float, float]]
    fixed: tuple[str, ...]

    def residuals_by_marker(self) -> list[tuple[str, float, float]]:
        """Of each marker that is ever known its name, and root mean square and largest residual, metres."""
        return [
            (name, float(np.sqrt(np.nanmean(column**2))), float(np.nanmax(column)))
            for name, column in zip(self.markers, self.residuals_m.T, strict=True)
            if np.isfinite(column).any()
        ]


@contextmanager
def opensim() -> Iterator[Any]:
    """The package, which is kept from writing a log into the current folder. InputError where it is not installed, and
    for what it cannot do."""
    with needed_for("Inverse kinematics", "opensim"):
        import opensim as package
    package.Logger.setLevelString("Off")
    package.Logger.removeFileSink()
    try:
        yield package
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise InputError("wrong-content", f"OpenSim could not go on with this model: {reason}") from None


def joint_sd_m() -> dict[str, float]:
    """The usual standard deviation of each joint's place, metres, as lifters err: the modes of
    models/angle_error/joint_noise.json. Heels and toes are as unsure as ankles."""
    shares = np.sqrt(np.square(shipped_noise().modes).sum(axis=(0, 2)))
    ours = {joint: _STATURE_M * float(share) for joint, share in zip(JOINTS, shares, strict=True)}
    return ours | {f"{side}_{part}": ours[f"{side}_ankle"] for side in "rl" for part in ("heel", "big_toe")}


def follow(
    package: Any,
    path: Path,
    joints: np.ndarray,
    names: Iterable[str],
    time_s: np.ndarray,
    mass_kg: float | None,
) -> Solved:
    """The model of a file, scaled to the median lengths of the joints (T, J, 3), metres, x forward, y up, z right, NaN
    where missing, and posed by inverse kinematics in each frame that has a joint.

    mass_kg: of the person; by default the model's. InputError for a file that is no model, and for a model without the
    bodies of both legs.
    """
    model, by_name = _opened(package, path), dict(zip(names, np.moveaxis(joints, 1, 0), strict=True))
    places, sd_m = _places(model, path, by_name), joint_sd_m()
    used = {name: points for name, points in by_name.items() if name in places and name in sd_m}
    scales, lengths_m = _scales(model, places, used)
    for toe in {*_TOES} & {*used}:  # its length is the person's already
        body, inside, at = places[toe]
        places[toe] = body, inside / scales[body], at
    model.updMarkerSet().clearAndDestroy()  # the model's own are of other programs' joints
    for name in used:
        body, inside, _ = places[name]
        model.addMarker(package.Marker(name, model.getBodySet().get(body), _vector(inside)))
    model.finalizeConnections()
    _scale(package, model, scales, mass_kg)
    state = model.initSystem()
    weights = {name: 1 / sd_m[name] ** 2 for name in used}
    fixed = _fix(model, state, weights)
    return Solved(model, *_solved(package, model, used, time_s, weights), scales, lengths_m, fixed)


def _opened(package: Any, path: Path) -> Any:
    if not path.is_file():
        raise InputError(
            "cannot-open", f"Expected a model of OpenSim (.osim) at {path}, found no file there."
        )
    try:
        model = package.Model(str(path))
        model.initSystem()
    except RuntimeError:
        raise InputError(
            "wrong-content",
            f"{path}: expected a model of OpenSim (.osim), and OpenSim cannot read this; open it in OpenSim and "
            "save it again.",
        ) from None
    return model


def _places(
    model: Any, path: Path, joints: Mapping[str, np.ndarray]
) -> dict[str, tuple[str, np.ndarray, np.ndarray]]:
    """By joint the body that holds it, and where it is (3,): in that body, and in the unscaled model's posture. joints:
    the person's (T, 3) by name; big toes have a place only where the heels and the model's toes have one, too."""
    bodies, state = model.getBodySet(), model.initSystem()
    body_names = {bodies.get(i).getName() for i in range(bodies.getSize())}
    if missing := sorted({*(_BODIES[joint] for joint in _LEGS), "pelvis"} - body_names):
        raise InputError(
            "wrong-content",
            f"{path}: expected a model with pelvis, femur, tibia and talus of both sides by these names (gait2392, "
            f"Rajagopal, Pose2Sim, OpenCap), got none named {', '.join(missing)}; give such a model.",
        )
    ground = {
        joint: _array(bodies.get(body).getPositionInGround(state))
        for joint, body in _BODIES.items()
        if body in body_names
    }
    places = {joint: (_BODIES[joint], np.zeros(3), place) for joint, place in ground.items()}
    for joint, (right, left, body) in _MIDDLES.items():
        if {right, left} <= {*ground} and body in body_names:
            middle = (ground[right] + ground[left]) / 2
            inside = _inside(model, state, "", middle, body)
            places[joint] = body, inside, middle
    for toe, (heel, toes) in _TOES.items():
        if {toe, heel} <= {*joints} and heel in places and toes in body_names:
            lengths = np.linalg.norm(joints[toe] - joints[heel], axis=-1)
            if np.isfinite(lengths).any():
                foot, _, at = places[heel]
                along = _inside(model, state, toes, np.zeros(3), foot)
                inside = np.nanmedian(lengths) * along / np.linalg.norm(along)
                places[toe] = foot, inside, at + inside
    return places


def _scales(
    model: Any, places: Mapping[str, Any], joints: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, tuple[float, float]]]:
    """Factors (3,) of every body, and the lengths that they rest on. Bodies with no length of their own, such as head,
    hands and feet, are scaled by the mean of all lengths."""
    lengths: dict[str, tuple[float, float]] = {}
    for segment in _SEGMENTS:
        pairs = [pair for pair in segment.ends if {*pair} <= {*joints}]
        both = [
            (
                float(np.nanmedian(np.linalg.norm(joints[a] - joints[b], axis=-1))),
                float(np.linalg.norm(places[a][2] - places[b][2])),
            )
            for a, b in pairs
            if np.isfinite(joints[a] + joints[b]).all(axis=-1).any()
        ]
        if both:
            person, of_model = np.mean(both, axis=0)
            lengths[segment.name] = float(person), float(of_model)
    if not lengths:
        raise InputError(
            "nothing-usable",
            "Expected two joints of a segment in one frame, got none in any; use another take.",
        )
    mean = sum(person for person, _ in lengths.values()) / sum(other for _, other in lengths.values())
    scales = {body.getName(): np.full(3, mean) for body in model.getBodySet()}
    for segment in _SEGMENTS:
        for body in segment.bodies:
            if segment.name in lengths and body in scales:
                person, of_model = lengths[segment.name]
                scales[body][["xyz".index(axis) for axis in segment.axes]] = person / of_model
    return scales, lengths


def _scale(package: Any, model: Any, scales: Mapping[str, np.ndarray], mass_kg: float | None) -> None:
    state, factors = model.initSystem(), package.ScaleSet()
    for body, factor in scales.items():
        scale = package.Scale()
        scale.setSegmentName(body)
        scale.setScaleFactors(_vector(factor))
        scale.setApply(True)
        factors.cloneAndAppend(scale)
    model.scale(state, factors, True, model.getTotalMass(state) if mass_kg is None else mass_kg)


def _fix(model: Any, state: Any, weights: Mapping[str, float]) -> tuple[str, ...]:
    """Lock the coordinates that the markers, with weights of 1/m2, tell no better than a guess, even of bent limbs;
    returns their names."""
    free = [
        coordinate
        for coordinate in model.getCoordinateSet()
        if not (coordinate.getLocked(state) or coordinate.isDependent(state))
    ]
    for coordinate in free:
        low, high = coordinate.getRangeMin(), coordinate.getRangeMax()
        bent = _BENT.get(coordinate.getName(), 0.0) * (1 if high > -low else -1)
        coordinate.setValue(state, float(np.clip(bent, low, high)), False)

    def where() -> np.ndarray:
        model.realizePosition(state)
        places = [model.getMarkerSet().get(name).getLocationInGround(state) for name in weights]
        return np.concatenate(
            [np.sqrt(weight) * _array(at) for at, weight in zip(places, weights.values(), strict=True)]
        )

    before, columns = where(), []
    for coordinate in free:
        value = coordinate.getValue(state)
        coordinate.setValue(state, value + _STEP, False)
        columns.append((where() - before) / _STEP)
        coordinate.setValue(state, value, False)
    fixed = []
    while True:
        jacobian = np.stack(columns, axis=1)
        # Of a coordinate that no marker tells the least eigenvalue is 0, and its error beyond any bound.
        values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
        sd = np.sqrt((vectors**2 / np.maximum(values, 1e-9)).sum(axis=1))
        worst = int(sd.argmax())
        if np.degrees(sd[worst]) <= _GUESSED_DEG:
            break
        columns.pop(worst)
        fixed.append(free.pop(worst))
    for coordinate in fixed:
        coordinate.setDefaultLocked(True)
    names = {coordinate.getName() for coordinate in fixed}
    return tuple(
        coordinate.getName() for coordinate in model.getCoordinateSet() if coordinate.getName() in names
    )


def _solved(
    package: Any,
    model: Any,
    joints: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    weights: Mapping[str, float],
) -> tuple[np.ndarray, tuple[str, ...], np.ndarray, tuple[str, ...], np.ndarray]:
    """The frames' times, coordinates and residuals, as `Solved` has them."""
    points = np.stack([*joints.values()], axis=1).astype(np.float64)
    rows = np.flatnonzero(np.isfinite(points).all(axis=-1).any(axis=-1))
    points, time_s = points[rows], time_s[rows]
    table, weigh = package.TimeSeriesTableVec3(), package.SetMarkerWeights()
    table.setColumnLabels([*joints])
    for at, row in zip(time_s, points, strict=True):
        table.appendRow(float(at), package.RowVectorVec3([_vector(point) for point in row]))
    for name, weight in weights.items():
        weigh.cloneAndAppend(package.MarkerWeight(name, weight / max(weights.values())))
    state = model.initSystem()
    solver = package.InverseKinematicsSolver(
        model, package.MarkersReference(table, weigh), package.SimTKArrayCoordinateReference()
    )
    solver.setAccuracy(_ACCURACY)
    every = [*model.getCoordinateSet()]
    turns = [coordinate.getMotionType() == _ROTATIONAL for coordinate in every]
    coordinates, residuals = np.empty((len(rows), len(every))), np.full(points.shape[:2], np.nan)
    order = [*joints]
    for i, at in each(enumerate(time_s), "inverse kinematics", len(time_s)):
        state.setTime(float(at))
        (solver.track if i else solver.assemble)(state)
        coordinates[i] = [coordinate.getValue(state) for coordinate in every]
        residuals[i] = [solver.computeCurrentMarkerError(name) for name in order]
    residuals[~np.isfinite(points).all(axis=-1)] = np.nan
    coordinates[:, turns] = np.degrees(coordinates[:, turns])
    return time_s, tuple(coordinate.getName() for coordinate in every), coordinates, tuple(order), residuals


def _inside(model: Any, state: Any, body: str, point: np.ndarray, other: str) -> np.ndarray:
    """(3,) a point of a body, or of the ground (""), in the axes of another body."""
    segment = model.getBodySet().get(body) if body else model.getGround()
    return _array(
        segment.findStationLocationInAnotherFrame(state, _vector(point), model.getBodySet().get(other))
    )


def _vector(values: np.ndarray) -> Any:
    import opensim as package

    return package.Vec3(*map(float, values))


def _array(vector: Any) -> np.ndarray:
    return np.array([vector.get(i) for i in range(3)])


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
