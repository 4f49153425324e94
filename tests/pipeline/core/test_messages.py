"""What a command says on stderr: plain lines, more or fewer, wrapped and marked on a terminal."""

import io
import re
import sys

import pytest

from pcnet3d.pipeline.core import messages
from pcnet3d.pipeline.core.measures import with_bar


@pytest.fixture(autouse=True)
def normal():
    yield
    messages.set_verbose(False)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("values", "told"),
    [([], ""), ([3], "3"), (range(5), "0, 1, 2, 3, 4"), (range(8), "0, 1, 2, 3, 4 and 3 more")],
)
def test_of_many_the_first_are_told_and_how_many_more_there_are(values, told):
    assert messages.first_few(values) == told


def test_spans_of_time_in_a_sentence():
    spans = [(0.5, 1), (2, 3), (4, 5.125)]
    assert messages.spans_in_words(spans[:1]) == "0.50 to 1.00 s"
    assert messages.spans_in_words(spans, 1) == "0.50 to 1.00 s and 2 more times"
    assert messages.spans_in_words(spans, 2) == "0.50 to 1.00 s, 2.00 to 3.00 s and 1 more time"
    assert messages.spans_in_words(spans) == "0.50 to 1.00 s, 2.00 to 3.00 s, 4.00 to 5.12 s"
    assert messages.spans_in_words([(1, 2.1), (4, 5), (1.004, 2)]) == "1.00 to 2.10 s, 4.00 to 5.00 s"
    assert messages.spans_in_words([(1, 1.3), (1.3, 1.6)]) == "1.00 to 1.30 s, 1.30 to 1.60 s"


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (97.31, 2.4, "97 ± 4"),
        (97.31, 0.0, "97.31 ± 0"),
        (97.31, None, "97"),
        (1.234, None, "1.2"),
        (123.0, None, "123"),
    ],
)
def test_a_figure_has_the_digits_that_its_error_leaves(value, error, shown):
    assert with_bar(value, error) == shown


def test_a_terminal_gets_wrapped_lines_whose_kinds_look_different(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    said = {}
    for kind in ("warning", "note"):
        monkeypatch.setattr(sys, "stderr", Terminal())
        messages.say(kind, "[1] the words of a long sentence " * 5)
        said[kind] = sys.stderr.getvalue()  # type: ignore[attr-defined]
        plain = re.sub(r"\x1b\[[\d;]*m", "", said[kind])
        assert max(map(len, plain.splitlines())) <= 40
        assert " ".join(plain.split()).count("[1] the words of a long sentence") == 5
    styles = [re.match(r"\x1b\[[\d;]*m", words) for words in said.values()]
    assert all(styles)
    assert styles[0][0] != styles[1][0]  # type: ignore[index]


def test_no_colour_where_none_is_wanted(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    coloured = re.compile(r"\x1b\[[\d;]*3\d")
    for wanted in (True, False):
        monkeypatch.delenv("NO_COLOR", raising=False)
        if not wanted:
            monkeypatch.setenv("NO_COLOR", "1")
        monkeypatch.setattr(sys, "stderr", Terminal())
        messages.say("warning", "look here")
        assert bool(coloured.search(sys.stderr.getvalue())) == wanted  # type: ignore[attr-defined]
