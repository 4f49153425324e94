"""A page of HTML that needs nothing but itself: pictures inside, no address of any other place, and no script but one
of ours that sorts tables, where there are such."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from hashlib import sha256
from html import escape
from typing import Literal, NamedTuple

# Even if a text of a stranger's file came through unescaped, a browser would load and run nothing.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"

# A click on a column's heading sorts by it, another one the other way round; what is not known comes last.
_SORT = """
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.textContent = head.textContent;
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending", numbers = head.classList.contains("number");
      heads.forEach(other => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const of = row => row.cells[column].textContent;
      const words = (a, b) => a.localeCompare(b, "en", { numeric: true });
      const compare = numbers ? (a, b) => parseFloat(a) - parseFloat(b) : words;
      const rows = [...body.rows].sort((a, b) =>
        (of(a) === "–") - (of(b) === "–") || (down ? -1 : 1) * (of(a) === "–" ? 0 : compare(of(a), of(b))));
      body.append(...rows);
    });
  });
}
"""
_TYPES = {"svg": "image/svg+xml", "jpeg": "image/jpeg", "png": "image/png"}

_STYLE = """
:root { color-scheme: light; --ink: #1c2024; --soft: #5b6470; --line: #d9dee4; --paper: #fff; --wash: #f5f7f9 }
* { box-sizing: border-box }
body { margin: 0 auto; padding: 1.2rem clamp(.8rem, 3vw, 2.2rem) 3rem; max-width: 76rem; background: var(--paper);
  color: var(--ink); font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
  overflow-wrap: anywhere; -webkit-text-size-adjust: 100% }
h1 { font-size: 1.65rem; line-height: 1.2; margin: .2rem 0 .4rem }
h2 { font-size: 1.2rem; margin: 2.2rem 0 .5rem; padding-bottom: .25rem; border-bottom: 1px solid var(--line) }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .4rem } h4 { font-size: .92rem; margin: 1rem 0 .3rem; color: var(--soft) }
p, ul, ol { margin: .4rem 0 .7rem; max-width: 62rem }
ul, ol { padding-left: 1.3rem }
p.soft { break-after: avoid } .soft, figure small { color: var(--soft); font-size: .86rem; line-height: 1.4 }
figure small { display: block } figcaption { font-size: .95rem; font-weight: 600; margin-bottom: .15rem }
nav { font-size: .9rem } nav a { color: #005a8d; margin-right: .9rem; display: inline-block; padding: .15rem 0 }
.box { border: 1px solid var(--line); border-left: .35rem solid #7a8694; background: var(--wash);
  padding: .55rem .9rem; margin: .7rem 0; border-radius: .25rem }
.box.warning { border-left-color: #d55e00; background: #fdf3ec } .box ul { margin: .2rem 0 }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .5rem;
  margin: .8rem 0 }
.facts div { background: var(--wash); border-radius: .3rem; padding: .5rem .8rem }
.facts dt { color: var(--soft); font-size: .82rem } .facts dd { margin: 0; font-weight: 600 }
.charts { display: grid; gap: 1.3rem 1.4rem; margin: .8rem 0 1.5rem;
  grid-template-columns: repeat(auto-fill, minmax(min(21rem, 100%), 1fr)) }
figure { margin: 0; break-inside: avoid }
figure img { display: block; width: 100%; height: auto }
.pair { display: grid; grid-template-columns: 5fr 6fr; gap: .3rem; align-items: center }
.table { overflow-x: auto; margin: .6rem 0 1rem }
.wide { overflow-x: auto } .wide img { min-width: 44rem }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums }
th, td { padding: .28rem .7rem .28rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line);
  overflow-wrap: normal }
th { font-weight: 600; white-space: nowrap } thead th { white-space: normal; vertical-align: bottom }
td.number, th.number { text-align: right } td.number { white-space: nowrap }
td.long { overflow-wrap: anywhere; min-width: 12rem }
.sortable thead button { all: unset; cursor: pointer; font: inherit } .sortable button:focus-visible { outline: auto }
.sortable [aria-sort] button::after { content: " ▲" } .sortable [aria-sort=descending] button::after { content: " ▼" }
.sortable tbody th { position: sticky; left: 0; background: var(--paper); white-space: normal; min-width: 7.5rem;
  max-width: 19rem; overflow-wrap: anywhere } .sortable th a { color: #005a8d }
@media print {
  @page { margin: 14mm 12mm }
  body { padding: 0; max-width: none; font-size: 10pt; print-color-adjust: exact; -webkit-print-color-adjust: exact }
  nav { display: none } h2, h3, h4 { break-after: avoid } tr, p, .box, .facts div { break-inside: avoid }
  .charts { grid-template-columns: repeat(2, 1fr) }
  .table, .wide { overflow: visible } td.long, .wide img { min-width: 0 }
  table { font-size: 8pt } th, td { padding-right: .45rem }
  .sortable tbody th { position: static; min-width: 5.5rem } .sortable [aria-sort] button::after { content: "" }
  .three { grid-template-columns: repeat(3, 1fr) }
}
"""


class Link(NamedTuple):
    """Words that lead to another file. address: relative to the page, already as a URL writes it."""

    words: str
    address: str


class Soft(NamedTuple):
    """Words in grey: a figure that says nothing by itself."""

    words: str


Cell = str | float | int | Link | Soft | None


def text(words: object) -> str:
    """As HTML that shows just these words."""
    return escape(str(words), quote=True)


def page(title: str, head: str, sections: Iterable[tuple[str, str]]) -> str:
    """A whole document. head: HTML under the title. sections: each one's title in words and its HTML; empty ones are
    left out. Everything but the HTML is escaped here."""
    kept = [(f"part-{i}", name, content) for i, (name, content) in enumerate(sections, 1) if content]
    links = "".join(f'<a href="#{key}">{text(name)}</a>' for key, name, _ in kept)
    body = "\n".join(
        f'<section id="{key}"><h2>{text(name)}</h2>\n{content}</section>' for key, name, content in kept
    )
    script, policy = "", _POLICY
    if '<table class="sortable">' in body:
        script = f"<script>{_SORT}</script>"
        policy += f"; script-src 'sha256-{b64encode(sha256(_SORT.encode()).digest()).decode('ascii')}'"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f"<title>{text(title)}</title>\n<style>{_STYLE}</style></head>\n"
        f"<body><header><h1>{text(title)}</h1>\n{head}<nav>{links}</nav></header>\n<main>{body}</main>{script}</body></html>\n"
    )


def heading(words: str, level: int = 3) -> str:
    """level: 3 for a part of a section, 4 for a part of that."""
    return f"<h{level}>{text(words[:1].upper() + words[1:])}</h{level}>\n"


def small(words: str) -> str:
    """A paragraph that explains."""
    return f'<p class="soft">{text(words)}</p>\n'


def listed(items: Iterable[str], ordered: bool = False) -> str:
    """An HTML list of texts, which are escaped; nothing when there are none."""
    tag = "ol" if ordered else "ul"
    lines = "".join(f"<li>{text(item)}</li>" for item in items)
    return f"<{tag}>{lines}</{tag}>\n" if lines else ""


def box(heading: str, items: Sequence[str], kind: Literal["plain", "warning"] = "plain") -> str:
    """A list that is not to be overlooked; nothing when it is empty."""
    return f'<div class="box {kind}"><b>{text(heading)}</b>{listed(items)}</div>\n' if items else ""


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """What is said of a thing at a glance; nothing when nothing is."""
    cells = "".join(f"<div><dt>{text(name)}</dt><dd>{text(value)}</dd></div>" for name, value in pairs)
    return f'<dl class="facts">{cells}</dl>\n' if cells else ""


def table(head: Sequence[str], rows: Sequence[Sequence[Cell]], sortable: bool = False) -> str:
    """The first cell of a row is its heading; a column of numbers has as many decimals as its largest one asks for;
    None is a dash. sortable: a click on a column's heading sorts by it."""
    if not rows:
        return ""
    columns = [_column(cells) for cells in zip(*rows, strict=True)]
    names = "".join(_cell("th", name, right) for name, (_, right) in zip(head, columns, strict=True))
    lines = "".join(
        "<tr>"
        + "".join(
            _cell("td" if i else "th", shown[j], right, row[i]) for i, (shown, right) in enumerate(columns)
        )
        + "</tr>"
        for j, row in enumerate(rows)
    )
    kind = ' class="sortable"' if sortable else ""
    return f'<div class="table"><table{kind}><thead><tr>{names}</tr></thead><tbody>{lines}</tbody></table></div>\n'


def _column(cells: Sequence[Cell]) -> tuple[list[str], bool]:
    """What stands in its cells, and whether they are numbers."""
    numbers = [abs(cell) for cell in cells if isinstance(cell, int | float)]
    largest = max(numbers, default=0.0)
    decimals = 0 if largest >= 1000 else 1 if largest >= 10 else 2 if largest >= 1 else 3
    shown = [
        "–" if cell is None else f"{cell:z.{decimals}f}" if isinstance(cell, float)
        else cell.words if isinstance(cell, Link | Soft) else str(cell)
        for cell in cells
    ]  # fmt: skip
    return shown, bool(numbers) and len(numbers) == sum(cell is not None for cell in cells)


def _cell(tag: str, shown: str, right: bool, cell: Cell = None) -> str:
    kind = "soft" if isinstance(cell, Soft) else "number" if right else "long" if len(shown) > 40 else ""
    words = f'<a href="{text(cell.address)}">{text(shown)}</a>' if isinstance(cell, Link) else text(shown)
    return f"<{tag}{f' class={kind}' if kind else ''}>{words}</{tag}>"


def picture(content: bytes, kind: Literal["svg", "jpeg", "png"], alt: str) -> str:
    """An <img> that holds its picture. alt: what it shows, for those who cannot see it."""
    data = b64encode(content).decode("ascii")
    return f'<img alt="{text(alt)}" src="data:{_TYPES[kind]};base64,{data}">'


def figure(pictures: Sequence[str], title: str, caption: str = "") -> str:
    """One picture, or several side by side, between its title and more words."""
    inside = pictures[0] if len(pictures) == 1 else f'<div class="pair">{"".join(pictures)}</div>'
    below = f"<small>{text(caption)}</small>" if caption else ""
    return f"<figure><figcaption>{text(title)}</figcaption>{inside}{below}</figure>\n"


def charts(figures: Iterable[str], three: bool = False) -> str:
    """Figures in as many columns as there is room for. three: that many on paper, instead of two."""
    inside = "".join(figures)
    return f'<div class="charts{" three" if three else ""}">{inside}</div>\n' if inside else ""
