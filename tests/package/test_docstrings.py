"""The reference of the API says what its functions take, give and refuse.

Methods are described by their classes; a method whose class or protocol says all needs no words of its own.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = [
    path
    for folder in ("pipeline", "adapters", "models", "stages")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if path.name == "__init__.py" or not path.name.startswith("_")
]
SHAPE = re.compile(r"\((?:\.{3}|[A-Z0-9]\w*|count|rows)(?:, ?[^()]*)?,?\)")
SAID_BY_ADAPTER = {"sniff"}  # pipeline/plugins/protocols.py


def public(path: Path) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node


def functions(path: Path) -> Iterator[tuple[ast.FunctionDef, str]]:
    """With their docstrings; those of the command line talk to users of programs, and are left out."""
    for node in public(path):
        if isinstance(node, ast.FunctionDef) and "typer." not in ast.unparse(node.args):
            yield node, ast.get_docstring(node) or ""


def takes_or_gives_arrays(function: ast.FunctionDef) -> bool:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    types = [function.returns, *(argument.annotation for argument in arguments)]
    return any("ndarray" in ast.unparse(each) for each in types if each is not None)


@pytest.mark.parametrize(
    "path", MODULES, ids=lambda path: ".".join(path.relative_to(ROOT).with_suffix("").parts)
)
def test_every_public_name_is_described(path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    silent = [node.name for node in public(path) if not ast.get_docstring(node)]
    assert not set(silent) - (SAID_BY_ADAPTER if path.parent.name == "adapters" else set())


@pytest.mark.parametrize(
    "path", MODULES, ids=lambda path: ".".join(path.relative_to(ROOT).with_suffix("").parts)
)
def test_arrays_have_shapes_and_refusals_are_told(path):
    shapeless = [
        f.name for f, words in functions(path) if takes_or_gives_arrays(f) and not SHAPE.search(words)
    ]
    assert not shapeless
    silent = [
        f.name
        for f, words in functions(path)
        if "raise InputError" in ast.unparse(f) and not re.search("InputError|[Rr]efuse", words)
    ]
    assert not silent


def test_what_counts_as_a_shape():
    for words in ("(T, 17, 3) metres", "angles (...,) in degrees", "(17,)", "points (count, 2)", "(3, 3)"):
        assert SHAPE.search(words), words
    for words in ("(T frames)", "one of them (of two)", "R_b_from_a, the inverse (of a rotation)"):
        assert not SHAPE.search(words), words
