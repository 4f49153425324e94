"""What several outputs need of a take: an angle's band, a mean of what is known; and where its figures come
from, as lines for the files whose format has room for them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.core.frames import Frame
from ...pipeline.core.measures import SD_90
from ...pipeline.core.pose import Step, package_version
from ...pipeline.core.take import Take
from ...pipeline.running.sentences import POSES_ARE, judgement
from ...pipeline.signals.angles import sides_of

RELATIVE = "relative to the camera"


def angle_bands(take: Take, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """(T, N) an angle by its name without a side, right before left, and how far its 90 % band reaches to each side of
    it, NaN where either is not known; None where the take has no value."""
    columns, nothing = take.kinematics or {}, np.full(len(take.need("poses")), np.nan)
    values, sds = (
        np.stack([columns.get(f"{part}_{ending}", nothing) for part in sides_of(name)], axis=1)
        for ending in ("deg", "sd_deg")
    )
    return (values, SD_90 * sds) if np.isfinite(values).any() else None


def mean(values: np.ndarray) -> float:
    """Of those that are known of (T,); NaN where none is."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


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
