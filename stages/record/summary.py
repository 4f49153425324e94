"""What the recording says about the take in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.messages import bound_in_words, how_many, rate_in_words
from ...pipeline.core.notices import verdict_words
from ...pipeline.core.take import Take
from ..drawing.facts import OWN_WAYS, Facts, facts_of, listed, ways_of_level


def summary_markdown(take: Take) -> str:
    """The take's summary: warnings first, then how it was rectified, what it is, and what was done to it."""
    facts = facts_of(take)
    poses = take.need("poses")
    unit = poses.frame.unit
    error = f"{bound_in_words(facts.error_deg)} deg (median)" if np.isfinite(facts.error_deg) else "not known"
    lines = [
        f"### {take.title}",
        *_told("#### ⚠ Warnings", take.texts("warning"), "**"),
        *([] if take.findings is None else [f"**Verdict: {verdict_words(take.judged)}.**"]),
        "#### Rectification",
        f"- method: {facts.rectified.method}",
        f"- levelled: {'yes' if facts.rectified.level_ok else f'**no: {facts.rectified.level_reason}**'}",
        *_up(facts),
        f"- heading of LEVEL: {facts.rectified.level_heading}",
        f"- expected rotation error: {error}",
        f"- axes of BODY and LEVEL: x back, y right, z up{_relative(facts)}",
        "#### Take",
        f"- {how_many(len(poses), 'frame')}, {poses.frame_index[0]} to {poses.frame_index[-1]}"
        + rate_in_words(poses.fps, ", "),
        f"- source axes: {poses.frame}",
        f"- unit of length: {'arbitrary, the source has no scale' if unit == 'arbitrary' else unit}",
        *_told("#### Repairs", take.texts("repair")),
        *_told("#### Notes", take.texts("note")),
        *(["#### Inputs"] if take.inputs else []),
        *(f"- {listed(entry)}" for entry in take.inputs),
        "#### Done to the poses",
        *(
            f"1. {step.name} ({step.version}){f': {listed(step.options)}' if step.options else ''}"
            for step in take.history
        ),
    ]
    return "\n".join(lines) + "\n"


def _up(facts: Facts) -> list[str]:
    """How sure up is and what it rests on; how the camera stands, or that it moves."""
    if facts.rectified.in_world:
        return [f"- up: that of the source's own axes. {facts.up_words}"]
    rests = f" {facts.rests_words}" if facts.rectified.level_ok and facts.bound_words else ""
    return [f"- up: {facts.up_words}{rests}".rstrip(), f"- camera: {facts.camera_words}"]


def _relative(facts: Facts) -> str:
    front, right = ways_of_level(facts.rectified.level_heading)
    if facts.rectified.camera != "moving":
        return "" if (front, right) == OWN_WAYS else f"; in LEVEL **-x points to {front}, y to {right}**"
    return (
        "; in LEVEL **back and right are relative to the camera**: its turns about the vertical cannot be seen, "
        "heights and horizontal distances can"
    )


def _told(heading: str, texts: Sequence[str], mark: str = "") -> list[str]:
    return [heading, *(f"- {mark}{text}{mark}" for text in texts)] if texts else []
