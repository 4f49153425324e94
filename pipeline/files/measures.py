"""A take's measures read back from summary.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..core.errors import InputError
from ..core.figures import FIGURES
from ..core.measures import Curve, Measure, Measures, Moments, Remark, Row, Side, side_of

_BY_KEY = {figure.key: figure for figure in FIGURES.values()}
_SIDES: dict[str, Side] = {"right": "right", "left": "left"}
# What stands beside a figure and is read with it.
_BESIDE = {
    key
    for figure in FIGURES.values()
    for key in (figure.error_key, figure.within_key, f"{figure.name}_at_least")
    if key not in _BY_KEY
}


def read_measures(figures: Mapping[str, Any]) -> Measures:
    """The measures whose `nested` (pipeline/core/measures.py) is that; InputError for what is not a run's."""
    try:
        return Measures(tuple(_rows(figures)))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            "file-damaged",
            f"Expected the measures of summary.json as a run writes them, got {error!r}; run the take again.",
        ) from None


def _rows(figures: Mapping[str, Any], group: tuple[str, ...] = ()) -> Iterator[Row]:
    # Of a group: it is one side's, or an angle's, a joint's or a limb's.
    sides: list[Side] = [own for name in group if (own := _SIDES.get(name) or side_of(name))]
    side: Side = sides[0] if sides else ""
    for key, content in figures.items():
        if key == Curve.name:
            yield from (_curve(angle, group, **fields) for angle, fields in content.items())
        elif isinstance(content, Mapping):
            yield from _rows(content, (*group, key))
        elif isinstance(content, str):
            yield Remark(key, content, side, group)
        elif key not in _BESIDE:
            yield from _figures(key, content, figures, side, group)


def _figures(
    key: str, content: Any, figures: Mapping[str, Any], side: Side, group: tuple[str, ...]
) -> Iterator[Row]:
    about = _BY_KEY[key]
    side = side or _SIDES.get(about.name, "")
    if about.unit == "moments":
        yield Moments(about.name, tuple(map(float, content)), side, group)
        return
    errors = figures.get(about.error_key)
    if not isinstance(content, Sequence):
        within, least = figures.get(about.within_key), figures.get(f"{about.name}_at_least", False)
        yield Measure(about.name, _number(content), _error(errors), side, None, within, least, group)
        return
    for number, each in enumerate(content):
        if each is not None:
            error = None if errors is None else _error(errors[number])
            yield Measure(about.name, _number(each), error, side, number, group=group)


def _curve(
    angle: str,
    group: tuple[str, ...],
    count: int,
    mean_deg: Sequence[float],
    sd_deg: Sequence[float] | None = None,
) -> Curve:
    sd = None if sd_deg is None else tuple(map(float, sd_deg))
    return Curve(angle, int(count), tuple(map(float, mean_deg)), sd, side_of(angle), group)


def _number(content: Any) -> float:
    if isinstance(content, bool) or not isinstance(content, int | float):
        raise TypeError(content)
    return content


def _error(content: Any) -> float | None:
    return None if content is None else float(_number(content))
