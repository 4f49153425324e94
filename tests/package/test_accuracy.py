"""The figures of accuracy in the documents are those that were measured, of the shipped networks."""

from __future__ import annotations

import copy
import importlib.util
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from pcnet3d.pipeline.core.errors import InputError

ROOT = Path(__file__).parents[2]
WRITE = ROOT / "docs" / "accuracy" / "write.py"
spec = importlib.util.spec_from_file_location("accuracy_write", WRITE)
assert spec is not None
assert spec.loader is not None
write = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = write  # where dataclasses look their annotations up
spec.loader.exec_module(write)

FIGURES, ERRORS = (json.loads(path.read_text(encoding="utf-8")) for path in (write.FIGURES, write.ERRORS))


def evaluation() -> dict:
    """As `pcnet3d lab evaluate real-take` writes it, the figures those of figures.json and some that nobody quotes."""
    shipped = write.shipped()
    content = json.dumps(FIGURES["real_take"]["figures"])
    content = re.sub(r'pcnet(?=[",])', f"pcnet@{shipped['pcnet']}", content)
    networks = [f"pcnet3d@{shipped['lifter']}", f"pcnet@{shipped['pcnet']}"]
    return json.loads(content) | {"date": "2031-01-02", "networks": networks, "report": "real-take"}


@pytest.mark.parametrize("name", write.MARKED)
def test_documents_say_what_was_measured(name):
    told = (ROOT / name).read_text(encoding="utf-8")
    assert told == write.pages(FIGURES, ERRORS)[name], (
        f"{name} does not say what docs/accuracy/figures.json does; run `python docs/accuracy/write.py`, or edit the "
        "templates in docs/accuracy instead of the document."
    )


def test_every_document_follows_the_figures():
    """A mark that is lost, or a macro that nobody names, would leave a table as it is."""
    doubled = write.pages(twice(FIGURES), twice(ERRORS))
    told = {name: (ROOT / name).read_text(encoding="utf-8") for name in doubled}
    assert [name for name, text in doubled.items() if text == told[name]] == []
    marks = [
        name
        for text in told.values()
        for name in re.findall(r"<!-- docs/accuracy/write\.py: (\w+) -->", text)
    ]
    macros = re.findall(r"^{% macro (\w+)\(\) %}", (write.HERE / "tables.j2").read_text(), re.MULTILINE)
    assert sorted(marks) == sorted(macros)


def twice(figures: Any) -> Any:
    """With every number doubled, also of "5.7 (4.9 to 6.6)"."""
    if isinstance(figures, dict):
        return {key: twice(value) for key, value in figures.items()}
    if isinstance(figures, list):
        return [twice(value) for value in figures]
    if isinstance(figures, str):
        interval = re.fullmatch(r"[\d.]+ \([\d.]+ to [\d.]+\)", figures)
        return (
            re.sub(r"[\d.]+", lambda number: f"{2 * float(number[0]):.1f}", figures) if interval else figures
        )
    return None if figures is None else 2 * figures


def test_new_rows_of_stated_errors_replace_those_of_their_configuration_and_people():
    row = {"statement": "up", "configuration": "image", "set": "val", "inside": 0.5}
    others = [row | {"configuration": "moving"}, row | {"set": "test"}]
    gone = row | {"statement": "no more"}
    assert write.merged([row, gone, *others], [row | {"inside": 0.9}]) == [*others, row | {"inside": 0.9}]


def test_what_an_evaluation_states_becomes_rows_of_its_people():
    figures = {"inside": 0.5, "low": None, "bias": 0.1}
    of = {"up": {"image": figures, "real take, image": figures}}
    image, real = write.stated({"report": "errors", "judged": "test", "statements": of})
    assert image == {"statement": "up", "configuration": "image", "set": "test", "inside": 0.5, "low": None}
    assert real == {**image, "configuration": "real take, image", "set": "val"}


def test_every_row_of_stated_errors_has_one_format_and_its_own_case():
    assert {tuple(row) for row in ERRORS} == {tuple(ERRORS[0])}
    cases = [(row["statement"], row["configuration"], row["set"]) for row in ERRORS]
    assert len(set(cases)) == len(cases)


def test_every_figure_is_of_the_shipped_networks():
    assert set(FIGURES) == set(write.BLOCKS)
    assert write.stale(FIGURES) == []


def test_an_evaluation_replaces_its_block_only():
    measured = evaluation()
    measured["standing"]["skeletons alone"]["mean"]["up_deg"] = 12.34567
    after = write.updated(FIGURES, measured)
    block = after.pop("real_take")
    assert after == {name: block for name, block in FIGURES.items() if name != "real_take"}
    assert block["date"] == "2031-01-02"
    assert block["networks"] == {name: write.shipped()[name] for name in ("lifter", "pcnet")}
    wanted = copy.deepcopy(FIGURES["real_take"]["figures"])
    wanted["standing"]["skeletons alone"]["mean"]["up_deg"] = 12.3457
    assert block["figures"] == wanted


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"networks": ["pcnet3d@000000000000"]}, "shipped lifter and pcnet"),
        ({"seed": 3}, "seed"),
        ({"bed": "typical"}, "typical"),
        ({"judged": "val"}, "val"),
        ({"balancing": {}}, "quote balancing/"),
    ],
)
def test_an_evaluation_of_something_else_is_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        write.updated(FIGURES, evaluation() | wrong)
    with pytest.raises(InputError, match="evaluate takes"):
        write.updated(FIGURES, {"report": "swaps"})  # which has no block
