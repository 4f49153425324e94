"""`pcnet3d compare`: finished runs against each other (two visits, cameras or estimators) or against motion capture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from ....models import load_rectifier
from ....models.common.metrics import joint_error, plain
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say_all, show
from ....pipeline.core.notices import Notice, grave, notice, verdict
from ....pipeline.core.pose import package_version
from ....pipeline.core.rotations import turn_deg, turned
from ....pipeline.files.atomic import add_to_list, whole_folder, write_json
from ....pipeline.files.digest import sha256
from ....pipeline.files.finished import read_run
from ....pipeline.plugins.options import pairs
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.flags import Force
from ....pipeline.reading.settings import OnDevice
from ....pipeline.running.conclusion import point_to
from ....pipeline.signals.angles import ANGLES
from ....pipeline.signals.filters import CUTOFF_HZ
from ....pipeline.signals.filters import rate as frame_rate
from ....pipeline.signals.imu import MOST_HZ
from ....pipeline.signals.rates import check_fps
from ..rates import is_lifted, rates_apart
from .accelerations import accelerations
from .align import AMBIGUOUS, CLEARLY, UNUSUAL, WEAK, Alignment, correlated, mirrored, size_ratio, stamped
from .changes import changes, from_same_place, other_cadence
from .comparison import Comparison, Pair, as_text, figures, result
from .cycles import cycles
from .figures import agreement, joint_agreement, view_spread
from .imu import as_page as sensors_page
from .imu import compared_with, read_sensors
from .page import as_page
from .recording import COLOURS, write_recording
from .side import Side, load_side, named_apart, one_clock, told_apart, truth_side, unrectified, with_trunk_of
from .truth import Up, read_truth
from .wrists import has_wrists, wrists

Align = Literal["auto", "stamps", "correlate", "cycles"]
_MOSTLY = 0.9  # of the longer take: two cameras that were started by hand lack a second or two of each other


def compare(
    folders: Annotated[
        list[Path], typer.Argument(help="Folders of finished runs; the first is the reference.")
    ],
    truth: Annotated[
        Path | None,
        typer.Option(help="Motion capture to use as the reference: TRC, C3D, BVH, .npz or FreeMoCap."),
    ] = None,
    clip: Annotated[str | None, typer.Option(help="Which clip, if the .npz file holds several.")] = None,
    up: Annotated[Up | None, typer.Option(help="Vertical axis of the motion capture.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the motion capture: m, cm, mm or inch.")] = None,
    rate: Annotated[
        float | None,
        typer.Option(help="Frames per second of the motion capture, or samples per second of the sensors."),
    ] = None,
    imu: Annotated[
        list[Path] | None,
        typer.Option(
            help="File of an inertial sensor, to compare one run with its accelerations; repeatable."
        ),
    ] = None,
    segment: Annotated[
        list[str] | None,
        typer.Option(help="Body segment of each --imu, such as r_forearm; that of pelvis is subtracted."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-O", help="Option KEY=VALUE for reading --imu; repeatable."),
    ] = None,
    align: Annotated[
        Align,
        typer.Option(
            help="How to match the runs in time: by time stamps, by correlating the angles, or by cycles only "
            "(different movements). auto uses stamps for runs of one recording, cycles if date, person or "
            "cadence differ or the correlation is doubtful, and correlate otherwise."
        ),
    ] = "auto",
    offset: Annotated[
        float, typer.Option(help="Seconds to add to the times of all runs except the reference.")
    ] = 0.0,
    search: Annotated[
        float, typer.Option(min=0, help="Largest time offset to search for, in seconds.")
    ] = 5.0,
    rectifier: Annotated[
        list[str] | None,
        typer.Option(
            help="With --truth, also compare the wrists of this rectifier, frame by frame: a name or .onnx file; "
            "repeatable."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for the results; by default `compare` in the folder of the first run.",
        ),
    ] = None,
    device: OnDevice = "auto",
    force: Force = False,
) -> None:
    """Compare runs with each other or with motion capture: angles, limits of agreement, cycles and wrist paths.

    Or one run with inertial sensors: lag, correlation and error of the accelerations."""
    if imu:
        others = (truth, clip, up, unit, rectifier)
        if len(folders) > 1 or align != "auto" or any(given is not None for given in others):
            raise InputError(
                "option-conflict",
                "--imu compares one run with sensors; leave the other runs, --truth, --align and --rectifier out.",
            )
        _with_sensors(folders[0], imu, segment or [], rate, pairs(option), offset, search, output, force)
        return
    if segment or option:
        raise InputError(
            "option-conflict", "--segment and --option are for sensors; give them with --imu FILE."
        )
    if truth is None and any(given is not None for given in (clip, up, unit, rate, rectifier)):
        raise InputError(
            "option-conflict",
            "--clip, --up, --unit, --rate and --rectifier need motion capture; give it with --truth FILE.",
        )
    sides = named_apart([load_side(folder) for folder in folders])
    if truth is not None:
        cutoffs = {side.cutoff_hz for side in sides}
        if len(cutoffs) > 1:
            raise InputError(
                "files-apart",
                f"Expected runs with one cut-off to compare with motion capture, got "
                f"{', '.join(map(str, cutoffs))} Hz; compare them one by one.",
            )
        poses = read_truth(truth, clip, up, unit, rate)
        about = (
            f"{truth.name}{f', clip {clip}' if clip else ''}, {how_many(len(poses), 'frame')}, "
            f"{poses.fps:.4g} a second"
        )
        sides = [truth_side(poses, about, cutoffs.pop()), *sides]
        entry = {"role": "motion capture", "file": truth.name, "sha256": sha256(truth)}
        sides[0] = replace(sides[0], sources=(entry,))
        sides[1:] = [with_trunk_of(side, sides[0]) for side in sides[1:]]
    with computing_on(device) as where:
        others = [load_rectifier(name) for name in rectifier or ()]
        found = compared(sides, align, offset, search, others)
    words = "\n".join([*as_text(found), *(f"warning: {each.text}" for each in found.notices)])
    target = folders[0] / "compare" if output is None else output
    with whole_folder(target, force, (*folders, *([truth] if truth else []))) as partial:
        content = {
            "pcnet3d": package_version(),
            "what": "comparison",
            **figures(found),
            "device": where.summary(),
        }
        write_json(partial / "compare.json", plain(content))
        (partial / "compare.html").write_text(as_page(found), encoding="utf-8")
        write_recording(found, words, partial / "compare.rrd")
    if output is None:
        add_to_list(folders[0], "compare")
    show("\n".join(as_text(found)))
    say_all("warning", [each.text for each in found.notices])
    show(f"{target}: {', '.join(sorted(file.name for file in target.iterdir()))}")
    for pair in found.pairs:
        print("\n".join(result(pair)))
    point_to(target)


def _with_sensors(
    folder: Path,
    files: list[Path],
    segments: list[str],
    rate_hz: float | None,
    options: dict[str, str],
    offset_s: float,
    search_s: float,
    output: Path | None,
    force: bool,
) -> None:
    """A run's folder against the sensors in files."""
    run = read_run(folder)
    if rate_hz is not None:
        check_fps(rate_hz, "--rate", MOST_HZ)
    given = options | ({} if rate_hz is None else {"rate_hz": rate_hz})
    found = compared_with(run, read_sensors(files, segments, given, offset_s), search_s)
    content = {
        "pcnet3d": package_version(),
        "what": "comparison with inertial sensors",
        "take": run.name,
        "inputs": [{"file": file.name, "sha256": sha256(file)} for file in files],
        "cutoff_hz": CUTOFF_HZ,
        "offset_s": offset_s,
        "search_s": search_s,
        "sensors": [felt.figures() for felt in found],
    }
    target = folder / "compare" if output is None else output
    with whole_folder(target, force, (folder, *files)) as partial:
        write_json(partial / "compare.json", plain(content))
        (partial / "compare.html").write_text(sensors_page(run.name, found), encoding="utf-8")
    if output is None:
        add_to_list(folder, "compare")
    say_all("warning", [each.text for felt in found for each in felt.notices])
    show(f"{target}: {', '.join(sorted(file.name for file in target.iterdir()))}")
    print("\n".join(map(str, found)))
    point_to(target)


def compared(
    sides: list[Side],
    align: Align = "auto",
    offset_s: float = 0.0,
    search_s: float = 5.0,
    rectifiers: Sequence[Rectifier] = (),
) -> Comparison:
    """Every side against the first, which is motion capture when it has no run. rectifiers: as of wrists.
    InputError for fewer than two sides, or for takes that do not overlap."""
    if not 2 <= len(sides) <= len(COLOURS) + 1:
        raise InputError(
            "needs-input",
            f"Expected two to {len(COLOURS) + 1} runs, or a run and motion capture (--truth FILE), got {len(sides)}.",
        )
    reference, *others = sides
    notices = [each for side in sides for each in side.notices]
    from_neutral = [side.name for side in sides if side.run and side.run.told.neutral is not None]
    if 0 < len(from_neutral) < len(sides):
        without = ", ".join(side.name for side in sides if side.name not in from_neutral)
        notices.append(notice("neutral-of-some", with_neutral=", ".join(from_neutral), without=without))
    cutoffs = {"none" if side.cutoff_hz is None else f"{side.cutoff_hz:g} Hz" for side in sides}
    if len(cutoffs) > 1:
        notices.append(notice("cutoffs-differ", cutoffs=", ".join(sorted(cutoffs))))
    notices += rates_apart(
        "runs", (frame_rate(side.time_s) for side in sides if side.run and is_lifted(side.run))
    )
    pairs = []
    doubts = {side.name: grave(side.run.judged) for side in sides if side.run}
    notices += [
        notice("run-doubtful", run=name, verdict=verdict(found), why=found[0].text.rstrip("."))
        for name, found in doubts.items()
        if found
    ]
    for side in others:
        near = from_same_place(side, reference)
        found = changes(side, reference, near)
        if doubts.get(side.name) or doubts.get(reference.name):  # whose errors do not hold
            found = [change._replace(differs=None) for change in found]
        differ = [*told_apart(side, reference), *["cadences"] * other_cadence(side, reference)]
        how, said = _aligned(side, reference, differ, align, offset_s, search_s)
        pair = replace(_pair(side, reference, how, rectifiers), changes=found, same_place=near)
        pairs.append(pair)
        notices += said
        notices += _beyond(pair)
    spread, without = _spreads(reference, pairs)
    return Comparison(reference, tuple(pairs), spread, without, tuple(notices))


def _aligned(
    side: Side, reference: Side, differ: list[str], align: Align, offset_s: float, search_s: float
) -> tuple[Alignment | None, list[Notice]]:
    """How the side's clock is brought to the reference's, None for takes of different motions, and doubts. differ: what
    the two do not have in common, as of motions that are not one."""
    if align == "cycles":
        if reference.run is None:
            raise InputError(
                "files-apart",
                "Motion capture of another motion is no reference; give that of the take itself.",
            )
        return None, []
    together = one_clock(side, reference)
    may_differ = align == "auto" and reference.run is not None and not together
    both: dict[str, Any] = {"run": side.name, "other": reference.name}
    if may_differ and differ:
        return None, [notice("told-apart", **both, what=" and ".join(differ))]

    def aligned(of: Side) -> Alignment:
        if align == "stamps" or (align == "auto" and together):
            return stamped(of, reference, offset_s)
        return correlated(of, reference, offset_s, search_s)

    try:
        how = aligned(side)
    except InputError:
        if not may_differ:
            raise
        return None, [notice("no-common-time", **both, search_s=search_s, offset_s=offset_s)]
    doubts = []
    with suppress(InputError):  # where one side of the body alone is known
        if (of_image := aligned(mirrored(side)).r) > UNUSUAL and of_image > how.r + CLEARLY:
            doubts = [notice("mirror-images", **both, r=how.r, of_image=of_image)]
    if not how.r >= (UNUSUAL if may_differ else WEAK):
        said = notice("angles-apart" if may_differ else "angles-weak", **both, r=how.r)
    elif how.runner_up > AMBIGUOUS * how.r:
        code = "shift-unknown" if may_differ else "shift-ambiguous"
        said = notice(code, run=side.name, r=how.r, runner_up=how.runner_up, offset_s=offset_s)
    elif how.r < UNUSUAL and not together:
        return how, [notice("angles-unusual", **both, r=how.r, usual=UNUSUAL), *doubts]
    else:
        return how, doubts
    return None if may_differ else how, [said, *doubts]


def _beyond(pair: Pair) -> list[Notice]:
    """A doubt about the measures of one motion, of which one take shows more than the other."""
    if pair.alignment is None or not pair.changes:
        return []
    spans = np.array([times[[0, -1]] for times in (pair.times, pair.reference.time_s)])
    common_s, longest_s = spans[:, 1].min() - spans[:, 0].max(), np.ptp(spans, axis=1).max()
    if common_s >= _MOSTLY * longest_s:
        return []
    both: dict[str, Any] = {"run": pair.side.name, "other": pair.reference.name}
    return [notice("partly-common", **both, common_s=float(common_s), longest_s=float(longest_s))]


def _pair(side: Side, reference: Side, how: Alignment | None, rectifiers: Sequence[Rectifier]) -> Pair:
    clock = one_clock(side, reference)
    if how is None:
        cut, scale = cycles(side, reference, None), _scale(side, reference)
        return Pair(side, reference, None, side.time_s, {}, {}, {}, cut, scale=scale, one_recording=clock)
    times = side.time_s + how.shift_s
    at_reference = {name: reference.at(name, times) for name in ANGLES}
    sd = {name: _sd(side, reference, name, times) for name in ANGLES}
    agreements = {name: agreement(side.angles[name], at_reference[name], sd[name]) for name in ANGLES}
    joints = reference.joints_at(times)
    turn, scale = turn_deg(side.level, joints), size_ratio(side.level, joints)
    level = scale * turned(side.level, turn)
    off = joint_error(level, joints)
    metres = reference.metric and np.isfinite(off).any()
    factor = 1.0 if side.metric and reference.metric else scale
    truth = reference.run is None
    return Pair(
        side=side,
        reference=reference,
        one_recording=clock,
        alignment=how,
        times=times,
        at_reference=at_reference,
        sd=sd,
        agreement={name: of for name, of in agreements.items() if of is not None},
        cycles=cycles(side, reference, how.shift_s),
        turn_deg=turn,
        scale=scale,
        joints_mm=float(1000 * np.nanmean(off)) if metres else None,
        joints=joint_agreement(level, joints, reference.metric),
        wrists=wrists(side, joints, rectifiers) if truth and has_wrists(joints) else None,
        accelerations=None if truth else accelerations(side, reference, times, factor),
    )


def _sd(side: Side, reference: Side, name: str, times: np.ndarray) -> np.ndarray:
    """(T,) standard error of the difference of an angle: of both runs together; motion capture has none."""
    if reference.run is None:
        return side.sd[name]
    row = np.clip(np.searchsorted(reference.time_s, times), 0, len(reference.time_s) - 1)
    return np.hypot(side.sd[name], reference.sd[name][row])


def _scale(side: Side, reference: Side) -> float:
    """1 where both have metres, else what makes both persons as large, on average over their takes."""
    if side.metric and reference.metric:
        return 1.0
    sizes = [np.sqrt(np.nanmean((each.level**2).sum(axis=-1))) for each in (reference, side)]
    return float(sizes[0] / sizes[1])


def _spreads(reference: Side, pairs: list[Pair]) -> tuple[dict[str, float], dict[str, float]]:
    """View-consistency by angle of all runs that show one motion, as they are and as if their cameras were level."""
    shifts = [(pair.side, pair.alignment.shift_s) for pair in pairs if pair.alignment]
    if reference.run:
        shifts.insert(0, (reference, 0.0))
    if len(shifts) < 2:
        return {}, {}
    times = shifts[0][0].time_s + shifts[0][1]

    def spread(sides: list[Side], names: Iterable[str]) -> dict[str, float]:
        series = {
            name: [side.at(name, times - shift) for side, (_, shift) in zip(sides, shifts, strict=True)]
            for name in names
        }
        values = {name: view_spread(of) for name, of in series.items()}
        return {name: value for name, value in values.items() if value is not None}

    sides = [side for side, _ in shifts]
    bare = [replace(side, angles=unrectified(side.run, side.cutoff_hz)) for side in sides if side.run]
    to_gravity = [name for name, angle in ANGLES.items() if angle.needs_gravity]
    return spread(sides, ANGLES), spread(bare, to_gravity) if all(side.angles for side in bare) else {}
