"""models/limits.toml has every number that `pipeline/signals` and `reading` decide by, and says where it is from."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from pcnet3d.pipeline.core.limits import limit, limits

ROOT = Path(__file__).parents[2]
HELD_TO_IT = [
    path.relative_to(ROOT).as_posix()
    for folder in ("pipeline/signals", "pipeline/reading")
    for path in sorted((ROOT / folder).rglob("*.py"))
]
# What decides nothing: indices, signs and orders; zero, one and half; per cent and degrees of a turn.
NEUTRAL = {*range(5), 0.5, 100, 180, 360}
# Against division by zero and rounding of times in single precision.
NEUTRAL |= {1e-12, 1e-9}
# Numbers of arithmetic, definitions and memory, by module: those in functions, and names of the module.
OWN = {
    "altered.py": {1e-6: "of single precision, and more", 1e-30: "the same of zeros"},
    "angles.py": {"REASONS": "codes"},
    "checks.py": {"_UP": "axes"},
    "filters.py": {"ORDER": "of the filter", "_ALL": "rows at once", "_AT_ONCE": "memory"},
    "findings.py": {
        24: "a mean over w is shorter by (rate w)^2 / 24", 0.25: "a root of a fourth power", 5: "seams that are named",
    },
    "joint_order.py": {"_MOST_ROWS": "time"},
    "load.py": {
        "_LISTED": "that are named", "_SHOWN": "that are shown", "_READ_JSON": "memory", 8: "of a header",
        12: "of a header", 16: "of a text",
    },
    "norms.py": {"FINE": "codes"},
    "people.py": {"_NEVER": "a cost beyond all others", "_RANGES": "of the values in OpenCV"},
    "reprojection.py": {"_ROUNDS": "until weights hardly change"},
    "swaps.py": {"_LOOKED_AT": "memory", "_MOST_RANGES": "that are named", 5: "rows of a step and of three behind it"},
    "testing.py": {"_GARBAGE": "made-up files"},
    "together.py": {"_FAR_SIZE": "a camera far away"},
}  # fmt: skip


def numbers(tree: ast.AST) -> Iterator[float]:
    """All in it."""
    if isinstance(tree, ast.Constant) and type(tree.value) in (int, float):
        yield tree.value
    for part in ast.iter_child_nodes(tree):
        yield from numbers(part)


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def asked_for() -> set[str]:
    """The names in all calls of `limit`, also where one of two is asked for."""
    paths = (
        path for name in ("pipeline", "adapters", "models", "stages") for path in (ROOT / name).rglob("*.py")
    )
    calls = (node for path in paths for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call))
    return {
        part.value
        for call in calls
        if isinstance(call.func, ast.Name) and call.func.id == "limit"
        for part in ast.walk(call)
        if isinstance(part, ast.Constant) and isinstance(part.value, str)
    }


@pytest.mark.parametrize("name", limits())
def test_a_limit_says_its_unit_what_it_tells_its_source_and_how_many_people(name):
    fields = limits()[name]
    assert list(fields) == ["value", "unit", "tells", "source", "people"]
    values = fields["value"] if isinstance(fields["value"], list) else [fields["value"]]
    assert values
    assert {type(value) for value in values} <= {int, float}
    assert all(fields[key].strip() == fields[key] != "" for key in ("unit", "tells", "source"))
    assert fields["tells"].endswith(".")
    assert fields["source"].endswith(".")
    people = fields["people"]
    assert people == "not recorded" or (type(people) is int and people >= 0)


def test_every_limit_is_used_and_every_name_that_is_used_is_a_limit():
    assert asked_for() == set(limits())


def test_an_unknown_name_is_an_error():
    with pytest.raises(KeyError, match="no-such"):
        limit("no-such.limit")


@pytest.mark.parametrize("module", HELD_TO_IT)
def test_no_number_that_decides_stands_beside_the_file(module):
    own = OWN.get(Path(module).name, {})
    for node in tree_of(ROOT / module).body:
        names = {
            part.id
            for part in ast.walk(node)
            if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
        }
        if isinstance(node, ast.Assign | ast.AnnAssign):
            of_name = [number for number in numbers(node) if number not in {0, 1}]
            assert not of_name or names & {*own}, f"{module}:{node.lineno} {of_name}"
        else:
            left = [number for number in numbers(node) if number not in {*NEUTRAL, *own}]
            assert not left, f"{module}:{node.lineno} {left}"
