"""How wrong a gait figure may be: standard deviations that were fitted on walks and runs with truth.

The error of a mean over N steps or strides is made of a part that all of them share and one that each has for itself.
That of lengths has what the pelvis path's own error adds. That of times and shares of the stride grows with how far the
found stance is from the usual one, for unusual gaits are found more usual than they are. The mean of N step or stride
times is the time between two landings by N: of these, what each has for itself falls with N and grows with how much the
values scatter, as they do where a landing is found too early or too late. Of gaits unlike all that it was fitted on the
error is larger yet. A difference of the sides has an error of its own: what a lifter puts too near of one leg and too
far of the other cancels in the mean over both and is twice as large in the difference, the more so the more of a step
is depth.

gait_error.json was learned on validation subjects, their walks as captured and in drawn styles, each person with the
same weight, so that nine in ten errors lie within 1.645 standard deviations: those of poses by the built-in lifter, and
those of captured ones, of which times and shares are known: 634 lifted and 319 captured walks and runs of six people
of CMU and ACCAD; fitted once, at commit afb266a4. After a new lifter, `pcnet3d lab evaluate errors` says whether they
still hold.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from ...pipeline.core.measures import SD_90
from ...pipeline.core.path import RootPath
from .gait import Step

ERROR_FILE = Path(__file__).with_name("gait_error.json")
OF_LENGTH = ("walking_speed", "step_length", "stride_length", "step_width")
# Those that are told of each side, and whose difference of the sides has an error.
OF_SIDES = (
    "step_time_s", "stance_time_s", "stance_percent", "swing_percent", "single_support_percent",
    "double_support_percent", "flight_time_s", "step_length",
)  # fmt: skip
OF_LANDINGS = ("step_time_s", "stride_time_s")  # whose mean is the time between two landings, by their number
FEWEST_OF_A_SIDE = 2  # values, for a difference of the sides


@dataclass(frozen=True)
class GaitErrors:
    """Of the gaits of one source's poses, all of {"walking", "running": {figure: {part: value}}}. figures: of means
    "shared", "each", and "root" of lengths, "apart" of others, of OF_LANDINGS also "scatter" and the "usual_scatter";
    differences: "shared", "each" and "depth", of right less left; in both "most" values, of more of which nothing is
    surer. seen: "least", "usual" and "most" of OF_STYLE, as they were found in what that was fitted on."""

    figures: Mapping[str, Mapping[str, Mapping[str, float]]]
    differences: Mapping[str, Mapping[str, Mapping[str, float]]]
    seen: Mapping[str, Mapping[str, Mapping[str, float]]]

    def mean(
        self,
        gait: str,
        figure: str,
        count: int,
        root_sd: float = 0.0,
        style: Mapping[str, float] | None = None,
        scatter: float = np.nan,
    ) -> float:
        """Standard deviation of the mean of `count` values of a figure (Gait.times, parameters.length_values), in its
        unit, lengths and speeds in lengths of a leg; NaN of lengths where it is not known. gait: "walking" or
        "running". root_sd: of the pelvis path in lengths of a leg. style: Gait.style of these values. scatter: of both
        sides' values (`scatter`), the usual one if not known. Where the style is beyond what was seen (`beyond`), all
        of it is larger by that share: a rule, for nothing was fitted there."""
        own = self.figures[gait].get(figure)
        if own is None:
            return float("nan")
        style, fewer = style or {}, min(count, own["most"])
        each = 1 / fewer if figure in OF_LANDINGS else 1 / np.sqrt(fewer)
        parts = [own["shared"], own["each"] * each]
        if figure in OF_LENGTH:
            parts.append(own["root"] * root_sd * each)
        else:
            usual = self.seen[gait]["stance_percent"]["usual"]
            parts.append(own["apart"] * abs(style.get("stance_percent", usual) - usual))
        if figure in OF_LANDINGS:
            parts.append(own["scatter"] * (scatter if np.isfinite(scatter) else own["usual_scatter"]) * each)
        beyond = 0.0 if figure in OF_LENGTH else max(self.beyond(gait, style).values(), default=0.0)
        return float(np.sqrt(np.sum(np.square(parts)))) * (1 + beyond)

    def beyond(self, gait: str, style: Mapping[str, float]) -> dict[str, float]:
        """{figure: how far} of those in a Gait.style that lie outside what was found in the walks and runs that errors
        were fitted on: the distance in half widths of that range."""
        outside_by = {}
        for name, value in style.items():
            least, most = self.seen[gait][name]["least"], self.seen[gait][name]["most"]
            outside = max(least - value, value - most)
            if outside > 0:
                outside_by[name] = 2 * outside / (most - least)
        return outside_by

    def difference(
        self, gait: str, figure: str, right: int, left: int, depth: float, scatter: float = np.nan
    ) -> float:
        """Standard deviation of the mean of `right` values of one side less that of `left` values of the other, in the
        figure's unit, of a length in lengths of a leg; NaN where it is not known. figure: of OF_SIDES. depth:
        `depth_of_steps`. scatter: of each side's values about their own mean, of which only what is beyond the usual
        one counts: in 134 lifted validation walks the median bar grows from 22.8 to 23.3 % of a step time."""
        own = self.differences[gait].get(figure)
        if own is None:
            return float("nan")
        pairs = min(1 / (1 / right + 1 / left), own["most"])
        parts = [own["shared"], own["each"] / np.sqrt(pairs), own["depth"] * depth]
        if figure in OF_LANDINGS and np.isfinite(scatter):
            mean = self.figures[gait][figure]
            beyond = np.sqrt(max(scatter**2 - mean["usual_scatter"] ** 2, 0.0))
            parts.append(mean["scatter"] * beyond * np.hypot(1 / right, 1 / left))
        return float(np.sqrt(np.sum(np.square(parts))))

    def side(self, gait: str, figure: str, depth: float) -> float:
        """Standard deviation that all values of one side share beyond `mean`: half of what a difference of the sides
        has however many steps there are. As those of `difference`."""
        own = self.differences[gait].get(figure)
        return float("nan") if own is None else float(np.hypot(own["shared"], own["depth"] * depth)) / 2


@cache
def shipped_errors(source: Literal["lifted", "measured"] = "lifted") -> GaitErrors:
    """What gait_error.json holds of poses by the built-in lifter, or of captured ones."""
    return GaitErrors(**json.loads(ERROR_FILE.read_text(encoding="utf-8"))[source])


def scatter(values: np.ndarray) -> float:
    """Standard deviation of values (N,) among themselves; NaN of fewer than two."""
    return float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def depth_of_steps(
    R_camera_from_body: np.ndarray, time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> float:
    """How much of a step is depth, 0 (seen from the side) to 1: the root mean square over the walks' frames of the
    cosine between where the person faces and the camera's axis. R_camera_from_body: (T, 3, 3), NaN where unknown;
    time_s: (T,). NaN where it is known of no frame."""
    ahead = R_camera_from_body[_inside(time_s, walks), 2, 0]  # BODY's x is back, CAMERA's z is away
    ahead = ahead[np.isfinite(ahead)]
    return float(np.sqrt(np.mean(ahead**2))) if len(ahead) else float("nan")


def path_error(
    path: RootPath, axis: np.ndarray, time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> tuple[float, float]:
    """Of an estimated pelvis path (models/place/path.py) in LEVEL: standard deviation of a place along the horizontal
    axis where it is worst, in the path's unit; and the share of lengths and speeds that may be wrong in all strides
    alike, by the body's size and, as far as the person walks along the camera's axis (3,), by the focal length. 0, 0
    without a place, NaN of a path that states no error. time_s: (T,).
    """
    if path.covariance is None or path.shared is None:
        return float("nan"), float("nan")
    root, covariance, (scale_sd, focal_sd) = path.points, path.covariance, path.shared
    # Of each frame for itself: less what the body's size and the focal length make wrong in all alike.
    depth = (root @ axis)[:, None] * axis
    alike = sum(sd**2 * at[:, :, None] * at[:, None, :] for sd, at in ((scale_sd, root), (focal_sd, depth)))
    own_error = (covariance - alike)[:, :2, :2]
    own_error = own_error[np.isfinite(own_error).all(axis=(1, 2))]
    if not len(own_error) or not walks:
        return 0.0, 0.0
    root_sd = float(np.sqrt(np.median(np.maximum(np.linalg.eigvalsh(own_error)[:, -1], 0.0))))
    velocity = np.gradient(root, time_s, axis=0)[_inside(time_s, walks)]
    velocity = velocity[np.isfinite(velocity).all(axis=1)]
    along = ((velocity @ axis) ** 2).sum() / max((velocity**2).sum(), 1e-12)
    # The bar's end, for a lens that may be twice as long makes more of a speed than its slope says.
    longer = np.sqrt(1 + along * ((1 + SD_90 * focal_sd) ** 2 - 1)) - 1
    return root_sd, float(np.hypot(scale_sd, longer / SD_90))


def _inside(time_s: np.ndarray, walks: Sequence[Sequence[Step]]) -> np.ndarray:
    """(T,) which frames are of a walk."""
    inside = np.zeros(len(time_s), dtype=bool)
    for walk in walks:
        inside |= (time_s >= walk[0].start_s) & (time_s <= walk[-1].stop_s)
    return inside
