"""Opens lifters: the built-in one, a file of one that was trained here, another package's, or a function of the user's
own: keypoints (T, K, 3), the image's size, frames a second -> (T, 17, 3)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.conversions import remap
from ...pipeline.core.errors import InputError, naming
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.lifted import Lifted, ToLift
from ...pipeline.core.rotations import is_finite
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.plugins.protocols import LIFTER_TAKES, Lifter
from ...pipeline.plugins.registry import open_model
from ...pipeline.signals.filters import each_path, on_lines
from ..common.function import answer_of, failed, name_of
from .builtin import OwnLifter, network
from .keypoints import USUAL_HZ, checked_size, long_gaps, on_grid, rate_of, refuse_two_people


class FunctionLifter:
    """A pipeline.plugins.protocols.Lifter whose `lift` asks the function.

    function(keypoints, size, fps): keypoints (T, K, 3) float32 of evenly spaced frames, in the detector's layout: x and
        y in pixels and a score in [0, 1]; where a joint is missing, a place on the line between those where it was
        seen, with a score of 0. size: width and height in pixels. fps: frames a second. -> (T, 17, 3), Human3.6M's
        joints in CAMERA (x right, y down, z away); NaN where there is no pose.
    """

    takes = ()

    def __init__(self, function: Callable[..., Any], unit: str = "arbitrary") -> None:
        """unit: of what it answers."""
        self._function, self.unit = function, unit
        self.method = f"{name_of(function)} (a function)"

    def lift(self, asked: ToLift) -> Lifted:
        """InputError where the function raises, or answers something else."""
        keypoints = asked.keypoints
        width, height = (int(side) for side in checked_size(asked))
        pixels, confidence, rows = on_grid(keypoints)
        rate = rate_of(keypoints, rows)
        refuse_two_people(pixels, rate)
        visible = is_finite(pixels)
        score = np.where(visible, np.where(np.isnan(confidence), 1.0, confidence), 0.0)
        # On a line from where a joint was last seen to where it is seen again; one that is never seen in the middle.
        lines = each_path(partial(on_lines, at=np.arange(len(pixels))), pixels)
        lines = np.where(np.isnan(lines), np.nanmean(lines, axis=1, keepdims=True), lines)
        x = np.concatenate([lines, score[..., None]], axis=-1).astype(np.float32)
        with naming("In frames {} to {}".format(*keypoints.frame_index[[0, -1]])):
            joints = answer_of("lift", self._function, "poses", x, (width, height), rate or USUAL_HZ)
            if joints.shape != (len(x), len(H36M17), 3):
                got = joints.shape if joints.size else "nothing"
                expected = f"expected the shape {(len(x), len(H36M17), 3)}, got {got}."
                raise failed("lift", self._function, expected)
            if np.isnan(joints).all():
                raise failed("lift", self._function, "every coordinate is NaN.")
            joints = joints.astype(np.float64)
        unseen = long_gaps(np.any(visible, axis=1), rate)
        joints = np.where(unseen[:, None, None], np.nan, joints)[rows]
        joints = joints - joints[:, [H36M17.index("pelvis")]]
        frame = CAMERA.with_(origin="pelvis", unit=self.unit)
        return Lifted(
            remap(keypoints, H36M17).with_(joints=joints, frame=frame),
            model=self.method,
            kind="function",
            focal_px=None,
            focal_known=asked.focal_known,
            frames_without_joints=int(unseen[rows].sum()),
            joints_on_a_line=int((~visible[rows] & ~unseen[rows, None]).sum()),
        )


def load_lifter(name: str | Path | Callable[..., Any] = "pcnet3d", unit: str | None = None) -> Lifter:
    """A lifter by name, one of `pcnet3d list models`: "pcnet3d", the built-in one, or another package's; the one in an
    .onnx file that `pcnet3d lab train` wrote; or one that is a function, whose answers are in that unit.

    InputError for an unknown name and for a network of another kind.
    """
    if not isinstance(name, str | Path):
        return FunctionLifter(name, unit or "arbitrary")
    if unit is not None:
        raise InputError("option-conflict", "The lifter knows its unit; leave --set lift.unit out.")
    opened = open_model("lifters", name)
    if isinstance(opened, Path):
        network(opened)
        return OwnLifter(str(opened))
    if unknown := [each for each in opened.takes if each not in LIFTER_TAKES]:
        raise InputError(
            "plugin-broken",
            f"The lifter '{name}' takes '{unknown[0]}', which is unknown: "
            f"{did_you_mean(unknown[0], LIFTER_TAKES)}",
        )
    return opened
