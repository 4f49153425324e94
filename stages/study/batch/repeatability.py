"""How well a measure repeats when nothing changed: of subjects with several takes at one visit.

ICC(2,1): Shrout & Fleiss, Psychol Bull 86(2), 1979, two-way random effects, absolute agreement, one take; its interval:
McGraw & Wong, Psychol Methods 1(1), 1996, table 7. SEM: the standard deviation within subjects (Bland & Altman, BMJ
313:744, 1996), with what all subjects have in common from one take to the next; MDC95: 1.96 sqrt(2) SEM (Weir, J
Strength Cond Res 19(1), 2005). Limits of agreement of two takes: Bland & Altman, Lancet 1986.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.measures import Measure
from ....pipeline.files.atomic import printable

FEWEST_SUBJECTS = 6  # for anything that is said of subjects in general
_LIMIT = 1.96
COLUMNS = (
    "measure", "unit", "subjects", "takes", "icc", "icc_lower", "icc_upper", "sem", "sem_lower", "sem_upper", "mdc95",
    "bias", "lower", "lower_from", "lower_to", "upper", "upper_from", "upper_to",
)  # fmt: skip


@dataclass(frozen=True)
class Repeatability:
    """Of one measure. of: the measure as one take has it. subjects, takes: how many, and how many each has. icc: with
    its 95 % interval; NaN where subjects do not differ at all. sem: with its 95 % interval, mdc95: in the measure's
    unit. bias: second take less first; lower, upper: 95 % limits of agreement of these, each with its 95 % interval."""

    of: Measure
    subjects: int
    takes: int
    icc: float
    icc_lower: float
    icc_upper: float
    sem: float
    sem_lower: float
    sem_upper: float
    bias: float
    lower: float
    lower_from: float
    lower_to: float
    upper: float
    upper_from: float
    upper_to: float

    @property
    def measure(self) -> str:
        """As in changes.csv."""
        return printable(".".join((*self.of.group, self.of.key)))

    @property
    def unit(self) -> str:
        return self.of.unit

    @property
    def mdc95(self) -> float:
        return _LIMIT * float(np.sqrt(2)) * self.sem


def repeatability(rows: Sequence[Mapping[str, Any]]) -> list[Repeatability]:
    """Of every measure that at least six subjects have in two takes or more of one visit and condition: of each subject
    the first such visit counts, with as many takes as all of them have. rows: those that may be believed, of a study's
    table."""
    measures = {key: of for row in rows for key, of in row["measures"].items()}
    result = []
    for key, measure in measures.items():
        cells: dict[str, dict[tuple[str, str], list[float]]] = {}
        for row in rows:
            if key in row["measures"]:
                visits = cells.setdefault(row["subject"], {})
                visits.setdefault((row["visit"], row["condition"]), []).append(row["measures"][key].value)
        several = [
            found
            for visits in cells.values()
            if (found := next((v for v in visits.values() if len(v) > 1), None))
        ]
        if len(several) >= FEWEST_SUBJECTS:
            takes = min(map(len, several))
            values = np.array([each[:takes] for each in several])
            figures = (*icc(values), *sem(values), *limits(values[:, 1] - values[:, 0]))
            result.append(Repeatability(measure, len(several), takes, *figures))
    return result


def icc(values: np.ndarray) -> tuple[float, float, float]:
    """ICC(2,1) of values (N, K), subjects and takes, with its 95 % interval; NaN where nothing varies."""
    from scipy.stats import f as fisher

    n, k = values.shape
    between, columns, rest = _mean_squares(values)
    denominator = between + (k - 1) * rest + k * (columns - rest) / n
    if denominator <= 0 or between <= 0:
        return float("nan"), float("nan"), float("nan")
    found = (between - rest) / denominator
    a = k * found / (n * (1 - found)) if found < 1 else np.inf
    b = 1 + k * found * (n - 1) / (n * (1 - found)) if found < 1 else np.inf
    if not np.isfinite([a, b]).all() or rest <= 0:
        return float(found), float("nan"), float("nan")
    freedom = (a * columns + b * rest) ** 2 / (
        (a * columns) ** 2 / (k - 1) + (b * rest) ** 2 / ((n - 1) * (k - 1))
    )
    high, low = fisher.ppf(0.975, n - 1, freedom), fisher.ppf(0.975, freedom, n - 1)
    both = k * columns + (k * n - k - n) * rest
    lower = n * (between - high * rest) / (high * both + n * between)
    upper = n * (low * between - rest) / (both + n * low * between)
    return float(found), float(lower), float(upper)


def sem(values: np.ndarray) -> tuple[float, float, float]:
    """The standard deviation within subjects of values (N, K), subjects and takes, with its 95 % interval (chi
    squared)."""
    from scipy.stats import chi2

    freedom = values.shape[0] * (values.shape[1] - 1)
    squares = float(((values - values.mean(axis=1, keepdims=True)) ** 2).sum())
    lower, upper = (float(np.sqrt(squares / chi2.ppf(share, freedom))) for share in (0.975, 0.025))
    return float(np.sqrt(squares / freedom)), lower, upper


def limits(off: np.ndarray) -> tuple[float, float, float, float, float, float, float]:
    """Of differences (N,): their mean, then the lower and the upper 95 % limit of agreement, each with its 95 %
    interval (standard error sqrt(1 / n + 1.96^2 / (2 (n - 1))) of their standard deviation)."""
    from scipy.stats import t as student_t

    n, mean, sd = len(off), float(off.mean()), float(off.std(ddof=1))
    margin = float(student_t.ppf(0.975, n - 1)) * sd * float(np.sqrt(1 / n + _LIMIT**2 / (2 * (n - 1))))
    low, high = mean - _LIMIT * sd, mean + _LIMIT * sd
    return mean, low, low - margin, low + margin, high, high - margin, high + margin


def as_lines(found: Sequence[Repeatability]) -> list[str]:
    """A table for the terminal."""
    if not found:
        return []
    head = (
        f"Repeatability of {found[0].takes} takes at one visit ({found[0].subjects} subjects; 95 % intervals in "
        "brackets):"
    )
    lines = [head, f"{'measure':<44}{'ICC(2,1)':>22}{'SEM':>24}{'MDC95':>9}{'limits of agreement':>24}"]
    for one in found:
        ratio = f"{one.icc:.2f} ({one.icc_lower:.2f} to {one.icc_upper:.2f})"
        spread = f"{one.sem:.3g} ({one.sem_lower:.3g} to {one.sem_upper:.3g})"
        between = f"{one.lower:.3g} to {one.upper:.3g}"
        lines.append(f"{one.measure:<44}{ratio:>22}{spread:>24}{one.mdc95:>9.3g}{between:>24}")
    return lines


def _mean_squares(values: np.ndarray) -> tuple[float, float, float]:
    """Between subjects, between takes, and what is left, of (n, k)."""
    n, k = values.shape
    rows, columns, all_ = (
        values.mean(axis=1, keepdims=True),
        values.mean(axis=0, keepdims=True),
        values.mean(),
    )
    rest = values - rows - columns + all_
    return (
        float(k * ((rows - all_) ** 2).sum() / (n - 1)),
        float(n * ((columns - all_) ** 2).sum() / (k - 1)),
        float((rest**2).sum() / ((n - 1) * (k - 1))),
    )
