"""YAML as far as files of numbers use it: mappings by indentation, and lists of numbers and words.

OpenCV's own parser ends the process on deeply nested text and never ends on some damaged files, and does not read what
PyYAML writes; PyYAML would be a dependency for these few lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

_ENTRY = re.compile(r"(\"[^\"]*\"|'[^']*'|[^\"'\[\]{}:#,-][^\[\]{}:#]*?)[ \t]*:(?:[ \t]+(.*))?")
_DASHES = re.compile(r"(?:-[ \t]+)+")
_TAG = re.compile(r"![^ \t]*[ \t]*")
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")
_COMMENT = re.compile(rf"({_QUOTED.pattern})|(?:^|[ \t])#.*")


def number_yaml(text: str) -> dict[str, Any]:
    """The first document. Values are text, True, False, mappings, or lists of the text of every number or word, those
    of lists within the list included. Items that follow a key on lines of their own are the entry `data` of a mapping,
    as in OpenCV's matrices. Tags mean nothing. ValueError, naming the line, for anything else.
    """
    root: dict[str, Any] = {}
    holders = [(-1, root)]  # the mappings that are open, and the indentation of the keys that they belong to
    for number, line in _lines(text):
        indent, body = len(line) - len(line.lstrip(" ")), line.strip()
        dashes, entry = _DASHES.match(body), _ENTRY.fullmatch(body)
        while holders[-1][0] > indent or (holders[-1][0] == indent and not dashes):
            holders.pop()
        holder = holders[-1][1]
        if dashes and holder is not root:
            holder.setdefault("data", []).extend(_words(body[dashes.end() :]))
        elif entry:
            key, value = _scalar(entry[1]), _TAG.sub("", entry[2] or "", count=1)
            holder[str(key)] = _words(value) if value.startswith("[") else _scalar(value) if value else {}
            if not value:
                holders.append((indent, holder[str(key)]))
        else:
            raise ValueError(f"line {number} of its YAML cannot be read")
    return root


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Number and text of each line of the first document, without comments; a list in brackets is one line."""
    parts: list[str] = []
    depth, begun = 0, False
    for number, whole in enumerate(text.splitlines(), 1):
        if depth <= 0 and whole.startswith(("---", "...", "%")):
            if begun:
                return
            continue
        line = _COMMENT.sub(lambda found: found[1] or "", whole)
        if not line.strip():
            continue
        bare = _QUOTED.sub("", line)
        depth += bare.count("[") - bare.count("]")
        begun = True
        parts.append(line)
        if depth <= 0:
            yield number, " ".join(parts)
            parts, depth = [], 0
    if parts:
        raise ValueError("a list of its YAML is never closed")


def _words(value: str) -> list[str]:
    words = re.sub(r"[\[\]]", "", value).strip().rstrip(",")
    return re.split(r"[ \t]*,[ \t]*", words) if words else []


def _scalar(value: str) -> str | bool:
    value = value.strip()
    if value[:1] in ("'", '"') and value[-1:] == value[:1]:
        return value[1:-1]
    return {"true": True, "false": False}.get(value.lower(), value)
