"""The history of poses is written for readers: no stage and no signal decides anything by it."""

import ast
from pathlib import Path

import pcnet3d

# Pages and files that show it. stages/study is judged by its own tests.
SHOW = {
    "stages/drawing/facts.py",
    "stages/export/writers.py",
    "stages/export/stage.py",
}


def test_only_pages_and_files_read_the_history():
    root = Path(pcnet3d.__file__).parent
    files = [*root.glob("stages/**/*.py"), *root.glob("pipeline/signals/*.py")]
    reads = {
        path.relative_to(root).as_posix()
        for path in files
        if path.relative_to(root).parts[1] != "study"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and node.attr == "history"
    }
    assert reads == SHOW
