"""What a batch is to run: the rows of a manifest, or what lies in a folder, as options of `pcnet3d run`."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.messages import how_many, say
from ....pipeline.core.system import is_file_name
from ....pipeline.files.atomic import printable
from ....pipeline.plugins import registry
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.reading.find import adapters, recognises
from ....pipeline.reading.flags import is_repeatable
from ....pipeline.reading.settings import RunOptions, flag_of, settings_named
from ....pipeline.running.plan import checked_setting, planned

LABELS = ("subject", "visit", "condition")
VIDEOS = (
    ".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm", ".wmv", ".flv", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts",
)  # fmt: skip
# Of files that hold poses and hardly anything else.
_POSES = (".npy", ".npz", ".pkl", ".pickle", ".mat", ".h5", ".hdf5", ".trc", ".c3d", ".bvh")
_NAMED = re.compile(r"(?P<take>.+)\.(?P<role>poses|keypoints)(\..*)?$")
_MOST = 10  # names of files in a sentence

_ROLES = ("video", "poses", "keypoints")
_FIELDS = tuple(name for name in RunOptions.model_fields if name not in ("settings", "keypoints_options"))
_TOGETHER = ("pitch", "roll")  # of which none is taken without the other
_DECIDING = (*_ROLES, "recipe", "calibrate", "person")  # which stages a take has
_LARGEST = 64 << 20  # bytes of a manifest; some 300,000 takes
_LONGEST = 100  # characters of a take's name, which becomes a folder's
_NO = ("no",)  # of a flag; it is no option of the take, but a common one does not win over it


@dataclass(frozen=True)
class Entry:
    """A take that is to be run.

    options: of `pcnet3d run`, as text, paths absolute; more than one for those that are repeatable. files: which of
    them are paths. labels: subject, visit and condition, empty where not given.
    """

    name: str
    options: dict[str, tuple[str, ...]]
    files: tuple[str, ...]
    labels: dict[str, str]

    @property
    def arguments(self) -> list[str]:
        """As on the command line, but for the output; a value stands in one word with its option, so that it may begin
        with a dash."""
        words = []
        for name, values in self.options.items():
            if name not in _FIELDS:
                words += [f"--set={name}={value}" for value in values]
            elif RunOptions.model_fields[name].annotation is bool:
                words.append(flag_of(name))
            elif name != "video":
                words += [f"{flag_of(name)}={value}".replace("--set ", "--set=") for value in values]
        return [*words, "--", *self.options["video"]] if "video" in self.options else words


def read_entries(source: Path, common: Mapping[str, str], outside: bool = False) -> tuple[Entry, ...]:
    """The takes of a manifest, or of a folder. common: options of `run` for every take that does not say otherwise.

    A manifest's columns are `name`, `subject`, `visit`, `condition` and the options of `run`; an empty cell is not
    given, several values of a repeatable option stand between semicolons. Its paths are relative to its folder and
    stay inside it, unless `outside`. In a folder videos, poses and keypoints of one name are a take.
    A common option that a take has no use for, such as a detector where there are poses, is not given to it.
    InputError names the row and what is wrong with it, or a common option that no take has a use for; nothing is run
    then.
    """
    given = {_column(name, "--set"): value for name, value in common.items()}
    if wrong := given.keys() & {"name", *LABELS}:
        raise InputError(
            "option-conflict", f"--set {min(wrong)}: that belongs to one take; write a manifest."
        )
    shared, shared_files = _options(given, Path.cwd(), None, "--set")
    if source.is_dir():
        rows, base = list(_folder(source)), source
    else:
        rows, base = list(_manifest(source)), source.parent
    if not rows:
        wanted = (
            "videos or files of poses in it"
            if source.is_dir()
            else "a line of column names and one for each take"
        )
        raise InputError("nothing-usable", f"{source} names no take; expected {wanted}.")
    entries = []
    without_use: dict[str, list[str]] = {
        name: [] for name in shared
    }  # why, of each take that does not set it
    for where, row in rows:
        own, own_files = _options(row, base, None if outside else base, where)
        options = {**shared, **own}
        reasons = {name: why for name in options if (why := _no_use(name, options))}
        for name in own.keys() & reasons.keys():
            raise InputError("option-conflict", f"{where}: {reasons[name]}")
        for name in shared.keys() - own.keys():
            without_use[name].append(reasons.get(name, ""))
        options = {name: of for name, of in options.items() if name not in reasons and of is not _NO}
        files = {*own_files, *(shared_files - own.keys())}
        name = row.get("name") or _stem(options, where)
        labels = {label: row.get(label, "") for label in LABELS}
        entries.append(Entry(name, options, tuple(option for option in options if option in files), labels))
    for name, whys in without_use.items():
        if whys and all(whys):
            raise InputError(
                "option-conflict", f"--set {name}: no take can use it; the last one says: {whys[-1]}"
            )
    _check_names(entries, [where for where, _ in rows])
    return tuple(entries)


def _column(name: str, where: str) -> str:
    """An option's name as Python writes it, or a setting as --set has it; InputError for one that is not known."""
    column = name.strip().lstrip("-").replace("-", "_")
    if "." in column or column in registry.registered("stages"):
        return column
    column = column.lower()
    own = {
        flag_of(field).partition(".")[2] or flag_of(field).lstrip("-").replace("-", "_"): field
        for field in _FIELDS
    }
    known = {"name", *LABELS, *own}
    if column not in known:
        settings = " or ".join(setting.partition("=")[0] for setting in settings_named(column))
        hint = f"it is '{settings}'." if settings else did_you_mean(column, known)
        raise InputError("name-unknown", f"{where}: there is no column '{printable(name)}'; {hint}")
    return own.get(column, column)


def _no_use(name: str, options: Mapping[str, tuple[str, ...]]) -> str:
    """Why `run` would refuse one of a take's options because of what the take is; empty where it takes it."""
    others = _TOGETHER if name in _TOGETHER else ()
    given = {key: options[key] for key in (*_DECIDING, *others) if key in options}
    if "video" not in given:
        given.pop("calibrate", None)  # one for all takes, which this one has no use for
    given |= {role: ("a file",) for role in _ROLES if role in given}  # which one does not matter
    return _refusal(name, options[name], tuple(given.items()))


@cache
def _refusal(name: str, values: tuple[str, ...], others: tuple[tuple[str, tuple[str, ...]], ...]) -> str:
    try:
        planned(_run_options({name: values, **dict(others)}))
    except InputError as error:
        return str(error)
    return ""


def _run_options(texts: Mapping[str, tuple[str, ...]]) -> RunOptions:
    """The options of a take as text, as those of a run; InputError for a value of another type."""
    fields = {name: values for name, values in texts.items() if name in _FIELDS}
    return RunOptions(
        settings={name: values[0] for name, values in texts.items() if name not in fields},
        **{name: values if is_repeatable(name) else values[0] for name, values in fields.items()},
    )


def _manifest(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Where it stands and what is in it, of every row."""
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(
                "unsafe", f"{path} has more than {_LARGEST >> 20} MB, too many for a manifest; split it."
            )
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, strict=True)
            header = next(reader, [])
            if len(header) == 1 and ";" in header[0]:
                raise InputError(
                    "format-unknown",
                    f"{path}: expected commas between columns, found semicolons; save it with commas.",
                )
            columns = [_column(name, str(path)) for name in header]
            if twice := {name for name in columns if columns.count(name) > 1}:
                raise InputError(
                    "wrong-content", f"{path}: the column '{min(twice)}' is there twice; keep one."
                )
            for cells in reader:
                where = f"{path}, line {reader.line_num}"
                if len(cells) > len(columns):
                    raise InputError(
                        "file-damaged",
                        f'{where}: expected {how_many(len(columns), "cell")}, found {len(cells)}; put " around commas.',
                    )
                row = {name: cell.strip() for name, cell in zip(columns, cells, strict=False)}
                if any(row.values()):
                    yield where, {name: cell for name, cell in row.items() if cell}
    except OSError as error:
        raise InputError(
            "cannot-open", f"Expected a manifest or a folder at {path}: {error.strerror}."
        ) from None
    except UnicodeDecodeError:
        raise InputError(
            "format-unknown", f"Expected a manifest in UTF-8 at {path}; save it as CSV UTF-8."
        ) from None
    except csv.Error as error:
        raise InputError("file-damaged", f"Expected a manifest as CSV at {path}: {error}.") from None


def _folder(folder: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """A row for each name of a folder's videos, poses and keypoints: `carl.mp4`, `carl.poses.npy` and
    `carl.keypoints.json` are the files of one take."""
    takes: dict[str, dict[str, Path]] = {}
    unused = []
    for path in sorted(path for path in folder.iterdir() if not path.name.startswith(".")):
        name, role = _take_of(path)
        if role is None:
            unused += [path.name] if path.is_file() else []
            continue
        first = takes.setdefault(name, {}).setdefault(role, path)
        if first != path:
            raise InputError(
                "choose-entry",
                f"{folder / name}: expected one file of {role}, found {first.name} and {path.name}; keep one, or write "
                "a manifest.",
            )
    if unused and takes:
        names = ", ".join(printable(name) for name in unused[:_MOST])
        say("note", f"not used: {names}{' ...' if len(unused) > _MOST else ''}")
    for name, files in takes.items():
        yield str(folder / name), {"name": name, **{role: path.name for role, path in files.items()}}


def _take_of(path: Path) -> tuple[str, str | None]:
    """Of a file the take's name and what it is to it. A file that looks like poses and that no adapter recognises is a
    take too, which its run refuses with the reason."""
    if named := _NAMED.match(path.name):
        return named["take"], named["role"]
    if path.is_dir():
        return path.name, None
    if path.suffix.lower() in VIDEOS:
        return path.stem, "video"
    gives = {adapter.gives for adapter in adapters().values() if recognises(adapter, path)}
    if not gives and path.suffix.lower() in _POSES:
        return path.stem, "poses"
    return path.stem, next((role for role in ("poses", "keypoints") if role in gives), None)


def _options(
    row: Mapping[str, str], base: Path, inside: Path | None, where: str
) -> tuple[dict[str, tuple[str, ...]], set[str]]:
    """Options of `run`, checked by their types, and which of them are files. inside: the folder that no path leaves.
    A flag that is switched off has the value _NO."""
    options: dict[str, tuple[str, ...]] = {}
    files = set()
    for name, cell in row.items():
        if name in ("name", *LABELS):
            continue
        listed = name in _FIELDS and is_repeatable(name)
        values = tuple(part.strip() for part in cell.split(";")) if listed else (cell,)
        with naming(where):
            value = _typed(name, values)
        if name in _FIELDS and value is False:
            values = _NO
        if isinstance(value, Path) or cell.lower().endswith(".onnx"):
            values = (str(_found(cell, base, inside, f"{where}: {name}")),)
            files.add(name)
        options[name] = values
    return options, files


def _typed(name: str, values: tuple[str, ...]) -> Any:
    """The value of an option or a setting; InputError for one of another type, or that its stage does not know."""
    given = _run_options({name: values})
    if name in _FIELDS:
        return getattr(given, name)
    return checked_setting(name, values[0]) if "." in name and given.settings else values[0]


def _found(cell: str, base: Path, inside: Path | None, where: str) -> Path:
    try:
        path = (base / cell).resolve()
        there = path.exists()
    except (OSError, ValueError) as error:  # too long a name, a zero byte, a ring of links
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(
            "bad-value", f"{where}: '{printable(cell[:80])}' cannot be a path: {reason}."
        ) from None
    if inside is not None and not path.is_relative_to(inside.resolve()):
        raise InputError(
            "unsafe", f"{where}: {printable(cell)} is outside {inside.resolve()}; pass --outside to allow it."
        )
    if not there:
        raise InputError("cannot-open", f"{where}: expected a file at {path}, found nothing there.")
    return path


def _stem(options: Mapping[str, tuple[str, ...]], where: str) -> str:
    for role in _ROLES:
        if role in options:
            return Path(options[role][0]).stem
    raise InputError("needs-input", f"{where}: expected a video, poses or keypoints, found none of them.")


def _check_names(entries: list[Entry], places: list[str]) -> None:
    """InputError for a name that is no folder's, that two takes have, or for a take that stands there twice."""
    names: dict[str, str] = {}
    takes: dict[str, str] = {}
    for entry, where in zip(entries, places, strict=True):
        _stem(entry.options, where)
        if not is_file_name(entry.name) or len(entry.name) > _LONGEST:
            raise InputError(
                "bad-value",
                f"{where}: the name {entry.name!r} cannot be a folder's name; give another in a column 'name'.",
            )
        first = names.setdefault(entry.name.casefold(), where)
        if first != where:
            raise InputError(
                "bad-value",
                f"{where}: the name '{entry.name}' is taken by {first}; give each take its own 'name'.",
            )
        same = takes.setdefault(repr(sorted(entry.options.items())), where)
        if same != where:
            raise InputError("bad-value", f"{where}: the same files and options as {same}; leave one out.")
