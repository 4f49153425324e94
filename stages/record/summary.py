"""What the recording says about the take in words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.camera import pitch_roll_deg
from ...pipeline.pose import Rectified, Step
from ...pipeline.take import Take
from ...pipeline.verdict import verdict_words
from .up import shared_up


def summary_markdown(take: Take) -> str:
    """The take's summary: warnings first, then how it was rectified, what it is, and what was done to it."""
    assert take.poses is not None
    assert take.rectified is not None
    poses, rectified = take.poses, take.rectified
    error = rectified.error_deg[np.isfinite(rectified.error_deg)]
    lines = [
        f"### {take.name}",
        *_told(take, "warning", "#### ⚠ Warnings"),
        *([] if take.findings is None else [f"**Verdict: {verdict_words(take.findings)}.**"]),
        "#### Rectification",
        f"- method: {rectified.method}",
        f"- levelled: {'yes' if rectified.level_ok else f'**no: {rectified.level_reason}**'}",
        *_up(take),
        f"- heading of LEVEL: {rectified.level_heading}",
        f"- expected rotation error: {f'{np.median(error):.1f} deg (median)' if len(error) else 'not known'}",
        f"- axes of BODY and LEVEL: x back, y right, z up{_relative(rectified)}",
        "#### Take",
        f"- {len(poses)} frames, {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.fps:.4g} a second",
        f"- source axes: {poses.frame}",
        f"- unit of length: {poses.frame.unit if poses.frame.metric else 'arbitrary, the source has no scale'}",
        *_told(take, "repair", "#### Repairs"),
        *_told(take, "note", "#### Notes"),
        *(["#### Inputs"] if take.inputs else []),
        *(f"- {_listed(entry)}" for entry in take.inputs),
        "#### Done to the poses",
        *(f"1. {_step(step)}" for step in rectified.body.history),
    ]
    return "\n".join(lines) + "\n"


def _up(take: Take) -> list[str]:
    """How well up is known and what it rests on; how the camera stands, or that it moves."""
    assert take.poses is not None
    assert take.rectified is not None
    rectified = take.rectified
    if rectified.camera == "gravity":
        return ["- up: that of the source's own axes"]
    moving = rectified.camera == "moving"
    camera = "moves, and up with it" if moving else standing(take)
    if not rectified.level_ok:
        return ["- up: a guess, not to be relied on", f"- camera: {camera}"]
    bound = rectified.up_bound_deg[np.isfinite(rectified.up_bound_deg)]
    if not len(bound):
        return ["- up: how well it is known is not stated", f"- camera: {camera}"]
    least, most = f"{bound.min():.1f}", f"{bound.max():.1f}"
    within = most if least == most else f"{least} to {most}"
    rests = ", ".join(f"{name} {100 * share:.0f} %" for name, share in rectified.up_shares.items())
    return [
        f"- up: known to within **{within} deg** (90 %)" + (f", rests on: {rests}" if rests else ""),
        f"- camera: {camera}",
    ]


def standing(take: Take) -> str:
    """A static camera's pitch and roll in words."""
    assert take.poses is not None
    assert take.rectified is not None
    up = take.poses.frame.basis.T @ shared_up(take.rectified)[0]
    pitch, roll = pitch_roll_deg(up)
    if not np.isfinite(pitch):
        return "stands still"
    return (
        f"stands still, looks {'down' if pitch >= 0 else 'up'} by {abs(pitch):.1f} deg (pitch), what it sees is "
        f"turned {'counter-' if roll >= 0 else ''}clockwise by {abs(roll):.1f} deg (roll)"
    )


def _relative(rectified: Rectified) -> str:
    if rectified.camera != "moving":
        return ""
    return (
        "; in LEVEL **back and right are relative to the camera**: how it turns about the vertical cannot be seen, "
        "heights and horizontal distances can"
    )


def _told(take: Take, kind: str, heading: str) -> list[str]:
    mark = "**" if kind == "warning" else ""
    texts = [f"- {mark}{event.text}{mark}" for event in take.events if event.kind == kind]
    return [heading, *texts] if texts else []


def _step(step: Step) -> str:
    options = f": {_listed(step.options)}" if step.options else ""
    return f"{step.name} ({step.version}){options}"


def _listed(options: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {value}" for key, value in options.items())


def up_by_source(take: Take) -> dict[str, dict[str, float]]:
    """What each source says about the camera by itself, its share of the take's up, and how far it pulls it."""
    assert take.poses is not None
    assert take.rectified is not None
    rectified, rows = take.rectified, {}
    for name, (up, error_deg) in rectified.up_own.items():
        pitch, roll = pitch_roll_deg(take.poses.frame.basis.T @ up)
        rows[name] = {"pitch_deg": float(pitch), "roll_deg": float(roll), "error_deg": error_deg}
    for name, share in rectified.up_shares.items():
        rows.setdefault(name, {})["share"] = share
    for name, pull in rectified.up_pulls.items():
        rows.setdefault(name, {})["pull_deg"] = pull
    return rows
