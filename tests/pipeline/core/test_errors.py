"""Refusals: every InputError has a code of one table, which the documents hold too."""

import ast
import copy
import pickle
from pathlib import Path
from typing import get_args

import pytest

from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.core.refusals import REFUSALS, Refusal

ROOT = Path(__file__).parents[3]


class _OfOursError(InputError):
    pass


@pytest.mark.parametrize("kind", [InputError, _OfOursError])
@pytest.mark.parametrize("copied", [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_code_and_message_pass_between_processes(kind, copied):
    error = kind("bad-value", "Expected a positive rate, got -1.")
    error.add_note("row 3")
    again = copied(error)
    assert (type(again), again.code, str(again)) == (kind, "bad-value", "Expected a positive rate, got -1.")
    assert again.__notes__ == ["row 3"]


def test_a_code_that_there_is_not_fails_at_once():
    with pytest.raises(TypeError, match="got 'no-such-code'"):
        InputError("no-such-code", "It cannot be.")  # pyright: ignore[reportArgumentType]
    with pytest.raises(TypeError):
        InputError("Only a message.")  # pyright: ignore[reportCallIssue]


def test_the_table_has_every_code_once():
    assert list(REFUSALS) == list(get_args(Refusal))


def test_every_refusal_has_a_code_of_the_table_and_every_code_is_used():
    """A code is written out where the error is raised, or is that of another refusal."""
    used = set()
    for room in ("pipeline", "adapters", "models", "stages", "examples", "docs"):
        for path in (ROOT / room).rglob("*.py"):
            for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(call, ast.Call) and ast.unparse(call.func).endswith("InputError"):
                    code, _ = call.args
                    either = [code.body, code.orelse] if isinstance(code, ast.IfExp) else [code]
                    used |= {
                        each.value if isinstance(each, ast.Constant) else ast.unparse(each) for each in either
                    }
    assert used == {*REFUSALS, "error.code"}
