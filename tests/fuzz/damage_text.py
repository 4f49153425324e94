"""Texts and JSON, damaged in their numbers, words, lines and trees."""

from __future__ import annotations

import json
import re
from random import Random
from typing import Any

from fuzz.damage_bytes import flip, insert, place

NUMBERS = (
    "0", "-0", "1", "-1", "0.5", "1e999", "-1e999", "nan", "NaN", "inf", "-Infinity", "1e308", "-1e308", "1e-320",
    "2147483648", "9223372036854775807", "-9223372036854775808", "18446744073709551616", "1e20", "9" * 400, "9" * 5000,
    "", "x", "0x10", "1_000", "٣", "1,5", "--1", "1e", "true", "null",
)  # fmt: skip
TEXTS = (
    "", " ", "x", "\0", "\x1b[2J\x1b]0;x\x07", "<script>alert(1)</script>", "&quot;", "../../etc/passwd", "\u202e", "ä",
    "'; DROP TABLE", "%s%s%n", "{0}", "x" * 100_000, "\n\n\n", "nan", "0" * 30, "99999999999999999999.jpg", "-5.jpg",
    "9007199254740991.jpg",
)  # fmt: skip
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def token(content: bytes, rng: Random) -> bytes:
    """One of the numbers becomes another."""
    places = [match.span() for match in _NUMBER.finditer(content[:200_000])]
    if not places:
        return flip(content, rng)
    start, end = places[min(int(len(places) * rng.random() ** 2), len(places) - 1)]
    return content[:start] + rng.choice(NUMBERS).encode() + content[end:]


def _lines(content: bytes, rng: Random) -> bytes:
    """A line is dropped, doubled, moved, emptied or repeated often."""
    lines = content.split(b"\n")
    i, j = (min(int(len(lines) * rng.random() ** 2), len(lines) - 1) for _ in range(2))
    match rng.randrange(6):
        case 0:
            del lines[i]
        case 1:
            lines.insert(i, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i] = b""
        case 4:
            lines[i:i] = [lines[i]] * rng.choice((10, 1000))
        case 5:
            del lines[i : i + rng.choice((5, 1000))]
    return b"\n".join(lines)


def _word(content: bytes, rng: Random) -> bytes:
    words = list(re.finditer(rb"[A-Za-z_]+", content[:100_000]))
    if not words:
        return insert(content, rng)
    start, end = rng.choice(words).span()
    other = words[rng.randrange(len(words))].group()
    return content[:start] + rng.choice((rng.choice(TEXTS).encode(), other, b"")) + content[end:]


def _separators(content: bytes, rng: Random) -> bytes:
    old, new = (
        rng.choice((b",", b"\t", b" ", b";", b"\n")),
        rng.choice((b",", b"\t", b" ", b";", b"\r", b'"', b"")),
    )
    return content.replace(old, new, rng.choice((1, 5, -1)))


def bracket(content: bytes, rng: Random) -> bytes:
    at = place(content, rng)
    return (
        content[:at]
        + rng.choice((b"{", b"}", b'"', b"[", b"]", b"#", b"'")) * rng.choice((1, 1, 2000))
        + content[at:]
    )


TEXT = (token, token, token, _lines, _lines, _word, _separators, bracket)


def json_tree(content: bytes, rng: Random) -> bytes:
    """One value somewhere in the tree becomes another, goes, comes twice or under another name."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return token(content, rng)
    holder: Any = [tree]
    root, key = holder, 0
    while True:
        value = holder[key]
        if not isinstance(value, list | dict) or not value or rng.random() < 0.15:
            break
        holder = value
        first = rng.random() < 0.5
        keys = list(value) if isinstance(value, dict) else range(len(value))
        key = keys[0] if first else rng.choice(keys)
    match rng.randrange(6):
        case 0 if holder is not root:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[rng.choice((*TEXTS, *holder))] = holder.pop(key)
        case 2 if isinstance(holder, list):
            holder[key:key] = [holder[key]] * rng.choice((1, 3, 100))
        case 3:
            holder[key] = rng.choice(([holder[key]], {"a": holder[key]}, [[holder[key]]]))
        case _:
            holder[key] = _MARK
    text = json.dumps(root[0])
    return text.replace(json.dumps(_MARK), _value(rng), 1).encode("utf-8", "surrogatepass")


_MARK = "<<here>>"


def _value(rng: Random) -> str:
    """A JSON value that a reader may not have expected."""
    match rng.randrange(4):
        case 0:
            return rng.choice(NUMBERS[:-4]) or "0"
        case 1:
            return rng.choice((json.dumps(rng.choice(TEXTS)), '"\\ud800"'))
        case 2:
            depth = rng.choice((1, 2, 50, 900, 100_000))
            return rng.choice(("[" * depth + "]" * depth, '{"a":' * depth + "0" + "}" * depth, "[" * depth))
        case _:
            return rng.choice(
                ("null", "true", "[]", "{}", "[[]]", "[null]", "[1,[2]]", '["a"]', "[1e999]", "[[1,2],[3]]")
            )
