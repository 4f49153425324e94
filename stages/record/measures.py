"""The take's measures as a text in the recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ...pipeline.core.measures import Row, nested

_LONG = 8  # a list of more is in summary.json and measures.csv only


def measures_markdown(measures: Iterable[Row], length: str) -> str:
    """A heading for each group, a table for its members, a line for each figure of its own; keys as they are, since
    they carry the units but that of lengths, which is `length`. Curves over a cycle are left out."""
    lines = [
        f"Unit of length: {length}. Curves over a cycle are in summary.json, those of each stride in strides.csv."
    ]
    for name, group in nested(measures).items():
        lines += ["", f"#### {_spoken(name)}", *_group(group)]
    return "\n".join(lines) + "\n"


def _group(group: Mapping[str, Any]) -> list[str]:
    members = {key: value for key, value in group.items() if isinstance(value, Mapping) and key != "cycles"}
    own = {key: value for key, value in group.items() if not isinstance(value, Mapping) and _short(value)}
    return [*(f"- {_spoken(key)}: {_said(value)}" for key, value in own.items()), *_table(members)]


def _table(members: Mapping[str, Mapping[str, Any]]) -> list[str]:
    keys = list(
        dict.fromkeys(
            key
            for member in members.values()
            for key, value in member.items()
            if not isinstance(value, Mapping) and not _is_of_strides(member, key) and _short(value)
        )
    )
    if not keys:
        return []
    rows = [
        f"| {_spoken(name)} | {' | '.join(_said(member.get(key, '–')) for key in keys)} |"
        for name, member in members.items()
    ]
    return ["", f"| | {' | '.join(map(_spoken, keys))} |", "|---" * (len(keys) + 1) + "|", *rows]


def _is_of_strides(member: Mapping[str, Any], key: str) -> bool:
    """Whether it is a list of figures of each stride, whose mean stands beside it."""
    return isinstance(member[key], list) and (f"mean_{key}" in member or "_error_" in key)


def _short(value: Any) -> bool:
    return not isinstance(value, list) or len(value) <= _LONG


def _spoken(key: str) -> str:
    return key.replace("_", " ")


def _said(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_said, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
