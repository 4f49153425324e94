"""Makes and executes a notebook out of a script in cells:  python docs/site/notebook.py docs/first_take.py

A line "# %%" begins a cell of code, "# %% [markdown]" one of text, whose lines are comments. The notebook lies beside
the script, with the same name. The script runs as it is, too.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

_CELL = re.compile(r"^# %%( \[markdown\])?\n(.*?)(?=^# %%|\Z)", re.MULTILINE | re.DOTALL)


def notebook(script: str) -> nbformat.NotebookNode:
    """The notebook of a script's text, not executed; its cells are numbered, so that it is the same every time."""
    cells = []
    for markdown, text in _CELL.findall(script):
        if markdown:
            cell = new_markdown_cell(re.sub(r"^# ?", "", text, flags=re.MULTILINE).strip())
        else:
            cell = new_code_cell(text.strip())
        cell["id"] = f"cell-{len(cells)}"
        cells.append(cell)
    return new_notebook(cells=cells, metadata={"kernelspec": {"name": "python3", "display_name": "Python 3"}})


def main() -> None:
    script = Path(sys.argv[1])
    made = notebook(script.read_text(encoding="utf-8"))
    NotebookClient(made, timeout=120, record_timing=False).execute()
    nbformat.write(made, script.with_suffix(".ipynb"))


if __name__ == "__main__":
    main()
