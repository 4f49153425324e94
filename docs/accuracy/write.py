"""Writes the tables of accuracy in documents, from what `pcnet3d lab evaluate` measured:

    python docs/accuracy/write.py [DIR/evaluation.json ...]
    python docs/accuracy/write.py --figures DIR "REASON FOR A LOOK AT TEST PEOPLE"
    python docs/accuracy/write.py --errors DIR

The second measures all of figures.json first, but what is in DIR, half an hour of a core; the third all of errors.json,
an hour of a core.

The figures that documents quote are in figures.json, a block per evaluation, with its command, its date and the
networks that it measured. An evaluation.json replaces the figures of its blocks; all others stay. Whether stated errors
hold, and how large errors are, is in errors.json; what `pcnet3d lab evaluate errors` measured replaces its rows of the
same configurations and people. Then what stands between `<!-- docs/accuracy/write.py: NAME -->`
and `<!-- end -->` in a document is written from the macro NAME of tables.j2. Words around the figures are not measured:
read them again.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pcnet3d.models.lab.beds import VIEWS
from pcnet3d.models.lifter.load import load_lifter
from pcnet3d.models.rectifier.load import load_rectifier
from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.core.figures import label_of

HERE = Path(__file__).parent
FIGURES = HERE / "figures.json"
ERRORS = HERE / "errors.json"
ROOT = HERE.parents[1]
MARKED = (
    "README.md", "docs/errors.md", "docs/paper.md", "docs/start.md", "docs/trust.md", "docs/up.md",
    "models/lifter/card.md", "models/rectifier/card.md",
)  # fmt: skip
_MARK = re.compile(r"(<!-- docs/accuracy/write\.py: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


@dataclass(frozen=True)
class Block:
    """Figures that one evaluation gives. report, options: of `pcnet3d lab evaluate`. rests_on: networks by which the
    figures would change. quoted: patterns of paths in the evaluation.json."""

    report: str
    options: str
    rests_on: tuple[str, ...]
    quoted: tuple[str, ...]

    @property
    def command(self) -> str:
        return f"pcnet3d lab evaluate {self.report} {self.options}".rstrip()


_TEST = "--sets test --because REASON"
_THREE = "--rectifier geometric --rectifier pcnet --rectifier paper"
BLOCKS = {
    "takes": Block(
        "takes",
        _TEST,
        ("lifter", "pcnet"),
        (
            "takes/*, lifted, upright, 2 s and more/methods/geometric, a frame/by person/rotation/said",
            *(
                f"takes/*, lifted, upright, 2 s and more/methods/pcnet, a {method}/{figure}"
                for method in ("frame", "take", "take, with its image")
                for figure in ("tilt/mean", "by person/rotation/said", "mpjpe/mean")
            ),
            "takes/HDM05, lifted, lying/takes",
            "takes/HDM05, lifted, lying/methods/pcnet, a take/levelled",
            "takes/HDM05, lifted, lying/methods/pcnet, a take/tilt/mean",
            "takes/HDM05, lifted, lying/methods/pcnet, a take/tilt/p50",
            "takes/HDM05, lifted, lying/methods/pcnet, a take, with its image/by person/rotation/said",
            "acceleration/CMU test, lifted/lift/*/rmse/p50",
        ),
    ),
    "real_take": Block(
        "real-take",
        "",
        ("lifter", "pcnet"),
        (
            "balancing/*/mean/rigid_mm",
            "balancing/*/mean/*_flexion/rmse",
            "balancing/*/mean/trunk_lean_*/mae",
            "balancing/*/mean/up_deg",
            "balancing/*/mean/stated_deg",
            "standing/*/mean/up_deg",
            "standing/*/mean/stated_deg",
        ),
    ),
    "lifter": Block(
        "lifter",
        _TEST,
        ("lifter",),
        (
            "beds/*/focal assumed/*/lifter/frame/*MPJPE/*",
            "beds/wild/focal assumed/*/lifter/counts/frames",
            "beds/wild/focal assumed/*/lifter/by person/MPJPE/said",
            *(
                f"beds/wild/focal assumed/CMU test upright/lifter/frame/{axis}/mean"
                for axis in ("depth", "lateral", "vertical")
            ),
        ),
    ),
    "rectifiers": Block(
        "rectifiers",
        f"{_THREE} {_TEST}",
        ("lifter", "pcnet", "paper"),
        (
            "rectifiers/*/rows/*/frames",
            "rectifiers/*/rows/*/rotation/*",
            "rectifiers/*/rows/*/by person/rotation/said",
            "rectifiers/pcnet/rows/*/expected/mean",
            "rectifiers/pcnet/rows/*/spearman",
        ),
    ),
}
_ERRORS = "pcnet3d lab evaluate errors --seed 5"
_SETTING = {"seed": 0, "bed": "wild", "judged": "test"}  # of every evaluation that has it


@cache
def shipped() -> dict[str, str]:
    """Each network of the package with the first 12 digits of its file's SHA-256."""
    models = {"lifter": load_lifter(), "pcnet": load_rectifier("pcnet"), "paper": load_rectifier("paper")}
    return {name: model.method.partition("@")[2] for name, model in models.items()}


def stale(figures: dict[str, Any]) -> list[str]:
    """A sentence for each block whose figures are of another network than the shipped one."""
    return [
        f"The figures of '{name}' are of another {network} ({measured}) than the shipped one ({shipped()[network]}); "
        f"run `{block['command']} -o DIR` and `python docs/accuracy/write.py DIR/evaluation.json`."
        for name, block in figures.items()
        for network, measured in block["networks"].items()
        if measured != shipped()[network]
    ]


def updated(figures: dict[str, Any], evaluation: dict[str, Any]) -> dict[str, Any]:
    """figures with the blocks that an evaluation.json has measured anew.

    InputError for an evaluation that gives no block, lacks a figure that is quoted, or is of other networks than the
    shipped ones or of another seed, bed or lift than the documents say.
    """
    names = [name for name, block in BLOCKS.items() if block.report == evaluation.get("report")]
    if not names:
        commands = "; ".join(block.command for block in BLOCKS.values())
        raise InputError(
            "format-unknown",
            f"Expected an evaluation.json of one of these commands: {commands}; this is of none.",
        )
    if other := {
        key: evaluation[key] for key in _SETTING if evaluation.get(key, _SETTING[key]) != _SETTING[key]
    }:
        raise InputError(
            "files-apart",
            f"The documents are about {_SETTING}, this evaluation about {other}; evaluate as they say.",
        )
    measured = {method.partition("@")[2] for method in evaluation.get("networks", [])}
    content = json.dumps(evaluation)
    for name, digest in shipped().items():
        content = content.replace(f"{name}@{digest}", name)
    new = dict(figures)
    for name in names:
        block = BLOCKS[name]
        if missing := [network for network in block.rests_on if shipped()[network] not in measured]:
            raise InputError(
                "needs-input",
                f"'{name}' is about the shipped {' and '.join(missing)}, which this evaluation did not measure; run "
                f"`{block.command} -o DIR` and give its evaluation.json.",
            )
        new[name] = {
            "command": block.command,
            "date": evaluation["date"],
            "networks": {network: shipped()[network] for network in block.rests_on},
            "figures": picked(json.loads(content), block.quoted),
        }
    return new


def picked(tree: dict[str, Any], patterns: Sequence[str]) -> dict[str, Any]:
    """The parts of nested figures whose paths, "key/key/key", fit a pattern, rounded to 4 digits after the point.

    InputError for a pattern that nothing fits.
    """
    unused = set(patterns)

    def inside(part: Any, path: str) -> Any:
        if isinstance(part, dict):
            kept = {key: inside(value, f"{path}/{key}" if path else key) for key, value in part.items()}
            return {key: value for key, value in kept.items() if value is not None} or None
        fitting = {pattern for pattern in patterns if fnmatchcase(path, pattern)}
        unused.difference_update(fitting)
        return (round(part, 4) if isinstance(part, float) else part) if fitting else None

    found = inside(tree, "")
    if unused:
        raise InputError(
            "needs-input",
            f"The documents quote {sorted(unused)[0]}, which this evaluation lacks; run it in full.",
        )
    return found


Rows = list[dict[str, Any]]


def stated(evaluation: dict[str, Any]) -> Rows:
    """The rows of stated errors of an evaluation.json of `errors`; of the real take, whoever else is judged, "val"."""
    return [
        {
            "statement": statement,
            "configuration": configuration,
            "set": "val" if configuration.startswith("real take") else evaluation["judged"],
            **{name: value for name, value in figures.items() if name != "bias"},
        }
        for statement, of in evaluation["statements"].items()
        for configuration, figures in of.items()
    ]


def merged(rows: Rows, new: Rows) -> Rows:
    """The rows of stated errors, with new ones in the place of all of the same configuration and people."""
    measured = {(row["configuration"], row["set"]) for row in new}
    return [row for row in rows if (row["configuration"], row["set"]) not in measured] + new


def of_kinds(named: Sequence[str]) -> dict[str, list[str]]:
    """The statements that documents show together, by kind, each once."""
    names = list(dict.fromkeys(named))
    return {
        "ranges": [name for name in names if name.startswith("range of ")],
        "rates": [name for name in names if name.startswith("rate of ")],
        "sides": [name for name in names if name.startswith("right less left range ")],
        "places": [name for name in names if name.startswith(("pelvis ", "body's ", "focal "))],
    }


def in_words(statement: str) -> str:
    """ "range of knee_flexion": the angle by its name on pages."""
    *before, name = statement.split(" ")
    return " ".join([*before, label_of(name) if "_" in name else name])


def pages(figures: dict[str, Any], errors: Rows) -> dict[str, str]:
    """Every document that quotes figures, by its path, as it has to read."""
    kit = Environment(
        loader=FileSystemLoader(HERE), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    kit.filters |= {f"d{digits}": f"{{:.{digits}f}}".format for digits in range(3)}
    kit.filters["in_words"] = in_words
    kit.filters["percent"] = lambda share: f"{100 * share:.0f} %"
    kit.filters["short"] = lambda figure: f"{figure:.0f}" if figure >= 10 else f"{figure:.2g}"
    kit.filters["spread"] = lambda of, digits=0: " / ".join(
        f"{of[name]:.{digits}f}" for name in ("p50", "mean", "p95")
    )
    words: dict[str, Any] = {name: block["figures"] for name, block in figures.items()}
    words["errors"] = errors
    words["statements"] = of_kinds([row["statement"] for row in errors])
    words["sides"] = [*VIEWS]
    words["of_sides"] = [f"{side}, image" for side in VIEWS]
    words["held"] = {(row["statement"], row["configuration"], row["set"]): row for row in errors}
    tables = kit.get_template("tables.j2").make_module(words)
    texts = {}
    for name in MARKED:
        text = (ROOT / name).read_text(encoding="utf-8")
        texts[name] = _MARK.sub(lambda mark: f"{mark[1]}{getattr(tables, mark[2])()}{mark[3]}", text)
    return texts


def measured(folder: Path, because: str = "") -> list[str]:
    """The files of every evaluation of figures.json, or without a reason to look at test people of that of errors.json,
    which is run unless its file is there."""
    commands = {folder / name / "evaluation.json": block.command for name, block in BLOCKS.items()}
    if not because:
        commands = {folder / "errors" / "evaluation.json": _ERRORS}
    for path, command in commands.items():
        if not path.exists():
            words = [because if word == "REASON" else word for word in command.split()]
            program = str(Path(sys.executable).with_name(words[0]))  # of this environment, activated or not
            subprocess.run([program, *words[1:], "-o", str(path.parent)], check=True)
    return list(map(str, commands))


def main() -> None:
    paths = sys.argv[1:]
    if paths[:1] in (["--figures"], ["--errors"]):
        paths = measured(Path(paths[1]), *paths[2:])
    figures, errors = (json.loads(path.read_text(encoding="utf-8")) for path in (FIGURES, ERRORS))
    try:
        for path in paths:
            evaluation = json.loads(Path(path).read_text(encoding="utf-8"))
            if evaluation.get("report") == "errors":
                errors = merged(errors, stated(evaluation))
            else:
                figures = updated(figures, evaluation)
    except InputError as error:
        sys.exit(f"{path}: {error}")
    texts = pages(figures, errors)  # all of them, before anything is written
    text = json.dumps(figures, indent=1, ensure_ascii=False)
    text = re.sub(r"{[^{}]*}", lambda innermost: " ".join(innermost[0].split()), text)  # a line each
    FIGURES.write_text(text + "\n", encoding="utf-8")
    lines = ",\n ".join(map(json.dumps, errors))  # a line each
    ERRORS.write_text(f"[\n {lines}\n]\n", encoding="utf-8")
    for name, page in texts.items():
        (ROOT / name).write_text(page, encoding="utf-8")
    print("\n".join(stale(figures)) or "All figures are of the shipped networks.")


if __name__ == "__main__":
    main()
