"""`pcnet3d compare`: finished runs against each other (two visits, cameras or estimators) or against motion capture."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from ....models.common.metrics import joint_error, plain
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say_all, show
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import add_to_list, whole_folder
from ....pipeline.files.digest import sha256
from ....pipeline.reading.flags import Force
from ....pipeline.reading.settings import OnDevice
from ....pipeline.running.conclusion import point_to
from ....pipeline.signals.angles import ANGLES
from ....pipeline.signals.filters import rate
from ..rates import is_lifted, rates_apart
from .accelerations import accelerations
from .align import AMBIGUOUS, UNUSUAL, WEAK, Alignment, correlated, size_ratio, stamped, turn_deg, turned
from .changes import changes, other_cadence
from .comparison import Comparison, Pair, as_text, figures, result
from .cycles import cycles
from .figures import agreement, view_spread
from .joints import joint_agreement
from .page import as_page
from .recording import COLOURS, write_recording
from .side import Side, load_side, named_apart, one_clock, told_apart, truth_side, unrectified
from .truth import Up, read_truth
from .wrists import lacks_keypoints, wrists

Align = Literal["auto", "stamps", "correlate", "cycles"]
_MOSTLY = 0.9  # of the longer take: two cameras that were started by hand lack a second or two of each other


def compare(
    folders: Annotated[
        list[Path], typer.Argument(help="Finished runs' folders; the first is the reference.")
    ],
    truth: Annotated[
        Path | None,
        typer.Option(help="Motion capture to be the reference: TRC, C3D, BVH, .npz or TotalCapture's."),
    ] = None,
    clip: Annotated[str | None, typer.Option(help="Which clip of a .npz file of several.")] = None,
    up: Annotated[Up | None, typer.Option(help="The motion capture's vertical axis.")] = None,
    unit: Annotated[str | None, typer.Option(help="Its unit of length: m, cm, mm, inch.")] = None,
    rate: Annotated[float | None, typer.Option(help="Its frames a second.")] = None,
    align: Annotated[
        Align,
        typer.Option(
            help="By time stamps, by correlation of the angles, or cycles only (other motions). auto: stamps for runs "
            "of one recording, cycles for other dates, people or cadences, else correlate, and cycles where that "
            "leaves doubts."
        ),
    ] = "auto",
    offset: Annotated[
        float, typer.Option(help="Seconds to add to the time of every run but the reference first.")
    ] = 0.0,
    search: Annotated[
        float, typer.Option(min=0, help="Search window for the time offset, in seconds.")
    ] = 5.0,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the results; `compare` in the first run's."),
    ] = None,
    device: OnDevice = "auto",
    force: Force = False,
) -> None:
    """Compare runs with each other or with motion capture: angles, limits of agreement, cycles, wrist paths."""
    if truth is None and any(given is not None for given in (clip, up, unit, rate)):
        raise InputError("--clip, --up, --unit and --rate are of motion capture; give it with --truth FILE.")
    sides = named_apart([load_side(folder) for folder in folders])
    if truth is not None:
        cutoffs = {side.cutoff_hz for side in sides}
        if len(cutoffs) > 1:
            raise InputError(
                f"Expected runs with one cut-off to compare with motion capture, got "
                f"{', '.join(map(str, cutoffs))} Hz; compare them one by one."
            )
        poses = read_truth(truth, clip, up, unit, rate)
        about = (
            f"{truth.name}{f', clip {clip}' if clip else ''}, {how_many(len(poses), 'frame')}, "
            f"{poses.fps:.4g} a second"
        )
        sides = [truth_side(poses, about, cutoffs.pop()), *sides]
        entry = {"role": "motion capture", "file": truth.name, "sha256": sha256(truth)}
        sides[0] = replace(sides[0], sources=(entry,))
    with computing_on(device) as where:
        found = compared(sides, align, offset, search)
    words = "\n".join([*as_text(found), *(f"warning: {warning}" for warning in found.warnings)])
    target = folders[0] / "compare" if output is None else output
    with whole_folder(target, force, (*folders, *([truth] if truth else []))) as partial:
        content = {
            "pcnet3d": package_version(),
            "what": "comparison",
            **figures(found),
            "device": where.summary(),
        }
        text = json.dumps(plain(content), indent=1, allow_nan=False)
        (partial / "compare.json").write_text(text + "\n", encoding="utf-8")
        (partial / "compare.html").write_text(as_page(found), encoding="utf-8")
        write_recording(found, words, partial / "compare.rrd")
    if output is None:
        add_to_list(folders[0], "compare")
    show("\n".join(as_text(found)))
    say_all("warning", found.warnings)
    show(f"{target}: {', '.join(sorted(file.name for file in target.iterdir()))}")
    for pair in found.pairs:
        print("\n".join(result(pair, found.reference.name)))
    point_to(target)


def compared(
    sides: list[Side],
    align: Align = "auto",
    offset_s: float = 0.0,
    search_s: float = 5.0,
) -> Comparison:
    """Every side against the first, which is motion capture when it has no run. InputError for fewer than two sides, or
    for takes that do not overlap."""
    if not 2 <= len(sides) <= len(COLOURS) + 1:
        raise InputError(
            f"Expected two to {len(COLOURS) + 1} runs, or a run and motion capture (--truth FILE), got {len(sides)}."
        )
    reference, *others = sides
    warnings = [warning for side in sides for warning in side.warnings]
    cutoffs = {side.cutoff_hz for side in sides}
    if len(cutoffs) > 1:
        warnings.append(
            f"The runs were low-passed at different cut-offs ({', '.join(map(str, cutoffs))} Hz)."
        )
    if apart := rates_apart(rate(side.time_s) for side in sides if side.run and is_lifted(side.run)):
        warnings.append(f"The runs were {apart}")
    pairs = []
    for side in others:
        found = changes(side, reference)
        differ = [*told_apart(side, reference), *["cadences"] * other_cadence(found)]
        how, said = _aligned(side, reference, differ, align, offset_s, search_s)
        warnings += said
        pair = _pair(side, reference, how)
        if pair.wrists and side.run and lacks_keypoints(side.run):
            warnings.append(
                f"{side.name} is of a version that kept no 2D keypoints: the wrist figure lacks them; run it again."
            )
        pair = replace(pair, changes=found, one_recording=one_clock(side, reference))
        pairs.append(pair)
        warnings += _beyond(pair, reference)
    spread, without = _spreads(reference, pairs)
    return Comparison(reference, tuple(pairs), spread, without, tuple(warnings))


def _aligned(
    side: Side, reference: Side, differ: list[str], align: Align, offset_s: float, search_s: float
) -> tuple[Alignment | None, list[str]]:
    """How the side's clock is brought to the reference's, None for takes of different motions, and doubts. differ: what
    the two do not have in common, as of motions that are not one."""
    if align == "cycles":
        if reference.run is None:
            raise InputError("Motion capture of another motion tells nothing; give that of the take itself.")
        return None, []
    together = one_clock(side, reference)
    may_differ = align == "auto" and reference.run is not None and not together
    apart = "taken for different motions, so only their ranges and cycles are compared."
    if may_differ and differ:
        return None, [
            f"{side.name} and {reference.name} have different {' and '.join(differ)}: {apart} --align correlate if not."
        ]
    try:
        if align == "stamps" or (align == "auto" and together):
            found = stamped(side, reference, offset_s)
        else:
            found = correlated(side, reference, offset_s, search_s)
    except InputError:
        if not may_differ:
            raise
        tried = f"within {search_s:g} s (--search) of {offset_s:g} s (--offset)"
        return None, [f"{side.name} and {reference.name} share no second by their clocks, {tried}: {apart}"]
    if not found.r >= WEAK:
        weak = f"The angles of {side.name} and {reference.name} correlate weakly (r {found.r:.2f})"
        if may_differ:
            return None, [f"{weak}: {apart}"]
        return found, [f"{weak}: are they of one motion, and is the shift right?"]
    if found.runner_up > AMBIGUOUS * found.r:
        fits = (
            f"Another shift of {side.name} fits about as well (r {found.runner_up:.2f} against {found.r:.2f}), as it "
            "does where a motion repeats itself, in two takes of walking too"
        )
        narrow = "narrow it with --offset and --search"
        if may_differ:
            return None, [
                f"{fits}: {apart} If they are one, {narrow}, or give --align stamps where both began together."
            ]
        return found, [f"{fits}; the one nearest to {offset_s:g} s (--offset) is taken: {narrow}."]
    if found.r < UNUSUAL and not together:
        return found, [
            f"The angles of {side.name} and {reference.name} correlate less (r {found.r:.2f}) than those of one motion "
            f"mostly do (r {UNUSUAL:g} and more): are they of one, and is the shift right?"
        ]
    return found, []


def _beyond(pair: Pair, reference: Side) -> list[str]:
    """A doubt about the measures of one motion, of which one take shows more than the other."""
    if pair.alignment is None or not pair.changes:
        return []
    spans = np.array([times[[0, -1]] for times in (pair.times, reference.time_s)])
    common_s, longest_s = spans[:, 1].min() - spans[:, 0].max(), np.ptp(spans, axis=1).max()
    if common_s >= _MOSTLY * longest_s:
        return []
    return [
        f"{pair.side.name} and {reference.name} have {common_s:.1f} of {longest_s:.1f} s in common: their ranges of "
        "motion, counts and figures of movements are each of its whole take, and may differ for that alone; run both "
        "on the common part (--time-range)."
    ]


def _pair(side: Side, reference: Side, how: Alignment | None) -> Pair:
    if how is None:
        return Pair(
            side, None, side.time_s, {}, {}, {}, cycles(side, reference, None), scale=_scale(side, reference)
        )
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
        wrists=wrists(side, joints) if truth else None,
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
    together = [pair for pair in pairs if pair.alignment is not None]
    if reference.run is None:
        clock, shifts = together[0].side, [pair.alignment.shift_s for pair in together if pair.alignment]
        sides = [pair.side for pair in together]
        times = clock.time_s + shifts[0]
    else:
        sides = [reference, *(pair.side for pair in together)]
        shifts = [0.0, *(pair.alignment.shift_s for pair in together if pair.alignment)]
        times = reference.time_s
    if len(sides) < 2:
        return {}, {}
    bare = [
        replace(side, angles=unrectified(side.run, side.cutoff_hz)) if side.run else side for side in sides
    ]
    spread, without = {}, {}
    for name, angle in ANGLES.items():
        spread[name] = view_spread(
            [s.at(name, times - shift) for s, shift in zip(sides, shifts, strict=True)]
        )
        if angle.needs_gravity and all(s.angles for s in bare):
            without[name] = view_spread(
                [s.at(name, times - shift) for s, shift in zip(bare, shifts, strict=True)]
            )
    return (
        {name: value for name, value in spread.items() if value is not None},
        {name: value for name, value in without.items() if value is not None},
    )
