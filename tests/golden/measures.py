"""Measures written as they stand in summary.json."""

from pcnet3d.pipeline.core.figures import FIGURES
from pcnet3d.pipeline.core.measures import Measure, Measures
from pcnet3d.pipeline.files.measures import read_measures
from pcnet3d.stages.study.batch.study import place


def rows_of(figures: dict) -> Measures:
    """The measures whose `nested` is these figures."""
    return read_measures(figures)


def by_place(numbers: dict[str, float]) -> dict[str, Measure]:
    """Measures as a study's rows have them, of numbers by their dotted keys, such as "walking.cadence_spm"."""
    names = {figure.key: figure.name for figure in FIGURES.values()}
    rows = []
    for dotted, number in numbers.items():
        *groups, key = dotted.split(".")
        rows.append(Measure(names[key], number, group=tuple(groups)))
    return {place(row): row for row in rows}
