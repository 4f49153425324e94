"""The site of the documents, which `make docs` builds: a broken link ends that, and so does what is loaded from a
network. What it shows besides: the notebook is that of its script, and the gallery's commands are commands."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from runpy import run_path

import pytest

from pcnet3d.pipeline.cli import load_command

ROOT = Path(__file__).parents[2]
problems = run_path(str(ROOT / "docs/site/check.py"))["problems"]
sys.path.insert(0, str(ROOT / "docs"))  # gallery.py takes pictures by screenshot.py beside it
commands = run_path(str(ROOT / "docs/gallery.py"))["commands"]
NOTEBOOK = ROOT / "docs/first_take.ipynb"


@pytest.mark.skipif("not __import__('importlib').util.find_spec('sphinx')", reason="needs the extra docs")
def test_broken_links_and_anchors_end_the_build(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    (source / "README.md").write_text(
        "# Title\n\n[a](gone.md) [b](#gone) [c](CHANGELOG.md#gone) [d](#title)\n"
    )
    (source / "CHANGELOG.md").write_text("# Changelog\n")
    words = ["-W", "-q", "-c", ROOT / "docs/site", source, tmp_path / "site"]
    done = subprocess.run([sys.executable, "-m", "sphinx", *words], capture_output=True, text=True)
    assert done.returncode != 0
    assert len(re.findall(r"\[myst\.xref_missing\]", done.stderr)) == 3, done.stderr


@pytest.mark.parametrize(
    ("file", "content", "count"),
    [
        ("index.html", '<script src="https://example.org/a.js"></script>', 1),
        ("index.html", '<script src="//example.org/a.js"></script>', 1),
        ("index.html", '<link rel="stylesheet" href="http://example.org/a.css">', 1),
        ("index.html", "<style>@font-face { src: url(https://example.org/a.woff2) }</style>", 1),
        ("index.html", "<style>@import 'https://example.org/a.css';</style>", 1),
        ("index.html", '<img src="https://example.org/a.png">', 1),
        ("index.html", '<img src="here.png" srcset="https://example.org/a.png 2x">', 1),
        ("a.css", "@font-face { src: url('https://example.org/a.woff2') }", 1),
        ("index.html", '<a href="https://example.org">c</a> <img src="data:image/png;base64,AA==">', 0),
    ],
)
def test_the_check_sees_what_is_loaded_and_lets_addresses_be_named(tmp_path, file, content, count):
    (tmp_path / file).write_text(content)
    assert len(problems(tmp_path)) == count


def test_the_notebook_is_that_of_its_script_small_and_names_no_machine():
    nbformat = pytest.importorskip("nbformat", reason="needs the extra docs")
    notebook = run_path(str(ROOT / "docs/site/notebook.py"))["notebook"]
    wanted = notebook(NOTEBOOK.with_suffix(".py").read_text(encoding="utf-8"))
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text) < 400_000
    assert re.findall(r"(?:/home|/root|/tmp|/work|/usr|site-packages)\b[^\"]*", text) == []
    made = nbformat.read(NOTEBOOK, as_version=4)
    assert [(cell.cell_type, cell.source) for cell in made.cells] == [
        (cell.cell_type, cell.source) for cell in wanted.cells
    ], "python docs/site/notebook.py docs/first_take.py"
    outputs = [output for cell in made.cells if cell.cell_type == "code" for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2
    assert {output.output_type for output in outputs} <= {"stream", "display_data"}
    assert {output.name for output in outputs if output.output_type == "stream"} == {"stdout"}


@pytest.mark.data("lifter")
def test_the_picture_of_rectified_skeletons_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["rectified.py", str(tmp_path / "out.png")])
    run_path(str(ROOT / "docs/rectified.py"))["main"]()
    assert (tmp_path / "out.png").stat().st_size > 10_000


def test_the_notebooks_script_runs():
    """With errors that its bands hold, and an up that is as good as it is said to be."""
    done = subprocess.run(
        [sys.executable, NOTEBOOK.with_suffix(".py")],
        capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "Agg"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    inside = [int(share) for share in re.findall(r"(\d+)% inside the band", done.stdout)]
    assert len(inside) == 2
    assert min(inside) >= 80
    stated, off = (float(deg) for deg in re.findall(r"off by ([\d.]+)", done.stdout)[:2])
    assert off < 1.645 * stated


def test_the_gallerys_commands(tmp_path):
    """The command line has each command with its options."""
    for words in commands(tmp_path / "out", tmp_path / "data").values():
        command = load_command(words[0])
        command.make_context(words[0], [str(word) for word in words[1:]])


@pytest.mark.data("models", "native", "video")
def test_the_gallerys_files(data, tmp_path):
    given = [word for words in commands(tmp_path, data).values() for word in words if isinstance(word, Path)]
    assert [path for path in given if data in path.parents and not path.exists()] == []
