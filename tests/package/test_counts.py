"""Messages name a count by `how_many`, so that nobody reads "1 frames"."""

import ast
import re
from pathlib import Path

import pcnet3d.pipeline

PACKAGE = Path(pcnet3d.pipeline.__file__).parents[1]
FLOORS = ("pipeline", "adapters", "stages", "models")
_THINGS = re.compile(
    r"^ (rows|frames|joints|people|takes|clips|files|poses|cells|columns|sensors|cameras|points)\b"
)


def _counted(text: ast.JoinedStr) -> list[str]:
    """The lengths that a text names with a plural behind them."""
    pairs = zip(text.values, text.values[1:], strict=False)
    return [
        ast.unparse(value)
        for value, after in pairs
        if isinstance(value, ast.FormattedValue)
        and ast.unparse(value.value).startswith("len(")
        and value.format_spec is None
        and isinstance(after, ast.Constant)
        and _THINGS.match(str(after.value))
    ]


def test_the_length_of_something_is_never_a_plural_in_any_case():
    several = {  # of these there is never one where the text is said
        "pipeline/core/intrinsics.py", "pipeline/reading/choose.py", "pipeline/reading/take.py",
        "stages/study/compare/truth.py", "stages/detect.py",
    }  # fmt: skip
    found: dict[str, list[str]] = {}
    for path in (path for floor in FLOORS for path in (PACKAGE / floor).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr) and (counted := _counted(node)):
                found.setdefault(path.relative_to(PACKAGE).as_posix(), []).extend(counted)
    assert {name: counted for name, counted in found.items() if name not in several} == {}
