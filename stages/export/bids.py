"""bids/: the take as a data set of Motion-BIDS, with joints, angles and their errors.

Specification: BIDS 1.10, "Motion" (Jeung et al., Scientific Data 11, 716, 2024). Data sets of several takes become one
when their folders are copied into one.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...models.common.metrics import plain
from ...pipeline.core.frames import LEVEL
from ...pipeline.core.layouts import with_feet
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import package_version
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ...pipeline.signals.filters import rate
from ...pipeline.signals.foot_angles import ALL_ANGLES
from .c3d import contacts
from .markers import frame_over_the_floor, nothing_in, over_the_floor, require_metres
from .provenance import provenance

_MADE_BY, _NONE = "pcnet3d", "n/a"
# Of channels.
_TYPES = ("ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL")
_EVENTS = {"landings": "initial contact", "toe_offs": "toe-off"}


class _Channel(NamedTuple):
    """A row of _channels.tsv by its columns, and the column (T,) of _motion.tsv that it describes."""

    name: str
    component: str
    type: str
    tracked_point: str
    units: str
    reference_frame: str
    description: str
    values: np.ndarray


def write_bids(take: Take, path: Path) -> tuple[Notice, ...]:
    """A folder: dataset_description.json, README.md, and in `sub-<person>[/ses-<date>]/motion/` `_motion.tsv`, its
    sidecar `_motion.json`, `_channels.tsv`, `_channels.json`, and `_events.tsv` of a walk. Rows are those of
    kinematics.parquet: seconds from the first, the filtered joints in metres (LEVEL, over the floor where that is
    known), angles in degrees and their standard deviations; a missing value is "n/a". Without any joint nothing is
    written, and a warning says so. InputError for a take without a scale.
    """
    if nothing := nothing_in(take.need("filtered").joints, path):
        return nothing
    labels = {"sub": _label(take.session.person_id or take.need("poses").person, "01")}
    if date := _label(take.session.date, ""):
        labels["ses"] = date
    folder = path.joinpath(*(f"{key}-{label}" for key, label in labels.items()), "motion")
    labels |= {"task": _label(take.name, "take"), "tracksys": _MADE_BY}
    stem = "_".join(f"{key}-{label}" for key, label in labels.items())
    channels, columns = list(_channels(take)), _Channel._fields[:-1]
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder / f"{stem}_motion.tsv", _cells(channels))
    _write(folder / f"{stem}_channels.tsv", (columns, *(channel[:-1] for channel in channels)))
    if events := list(_events(take)):
        _write(folder / f"{stem}_events.tsv", (("onset", "duration", "trial_type"), *events))
    _write_json(folder / f"{stem}_motion.json", _sidecar(take, channels))
    frame = {"SpatialAxes": "PRS", "Description": str(frame_over_the_floor(take, LEVEL))}
    _write_json(folder / f"{stem}_channels.json", {"reference_frame": {"Levels": {"level": frame}}})
    _write(
        path / "README.md", [["Motion of people in videos, by pcnet3d; errors are one standard deviation."]]
    )
    made = {"Name": _MADE_BY, "Version": package_version()}
    about = {
        "Name": "Motion by pcnet3d",
        "BIDSVersion": "1.10.0",
        "DatasetType": "raw",
        "GeneratedBy": [made],
    }
    _write_json(path / "dataset_description.json", about)
    return ()


def _channels(take: Take) -> Iterator[_Channel]:
    path, columns = with_feet(take.need("filtered")), take.need("kinematics")
    require_metres(path.frame.unit)
    joints, times = path.joints.astype(np.float64), path.times
    if path.root is not None:
        joints += over_the_floor(take, path.root.astype(np.float64), LEVEL)[:, None]
    latency = "seconds from the first row"
    yield _Channel("latency", _NONE, "LATENCY", _NONE, "s", _NONE, latency, times - times[0])
    for i, joint in enumerate(path.layout.joints):
        for j, axis in enumerate("xyz"):
            yield _Channel(f"{joint}_{axis}", axis, "POS", joint, "m", "level", _NONE, joints[:, i, j])
    for name, angle in ALL_ANGLES.items():
        if f"{name}_deg" in columns:
            kind = "MISC" if angle.needs_gravity else "JNTANG"
            words, value, sd = f"{angle.words}; grows: {angle.positive}", f"{name}_deg", f"{name}_sd_deg"
            yield _Channel(name, _NONE, kind, _NONE, "deg", _NONE, words, columns[value])
            words = f"standard deviation of the error of {name}"
            yield _Channel(f"{name}_sd", _NONE, "MISC", _NONE, "deg", _NONE, words, columns[sd])


def _events(take: Take) -> Iterator[tuple[str, str, str]]:
    """Seconds from the first row, a duration of 0 and the words of each foot's contact."""
    for at_s, side, name in contacts(take):
        yield repr(at_s - float(take.need("filtered").times[0])), "0", f"{side} {_EVENTS[name]}"


def _sidecar(take: Take, channels: Iterable[_Channel]) -> dict[str, Any]:
    times = take.need("filtered").times
    kinds = Counter(channel.type for channel in channels)
    span_s = float(times[-1] - times[0])
    return {
        "TaskName": take.name,
        "TrackingSystemName": _MADE_BY,
        "SamplingFrequency": rate(times) if span_s else _NONE,
        "SamplingFrequencyEffective": (len(times) - 1) / span_s if span_s else _NONE,
        "RecordingDuration": span_s,
        "MissingValues": _NONE,
        "MotionChannelCount": kinds.total(),
        "TrackedPointsCount": len({channel.tracked_point for channel in channels} - {_NONE}),
        **{f"{kind}ChannelCount": kinds[kind] for kind in _TYPES},
        "SoftwareVersions": package_version(),
        "Provenance": provenance(take, frame_over_the_floor(take, LEVEL)),
    }


def _label(text: str, otherwise: str) -> str:
    """Letters and digits alone, as BIDS has them in names of files."""
    return re.sub("[^0-9A-Za-z]", "", text) or otherwise


def _cells(channels: Iterable[_Channel]) -> Iterator[list[str]]:
    for row in np.stack([channel.values for channel in channels], axis=1).astype(np.float64).tolist():
        yield [repr(value) if value == value else _NONE for value in row]


def _write(path: Path, rows: Iterable[Iterable[str]]) -> None:
    with whole_file(path) as partial:
        lines = ("\t".join(row) + "\n" for row in rows)
        partial.write_text("".join(lines), encoding="utf-8", newline="\n")


def _write_json(path: Path, content: dict[str, Any]) -> None:
    _write(path, [[json.dumps(plain(content), indent=1, ensure_ascii=False)]])
