"""What users and plug-ins import is named by the four faces, and their documents and templates use nothing else."""

import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FACES = ("pipeline", "adapters", "models", "stages")
_IMPORT = re.compile(r"^(?:from|import) (pcnet3d[\w.]*)", re.MULTILINE)


@pytest.mark.parametrize("face", FACES)
def test_every_name_is_there(face):
    module = import_module(f"pcnet3d.{face}")
    assert [name for name in module.__all__ if getattr(module, name, None) is None] == []


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="nothing_like_it"):
        import_module("pcnet3d.pipeline").nothing_like_it  # noqa: B018


def test_users_import_from_faces_alone():
    places = [
        *(ROOT / "docs").glob("*.md"),
        ROOT / "README.md",
        *(ROOT / "examples" / "plugin").rglob("*.py"),
        ROOT / "examples" / "live.py",
    ]
    faces = {"pcnet3d", "pcnet3d.examples.walker", "pcnet3d_acme", *(f"pcnet3d.{face}" for face in FACES)}
    others = {
        f"{path.name}: {module}"
        for path in places
        for module in _IMPORT.findall(path.read_text(encoding="utf-8"))
        if module not in faces and not module.startswith("pcnet3d_acme.")
    }
    assert others == set()
