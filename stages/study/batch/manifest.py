"""What a batch is to run: the rows of a manifest, or what lies in a folder, as options of a run."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.messages import how_many, say
from ....pipeline.core.system import is_file_name
from ....pipeline.files.atomic import printable
from ....pipeline.plugins import registry
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.plugins.removed import refuse_removed
from ....pipeline.reading.load import adapters, recognises
from ....pipeline.reading.settings import READ, RunOptions, is_repeatable
from ....pipeline.running.recipe import checked_setting, planned

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
_LONGEST = 100  # characters of a take's name, which becomes a folder's

# Texts of cells by option of a run, or by STAGE.KEY; several of an option that is repeatable.
Texts = dict[str, str | tuple[str, ...]]


@dataclass(frozen=True)
class Entry:
    """A take that is to be run; paths among its options are absolute. labels: subject, visit and condition, empty where
    not given."""

    name: str
    options: RunOptions
    labels: dict[str, str]


def read_entries(source: Path, common: Mapping[str, str]) -> tuple[Entry, ...]:
    """The takes of a manifest, or of a folder. common: options of `run` for every take that does not say otherwise.

    A manifest's columns are `name`, `subject`, `visit`, `condition` and the options of `run`; an empty cell is not
    given, several values of a repeatable option stand between semicolons. Its paths are relative to its folder. In a
    folder videos, poses and keypoints of one name are a take.
    InputError names the row and what is wrong with it, or a common option that its take has no use for; nothing is run
    then.
    """
    common_values = {_column(name, "--set"): value for name, value in common.items()}
    if wrong := common_values.keys() & {"name", *LABELS}:
        raise InputError(
            "option-conflict", f"--set {min(wrong)}: that belongs to one take; write a manifest."
        )
    shared = _texts(common_values, Path.cwd(), "--set")
    folder = source.is_dir()
    rows = list(_folder(source) if folder else _manifest(source))
    if not rows:
        wanted = (
            "videos or files of poses in it" if folder else "a line of column names and one for each take"
        )
        raise InputError("nothing-usable", f"{source} names no take; expected {wanted}.")
    entries, places = list[Entry](), dict[str, str]()
    for where, row in rows:
        row_values = _texts(row, source if folder else source.parent, where)
        with naming(where):
            options = _run_options({**shared, **row_values})
            files = [str(row_values[role]) for role in _ROLES if role in row_values]
            if not files:
                raise InputError("needs-input", "expected a video, poses or keypoints, found none of them.")
            planned(options)
        name = row.get("name") or Path(files[0]).stem
        if not is_file_name(name) or len(name) > _LONGEST:
            raise InputError(
                "bad-value",
                f"{where}: the name {name!r} cannot be a folder's name; give another in a column 'name'.",
            )
        if (first := places.setdefault(name.casefold(), where)) != where:
            raise InputError(
                "bad-value",
                f"{where}: the name '{name}' is taken by {first}; give each take its own 'name'.",
            )
        labels = {label: row.get(label, "") for label in LABELS}
        entries.append(Entry(name, options, labels))
    return tuple(entries)


def _column(name: str, where: str) -> str:
    """An option's name as Python writes it, or a setting as --set has it; InputError for one that is not known."""
    column = name.strip().lstrip("-").replace("-", "_").removeprefix(f"{READ}.")
    if "." in column or column in registry.registered("stages"):
        return column
    column = "options" if column.lower() == "option" else column.lower()  # the only flag of another name
    columns = ("name", *LABELS, *_FIELDS)
    if column not in columns:
        with naming(where):
            refuse_removed("settings", f"{READ}.{column}")
        hint = "put commas between columns" if ";" in name else did_you_mean(column, columns)
        raise InputError("name-unknown", f"{where}: there is no column '{printable(name)}'; {hint}")
    return column


def _texts(row: Mapping[str, str], base: Path, where: str) -> Texts:
    """The options in a row by their names, checked by their types one by one; those that are files from `base` on.
    InputError for one of another type, or that its stage does not know."""
    texts = Texts()
    for name, cell in row.items():
        if name in ("name", *LABELS):
            continue
        listed = name in _FIELDS and is_repeatable(name)
        texts[name] = tuple(part.strip() for part in cell.split(";")) if listed else cell
        with naming(where):
            options = _run_options({name: texts[name]})
            value = getattr(options, name) if name in _FIELDS else cell
            if "." in name and options.settings:
                value = checked_setting(name, cell)
            if isinstance(value, Path) or cell.lower().endswith(".onnx"):
                texts[name] = _existing(cell, base, name)
    return texts


def _run_options(texts: Texts) -> RunOptions:
    fields = {name: text for name, text in texts.items() if name in _FIELDS}
    return RunOptions(settings={name: text for name, text in texts.items() if name not in fields}, **fields)


def _manifest(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Of every row: its file and line, for errors, and its cells by column."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, restkey="", restval="", strict=True)
            columns = [_column(name, str(path)) for name in reader.fieldnames or ()]
            if twice := {name for name in columns if columns.count(name) > 1}:
                raise InputError(
                    "wrong-content", f"{path}: the column '{min(twice)}' is there twice; keep one."
                )
            reader.fieldnames = columns
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                if more := row.pop("", None):
                    raise InputError(
                        "file-damaged",
                        f"{where}: expected {how_many(len(columns), 'cell')}, found {len(columns) + len(more)}; put "
                        '" around commas.',
                    )
                if given := {name: cell.strip() for name, cell in row.items() if cell.strip()}:
                    yield where, given
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
    """The name of the take that a file belongs to, and its role there. A file that looks like poses but that no adapter
    recognises is a take too; its run refuses it with the reason."""
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


def _existing(cell: str, base: Path, name: str) -> str:
    try:
        path = (base / cell).resolve()
        exists = path.exists()
    except (OSError, ValueError) as error:  # too long a name, a zero byte, a ring of links
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(
            "bad-value", f"{name}: '{printable(cell[:80])}' cannot be a path: {reason}."
        ) from None
    if not exists:
        raise InputError("cannot-open", f"{name}: expected a file at {path}, found nothing there.")
    return str(path)
