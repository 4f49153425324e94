"""The charts of a comparison, the right side beside the left on one row: the reference in grey, the other one in the
colours that the sides have everywhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from markupsafe import Markup

from ....models.common.metrics import SD_90
from ....pipeline.core.canonical import R_world_from_body
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import side_of
from ....pipeline.core.rotations import is_finite, rotate, transpose
from ....pipeline.signals.angles import MIDLINE, OF_BOTH, near, sides_of
from ...drawing.charts import LEFT, MIDDLE, RIGHT, SOFT, Cloud, Curve, over_time, path, scatter
from ...drawing.facts import ways_of_level
from ...drawing.page import charts, figure, joined
from ...drawing.skeletons import body_views, key_rows, skeletons
from ...drawing.words import spoken
from .comparison import Pair

_LEAST_HEIGHT_DEG = 1.0  # of the axis of differences
_WIDE = 2.6  # the reference's line, so that it is seen where both run together


def thumbnails(pair: Pair) -> Markup:
    """Both skeletons at the same moments, one over the other, each turned to face the reader."""
    both = (pair.level, pair.reference.joints_at(pair.times))  # LEVEL
    mine, other = (rotate(transpose(R_world_from_body(joints)), joints) for joints in both)
    there = is_finite(other)
    known = there.mean(axis=1, keepdims=True) > 0.5 * there.any(axis=0).mean()  # of what it has in any frame
    shown = []
    for row in key_rows(np.where(known[..., None], mine, np.nan)):
        words = f"{pair.side.name} over {pair.reference.name} at {pair.times[row]:.2f} s"
        drawn = skeletons(body_views(mine[row]), H36M17, words, behind=body_views(other[row]))
        shown.append(figure([drawn], f"{pair.times[row]:.2f} s"))
    return charts(shown, small=True)


def angle_rows(pair: Pair) -> Markup:
    """A row of charts for every angle: over time, right and left, and the differences over the mean of both."""
    return joined(charts(_angle_row(pair, name)) for name in OF_BOTH)


def _angle_row(pair: Pair, both: str) -> Iterator[Markup]:
    names = [name for name in sides_of(both) if name in pair.agreement]
    clouds = []
    for name in names:
        title = f"{spoken(name).capitalize()} (°)"
        values, other = pair.side.angles[name], pair.at_reference[name]
        curves = _two(pair.reference.name, other, pair.side.name, values, name, pair.sd[name])
        yield figure([over_time(curves, pair.times, f"{title} of both over time")], title)
        clouds.append(differences(name, values, other, pair.agreement[name]))
    if clouds:
        title = f"{spoken(both).capitalize()}: difference (°)"
        drawn = scatter(clouds, f"{title} over the mean of both", "mean of both (°)", _LEAST_HEIGHT_DEG)
        yield figure([drawn], title)


def differences(name: str, values: np.ndarray, reference: np.ndarray, of: Mapping[str, float | int]) -> Cloud:
    """The differences of an angle (T,) from the reference's (T,) in degrees over the means of both, with the bias and
    the limits. of: figures.agreement of the two."""
    off = near(values - reference, 0.0)
    levels = (float(of["bias_deg"]), float(of["lower_deg"]), float(of["upper_deg"]))
    return Cloud(side_of(name), reference + off / 2, off, _colour(name), levels)


def cycle_rows(pair: Pair) -> Markup:
    """The mean cycles of both with a band of one standard deviation, each kind of cycle on rows of its own."""
    rows: dict[str, list[Markup]] = {}
    for cycle in pair.cycles:
        mine, other = (
            (each.mean(axis=0), each.std(axis=0, ddof=1)) for each in (cycle.curves, cycle.reference)
        )
        curves = [
            Curve(pair.reference.name, other[0], SOFT, other[1], width=_WIDE),
            Curve(pair.side.name, mine[0], _colour(cycle.angle), mine[1]),
        ]
        title = f"{cycle.kind.capitalize()}: {spoken(cycle.angle)} (°)"
        chart = over_time(curves, np.linspace(0, 100, len(mine[0])), f"{title} over a cycle", "cycle (%)")
        rows.setdefault(cycle.kind, []).append(figure([chart], title))
    return joined(map(charts, rows.values()))


def wrist_paths(pair: Pair, unit: str) -> Markup:
    """Both wrists from two sides and from above, in the reference's LEVEL and at one scale."""
    mine, other = (_wrists(joints) for joints in (pair.level, pair.reference.joints_at(pair.times)))
    front, right = ways_of_level(
        pair.reference.run.need("rectified").level_heading if pair.reference.run else "median"
    )
    views = {
        f"From {right}": ((0, 2), (-1, 1), f"{front} is to the right"),
        "From above": ((1, 0), (1, -1), f"{front} is up, {right} to the right"),
        f"From {front}": ((1, 2), (-1, 1), f"{right} is to the left"),
    }
    every = np.concatenate([*mine.values(), *other.values()])
    every = every[is_finite(every)]
    if not len(every):
        return Markup("")
    low, high = every.min(axis=0), every.max(axis=0)
    reach, shown = 0.55 * float((high - low).max()), []
    gap = np.full((1, 3), np.nan)
    for name, (axes, signs, words) in views.items():
        lines = {SOFT: np.concatenate([other[RIGHT], gap, other[LEFT]]), **mine}
        drawn = {colour: points[:, axes] * signs for colour, points in lines.items()}
        title = f"{name} ({unit})"
        centre = ((low + high) / 2)[list(axes)] * signs
        shown.append(
            figure([path(drawn, centre, reach, f"Paths of both wrists: {title}")], title, f"{words}.")
        )
    return charts(shown)


def acceleration_rows(pair: Pair, unit: str) -> Markup:
    """Charts of the accelerations of both over time, right beside left."""
    both = pair.accelerations
    if both is None:
        return Markup("")
    rows = []
    for limb in ("wrist", "ankle"):
        shown = []
        for joint in (f"{side}_{limb}" for side in "rl"):
            if joint in both.values:
                title = f"{spoken(joint).capitalize()} acceleration ({unit}/s²)"
                curves = _two(
                    pair.reference.name, both.reference[joint], pair.side.name, both.values[joint], joint,
                    both.sd[joint],
                )  # fmt: skip
                shown.append(figure([over_time(curves, pair.times, f"{title} of both over time")], title))
        rows.append(charts(shown))
    return joined(rows)


def _two(
    reference: str, other: np.ndarray, side: str, values: np.ndarray, name: str, sd: np.ndarray
) -> list[Curve]:
    """The reference and, over it, the side with the band that holds nine of ten references if the errors are right."""
    margin = SD_90 * sd if np.isfinite(sd).any() else None
    return [Curve(reference, other, SOFT, width=_WIDE), Curve(side, values, _colour(name), margin)]


def _colour(name: str) -> str:
    """Of an angle's or a joint's side."""
    return MIDDLE if name in MIDLINE else RIGHT if name.startswith("r_") else LEFT


def _wrists(joints: np.ndarray) -> dict[str, np.ndarray]:
    """(T, 3) by colour."""
    return {RIGHT: joints[:, H36M17.index("r_wrist")], LEFT: joints[:, H36M17.index("l_wrist")]}
