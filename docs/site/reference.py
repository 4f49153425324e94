"""Writes the reference of the Python API, out of the docstrings:  python docs/site/reference.py OUT

Every module is named, because pdoc leaves out what a package's `__all__` does not list.
"""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pdoc

PACKAGE = "pcnet3d"
FLOORS = tuple(f"{PACKAGE}.{floor}" for floor in ("pipeline", "adapters", "models", "stages"))


def main() -> None:
    # Types that are imported for type checkers only are shown by their names.
    warnings.filterwarnings("ignore", "Error parsing type annotation")
    # The floors are in the package's `__all__` too.
    warnings.filterwarnings("ignore", "The module specification")
    modules = [PACKAGE, *FLOORS]
    for face in map(import_module, modules[:]):
        # A name that costs its imports only when it is asked for has to be asked for before pdoc sees it.
        vars(face).update({name: getattr(face, name) for name in face.__all__})
        if face.__name__ in FLOORS:
            inside = walk_packages(face.__path__, f"{face.__name__}.")
            modules += [module.name for module in inside if not module.ispkg]
    pdoc.render.configure(template_directory=Path(__file__).parent / "pdoc")
    pdoc.pdoc(*modules, output_directory=Path(sys.argv[1]))


if __name__ == "__main__":
    main()
