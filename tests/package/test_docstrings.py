"""The reference of the API says what its functions take, give and refuse.

Methods are described by their classes; a method whose class or protocol says all needs no words of its own.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULES = [
    path
    for folder in ("pipeline", "adapters", "models", "stages")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if path.name == "__init__.py" or not path.name.startswith("_")
]
SHAPE = re.compile(r"\((?:\.{3}|[A-Z0-9]\w*|count|rows)(?:, ?[^()]*)?,?\)")
SAID_BY_ADAPTER = {"sniff"}  # pipeline/plugins/protocols.py


@cache
def parsed(path: Path) -> ast.Module:
    """A module's syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"))


def public(path: Path) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in parsed(path).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node


def functions(path: Path) -> Iterator[tuple[ast.FunctionDef, str]]:
    """With their docstrings; those of the command line talk to users of programs, and are left out."""
    for node in public(path):
        if isinstance(node, ast.FunctionDef) and "Option(" not in ast.unparse(node.args):
            yield node, ast.get_docstring(node) or ""


def takes_or_gives_arrays(function: ast.FunctionDef) -> bool:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    types = [function.returns, *(argument.annotation for argument in arguments)]
    return any("ndarray" in ast.unparse(each) for each in types if each is not None)


def wrong(path: Path) -> Iterator[str]:
    """What a module leaves unsaid."""
    if not ast.get_docstring(parsed(path)):
        yield "a word about the module"
    excused = SAID_BY_ADAPTER if path.parent.name == "adapters" else set()
    for node in public(path):
        if not ast.get_docstring(node) and node.name not in excused:
            yield f"{node.name}: a docstring"
    for function, words in functions(path):
        if takes_or_gives_arrays(function) and not SHAPE.search(words):
            yield f"{function.name}: the shapes of its arrays"
        if "raise InputError" in ast.unparse(function) and not re.search("InputError|[Rr]efuse", words):
            yield f"{function.name}: what it refuses"


def test_every_public_name_says_what_it_takes_gives_and_refuses():
    lacking = [f"{path.relative_to(ROOT).as_posix()}: {each}" for path in MODULES for each in wrong(path)]
    assert not lacking, "\n".join(["", *lacking])
