"""Where a take's figures come from, as lines for the files whose format has room for them."""

from __future__ import annotations

from collections.abc import Mapping

from ...pipeline.core.frames import Frame
from ...pipeline.core.pose import Step, package_version
from ...pipeline.core.take import Take
from ...pipeline.running.sentences import POSES_ARE, judgement

RELATIVE = "relative to the camera"


def provenance(
    take: Take, frame: Frame | None = None, history: tuple[Step, ...] | None = None
) -> dict[str, str]:
    """Name and value of each line, one line of text each: version, take, inputs, axes, unit of length, warnings, steps.
    frame: that of the file's points; by default LEVEL, with the pelvis path apart from the joints. history: those
    steps, for what has not been through all of the take's."""
    rectified = take.need("rectified")
    lines = {"pcnet3d": package_version(), "take": take.name}
    for entry in take.inputs:
        named = {key: entry[key] for key in ("file", "sha256", "adapter") if key in entry}
        lines[f"input {entry.get('role', '')}"] = _listed(named)
    lines["axes"] = str(frame or rectified.level.frame)
    lines["length_unit"] = (frame or take.need("poses").frame).unit
    if frame is None and rectified.level.root is not None:
        lines["root"] = f"the pelvis, from {'the world' if rectified.in_world else 'the camera'}'s origin"
    if rectified.camera == "moving":
        lines["horizontal"] = RELATIVE
    lines["rectifier"] = rectified.method
    if code := judgement(take):
        lines["verdict"] = POSES_ARE[code]
    for number, warning in enumerate(take.texts("warning"), 1):
        lines[f"warning {number}"] = warning
    for number, step in enumerate(take.history if history is None else history, 1):
        lines[f"step {number}"] = f"{step.name} ({step.version}) {_listed(step.options)}"
    return {name: " ".join(text.split()) for name, text in lines.items()}


def _listed(options: Mapping[str, object]) -> str:
    """Names and values in a line: "a 1, b 2"."""
    return ", ".join(f"{key} {value}" for key, value in options.items())
