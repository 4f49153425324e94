"""Writes the tables of notices.md from the catalogues: python docs/notices.py."""

from pathlib import Path

from pcnet3d.pipeline.core.notices import notices_table
from pcnet3d.pipeline.core.refusals import refusals_table

if __name__ == "__main__":
    page = Path(__file__).with_suffix(".md")
    text = page.read_text(encoding="utf-8")
    for heading, table in (("| code |", notices_table()), ("| refusal |", refusals_table())):
        before, _, rest = text.partition(heading)
        text = before + table + rest[rest.find("\n\n") + 1 :] * ("\n\n" in rest)
    page.write_text(text, encoding="utf-8", newline="\n")
