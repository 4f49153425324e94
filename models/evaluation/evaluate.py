"""How well lifting and rectification do where the truth is known:  pcnet3d evaluate -o DIR

The lifter on virtual takes of people it never saw, then a rectifier on the lifted takes; on request the lifter
beside other lifters on real clips, where nobody knows the truth. Writes evaluation.md and evaluation.json.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ...pipeline.device import computing_on
from ...pipeline.errors import InputError
from ...pipeline.files.atomic import refuse_unwritable, whole_file
from ...pipeline.frames import IMAGE
from ...pipeline.layouts import H36M17
from ...pipeline.messages import how_many
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.pose import PoseSequence, package_version
from ...pipeline.reading.settings import OnDevice
from ...pipeline.rotations import angle_deg, geodesic_deg, kabsch
from ..common.metrics import Figure, joint_error, plain, procrustes_error, scaled
from ..lifter.builtin import lift
from ..lifter.load import load_lifter
from ..mocap.clips import read_mocap
from ..mocap.split import read_parts
from ..rectifier.load import load_rectifier
from ..synthetic.views import Targets
from .angles import MOTIONS, angle_tables
from .angles import as_markdown as angles_as_markdown
from .gait import as_markdown as gait_as_markdown
from .gait import gait_tables
from .motion import as_markdown as motion_as_markdown
from .motion import motion_tables
from .place import as_markdown as places_as_markdown
from .place import place_tables
from .real_take import as_markdown as real_take_as_markdown
from .real_take import real_take_tables
from .rectifiers import as_markdown as tables_as_markdown
from .rectifiers import own_tables, rectifier_tables
from .sets import Sets, evaluation_sets
from .swaps import as_markdown as swaps_as_markdown
from .swaps import swap_tables
from .takes import as_markdown as takes_as_markdown
from .takes import take_tables
from .testbed import BEDS, Bed, LiftedTake, SeenTake

_DEFAULT = ("geometric", "pcnet")
_POSTURES = ("upright", "lying")


def evaluate(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for evaluation.md and .json.")],
    rectifier: Annotated[
        list[str] | None,
        typer.Option(
            help="A rectifier, or a network's .onnx file; repeatable. Default: geometric; takes, angles, real take: "
            "also pcnet; gait: pcnet."
        ),
    ] = None,
    lifter: Annotated[str, typer.Option(help="pcnet3d (built-in), or an .onnx file.")] = "pcnet3d",
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    bed: Annotated[
        Bed | None,
        typer.Option(
            help="Cameras: wild, steep and tilted with long lenses too, or typical, as people film. Default: wild, of "
            "--place typical; the lifter's figures are of both."
        ),
    ] = None,
    sets: Annotated[
        Sets, typer.Option(help="Whom to judge: test subjects, or those that networks are chosen by.")
    ] = "test",
    flip: Annotated[bool, typer.Option("--flip", help="Average with the mirrored lift.")] = False,
    real: Annotated[
        bool, typer.Option("--real", help="Also compare with other lifters on real clips.")
    ] = False,
    data: Annotated[Path | None, typer.Option(help="Other motion capture, a file of pcnet3d mocap.")] = None,
    split: Annotated[
        Path | None, typer.Option(help="JSON whose `test` says whom of --data to judge.")
    ] = None,
    targets: Annotated[Targets, typer.Option(help="With --data: gravity and heading, or its axes.")] = "body",
    takes: Annotated[
        bool, typer.Option("--takes", help="Judge one gravity per take instead of single frames.")
    ] = False,
    angles: Annotated[
        bool, typer.Option("--angles", help="Judge joint angles and their stated errors.")
    ] = False,
    motion: Annotated[
        bool, typer.Option("--motion", help="Judge accelerations and their stated errors, by smoother.")
    ] = False,
    swaps: Annotated[
        bool, typer.Option("--swaps", help="Judge how exchanged limbs and overturned depth are found.")
    ] = False,
    place: Annotated[
        bool, typer.Option("--place", help="Judge the pelvis's path before the camera and its stated error.")
    ] = False,
    gait: Annotated[
        bool, typer.Option("--gait", help="Judge contacts, steps and gait figures with their stated errors.")
    ] = False,
    real_take: Annotated[
        bool, typer.Option("--real-take", help="Judge everything on real videos of four cameras, with truth.")
    ] = False,
    device: OnDevice = "auto",
) -> None:
    """Judge the lifter and rectifiers, on lifted and on clean poses, against motion capture.

    With --data only the rectifiers are judged, on clean poses of that data. With --takes only they are, on takes of
    one camera that stands still: tilt, stated errors, accelerations, one take from eight cameras. With --angles joint
    angles and their rates are, on the same takes; with --motion accelerations of wrists and ankles, by several
    smoothers, with --real also on real recordings; with --gait walks and runs: contacts, times, lengths, speed. With
    --swaps exchanged limbs and overturned depth are put into takes and looked for. With --place the pelvis path before
    the camera is judged. With --real-take the way from the video to upright joints and angles is judged on a real take
    (real/ of the data).
    """
    refuse_unwritable(output)
    reports = {
        "--takes": takes,
        "--angles": angles,
        "--motion": motion,
        "--swaps": swaps,
        "--place": place,
        "--gait": gait,
        "--real-take": real_take,
    }
    asked = [flag for flag, given in reports.items() if given]
    if len(asked) > 1:
        raise InputError(f"{' and '.join(asked)} are reports of their own; ask for one at a time.")
    if asked and ((real and not motion) or data is not None):
        flags = "--data" if motion else "--real and --data"
        raise InputError(f"{asked[0]} judges takes of the project's own data; leave {flags} out.")
    if (real_take or data is not None) and (bed is not None or sets != "test"):
        raise InputError(
            f"--bed and --sets are about the project's own motion capture, which "
            f"{'--real-take' if real_take else '--data'} does not judge; leave them out."
        )
    if (swaps or place or motion) and rectifier:
        raise InputError(f"{asked[0]} judges no rectifier; leave --rectifier out.")
    if gait and len(rectifier or ()) > 1:
        raise InputError("--gait judges with one rectifier; give --rectifier once.")
    with computing_on(device) as where:
        rectifiers = [
            load_rectifier(name)
            for name in rectifier
            or (_DEFAULT[-1:] if gait else ())
            or _DEFAULT[: 2 if takes or angles or real_take else 1]
        ]
        if data is None and (split is not None or targets != "body"):
            raise InputError("--split and --targets are for --data FILE, a file of pcnet3d mocap.")
        judged = evaluation_sets(sets, bed or ("typical" if place else "wild"))
        if data is None and not real_take:
            for one in judged:
                one.clips()  # a set without takes is refused before the work
        if takes:
            results = take_tables(rectifiers, lifter, seed, flip, judged)
        elif angles:
            results = angle_tables(rectifiers, lifter, seed, flip, judged)
        elif motion:
            results = motion_tables(lifter, seed, flip, judged)
            if real:
                from .real_motion import real_motion

                results["real"] = real_motion(load_rectifier("pcnet"), lifter, flip)
        elif swaps:
            results = swap_tables(lifter, seed, flip, judged)
        elif place:
            results = place_tables(lifter, seed, flip, judged)
        elif gait:
            results = gait_tables(rectifiers[0], lifter, seed, flip, judged)
        elif real_take:
            results = real_take_tables(rectifiers, lifter, flip)
        elif data is not None:
            if real or flip or lifter != "pcnet3d":
                raise InputError(
                    "--real, --flip and --lifter are about the lifter, which --data does not judge."
                )
            results = own_evaluation(rectifiers, data, split, targets, seed)
        else:
            beds = tuple(BEDS) if bed is None else (bed,)
            results = evaluation(rectifiers[0], lifter, seed, flip, sets, beds)
            results["bed"] = judged[0].bed
            results["rectifiers"] = rectifier_tables(rectifiers, seed, lifter, judged, flip)
        if real and not asked:
            from .real_clips import agreement
            from .real_rectified import consistency

            results["real"] = agreement(lifter, flip)
            results["real, rectified"] = consistency(rectifiers, lifter, flip)
        results |= measured(lifter, rectifiers)
    results["device"] = where.summary()
    output.mkdir(parents=True, exist_ok=True)
    pages = {
        "--takes": takes_as_markdown, "--angles": angles_as_markdown, "--motion": motion_as_markdown,
        "--swaps": swaps_as_markdown, "--place": places_as_markdown, "--gait": gait_as_markdown,
        "--real-take": real_take_as_markdown,
    }  # fmt: skip
    page = pages[asked[0]] if asked else as_markdown if data is None else own_as_markdown
    text = page(results)
    with whole_file(output / "evaluation.md") as partial:
        partial.write_text(text, encoding="utf-8")
    with whole_file(output / "evaluation.json") as partial:
        partial.write_text(json.dumps(plain(results), indent=1), encoding="utf-8")
    print(text)


def measured(lifter: str, rectifiers: Sequence[Rectifier]) -> dict[str, Any]:
    """When and of which networks the figures are: {"date": "2026-11-22", "networks": ["NAME@HASH", ...]}."""
    methods = [load_lifter(lifter).method, *(each.method for each in rectifiers)]
    return {"date": date.today().isoformat(), "networks": [name for name in methods if "@" in name]}


def own_evaluation(
    rectifiers: Sequence[Rectifier], data: Path, split: Path | None, targets: Targets, seed: int
) -> dict[str, Any]:
    """The rectifiers on the test subjects of a file of clips, or on everybody without a split."""
    clips = read_parts(data, split, ["test"]).clips["test"] if split else read_mocap(data)
    whom = f"{data.name}, {'test' if split else 'everybody'}"
    return {
        "pcnet3d": package_version(), "data": str(data), "split": str(split or ""), "targets": targets, "seed": seed,
        "subjects": sorted({clip.subject for clip in clips}),
        "rectifiers": own_tables(rectifiers, whom, clips, seed, targets),
    }  # fmt: skip


def evaluation(
    rectifier: Rectifier,
    lifter: str = "pcnet3d",
    seed: int = 0,
    flip: bool = False,
    sets: Sets = "test",
    beds: Sequence[Bed] = tuple(BEDS),
) -> dict[str, Any]:
    """The lifter's figures, and the rectifier's on its takes: {"beds": {bed: {"focal assumed", "focal known": {"SET
    GROUP": {"lifter", "rectifier"}}}}}, the group a posture, or a motion without the rectifier."""
    results: dict[str, Any] = {
        "pcnet3d": package_version(), "lifter": lifter, "rectifier": rectifier.method, "seed": seed, "flip": flip,
        "beds": {},
    }  # fmt: skip
    for bed in beds:
        rows: dict[str, dict[str, Any]] = {"focal assumed": {}, "focal known": {}}
        for key, table in rows.items():
            for one in evaluation_sets(sets, bed):
                takes = list(one.takes(seed, lifter, flip, focal_known=key == "focal known"))
                table |= {f"{one.label} {name}": row for name, row in groups(rectifier, takes).items()}
        results["beds"][bed] = rows
    results["frames_per_s"] = speed(lifter)
    return results


def groups(rectifier: Rectifier, takes: Sequence[LiftedTake]) -> dict[str, dict[str, Any]]:
    """{group: {"lifter": figures, "rectifier": figures of a posture}} of the groups that have frames."""
    rows: dict[str, dict[str, Any]] = {}
    for group in (*_POSTURES, *MOTIONS):
        figures = lifter_figures(takes, group)
        if figures["counts"]["frames"]:
            rows[group] = {"lifter": figures}
            if group in _POSTURES:
                rows[group]["rectifier"] = rectifier_figures(rectifier, takes, group)
    return rows


def in_group(seen: SeenTake, group: str) -> np.ndarray:
    """(T,) the frames that are "upright" or "lying", or upright and of a motion (motion_class)."""
    if group == "lying":
        return seen.lying
    return ~seen.lying if group == "upright" else ~seen.lying & seen.motion[group]


def lifter_figures(takes: Iterable[LiftedTake], group: str) -> dict[str, dict[str, Any]]:
    """Errors in mm (angles in degrees) of the frames of a group.

    "frame": the lift is scaled to the truth frame by frame (as for a lifter without a scale; N-MPJPE, Rhodin et
    al. 2018), and figures run over frames. "take": one scale for a whole take, and figures run over takes.
    Both are in mm of each person's own size. depth, lateral, vertical: mean absolute error along the ray to the
    body, across it and level, and up. hidden rotation: the rigid rotation that would bring the lift closest.
    """
    parts: dict[str, dict[str, list[np.ndarray]]] = {"frame": {}, "take": {}}
    for take in takes:
        use = in_group(take.seen, group)
        if not use.any():
            continue
        truth, lifted = take.seen.truth, take.lifted.joints.astype(np.float64)
        for per, rows in parts.items():
            fitted = scaled(lifted, truth, per)
            errors = {
                "MPJPE": 1000 * joint_error(fitted, truth),
                "PA-MPJPE": 1000 * procrustes_error(lifted, truth),
                **_along(fitted - truth, take),
                "hidden rotation": angle_of(kabsch(truth, lifted)),
            }
            for name, values in errors.items():
                rows.setdefault(name, []).append(values[use])
    frames = np.concatenate(parts["frame"].get("MPJPE", [np.zeros(0)]))
    return {
        "frame": {name: Figure.of(np.concatenate(values)) for name, values in parts["frame"].items()},
        "take": {name: _of_takes(values) for name, values in parts["take"].items()},
        "counts": {
            "frames": len(frames),
            "not lifted": int(np.isnan(frames).sum()),
            "takes": len(parts["take"].get("MPJPE", [])),
        },
    }


def rectifier_figures(rectifier: Rectifier, takes: Iterable[LiftedTake], group: str) -> dict[str, Any]:
    """Geodesic rotation error and tilt error in degrees of R_camera_from_body, on lifted and on true joints."""
    figures: dict[str, Any] = {}
    parts: dict[str, list[np.ndarray]] = {}
    for take in takes:
        use = in_group(take.seen, group)
        if not use.any():
            continue
        for source, joints in (("lifted", take.lifted.joints), ("true", take.seen.truth)):
            R, _ = rectifier.rotation(joints)
            parts.setdefault(f"rotation, {source} joints", []).append(
                geodesic_deg(R, take.seen.R_camera_from_body)[use]
            )
            parts.setdefault(f"tilt, {source} joints", []).append(
                angle_deg(R[..., 2], np.broadcast_to(take.seen.up, R[..., 2].shape))[use]
            )
    for name, values in parts.items():
        figures[name] = Figure.of(np.concatenate(values))
        figures[f"{name}, per take"] = _of_takes(values)
    return figures


def _of_takes(values: list[np.ndarray]) -> Figure:
    return Figure.of(np.array([np.nanmean(v) for v in values if np.isfinite(v).any()]))


def angle_of(R: np.ndarray) -> np.ndarray:
    """Angle of a rotation in degrees, (...,)."""
    return geodesic_deg(R, np.broadcast_to(np.eye(3), R.shape))


def speed(lifter: str = "pcnet3d", frames: int = 6000) -> float:
    """Frames lifted per second of wall time on this machine, features included."""
    rng = np.random.default_rng(0)
    walk = np.cumsum(rng.normal(0, 0.3, (frames, 17, 2)), axis=0) + rng.uniform(300, 700, (17, 2))
    keypoints = PoseSequence(walk, H36M17, IMAGE)
    lift(keypoints, (1920, 1080), model=lifter)
    start = time.perf_counter()
    lift(keypoints, (1920, 1080), model=lifter)
    return frames / (time.perf_counter() - start)


def as_markdown(results: dict[str, Any]) -> str:
    """The report as a page of tables; every cell is p50 / mean / p95."""
    lines = [
        "# Evaluation",
        "",
        f"pcnet3d {results['pcnet3d']}, lifter {results['lifter']}, rectifier {results['rectifier']}, seed "
        f"{results['seed']}, flip {'on' if results['flip'] else 'off'}; {results['frames_per_s']:,.0f} frames/s.",
        "Cells are p50 / mean / p95; mm of each person's own size, degrees.",
    ]
    for bed, tables in results["beds"].items():
        for key, rows in tables.items():
            lines += _lifter_lines(f"{bed} views, {key}", results["rectifier"], rows)
    if "rectifiers" in results:
        lines += ["", f"In the tables that follow, lifted takes are seen from {results['bed']} views."]
        lines += ["", tables_as_markdown(results["rectifiers"])]
    if "real" in results:
        lines += [
            "",
            "## Real clips: how far two lifters are apart",
            "",
            "PA-MPJPE in mm of a standard body.",
            "",
        ]
        lines += [_row(["clip", "one", "other", "apart"]), _row(["---"] * 4)]
        lines += [_row([*row["pair"], str(row["apart"])]) for row in results["real"]]
    if "real, rectified" in results:
        from .real_rectified import as_markdown as rectified_as_markdown

        lines += ["", rectified_as_markdown(results["real, rectified"])]
    return "\n".join(lines) + "\n"


def _lifter_lines(views: str, rectifier: str, rows: dict[str, Any]) -> list[str]:
    """The tables of one bed: rows by set and group."""
    lines = ["", f"## Lifter, {views}", ""]
    for per, what in (
        ("frame", "scale aligned per frame, over frames"),
        ("take", "scale aligned per take, over takes"),
    ):
        names = list(next(iter(rows.values()))["lifter"][per])
        lines += [f"{what}:", "", _row(["", *names]), _row(["---"] * (len(names) + 1))]
        for label, values in rows.items():
            counts = values["lifter"]["counts"]
            label = f"{label} ({counts[f'{per}s']:,} {per}s)"
            lines.append(_row([label, *(str(figure) for figure in values["lifter"][per].values())]))
        lines.append("")
    judged = {label: values["rectifier"] for label, values in rows.items() if "rectifier" in values}
    names = list(next(iter(judged.values())))
    lines += [f"## Rectifier {rectifier} on the lifted takes, {views}", ""]
    lines += [_row(["", *names]), _row(["---"] * (len(names) + 1))]
    return lines + [_row([label, *map(str, figures.values())]) for label, figures in judged.items()]


def own_as_markdown(results: dict[str, Any]) -> str:
    """own_evaluation as a page."""
    subjects = how_many(len(results["subjects"]), "subject")
    about = f"pcnet3d {results['pcnet3d']}, {results['data']}, {subjects}, targets {results['targets']}"
    return f"# Evaluation\n\n{about}, seed {results['seed']}.\n\n" + tables_as_markdown(results["rectifiers"])


def _along(error: np.ndarray, take: LiftedTake) -> dict[str, np.ndarray]:
    """(T,) mean absolute error in mm along the ray to the body, along up made square to it, and across both."""
    depth = take.seen.R_camera_from_ray[..., 2]
    up = take.seen.up - (take.seen.up * depth).sum(-1, keepdims=True) * depth
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    axes = {"depth": depth, "lateral": np.cross(depth, up), "vertical": up}
    return {name: 1000 * np.abs(np.einsum("tji,ti->tj", error, axis)).mean(-1) for name, axis in axes.items()}


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
