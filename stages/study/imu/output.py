"""What a comparison of video and IMU leaves: a table, a page of charts and a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....pipeline.core.notices import Notice
from ....pipeline.core.rotations import is_finite
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import whole_file
from ....pipeline.files.names import RECORDING
from ...drawing.charts import Curve, busiest, over_time
from ...drawing.page import answer, box, charts, figure, page
from ...drawing.palette import GREEN, MIDDLE, PURPLE, as_hex
from ...drawing.rerun_file import recording_file
from ...drawing.rerun_log import time_columns
from .align import Alignment, Signal

if TYPE_CHECKING:
    import rerun.blueprint as rrb

IMU_RECORDING = "imu.rrd"
_AXES = {"x": "back", "y": "right", "z": "up", "norm": "norm"}
_COLUMNS = {
    "r": "r", "rmse_mps2": "RMSE (m/s^2)", "gain": "gain", "lag_s": "own lag (ms)", "offset_mps2": "offset (m/s^2)",
}  # fmt: skip
_VIDEO, _IMU, _PER_FRAME = PURPLE, GREEN, MIDDLE  # none is the colour of a body's side
_SHOWN_S = 20.0  # of a long take, where most happens


@dataclass(frozen=True, eq=False)
class Comparison:
    """One sensor against every method.

    means: how the pelvis' own motion was dealt with, in words. compared_s: of motion known to both. video, imu: by
    method accelerations (N, 3), m/s^2, at time_s (N,) of the video's clock, in the method's axes (back, right, up).
    agreement: by method and axis, of align.agreement, or of the norm alone, which the curves then have as their
    third column. The run's own method is the last.
    """

    segment: str
    means: str
    alignment: Alignment
    imu_hz: float
    compared_s: float
    metres_per_unit: float
    time_s: np.ndarray
    video: dict[str, np.ndarray]
    imu: dict[str, np.ndarray]
    agreement: dict[str, dict[str, dict[str, float]]]
    notices: tuple[Notice, ...]

    @property
    def own(self) -> str:
        return list(self.video)[-1]

    @property
    def axes(self) -> list[str]:
        return list(self.agreement[self.own])

    def curves(self, values: np.ndarray) -> np.ndarray:
        """(N, len(axes)): values (N, 3) less their means, as they are compared, and their norm."""
        centred = values - values[is_finite(values)].mean(axis=0)
        if self.axes == ["norm"]:
            return centred[:, 2:]
        return np.column_stack([centred, np.linalg.norm(centred, axis=-1)])

    def figures(self) -> dict[str, Any]:
        """Everything but the curves."""
        how = self.alignment
        return {
            "pelvis": self.means,
            "lag_s": how.lag_s,
            "clock_rate": how.rate,
            "heading_deg": how.heading_deg,
            "r_three_axes": how.score,
            "r_next_best_lag": how.runner_up,
            "imu_hz": self.imu_hz,
            "compared_s": self.compared_s,
            "metres_per_unit": self.metres_per_unit,
            "methods": self.agreement,
            "notices": [each.as_dict() for each in self.notices],
        }


def as_markdown(take: str, segments: Mapping[str, Mapping[str, Any]]) -> str:
    """The tables in words and figures. segments: by name what `figures` gives, with the cut-off and None for NaN."""
    lines = [f"# {take}: video against IMU", ""]
    for name, of in segments.items():
        lines += [
            f"## {name}",
            "",
            f"- {of['pelvis']}; {of['compared_s']:.1f} s compared",
            f"- both sides low-passed at {of['cutoff_hz']:g} Hz; the IMU samples at {of['imu_hz']:.4g} Hz",
            f"- the IMU's stamps{_added(of['offset_s'])} are {1000 * of['lag_s']:.0f} ms later than the video's, "
            "its clock runs at "
            f"{of['clock_rate']:.5f}"
            + (
                ""
                if of["heading_deg"] is None
                else f", its heading differs by {of['heading_deg']:.0f} degrees"
            ),
            *(f"- **{each['text']}**" for each in of["notices"]),
            "",
            f"| method | {' | '.join(_COLUMNS.values())} |",
            f"|---{'|---' * len(_COLUMNS)}|",
        ]
        for method, axes in of["methods"].items():
            cells = [_cell(of["lag_s"], axes, figure) for figure in _COLUMNS]
            lines.append(f"| {method} | {' | '.join(cells)} |")
        lines.append("")
    lines += [
        "Each cell: back / right / up of LEVEL / norm (or the norm alone), the heading fitted to each method. RMSE is "
        "without the means, whose difference is the offset (bias and tilt). Gain: the video's amplitude over the "
        "IMU's. Own lag: where that axis alone fits best. ? is not known.",
        "",
    ]
    return "\n".join(lines)


def _added(offset_s: float) -> str:
    """What a lag is counted from, where --offset moved the IMU's stamps; all digits, for some count from 1970."""
    return f", with {offset_s:.15g} s added by --offset," if offset_s else ""


def _cell(lag_s: float, axes: Mapping[str, Mapping[str, float | None]], figure: str) -> str:
    # The norm has no offset; what is only unknown keeps its place among the axes.
    values = np.array([of[figure] for of in axes.values() if figure in of], dtype=float)
    if figure == "lag_s":
        values = 1000 * (lag_s + values)
    form = {"lag_s": ".0f", "r": ".3f"}.get(figure, ".2f")
    return " / ".join(format(value, form) if np.isfinite(value) else "?" for value in values)


def as_page(result: Comparison, offset_s: float) -> str:
    """One HTML page of a sensor: back, right, up and norm over time, the IMU beside the run's own method, for the take
    and per frame. offset_s: what was added to the IMU's stamps first."""
    known = is_finite(result.video[result.own])
    power = np.where(known, (result.imu[result.own] ** 2).sum(axis=-1), np.nan)
    rows = busiest(power, result.time_s, _SHOWN_S)
    per_frame = f"{result.own} per frame"
    lines = [
        (per_frame, result.video.get(per_frame), _PER_FRAME, 1.0),
        ("IMU", result.imu[result.own], _IMU, 2.4),
        (result.own, result.video[result.own], _VIDEO, 1.6),
    ]
    shown = []
    for i, axis in enumerate(result.axes):
        curves = [
            Curve(name, result.curves(values)[rows, i], as_hex(colour), width=width)
            for name, values, colour, width in lines
            if values is not None
        ]
        of = result.agreement[result.own][axis]
        title = f"{_AXES[axis].capitalize()} (m/s²)"
        chart = over_time(curves, result.time_s[rows], f"{title} of both over time")
        shown.append(figure([chart], title, f"r {of['r']:.3f}, RMSE {of['rmse_mps2']:.2f} m/s²"))
    what = (
        "Norm of the acceleration with gravity"
        if result.axes == ["norm"]
        else "Acceleration relative to the pelvis"
    )
    late = f"the IMU{_added(offset_s)} is {1000 * result.alignment.lag_s:.0f} ms late"
    said = f"{what}: {late}, {result.compared_s:.1f} s were compared."
    head = answer([said]) + box("Warnings", [each.text for each in result.notices], "warning")
    return page(f"{result.segment}: video against IMU", head, [("Over time", charts(shown))])


def write_recording(run: Take, results: Sequence[Comparison], words: str, folder: Path, path: Path) -> None:
    """All of the run's own recording, and the curves of both on its time axes under imu/<segment>/<axis>."""
    import rerun as rr
    from rerun.chunk import RrdReader

    times = run.need("poses").times
    clock = time_columns(run.need("poses").frame_index, times)
    with whole_file(path) as partial, recording_file(partial, _views(folder, results), path) as file:
        recording = file.stream
        if (folder / RECORDING).is_file():
            recording.send_chunks(RrdReader(folder / RECORDING).stream())
        recording.log("imu/summary", rr.TextDocument(words, media_type=rr.MediaType.MARKDOWN), static=True)
        for result in results:
            video, imu = (
                result.curves(Signal(result.time_s, side[result.own])(times))
                for side in (result.video, result.imu)
            )
            for i, axis in enumerate(result.axes):
                entity = f"imu/{result.segment}/{axis}"
                names = [f"IMU {_AXES[axis]} (m/s^2)", f"{result.own} {_AXES[axis]} (m/s^2)"]
                look = rr.SeriesLines(names=names, colors=[_IMU, _VIDEO], widths=[2.0, 1.5])
                recording.log(entity, look, static=True)
                values = np.column_stack([imu[:, i], video[:, i]])
                columns = rr.Scalars.columns(scalars=values.reshape(-1))
                recording.send_columns(entity, clock, columns.partition(np.full(len(values), 2)))


def _views(folder: Path, results: Sequence[Comparison]) -> rrb.Container:
    """The video and LEVEL of the run's recording, where there is one, and a page of curves for each sensor."""
    import rerun.blueprint as rrb

    pages = [
        rrb.Vertical(
            *(
                rrb.TimeSeriesView(
                    origin=f"imu/{result.segment}/{axis}", name=f"{result.segment}: {_AXES[axis]} (m/s^2)"
                )
                for axis in result.axes
            ),
            name=result.segment,
        )
        for result in results
    ]
    words = rrb.TextDocumentView(origin="imu/summary", name="Video against IMU")
    views: list[Any] = [rrb.Tabs(*pages), words]
    if (folder / RECORDING).is_file():
        person = rrb.Vertical(
            rrb.Spatial2DView(origin="video", name="Video"), rrb.Spatial3DView(origin="level", name="LEVEL")
        )
        views.insert(0, person)
    return rrb.Horizontal(*views)
