"""Sphinx makes the site out of the Markdown files as they lie in the repository (`make docs`): README.md is its first
page, navigation.md is added to that page, and pdoc's reference of the API lies beside the pages, in api/.

Nothing is fetched when a page is looked at, and whatever points nowhere is a warning, which ends the build.
"""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from pcnet3d.pipeline.core import errors, figures, notices

HERE = Path(__file__).parent
PROJECT = tomllib.loads((HERE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FIRST_PAGE = "README"

project, version, author = PROJECT["name"], PROJECT["version"], "The pcnet3d authors"
root_doc = FIRST_PAGE
include_patterns = ["*.md", "docs/*.md", "docs/*.ipynb", "models/*/card.md"]
exclude_patterns = [".*", "build", "tests"]  # large folders that need not be looked through

extensions = ["myst_nb"]
myst_heading_anchors = 4  # the slugs that GitHub makes, to which the pages link
nb_execution_mode = "off"  # notebooks come executed

html_theme = "furo"
html_title = PROJECT["name"]
html_copy_source = html_show_sourcelink = False
templates_path = ["templates"]
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "api.html",
        "sidebar/scroll-end.html",
    ]
}


def add_navigation(app: Sphinx, page: str, source: list[str]) -> None:
    """GitHub would show the lists of pages as code, so they stand in a file of their own."""
    if page == FIRST_PAGE:
        source[0] += "\n" + (HERE / "navigation.md").read_text(encoding="utf-8")


def add_catalogues(app: Sphinx, page: str, source: list[str]) -> None:
    """What `pcnet3d list notices`, `list refusals` and `list figures` print, as tables."""
    tables = {
        "docs/notices": {"All notices": notices, "All refusals": errors},
        "docs/movements": {"Every figure": figures},
    }
    for heading, catalogue in tables.get(page, {}).items():
        rows = catalogue.listed()
        lines = [[*rows[0]], ["---"] * 3, *([f"`{code}`", *texts] for code, *texts in map(dict.values, rows))]
        table = "\n".join(f"| {' | '.join(text.replace('|', '&#124;') for text in line)} |" for line in lines)
        source[0] += f"\n## {heading}\n\n{table}\n"


def add_index(app: Sphinx, error: Exception | None) -> None:
    """What a browser opens in a folder."""
    if error is None:
        shutil.copy(app.outdir / f"{FIRST_PAGE}.html", app.outdir / "index.html")


def setup(app: Sphinx) -> None:
    app.add_lexer("csv", TextLexer)  # Pygments has none
    app.connect("source-read", add_navigation)
    app.connect("source-read", add_catalogues)
    app.connect("build-finished", add_index)
