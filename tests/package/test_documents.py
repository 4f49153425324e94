"""What code and documents point at is there: documents, their numbered sections, source files, modules, links."""

from __future__ import annotations

import ast
import importlib.util
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.reading.settings import reading_options
from pcnet3d.pipeline.signals.angles import ANGLES, REASONS

ROOT = Path(__file__).parents[2]
FOLDERS = ("pipeline", "adapters", "models", "stages", "examples", "tests", "docs")
DOCUMENTS = [*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md"))]
CODE = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
CONFIGS = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.toml")]
UPSTREAM = "formats.md"  # names the files of other repositories

_NUMBER = r"\d+(?:\.\d+)?"
SECTION = re.compile(
    rf"(design|formats)\.md\)?,? (?:sections? )?({_NUMBER}(?:(?:, and|,| and| to) (?:section )?{_NUMBER}\b)*)"
)
DOCUMENT = re.compile(r"(?<![\w*/.-])((?:[\w.-]+/)*[\w-]+\.md)\b")
SOURCE = re.compile(
    rf"(?<![\w./<-])((?:{'|'.join(FOLDERS)})/[\w./-]*\w\.(?:py|toml|onnx|json|png|md|html|j2|css|js))\b"
)
FOLDER = re.compile(rf"(?<![\w./<-])((?:{'|'.join(FOLDERS)})/(?:\w+/?)+)(?![\w.*<-])")
BARE = re.compile(r"`(\w+\.py)`")
MODULE = re.compile(r"\bpcnet3d\.((?:pipeline|adapters|models|stages|examples)(?:\.\w+)+)")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#([^)\s]+))?\)|\]\(#([^)\s]+)\)")
MADE = {"evaluation.md", "lifters.md", "DIR/mmfi.md", "judged.md", "mmfi.md"}  # by commands
OTHERS = {"vis.py", "main_3dhp.py"}  # scripts of upstream repositories


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def words(path: Path) -> str:
    """A document, or the comments and docstrings of a module, in one line."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".toml":
        text = "\n".join(re.findall(r"#(.*)", text))
    elif path.suffix == ".py":
        strings = [
            node.value.value
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ]
        text = "\n".join([*strings, *re.findall(r"(?:^|\s)#\s?(.*)", text)])
    return re.sub(r"\s+", " ", text)


@cache
def sections(document: str) -> frozenset[str]:
    """Numbers of a document's headings, and of the entries of numbered lists below them ("9.5")."""
    found, heading = set(), ""
    for line in (ROOT / "docs" / document).read_text(encoding="utf-8").splitlines():
        if titled := re.match(rf"##+ ({_NUMBER})\.? ", line):
            heading = titled[1]
            found.add(heading)
        elif listed := re.match(r"(\d+)\. ", line):
            found.add(f"{heading}.{listed[1]}")
    return frozenset(found)


def cited(text: str) -> Iterator[tuple[str, str]]:
    """Document and number of every "design.md section N", "formats.md 7.1, 7.2 and 7.3"."""
    for found in SECTION.finditer(text):
        for number in re.findall(_NUMBER, found[2]):
            yield f"{found[1]}.md", number


def none_wrong(paths: Iterable[Path], wrong: Callable[[Path], Iterable[str]]) -> None:
    """Look at every file, then fail once with all that is wrong in them."""
    lines = sorted(f"{name(path)}: {each}" for path in paths for each in wrong(path))
    assert not lines, "\n".join(["", *lines])


def test_sections_exist():
    assert sum(1 for path in CODE for _ in cited(words(path))) > 60
    none_wrong(
        [*DOCUMENTS, *CODE],
        lambda path: {f"{of} {number}" for of, number in cited(words(path)) if number not in sections(of)},
    )


def _is_document(named: str, beside: Path) -> bool:
    places = (ROOT, ROOT / "docs", beside.parent)
    return any((place / named).exists() for place in places)


def test_documents_and_source_files_exist():
    def missing(path: Path) -> set[str]:
        text = re.sub(r"https?://\S+", "", words(path))
        documents = {each for each in DOCUMENT.findall(text) if not each.startswith("doc/")} - MADE
        files = {*SOURCE.findall(text), *(folder.rstrip("/") for folder in FOLDER.findall(text))} - MADE
        return {each for each in documents if not _is_document(each, path)} | {
            each for each in files if "NAME" not in each and not (ROOT / each).exists()
        }

    none_wrong((path for path in (*DOCUMENTS, *CODE, *CONFIGS) if path.name != UPSTREAM), missing)


def test_modules_exist():
    """`spam.py` in a document is one of ours, and pcnet3d.models.spam is a module or a name in one."""
    ours = {each.name for each in CODE} | OTHERS

    def missing(path: Path) -> set[str]:
        modules = {each for each in MODULE.findall(words(path)) if not _is_name(each)}
        return modules | (set(BARE.findall(words(path))) - ours)

    none_wrong((path for path in DOCUMENTS if path.name != UPSTREAM), missing)


def _is_name(dotted: str) -> bool:
    place, *parts = ROOT / dotted.split(".")[0], *dotted.split(".")[1:]
    while parts and (place / parts[0]).is_dir():
        place /= parts.pop(0)
    if parts and (place / f"{parts[0]}.py").exists():
        place /= f"{parts.pop(0)}.py"
    elif parts:
        place /= "__init__.py"
    return not parts or bool(re.search(rf"\b{parts[0]}\b", place.read_text(encoding="utf-8")))


def test_links_lead_somewhere():
    none_wrong(DOCUMENTS, _broken_links)


def _broken_links(path: Path) -> Iterator[str]:
    for target, part, here in LINK.findall(path.read_text(encoding="utf-8")):
        if target.startswith(("http:", "https:")):
            continue
        file, heading = path.parent / target if target else path, part or here
        if not file.exists():
            yield target
        elif heading and heading not in anchors(file):
            yield f"{target}#{heading}"


@cache
def anchors(path: Path) -> frozenset[str]:
    """Of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return frozenset(re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles)


def _guide() -> list[Path]:
    """The pages for users, by the first table of the index."""
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8").partition("For developers:")[0]
    return [ROOT / "docs" / page for page in re.findall(r"^\| \[(\w+\.md)\]", index, re.MULTILINE)]


def test_every_page_of_the_guide_begins_with_a_block_that_runs_and_a_picture():
    assert len(_guide()) == 11
    begins = re.compile(r"# .+\n\n(?:!\[.+\n\n)?(?:[^#`<|\n].*\n)+\n```(?:sh|python)\n")
    texts = {page.name: page.read_text(encoding="utf-8") for page in _guide()}
    assert [name for name, text in texts.items() if not begins.match(text)] == []
    assert [name for name, text in texts.items() if "\n![" not in text.partition("\n## ")[0]] == []


def test_every_angle_and_reason_is_explained():
    rows = (ROOT / "docs" / "angles.md").read_text(encoding="utf-8")
    assert (
        sorted(
            name for name in {re.sub("^[rl]_", "", name) for name in ANGLES} if f"| `{name}` |" not in rows
        )
        == []
    )
    assert sorted(code for code in REASONS if f"\n| {code} | " not in rows) == []


def test_every_angle_is_drawn():
    spec = importlib.util.spec_from_file_location("drawing", ROOT / "docs" / "angles.py")
    assert spec is not None
    assert spec.loader is not None
    drawing = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(drawing)
    drawn = {panel[0] for panel in drawing.PANELS}
    assert drawn == {name for name in ANGLES if not name.startswith("l_")}, (
        "add a panel to PANELS of docs/angles.py"
    )


def test_every_format_of_a_run_is_explained():
    """By name in results.md, and there with its file in a row of its table."""
    text = (ROOT / "docs/results.md").read_text(encoding="utf-8")
    (told,) = re.findall(r"`--also (\S+)` adds", text)
    built_in = {
        name: point.load().file
        for name, point in registry.registered("writers").items()
        if point.value.startswith("pcnet3d.")
    }
    assert set(told.split("|")) == set(built_in), "name it in `--also ...` of docs/results.md"
    rows = dict(re.findall(r"^\| `(\w+)` \| `([\w.]+)`", text, re.MULTILINE))
    assert built_in.items() <= rows.items()


def test_every_network_has_its_licence():
    """In a row by its name, with the words that are shown before a download."""
    licences = (ROOT / "docs/video.md").read_text(encoding="utf-8").partition("## Licences")[2]
    rows = re.findall(r"^\| `(\S+)` \| (.+?) \|", licences, re.MULTILINE)
    ours = {
        name: getattr(registry.load_all(group)[name], "licence", "MIT")
        for group in ("rectifiers", "lifters", "detectors", "person_detectors")
        for name, point in registry.registered(group).items()
        if point.value.startswith("pcnet3d.")
    }
    assert sorted(name for name, _ in rows) == sorted(ours), "docs/video.md has a row for each network"
    told = dict(rows)
    assert sorted(name for name, words in ours.items() if words.split(",")[0] not in told[name]) == []


def test_what_run_takes_by_set_is_in_the_design():
    (section,) = re.findall(r"by `--set`.*?\n\n", (ROOT / "docs/design.md").read_text(), re.DOTALL)
    assert [name for name in reading_options() if f"`{name}`" not in section] == []


def test_readme_and_cards_stay_short():
    longest = {"README.md": 90, "models/rectifier/card.md": 100, "models/lifter/card.md": 100}
    lines = {each: len((ROOT / each).read_text(encoding="utf-8").splitlines()) for each in longest}
    assert {each: count for each, count in lines.items() if count > longest[each]} == {}
