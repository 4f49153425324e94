"""Packages whose names cost their imports only when they are asked for (PEP 562)."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def lazily(package: str) -> Callable[[str], Any]:
    """A package's `__getattr__`. Its names are those that its source imports for type checkers; none of them may be the
    name of a submodule, which would hide it once it is imported."""

    @cache
    def homes() -> dict[str, str]:
        """The module that has each name, counted from the package."""
        source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
        nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
        return {one.name: f".{node.module}" for node in nodes if node.level == 1 for one in node.names}

    def named(name: str) -> Any:
        if name not in homes():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes()[name], package), name)

    return named
