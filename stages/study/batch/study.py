"""The study's table: a row for every take, and how the measures of a subject change from visit to visit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from decimal import Decimal
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from ....models.angle_error.repeatability import difference_sd, figure_of, judged
from ....models.common.metrics import plain
from ....pipeline.core.errors import InputError
from ....pipeline.core.measures import OF_LENGTH, SD_90, Measure, grouped, nested, subgroup, text
from ....pipeline.core.messages import how_many
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import REPORT, SUMMARY, printable, read_summary
from ....pipeline.files.finished import read_run
from ....pipeline.files.names import POSES
from ....pipeline.plugins.options import did_you_mean
from ...drawing.facts import facts_of, mean
from ...drawing.skeletons import key_rows
from ..rates import is_lifted, rates_apart

QUALITY = ("up_error_deg", "up_bound_deg", "error_deg_mean", "bone_length_spread")

FEWEST_SUBJECTS = 6  # for anything that is said of subjects in general
_CHANCE = 0.05
# Of the steps in which figures are stated: standard deviation of the difference of two (uniform errors).
_ROUNDED = float(np.sqrt(2 / 12))
# Figures that others rest on.
_BASIS = ("frames", "nan_share", "beyond_anatomy_frames", "usual_error", "peak_mdc90")
_OF_RECORDING = {("off_keypoints",)}  # groups: the lift's residuals
# Of a notice.
_SAID = ("code", "weight", "about", "text")

# What the table says of a run that left nothing to judge it by.
_UNKNOWN: dict[str, Any] = {
    "notices": [], "verdict": "", "frames": None, "fps": None, "duration_s": None, "unit": "",
    "method": "", "angle_errors": "", "level_ok": None, "level_reason": "", **dict.fromkeys(QUALITY),
    "posture": None, "lifted": False, "judged": False, "gait": "", "measures": {}, "numbers": {},
}  # fmt: skip
# Of study.parquet, whose other columns are numbers, each measure's among them.
_COLUMNS = (
    "name", "subject", "visit", "condition", "person", "state", "exit_code", "code", "reason", "report", "notices",
    "verdict", "frames", "fps", "duration_s", "unit", "method", "angle_errors", "device",
    "level_ok", "level_reason", *QUALITY,
)  # fmt: skip
_NUMBERS = ("fps", "duration_s", *QUALITY)


def figures(folder: Path) -> tuple[dict[str, Any], ...]:
    """What the table says of a take's folder, a row for each person who has a run in it. numbers: all single numbers by
    their keys, as in summary.json. What `write_table` has not: measures, the figures that can be compared, by `place`;
    posture, a frame's joints in BODY; and lifted, whether the run lifted its poses itself. InputError when a file is
    not as a run writes it."""
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
        raise InputError(error.code, f"{str(error).rstrip('.')}: remove that folder first.") from None
    return {**plain(_of_take(take)), "measures": _comparable(take), **row}


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
        "angle_errors": take.angle_errors or "",
        "level_ok": facts.rectified.level_ok,
        "level_reason": printable(facts.rectified.level_reason),
        "up_error_deg": mean(rectified.up_error_deg[rows]),
        "up_bound_deg": mean(rectified.up_bound_deg[rows]),
        "error_deg_mean": mean(rectified.error_deg),
        "bone_length_spread": facts.bone_length_spread,
        "posture": _posture(rectified.body.joints.astype(np.float64)),
        "lifted": is_lifted(take),
        "judged": judged(take.need("poses")),
        "gait": text(subgroup(grouped(take.measures or ()), "walking"), "gait"),
        "numbers": {printable(name): value for name, value in _numbers(nested(take.measures or ()))},
    }


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


def _comparable(take: Take) -> dict[str, Measure]:
    """The take's single figures by place, but no length without a scale, nor what is of the recording, the same as
    another figure, or only says what others rest on."""
    metric = take.need("poses").frame.metric
    return {
        place(row): row
        for row in take.measures or ()
        if isinstance(row, Measure)
        and row.number is None
        and row.name not in _BASIS
        and row.group[:1] not in _OF_RECORDING
        # Its right and left are ranges of motion, which stand by themselves.
        and (row.group[:1] != ("symmetry",) or row.name == "symmetry_index")
        and (metric or row.unit not in OF_LENGTH)
        and bool(np.isfinite(row.value))
    }


def place(measure: Measure) -> str:
    """Its groups and its name: `walking.cadence`."""
    return ".".join((*measure.group, measure.name))


def doubts(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Finished runs by what is not to be believed of them, such as "with unusable poses", or by why it cannot be told;
    rows: as of `study_rows`, one for each person of a take."""
    runs = {
        f"with {weight} poses": [row for row in rows if row.get("verdict") == weight]
        for weight in ("suspicious", "unusable")
    }
    runs["not levelled"] = [row for row in rows if row.get("level_ok") is False]
    # Without the stage `export` a run's summary has no figures.
    runs["that cannot be judged"] = [row for row in rows if row.get("level_ok") is None]
    return {what: doubtful for what, doubtful in runs.items() if doubtful}


def rates_within(rows: Sequence[Mapping[str, Any]]) -> str:
    """What is to be said of subjects whose lifted takes differ in frame rate, for these are compared with each other;
    empty where there is no such subject. rows: as of `study_rows`."""
    rates: dict[str, list[float]] = {}
    for row in rows:
        if row.get("subject") and row.get("lifted") and row.get("fps"):
            rates.setdefault(row["subject"], []).append(row["fps"])
    apart = [subject for subject, of in rates.items() if rates_apart("takes", of)]
    takes = f"takes of {how_many(len(apart), 'subject')}"
    return "".join(
        said.text for said in rates_apart(takes, (rate for subject in apart for rate in rates[subject]))
    )


def name_of(row: Mapping[str, Any]) -> str:
    """A take's name, and the person's where it shows several."""
    return f"{row['name']}, {row['person']}" if row.get("person") else row["name"]


def write_table(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """study.parquet: the columns of the rows, then a column for every number of any; null where a take has none."""
    import pyarrow as pa
    from pyarrow import parquet

    kinds: dict[str, Any] = {name: pa.float64() if name in _NUMBERS else pa.string() for name in _COLUMNS}
    kinds |= {"exit_code": pa.int64(), "frames": pa.int64(), "level_ok": pa.bool_()}
    kinds["notices"] = pa.list_(pa.struct([(name, pa.string()) for name in _SAID]))
    kinds |= {key: pa.float64() for row in rows for key in row.get("numbers", {}) if key not in kinds}
    lines = [{**row.get("numbers", {}), **row} for row in rows]
    parquet.write_table(pa.Table.from_pylist(lines, schema=pa.schema(kinds)), path)


@dataclass(frozen=True)
class Change:
    """Of a measure within subjects, from one visit or condition to another. of: the measure as one take has it.

    n: subjects who have both. bias: mean of the differences, later less earlier; sd: their standard deviation, but what
    the rounding of the figures makes at least, for differences of a few rounded ones may all be the same;
    mean_lower, mean_upper: 95 % confidence interval of the bias (Student's t). mdc90: the minimal detectable change of
    one subject's single take, from wherever both were filmed, by the takes' stated errors
    (repeatability.difference_sd; their median); None where they state none. p: that the mean differs from 0 (Student's
    t, paired). primary: whether it is the outcome that was declared beforehand. differs: whether the subjects changed
    on average, of six subjects or more, None of fewer: the primary outcome by p <= 0.05, the others by p as Benjamini &
    Hochberg (1995) correct it, among those of one step.
    """

    factor: str
    earlier: str
    later: str
    of: Measure
    n: int
    bias: float
    sd: float
    mean_lower: float
    mean_upper: float
    mdc90: float | None = None
    p: float = float("nan")
    primary: bool = False
    differs: bool | None = None

    @property
    def measure(self) -> str:
        """As summary.json has it: its groups and its key."""
        return _key(self.of)


CHANGE = tuple("measure" if field.name == "of" else field.name for field in fields(Change))  # of changes.csv


def changes(rows: Sequence[Mapping[str, Any]], primary: str | None = None) -> list[Change]:
    """Every visit against the first one, and every condition, in the order in which the manifest names them, whatever
    became of the takes that name them first. One without any take to compare is left out.

    A subject's takes of one visit and condition are averaged, then compared within each condition (or visit, for
    conditions), and these differences averaged, so that a subject counts once. Fewer than two subjects: no row.
    Takes that could not be levelled or have unusable poses have no say, nor have takes of several people: nothing says
    which of them is the subject, or who is who at the next visit. primary: the measure, as in changes.csv, that is
    tested without correction. InputError for one that no take has, where
    others have measures.
    """
    done = believed(rows)
    measures = {key: of for row in done for key, of in row["measures"].items()}
    names = [_key(of) for of in measures.values()]
    if names and primary is not None and primary not in names:
        raise InputError(
            "name-unknown", f"No take has the measure '{primary}' (--primary); {did_you_mean(primary, names)}"
        )
    result = []
    for factor, other in (("visit", "condition"), ("condition", "visit")):
        usable = {row[factor] for row in done}
        levels = [level for level in dict.fromkeys(row[factor] for row in rows) if level and level in usable]
        for later in levels[1:]:
            step_changes = []
            for key, measure in measures.items():
                off = _differences(done, key, factor, other, levels[0], later)
                if len(off) >= 2:
                    step = _step(row["measures"][key].value for row in done if key in row["measures"])
                    change = _change(factor, levels[0], later, measure, off, _ROUNDED * step)
                    step_changes.append(replace(change, mdc90=_mdc90(done, key)))
            result += _judged(step_changes, primary)
    return result


def _judged(found: Sequence[Change], primary: str | None) -> list[Change]:
    """The changes of one step, each with whether it differs from none."""
    from scipy.stats import false_discovery_control

    found = [replace(change, primary=change.measure == primary) for change in found]
    enough = [change.n >= FEWEST_SUBJECTS for change in found]
    tested = [change.p for change, many in zip(found, enough, strict=True) if many and not change.primary]
    corrected = iter(false_discovery_control(tested) if tested else ())
    judged = []
    for change, many in zip(found, enough, strict=True):
        p = change.p if change.primary or not many else float(next(corrected))
        judged.append(replace(change, differs=p <= _CHANCE if many else None))
    return judged


def _key(of: Measure) -> str:
    return printable(".".join((*of.group, of.key)))


def _mdc90(rows: Sequence[Mapping[str, Any]], key: str) -> float | None:
    """Of the takes that have the measure; None where one of them states no error."""
    found = []
    for row in rows:
        if (of := row["measures"].get(key)) is not None:
            error, figure = of.error, figure_of(of, row["gait"])
            errors = (np.nan, np.nan) if error is None else (error, error)
            if row["judged"] and figure is not None:
                found.append(difference_sd(figure, errors, "elsewhere"))
            else:
                found.append(float(np.hypot(*errors)))
    usual = float(np.median(found))
    return SD_90 * usual if np.isfinite(usual) else None


def believed(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Those of subjects that have a say in changes."""
    people = Counter(row["name"] for row in rows if row.get("person"))
    return [
        row
        for row in rows
        if row.get("subject")
        and row.get("measures")
        and row["level_ok"] is not False
        and row.get("verdict") != "unusable"
        and not (row.get("person") and people[row["name"]] > 1)
    ]


def _change(factor: str, earlier: str, later: str, of: Measure, off: np.ndarray, rounding: float) -> Change:
    """off: (n,) differences, one a subject. rounding: the least standard deviation."""
    from scipy.stats import t as student_t

    bias, sd = float(off.mean()), max(float(off.std(ddof=1)), rounding)
    margin = float(student_t.ppf(0.975, len(off) - 1)) * sd / np.sqrt(len(off))
    p = float(2 * student_t.sf(abs(bias) / (sd / np.sqrt(len(off))), len(off) - 1)) if sd > 0 else 1.0
    return Change(factor, earlier, later, of, len(off), bias, sd, bias - margin, bias + margin, p=p)


def _step(values: Iterable[float]) -> float:
    """Of the last decimal in which any is stated, to which all are taken to be rounded; 1 of whole numbers, counts too.
    Takes that are alike are rounded alike, so that a mean of several is known no better."""
    ends = [int(Decimal(str(value)).normalize().as_tuple().exponent) for value in values]
    return float(10.0 ** min([0, *ends]))


def _differences(
    rows: Sequence[Mapping[str, Any]], key: str, factor: str, other: str, earlier: str, later: str
) -> np.ndarray:
    """(subjects who have both,) of one measure."""
    cells: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        if key in row["measures"] and row[factor] in (earlier, later):
            cells.setdefault((row["subject"], row[other], row[factor]), []).append(row["measures"][key].value)
    within: dict[str, list[float]] = {}
    for subject, level, place in cells:
        if place == earlier and (subject, level, later) in cells:
            off = fmean(cells[subject, level, later]) - fmean(cells[subject, level, earlier])
            within.setdefault(subject, []).append(off)
    return np.array([fmean(off) for off in within.values()])
