"""The study's table: a row for every take, and how the measures of a subject change from visit to visit.

Limits of agreement: Bland & Altman, "Statistical methods for assessing agreement between two methods of clinical
measurement", Lancet 1986: mean of the differences and 1.96 of their standard deviations to each side.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from ....models.common.metrics import plain
from ....pipeline.core.errors import InputError
from ....pipeline.core.measures import nested
from ....pipeline.core.messages import how_many
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import REPORT, SUMMARY, printable, read_summary
from ....pipeline.files.finished import POSES, read_run
from ...drawing.facts import facts_of
from ...drawing.skeletons import key_rows
from ..rates import is_lifted, rates_apart

QUALITY = ("up_error_deg", "up_bound_deg", "error_deg_mean", "bone_length_spread")

_LIMIT = 1.96
# Of the steps in which figures are stated: standard deviation of the difference of two (uniform errors).
_ROUNDED = float(np.sqrt(2 / 12))
# What a measure rests on, or its error.
_NO_MEASURE = ("frames", "nan_share", "beyond_anatomy_frames", "places", "sd_deg")


# What the table says of a run that left nothing to judge it by.
_UNKNOWN: dict[str, Any] = {
    "notices": [], "verdict": "", "frames": None, "fps": None, "duration_s": None, "unit": "",
    "method": "", "level_ok": None, "level_reason": "", **dict.fromkeys(QUALITY), "posture": None, "lifted": False,
    "measures": {},
}  # fmt: skip
# Of a notice.
_SAID = ("code", "weight", "about", "text")


def figures(folder: Path) -> tuple[dict[str, Any], ...]:
    """What the table says of a take's folder, a row for each person who has a run in it. posture: a frame's joints in
    BODY, and lifted: whether the run lifted its poses itself; `write_table` has neither. InputError when a file is not
    as a run writes it."""
    people = [path.parent for path in sorted(folder.glob(f"*/{SUMMARY}")) if (path.parent / POSES).exists()]
    return tuple(_figures(run, run.relative_to(folder.parent.parent)) for run in people or [folder])


def _figures(folder: Path, place: Path) -> dict[str, Any]:
    """place: of the folder, seen from the study's page."""
    device = read_summary(folder).get("device")
    networks = device.get("networks") if isinstance(device, dict) else None
    row = {
        "person": printable(folder.name) if len(place.parts) > 2 else "",
        "report": printable((place / REPORT).as_posix()) if (folder / REPORT).exists() else "",
        "device": printable(", ".join(sorted({*map(str, networks.values())})))
        if isinstance(networks, dict)
        else "",
    }
    if not (folder / POSES).exists():
        return {**_UNKNOWN, **row}
    try:
        take = read_run(folder)
    except InputError as error:
        raise InputError(f"{str(error).rstrip('.')}: remove that folder first.") from None
    return plain({**_of_take(take), **row})


def _of_take(take: Take) -> dict[str, Any]:
    facts, rectified = facts_of(take), take.need("rectified")
    rows = rectified.turned if rectified.camera == "moving" else slice(None)
    return {
        "notices": [{part: printable(getattr(each, part)) for part in _SAID} for each in take.said],
        "verdict": facts.verdict or "",
        "frames": len(facts.poses),
        "fps": facts.poses.fps,
        "duration_s": facts.duration_s,
        "unit": facts.poses.frame.unit,
        "method": printable(facts.rectified.method),
        "level_ok": facts.rectified.level_ok,
        "level_reason": printable(facts.rectified.level_reason),
        "up_error_deg": _mean(rectified.up_error_deg[rows]),
        "up_bound_deg": _mean(rectified.up_bound_deg[rows]),
        "error_deg_mean": _mean(rectified.error_deg),
        "bone_length_spread": facts.bone_length_spread,
        "posture": _posture(rectified.body.joints.astype(np.float64)),
        "lifted": is_lifted(take),
        "measures": {printable(name): value for name, value in _numbers(nested(take.measures or ()))},
    }


def _mean(values: np.ndarray) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def _posture(body: np.ndarray) -> list[list[float]] | None:
    """The joints of one frame that shows what happens in a take, of joints (T, 17, 3); None where nothing is known of
    any."""
    rows = key_rows(body, 1)
    return np.round(body[rows[0]], 3).tolist() if rows else None


def _numbers(group: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, float]]:
    """The single figures, their keys joined by dots as in measures.csv; lists and words are left out."""
    for key, value in group.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{above}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{above}{key}", float(value)


def error_key(measure: str) -> str:
    """Of the error of a measure, such as `walking.cadence_error_spm`: the table of a study has only keys, those of
    summary.json."""
    if of_length(measure):
        return f"{measure}_error"
    words, _, unit = measure.rpartition("_")
    return f"{words}_error_{unit}"


def of_length(measure: str) -> bool:
    """Whether a measure is in the take's unit of length, or in that a second, which its key does not name."""
    return measure.removesuffix("_error").endswith(("_length", "_width", "_height", "_speed"))


def doubts(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Finished runs by what is not to be believed of them, such as "with unusable poses", or by why it cannot be told;
    rows: as of `study_rows`, one for each person of a take."""
    found = {
        f"with {weight} poses": [row for row in rows if row.get("verdict") == weight]
        for weight in ("suspicious", "unusable")
    }
    found["not levelled"] = [row for row in rows if row.get("level_ok") is False]
    # Without the stage `export` a run's summary has no figures.
    found["that left nothing to judge them by"] = [row for row in rows if row.get("level_ok") is None]
    return {what: doubtful for what, doubtful in found.items() if doubtful}


def rates_within(rows: Sequence[Mapping[str, Any]]) -> str:
    """What is to be said of subjects whose lifted takes differ in frame rate, for these are compared with each other;
    empty where there is no such subject. rows: as of `study_rows`."""
    rates: dict[str, list[float]] = {}
    for row in rows:
        if row.get("subject") and row.get("lifted") and row.get("fps"):
            rates.setdefault(row["subject"], []).append(row["fps"])
    apart = [subject for subject, of in rates.items() if rates_apart(of)]
    if not apart:
        return ""
    words = rates_apart(rate for subject in apart for rate in rates[subject])
    return f"The takes of {how_many(len(apart), 'subject')} were {words}"


def name_of(row: Mapping[str, Any]) -> str:
    """A take's name, and the person's where it shows several."""
    return f"{row['name']}, {row['person']}" if row.get("person") else row["name"]


def write_table(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """study.parquet: the columns of the rows, then a column for every measure of any; null where a take has none."""
    import pyarrow as pa
    from pyarrow import parquet

    words = (
        "name",
        "subject",
        "visit",
        "condition",
        "person",
        "state",
        "reason",
        "report",
        "unit",
        "method",
        "device",
        "verdict",
    )
    kinds: dict[str, Any] = dict.fromkeys((*words, "verdict", "level_reason"), pa.string())
    kinds |= {"exit_code": pa.int64(), "frames": pa.int64(), "level_ok": pa.bool_()}
    kinds["notices"] = pa.list_(pa.struct([(name, pa.string()) for name in _SAID]))
    measures = dict.fromkeys(key for row in rows for key in row.get("measures", {}))
    order = [
        *words[:6],
        "exit_code",
        "reason",
        "report",
        "notices",
        "verdict",
        "frames",
        "fps",
        "duration_s",
        "unit",
    ]
    order += ["method", "device", "level_ok", "level_reason", *QUALITY]
    columns = {
        name: pa.array([row.get(name) for row in rows], type=kinds.get(name, pa.float64())) for name in order
    }
    columns |= {
        name: pa.array([row.get("measures", {}).get(name) for row in rows], type=pa.float64())
        for name in measures
    }
    parquet.write_table(pa.table(columns), path)


@dataclass(frozen=True)
class Change:
    """Of a measure within subjects, from one visit or condition to another.

    n: subjects who have both. bias: mean of the differences, later less earlier; sd: their standard deviation, but what
    the rounding of the figures makes at least, for differences of a few rounded ones may all be the same;
    mean_lower, mean_upper: 95 % confidence interval of the bias (Student's t). lower, upper: 95 % limits of agreement,
    between which the change of a single subject lies.
    """

    factor: str
    earlier: str
    later: str
    measure: str
    n: int
    bias: float
    sd: float
    mean_lower: float
    mean_upper: float
    lower: float
    upper: float

    @property
    def of_the_mean(self) -> bool:
        """Whether the subjects changed on average: 0 lies outside the interval of the mean."""
        return self.mean_lower > 0 or self.mean_upper < 0


def changes(rows: Sequence[Mapping[str, Any]]) -> list[Change]:
    """Every visit against the first one, and every condition, in the order in which the manifest names them, whatever
    became of the takes that name them first. One without any take to compare is left out.

    A subject's takes of one visit and condition are averaged, then compared within each condition (or visit, for
    conditions), and these differences averaged, so that a subject counts once. Fewer than two subjects: no row.
    Takes that could not be levelled or have unusable poses have no say, nor have takes of several people: nothing says
    which of them is the subject, or who is who at the next visit. Nor has the unknown unit of a take without a scale in
    its lengths.
    """
    from scipy.stats import t as student_t

    found = []
    people = Counter(row["name"] for row in rows if row.get("person"))
    done = [
        row
        for row in rows
        if row.get("subject")
        and row.get("measures")
        and row["level_ok"] is not False
        and row.get("verdict") != "unusable"
        and not (row.get("person") and people[row["name"]] > 1)
    ]
    names = dict.fromkeys(key for row in done for key in row["measures"] if not _rests_on(key))
    rounding = {name: _ROUNDED * _step(row["measures"].get(name) for row in done) for name in names}
    for factor, other in (("visit", "condition"), ("condition", "visit")):
        usable = {row[factor] for row in done}
        levels = [level for level in dict.fromkeys(row[factor] for row in rows) if level and level in usable]
        for later in levels[1:]:
            for name in names:
                off = _differences(done, name, factor, other, levels[0], later)
                if len(off) >= 2:
                    bias, sd = float(off.mean()), max(float(off.std(ddof=1)), rounding[name])
                    margin = float(student_t.ppf(0.975, len(off) - 1)) * sd / np.sqrt(len(off))
                    limits = (bias - margin, bias + margin, bias - _LIMIT * sd, bias + _LIMIT * sd)
                    found.append(Change(factor, levels[0], later, name, len(off), bias, sd, *limits))
    return found


def _rests_on(name: str) -> bool:
    """Whether a figure says what a measure rests on or how wrong it is, and is none itself. A count of a curve's cycles
    is of those that are whole; other counts are of what the person did."""
    *groups, key = name.split(".")
    whole_cycles = key == "count" and "cycles" in groups
    return key in _NO_MEASURE or whole_cycles or "_error_" in key or key.endswith("_error")


def _step(values: Iterable[float | None]) -> float:
    """Of the last decimal in which any is stated, to which all are taken to be rounded; 1 of whole numbers, counts too.
    Takes that are alike are rounded alike, so that a mean of several is known no better."""
    known = [value for value in values if value is not None and np.isfinite(value)]
    ends = [int(Decimal(str(value)).normalize().as_tuple().exponent) for value in known]
    return float(10.0 ** min([0, *ends]))


def _differences(
    rows: Sequence[Mapping[str, Any]], name: str, factor: str, other: str, earlier: str, later: str
) -> np.ndarray:
    """(subjects who have both,) of one measure."""
    cells: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        value = None if of_length(name) and row["unit"] != "m" else row["measures"].get(name)
        if value is not None and row[factor] in (earlier, later):
            cells.setdefault((row["subject"], row[other], row[factor]), []).append(value)
    within: dict[str, list[float]] = {}
    for subject, level, place in cells:
        if place == earlier and (subject, level, later) in cells:
            off = fmean(cells[subject, level, later]) - fmean(cells[subject, level, earlier])
            within.setdefault(subject, []).append(off)
    return np.array([fmean(off) for off in within.values()])
