"""What the recording says about the take in words."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.messages import bound_in_words, how_many, rate_in_words
from ...pipeline.core.notices import verdict_words
from ...pipeline.core.take import Take
from ..drawing.facts import OWN_WAYS, Facts, facts_of, listed, ways_of_level


def summary_markdown(take: Take) -> str:
    """The take's summary: warnings first, then how it was rectified, what it is, and what was done to it."""
    facts = facts_of(take)
    error = f"{bound_in_words(facts.error_deg)} deg (median)" if np.isfinite(facts.error_deg) else "not known"
    lines = [
        f"### {take.title}",
        *_told("#### ⚠ Warnings", facts.warnings, "**"),
        *([] if take.findings is None else [f"**Verdict: {verdict_words(take.findings)}.**"]),
        "#### Rectification",
        f"- method: {facts.method}",
        f"- levelled: {'yes' if facts.level_ok else f'**no: {facts.level_reason}**'}",
        *_up(facts),
        f"- heading of LEVEL: {facts.level_heading}",
        f"- expected rotation error: {error}",
        f"- axes of BODY and LEVEL: x back, y right, z up{_relative(facts)}",
        "#### Take",
        f"- {how_many(facts.frames, 'frame')}, {facts.first_frame} to {facts.last_frame}"
        + rate_in_words(facts.fps, ", "),
        f"- source axes: {facts.axes}",
        f"- unit of length: {'arbitrary, the source has no scale' if facts.unit == 'arbitrary' else facts.unit}",
        *_told("#### Repairs", facts.repairs),
        *_told("#### Notes", facts.notes),
        *(["#### Inputs"] if take.inputs else []),
        *(f"- {listed(entry)}" for entry in take.inputs),
        "#### Done to the poses",
        *(
            f"1. {step.name} ({step.version}){f': {listed(step.options)}' if step.options else ''}"
            for step in facts.history
        ),
    ]
    return "\n".join(lines) + "\n"


def _up(facts: Facts) -> list[str]:
    """How well up is known and what it rests on; how the camera stands, or that it moves."""
    if facts.up_of_world:
        return [f"- up: that of the source's own axes. {facts.up_of_world}"]
    camera = f"- camera: {facts.camera_words}"
    if not facts.level_ok:
        return ["- up: a guess, not to be relied on", camera]
    if facts.bound_words is None:
        return ["- up: how well it is known is not stated", camera]
    rests = f", rests on: {facts.shares_words}" if facts.shares_words else ""
    return [f"- up: known to within **{facts.bound_words} deg** (90 %){facts.unless_words}{rests}", camera]


def _relative(facts: Facts) -> str:
    front, right = ways_of_level(facts.level_heading)
    if facts.camera != "moving":
        return "" if (front, right) == OWN_WAYS else f"; in LEVEL **-x points to {front}, y to {right}**"
    return (
        "; in LEVEL **back and right are relative to the camera**: how it turns about the vertical cannot be seen, "
        "heights and horizontal distances can"
    )


def _told(heading: str, texts: tuple[str, ...], mark: str = "") -> list[str]:
    return [heading, *(f"- {mark}{text}{mark}" for text in texts)] if texts else []
