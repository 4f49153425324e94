"""What a report says in words and tables: the take at a glance, its angles' ranges, and where everything comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...pipeline.motion.angles import ANGLES, FINE, REASONS
from ...pipeline.pose import Rectified, package_version
from ...pipeline.rotations import known
from ...pipeline.take import Take
from ...pipeline.verdict import verdict
from ..drawing.page import box, facts, listed, small, table
from ..record.summary import standing, up_by_source

BOUND = float(np.sqrt(np.log(10)))  # 90 % bound over root mean square of an error in two dimensions
_MOST = 40  # events of one kind
_LONGEST = 240  # characters of an option's value


def at_a_glance(take: Take) -> str:
    """The facts under the title, then what is not to be overlooked."""
    assert take.poses is not None
    assert take.rectified is not None
    poses, rectified = take.poses, take.rectified
    seconds = float(poses.times[-1] - poses.times[0])
    turned = int(known(rectified.R_source_from_body).all(axis=1).sum())
    pairs = [
        ("Take", f"{len(poses)} frames, {seconds:.1f} s at {poses.fps:.4g} a second"),
        ("Rectified by", rectified.method),
        ("Frames rectified", f"{turned} of {len(poses)}"),
        *([] if take.findings is None else [("Poses are", verdict(take.findings))]),
        ("Levelled", "yes" if rectified.level_ok else "no"),
        ("Up is known to within (90 %)", up_bound(rectified)),
        ("Length", "metres" if poses.frame.metric else "no scale: arbitrary units (au)"),
    ]
    not_level = [] if rectified.level_ok else [f"The take could not be levelled: {rectified.level_reason}"]
    doubts = [finding.text for finding in take.findings or () if finding.weight != "note"]
    return (
        facts(pairs)
        + box(f"The poses are {verdict(take.findings or ())}", doubts, "warning")
        + box("Warnings", [*not_level, *_told(take, "warning")], "warning")
        + box("Repairs", _told(take, "repair"))
    )


def up_bound(rectified: Rectified) -> str:
    """The angle that nine in ten takes stay under, in words."""
    bound = rectified.up_bound_deg[np.isfinite(rectified.up_bound_deg)]
    if rectified.camera == "gravity":
        return "the source knows its own up"
    if not rectified.level_ok or not len(bound):
        return "not known"
    least, most = f"{bound.min():.1f}", f"{bound.max():.1f}"
    return f"{most}°" if least == most else f"{least}° to {most}°"


def gravity_words(take: Take) -> str:
    """How the camera stands and what up rests on."""
    assert take.rectified is not None
    rectified = take.rectified
    if rectified.camera == "gravity":
        return small("The source's own axes say which way is up; nothing was estimated.")
    error = rectified.error_deg[np.isfinite(rectified.error_deg)]
    shares = [f"{name} {100 * share:.0f} %" for name, share in rectified.up_shares.items()]
    moves = "moves, and up with it; back and right in LEVEL are relative to it"
    lines = [
        f"The camera {moves if rectified.camera == 'moving' else standing(take)}.",
        f"Up is known to within (90 %): {up_bound(rectified)}.",
        *([f"Up rests on: {', '.join(shares)}."] if shares else []),
        f"Heading of LEVEL: {rectified.level_heading}.",
        *([f"Expected error of a frame's whole rotation: {np.median(error):.1f}° (median)."] if len(error) else []),
    ]  # fmt: skip
    return listed(lines)


def up_table(take: Take) -> str:
    """What each source says about the camera by itself, with its 90 % bound, and how far it pulls the take's up."""
    rows: list[list[str | float | None]] = []
    for name, row in up_by_source(take).items():
        bound = BOUND * row["error_deg"] if "error_deg" in row else None
        own = [_rounded(row.get(f"{angle}_deg"), bound) for angle in ("pitch", "roll")]
        share = f"{100 * row['share']:.0f} %" if "share" in row else "not heard"
        rows.append([name, *own, share, _rounded(row.get("pull_deg"), 1.0)])
    head = ("source of up", "camera's pitch (°)", "camera's roll (°)", "share", "moves up by (°)")
    return table(head, rows) if len(rows) > 1 or take.camera else ""


def _rounded(value: float | None, bound: float | None) -> str | None:
    """A figure to the digits that its 90 % bound leaves."""
    if value is None or bound is None:
        return None
    digits = 0 if bound >= 3 else 1
    return f"{value:.{digits}f}" + (f" ± {bound:.{digits}f}" if bound != 1.0 else "")


def angle_table(columns: Mapping[str, np.ndarray]) -> str:
    """In how many frames each angle is known and how well (medians), and why the others have none. columns: (T,) of the
    take's kinematics."""
    rows: list[list[str | float | None]] = []
    used: set[int] = set()
    for name in ANGLES:
        values = columns.get(f"{name}_deg")
        if values is None:
            continue
        reason = columns.get(f"{name}_reason", np.where(np.isfinite(values), FINE, -1))
        lost = {int(code): int((reason == code).sum()) for code in np.unique(reason) if code != FINE}
        used |= lost.keys()
        why = ", ".join(f"{code}: {count}" if code in REASONS else str(count) for code, count in lost.items())
        fine = values[np.isfinite(values)]
        error = columns.get(f"{name}_sd_deg", np.full(1, np.nan))
        error = error[np.isfinite(error)]
        share = f"{100 * len(fine) / len(values):.0f} %"
        median = float(np.median(fine)) if len(fine) else None
        stated = float(np.median(error)) if len(error) else None
        rows.append([spoken(name), share, median, stated, why or "–"])
    if not rows:
        return ""
    reasons = "; ".join(f"{code}: {REASONS[code]}" for code in sorted(used & REASONS.keys()))
    head = (
        "angle",
        "frames with a value",
        "median (°)",
        "stated standard deviation (°)",
        "frames without, by reason",
    )
    return table(head, rows) + (small(f"Reasons: {reasons}.") if reasons else "")


def spoken(name: str) -> str:
    """A name of the data in words: `r_knee_flexion` is "right knee flexion"."""
    side = {"r_": "right ", "l_": "left "}.get(name[:2], "")
    return side + (name[2:] if side else name).replace("_", " ")


def provenance(take: Take) -> str:
    """What was read and what was done to it: files by their SHA-256, versions, options."""
    assert take.poses is not None
    poses = take.poses
    keys = ("role", "file", "adapter", "sha256")
    files = [tuple(str(entry.get(key, "–")) for key in keys) for entry in take.inputs]
    about = [
        f"pcnet3d {package_version()}.",
        f"Poses: video frames {poses.frame_index[0]} to {poses.frame_index[-1]}, person {poses.person}.",
        f"Axes that the poses came in: {poses.frame}.",
    ]
    if take.video is not None:
        video = take.video
        about.append(
            f"Video: {video.width} x {video.height} pixels, {len(video.time_s)} frames at {video.fps:.4g} a second, "
            f"{video.codec}" + (f", turned by {video.rotation_deg}°." if video.rotation_deg else ".")
        )
    if poses.seams:
        times = ", ".join(f"{poses.times[seam]:.2f}" for seam in poses.seams[:_MOST])
        about.append(
            f"Seams, where the estimator began anew, at {times}{' ...' if len(poses.seams) > _MOST else ''} s."
        )
    done = (take.filtered or take.rectified.level if take.rectified else poses).history
    steps = [(step.name, step.version, _options(step.options)) for step in done]
    return (
        listed(about)
        + table(("input", "file", "read as", "SHA-256"), files)
        + box("Notes", _told(take, "note"))
        + table(("step", "version", "options and counts"), steps)
    )


def _told(take: Take, kind: str) -> list[str]:
    texts = [event.text for event in take.events if event.kind == kind]
    more = len(texts) - _MOST
    return [*texts[:_MOST], f"and {more} more, in summary.json"] if more > 0 else texts


def _options(options: Mapping[str, Any]) -> str:
    said = ", ".join(
        f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in options.items()
    )
    return said if len(said) <= _LONGEST else f"{said[:_LONGEST]}…"
