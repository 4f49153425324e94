"""Packages whose names cost their imports only when they are asked for (PEP 562)."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def lazily(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """A package's `__getattr__` and `__dir__`.

    Its names are those that its source imports for type checkers, of modules or, by `from . import NAME`, modules
    themselves; none of the former may have the name of a submodule, which would hide it once that is imported. `dir`
    and tab completion show what its `__all__` lists.
    """

    @cache
    def homes() -> dict[str, str]:
        """The module that has each name, counted from the package; "." of a module itself."""
        source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
        nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
        return {
            alias.name: "." * node.level + (node.module or "")
            for node in nodes
            if node.level
            for alias in node.names
        }

    def named(name: str) -> Any:
        home = homes().get(name)
        if home is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if home == ".":
            return import_module(f".{name}", package)
        return getattr(import_module(home, package), name)

    def names() -> list[str]:
        return list(sys.modules[package].__all__)

    return named, names
