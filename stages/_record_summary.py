"""What the recording says about the take in words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..pipeline.pose import Step
from ..pipeline.take import Take


def summary_markdown(take: Take) -> str:
    """The take's summary: warnings first, then what it is, where it came from and what was done to it."""
    assert take.poses is not None
    assert take.rectified is not None
    poses, rectified = take.poses, take.rectified
    error = rectified.error_deg[np.isfinite(rectified.error_deg)]
    lines = [
        f"## {take.name}",
        *_told(take, "warning", "### ⚠ Warnings"),
        "### Take",
        f"- {len(poses)} frames, {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.fps:.4g} a second",
        f"- source axes: {poses.frame}",
        f"- unit of length: {poses.frame.unit if poses.frame.metric else 'arbitrary, the source has no scale'}",
        "### Rectification",
        f"- method: {rectified.method}",
        f"- levelled: {'yes' if rectified.level_ok else f'**no, {rectified.level_reason}**'}",
        f"- heading of LEVEL: {rectified.level_heading}",
        f"- expected rotation error: {f'{np.median(error):.1f} deg (median)' if len(error) else 'not known'}",
        "- axes of BODY and LEVEL: x back, y right, z up",
        *_told(take, "repair", "### Repairs"),
        *_told(take, "note", "### Notes"),
        *(["### Inputs"] if take.inputs else []),
        *(f"- {_listed(entry)}" for entry in take.inputs),
        "### Done to the poses",
        *(f"1. {_step(step)}" for step in rectified.body.history),
    ]
    return "\n".join(lines) + "\n"


def _told(take: Take, kind: str, heading: str) -> list[str]:
    mark = "**" if kind == "warning" else ""
    texts = [f"- {mark}{event.text}{mark}" for event in take.events if event.kind == kind]
    return [heading, *texts] if texts else []


def _step(step: Step) -> str:
    options = f": {_listed(step.options)}" if step.options else ""
    return f"{step.name} ({step.version}){options}"


def _listed(options: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {value}" for key, value in options.items())
