"""The table of docs/adapters.md, made of every golden file; `PYTHONPATH=tests python -m golden.table` rewrites it."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from golden.bodies import Person
from golden.catalogue import CATALOGUE, Golden
from pcnet3d.pipeline import PoseSequence, check_adapter

DOCUMENT = Path(__file__).parents[2] / "docs" / "adapters.md"
COLUMNS = ("adapter", "files", "axes; unit", "knows", "people")
BEGIN, END = "<!-- table: written by the tests -->\n\n", "\n<!-- end of the table -->"
AXES = {
    "right, down, away": "camera",
    "right, down": "image",
    "north, west, up": "z up",
    "west, up, north": "y up",
}


def row(golden: Golden, folder: Path) -> list[str]:
    """What the golden file, written into the folder, shows. AssertionError when its adapter breaks a promise."""
    (folder / "mirrored").mkdir()
    mirrored = golden.write(Person(mirrored=True), folder / "mirrored")
    path = golden.write(Person(), folder)
    people = check_adapter(golden.adapter, path, mirrored=mirrored, by_name=golden.by_name, **golden.options)
    told = f" ({', '.join(golden.options)} given)" if golden.options else ""
    shown = ["", "times, frames" if golden.adapter == "video" else "times", ""]
    if isinstance(people[0], PoseSequence):
        axes, unit = ", ".join(people[0].frame.axes), people[0].frame.unit
        knows = {
            "times": all(poses.time_s is not None for poses in people),
            "frames": all(poses.frames_known for poses in people),
            "scores": any(np.isfinite(poses.confidence).any() for poses in people),
        }
        joined = "joined" if any(poses.linked for poses in people) else "named"
        shown = [
            f"{AXES.get(axes, axes)}; {unit}",
            ", ".join(word for word, known in knows.items() if known),
            "one" if len(people) == 1 else joined,
        ]
    return [golden.adapter, golden.form + told, *shown]


def table(rows: list[list[str]]) -> str:
    """A line for each adapter's files that show the same."""
    files: dict[tuple[str, ...], list[str]] = {}
    for adapter, form, *shown in rows:
        files.setdefault((adapter, *shown), []).append(form)
    joined = [[adapter, "; ".join(forms), *shown] for (adapter, *shown), forms in files.items()]
    lines = [COLUMNS, ["---"] * len(COLUMNS), *joined]
    return "".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |\n" for line in lines)


def parts(document: str) -> tuple[str, str, str]:
    """What stands before the table, the table, and what stands after it."""
    before, _, rest = document.partition(BEGIN)
    found, _, after = rest.partition(END)
    return before + BEGIN, found, END + after


def main() -> None:
    rows = []
    for golden in CATALOGUE:
        with TemporaryDirectory() as folder:
            rows.append(row(golden, Path(folder)))
    before, _, after = parts(DOCUMENT.read_text(encoding="utf-8"))
    DOCUMENT.write_text(before + table(rows) + after, encoding="utf-8")


if __name__ == "__main__":
    main()
