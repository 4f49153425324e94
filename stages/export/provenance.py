"""Where a take's figures come from, as lines that every exported table carries."""

from __future__ import annotations

from collections.abc import Mapping

from ...pipeline.pose import Step, package_version
from ...pipeline.take import Take

RELATIVE = "relative to the camera"


def steps(take: Take) -> tuple[Step, ...]:
    """What was done to the poses, oldest first: up to LEVEL, and the filter that kinematics rest on."""
    assert take.rectified is not None
    done = take.rectified.body.history
    return done if take.filtered is None else (*done, take.filtered.history[-1])


def provenance(take: Take) -> dict[str, str]:
    """Name and value of each line, one line of text each: version, take, inputs, axes, unit of length ("m" or
    "arbitrary"), warnings, steps."""
    assert take.poses is not None
    assert take.rectified is not None
    rectified = take.rectified
    lines = {"pcnet3d": package_version(), "take": take.name}
    for entry in take.inputs:
        told = {key: entry[key] for key in ("file", "sha256", "adapter") if key in entry}
        lines[f"input {entry.get('role', '')}"] = _listed(told)
    lines["axes"] = str(rectified.level.frame)
    lines["length_unit"] = take.poses.frame.unit
    if rectified.level.root is not None:
        lines["root"] = "the pelvis, from the camera's centre or the world's origin"
    if rectified.camera == "moving":
        lines["horizontal"] = RELATIVE
    lines["rectifier"] = rectified.method
    for number, event in enumerate((event for event in take.events if event.kind == "warning"), 1):
        lines[f"warning {number}"] = event.text
    for number, step in enumerate(steps(take), 1):
        lines[f"step {number}"] = f"{step.name} ({step.version}) {_listed(step.options)}"
    return {name: " ".join(text.split()) for name, text in lines.items()}


def _listed(options: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {value}" for key, value in options.items())
