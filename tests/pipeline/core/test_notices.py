"""Notices: one catalogue of codes and sentences, which the documents hold too."""

import json
import re
from pathlib import Path
from string import Formatter

import pytest

from pcnet3d.pipeline.core.catalogue import CATALOGUE
from pcnet3d.pipeline.core.notices import Notice, notice, own_notice, verdict, without_doubles
from pcnet3d.pipeline.core.take import Take

ROOT = Path(__file__).parents[3]


def test_a_notice_has_its_sentence_and_plain_values():
    said = notice("duplicates", rows=[4], weight="suspicious", repeated=2, first=4)
    assert said.text == "2 rows repeat the row before exactly, first at row 4; speeds are wrong there."
    assert notice("duplicates", repeated=1, first=4).text.startswith("1 row repeats the row before")
    assert json.loads(json.dumps(said.as_dict())) == {
        "code": "duplicates",
        "weight": "suspicious",
        "about": "poses",
        "text": said.text,
        "rows": [4],
        "values": {"repeated": 2, "first": 4},
    }


def test_a_code_or_a_value_that_lacks_fails_where_the_notice_is_made():
    with pytest.raises(KeyError):
        notice("no-such-code")
    with pytest.raises(KeyError):
        notice("scaled", factor=2.0)


def test_other_packages_say_their_own_with_a_prefix():
    said = own_notice("mypackage.dark", "The video is dark: {no} value.", "warning", about="view", lux=3)
    assert (said.text, said.warns, said.values["lux"]) == ("The video is dark: {no} value.", True, 3)
    for code in ("dark", "mypackage.", ".dark"):
        with pytest.raises(ValueError, match="prefix"):
            own_notice(code, "Dark.")


def test_doubles_are_told_by_code_rows_and_values():
    first, second = (notice("seam", rows=[row]) for row in (3, 5))
    assert without_doubles([first, second, notice("seam", rows=[3])]) == (first, second)
    assert Take("t").saying(first).saying(first, second).notices == (first, second)


def test_the_verdict_is_that_of_the_gravest():
    notes: list[Notice] = [notice("rate-not-stated")]
    assert verdict(notes) == "good"
    assert verdict([*notes, notice("axis-invented", axis="z"), notice("rebase", axis="y")]) == "unusable"


def test_codes_are_words_and_sentences_end():
    for code, entry in CATALOGUE.items():
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", code)
        assert all(name.isidentifier() for _, name, _, _ in Formatter().parse(entry.template) if name)
        assert entry.template.endswith((".", ".}", "?", "{reason}")), code


def test_every_code_is_said_somewhere():
    rooms = ("pipeline", "adapters", "models", "stages")
    sources = [path for room in rooms for path in (ROOT / room).rglob("*.py") if "catalogue" not in path.name]
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources)
    made = {code for code in CATALOGUE if f'"{code}"' in text or f'"{code.replace("-", "_")}"' in text}
    assert sorted(set(CATALOGUE) - made) == []
