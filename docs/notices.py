"""Writes the table of notices.md from the catalogue: python docs/notices.py."""

from pathlib import Path

from pcnet3d.pipeline.core.notices import notices_table

if __name__ == "__main__":
    page = Path(__file__).with_suffix(".md")
    head = page.read_text(encoding="utf-8").partition("| code |")[0]
    page.write_text(head + notices_table(), encoding="utf-8", newline="\n")
