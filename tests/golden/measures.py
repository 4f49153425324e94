"""Rows of measures written as they stand in summary.json."""

from dataclasses import replace

from pcnet3d.pipeline.core.measures import (
    UNITS,
    Curve,
    Curves,
    Measure,
    Moments,
    Remark,
    Row,
    side_of,
    within,
)
from pcnet3d.stages.study.batch.study import place

_LENGTHS = {"_length": "length", "_width": "length", "_height": "length", "_speed": "speed"}
_MOMENTS = ("start_s", "stop_s", "peak_at_s", "stride_start_s", "stride_stop_s", "landings_s", "toe_offs_s")
_SIDES = {"right": "right", "left": "left"}


def rows_of(figures: dict) -> tuple[Row, ...]:
    """The rows whose `nested` is these figures."""
    rows: list[Row] = []
    for key, value in figures.items():
        if key == "cycles":
            curves = (
                Curve(angle, of["count"], tuple(of["mean_deg"]), of.get("sd_deg"))
                for angle, of in value.items()
            )
            rows.append(Curves(tuple(curves)))
        elif isinstance(value, dict):
            rows += within(key, rows_of(value), _SIDES.get(key, side_of(key)))
        elif isinstance(value, str):
            rows.append(Remark(key, value))
        elif key in _MOMENTS:
            rows.append(Moments(key.removesuffix("_s"), tuple(value)))
        elif not ("_error" in key or key == "within_error" or key.endswith("_at_least")):
            rows += [one for one in _measures(key, value, figures) if one.value is not None]
    return tuple(rows)


def by_place(numbers: dict[str, float]) -> dict[str, Measure]:
    """Measures as a study's rows have them, of numbers by their dotted keys, such as "walking.cadence_spm"."""
    rows = []
    for dotted, number in numbers.items():
        *groups, key = dotted.split(".")
        (row,) = _measures(key, number, {})
        rows.append(replace(row, group=tuple(groups)))
    return {place(row): row for row in rows}


def _measures(key: str, value: float | list, figures: dict) -> list[Measure]:
    unit = next((name for ending, name in _LENGTHS.items() if key.endswith(ending)), "")
    unit = unit or next((name for name, of in UNITS.items() if of.ending and key.endswith(of.ending)), "")
    name = key.removesuffix(UNITS[unit].ending)
    side = _SIDES.get(name, "")
    one = Measure(name, 0.0, unit, side=side)
    errors = figures.get(one.error_key)
    judged = figures.get(name.replace("symmetry_index", "within_error")) if "symmetry_index" in name else None
    least = figures.get(f"{name}_at_least", False)
    if not isinstance(value, list):
        return [Measure(name, value, unit, errors, side, within_error=judged, at_least=least)]
    errors = errors or [None] * len(value)
    return [
        Measure(name, each, unit, error, side, i)
        for i, (each, error) in enumerate(zip(value, errors, strict=True))
    ]
