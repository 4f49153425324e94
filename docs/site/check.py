"""What the built site loads from a network:  python docs/site/check.py build/site

A page may name addresses to go to, but loads no script, style, font or image from elsewhere. What does is printed, and
ends with code 1. Broken links between documents end the build itself; those of the reference are not looked at.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

_NETWORK = re.compile(r"(?:https?:)?//")
# In style sheets: url(...) and @import, whose address may stand in quotes.
_STYLE = re.compile(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')\s]+)")


class Page(HTMLParser):
    """loads: addresses that a browser fetches to show the page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.feed(text)
        self.loads += _STYLE.findall(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value is not None}
        names = ("src", "data", "poster") if tag in ("a", "area") else ("src", "data", "poster", "href")
        self.loads += [given[name] for name in names if name in given and tag != "input"]
        self.loads += [part.split()[0] for part in given.get("srcset", "").split(",") if part.strip()]


def problems(site: Path) -> list[str]:
    """A sentence for each thing that a page or a style sheet loads from a network."""
    loads = {path: Page(path.read_text(encoding="utf-8")).loads for path in sorted(site.rglob("*.html"))}
    loads |= {path: _STYLE.findall(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.css"))}
    return [
        f"{path.relative_to(site)} loads {each}"
        for path, found in loads.items()
        for each in found
        if _NETWORK.match(each)
    ]


def main() -> None:
    site = Path(sys.argv[1]).resolve()
    found = problems(site)
    if not (site / "index.html").is_file():
        found.append("index.html is not there")
    print("\n".join(found) or "nothing is loaded from a network")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
