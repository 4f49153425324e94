"""What is wrong with the built site:  python docs/site/check.py build/site

A page may name addresses to go to, but loads nothing from a network: no script, style, font or image. Every link
within the site leads to a file of it, and to an anchor of that file. What is wrong is printed, and ends with code 1.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_NETWORK = re.compile(r"(?:https?:)?//")
# In style sheets: url(...) and @import, whose address may stand in quotes.
_STYLE = re.compile(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')\s]+)")
_OUTSIDE = re.compile(r"[a-z]+:|//")  # mailto:, data:, https: ...
_BY_SCRIPT = {"search"}  # pages whose anchors are made while they are shown


class Page(HTMLParser):
    """loads: addresses that a browser fetches to show the page. links: those that a reader may follow.
    anchors: what a link may lead to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)
        self.loads += _STYLE.findall(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value is not None}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        self.loads += [given[name] for name in ("src", "data", "poster") if name in given and tag != "input"]
        self.loads += [part.split()[0] for part in given.get("srcset", "").split(",") if part.strip()]
        if "href" in given:
            (self.links if tag in ("a", "area") else self.loads).append(given["href"])


def problems(site: Path) -> list[str]:
    """A sentence for each thing that a page or a style sheet loads from a network, and for each broken link."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        name = path.relative_to(site)
        found += [f"{name} loads {each}" for each in page.loads if _NETWORK.match(each)]
        inside = [each for each in [*page.links, *page.loads] if not _OUTSIDE.match(each)]
        found += [
            f"{name} points nowhere: {each}"
            for each in dict.fromkeys(inside)
            if not _leads(path, each, pages)
        ]
    for path in sorted(site.rglob("*.css")):
        styles = _STYLE.findall(path.read_text(encoding="utf-8"))
        found += [f"{path.relative_to(site)} loads {each}" for each in styles]
    return found


def _leads(path: Path, link: str, pages: dict[Path, Page]) -> bool:
    target = urlsplit(link)
    file = (path.parent / unquote(target.path)).resolve() if target.path else path
    if file.is_dir():
        file /= "index.html"
    if not file.is_file():
        return False
    anchor = unquote(target.fragment)
    return not anchor or file not in pages or file.stem in _BY_SCRIPT or anchor in pages[file].anchors


def main() -> None:
    found = problems(Path(sys.argv[1]).resolve())
    print("\n".join(found) or "nothing is loaded from a network, and every link leads somewhere")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
