"""What users and plug-ins import is named by the package and its parts; documents and templates use nothing else."""

import re
import rlcompleter
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from pcnet3d.pipeline.core import layouts

ROOT = Path(__file__).parents[2]
FLOORS = ("pcnet3d.pipeline", "pcnet3d.adapters", "pcnet3d.models", "pcnet3d.stages")
FACES = ("pcnet3d", *FLOORS)
HEAVY = ("numpy", "scipy", "pydantic", "typer", "cv2", "onnxruntime", "rerun", "pyarrow", "av", "pandas")
_IMPORT = re.compile(r"^(?:from|import) (pcnet3d[\w.]*)", re.MULTILINE)


@pytest.mark.parametrize("face", FACES)
def test_dir_and_tab_completion_show_the_names_and_nothing_else(face):
    module = import_module(face)
    assert dir(module) == sorted(module.__all__)
    assert [name for name in module.__all__ if getattr(module, name, None) is None] == []
    completed = rlcompleter.Completer({"module": module}).attr_matches("module.")
    names = {each.removeprefix("module.").rstrip("()") for each in completed}
    assert names == {name for name in module.__all__ if not name.startswith("_")}


def test_importing_loads_nothing_heavy_and_finds_the_parts():
    told = f"import sys, pcnet3d; print([name for name in {HEAVY!r} if name in sys.modules]); pcnet3d.stages.rectify"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr


def test_every_layout_is_public():
    for face in ("pcnet3d", "pcnet3d.pipeline"):
        module = import_module(face)
        assert {name: getattr(module, name) for name in layouts.LAYOUTS} == layouts.LAYOUTS


def test_users_import_from_faces_alone():
    places = [
        *(ROOT / "docs").glob("*.md"),
        ROOT / "README.md",
        *(ROOT / "examples" / "plugin").rglob("*.py"),
        ROOT / "examples" / "movement_loader.py",
    ]
    faces = {*FACES, "pcnet3d.examples.walker", "pcnet3d.examples.movement_loader", "pcnet3d_acme"}
    others = {
        f"{path.name}: {module}"
        for path in places
        for module in _IMPORT.findall(path.read_text(encoding="utf-8"))
        if module not in faces and not module.startswith("pcnet3d_acme.")
    }
    assert others == set()
