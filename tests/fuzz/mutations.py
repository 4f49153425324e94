"""A file's bytes, damaged: anywhere, in its numbers, or where its format keeps what a reader trusts.

`mutated(content, suffix, rng)` gives the same bytes for the same state of `rng`, a random.Random.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

import numpy as np

Mutation = Callable[[bytes, Random], bytes]

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
_EXTREMES = (
    0,
    1,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0x8000,
    0xFFFF,
    0x7FFFFFFF,
    0x80000000,
    0xFFFFFFFF,
    0x7FFFFFFFFFFFFFFF,
)
_FLOATS = (np.nan, np.inf, -np.inf, 0.0, 1e30, -1e30, 3e38, 1e-40, 1.0)
_MOST = 2_000_000  # bytes of a mutated file, bombs apart


def mutated(content: bytes, suffix: str, rng: Random) -> bytes:
    """The content after one to three mutations, those of the format and those of any bytes."""
    special = _OF_SUFFIX.get(suffix, ())
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        pool = special if special and rng.random() < 0.65 else _BYTES
        content = rng.choice(pool)(content, rng)[: max(_MOST, 2 * len(content))]
    return content


# Any bytes.


def _place(content: bytes, rng: Random) -> int:
    """Anywhere, more often near the beginning, where headers are."""
    end = len(content) if rng.random() < 0.5 else min(len(content), 1024)
    return rng.randrange(end) if end else 0


def _flip(content: bytes, rng: Random) -> bytes:
    found = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8, 64)) if found else 0):
        found[_place(content, rng)] ^= 1 << rng.randrange(8)
    return bytes(found)


def _integer(content: bytes, rng: Random) -> bytes:
    """A number of 1, 2, 4 or 8 bytes, at its own alignment, becomes an extreme one."""
    width = rng.choice((1, 2, 4, 8))
    at = _place(content, rng) // width * width
    value = (rng.choice(_EXTREMES) + rng.choice((-1, 0, 0, 1))) % (1 << 8 * width)
    return content[:at] + value.to_bytes(width, rng.choice(("little", "big"))) + content[at + width :]


def _real(content: bytes, rng: Random) -> bytes:
    width, code = rng.choice(((4, "f"), (8, "d")))
    at = _place(content, rng) // width * width
    value = rng.choice((np.nan, np.inf, -np.inf, 1e38, -1.0, 0.0, 1e-40))
    return content[:at] + struct.pack(rng.choice("<>") + code, value) + content[at + width :]


def _cut(content: bytes, rng: Random) -> bytes:
    return content[: rng.choice((0, 1, 16, len(content) - 1, _place(content, rng)))]


def _remove(content: bytes, rng: Random) -> bytes:
    at = _place(content, rng)
    return content[:at] + content[at + rng.choice((1, 2, 8, 64, 1000)) :]


def _repeat(content: bytes, rng: Random) -> bytes:
    at, length = _place(content, rng), rng.choice((1, 4, 50, 2000))
    return content[:at] + content[at : at + length] * rng.choice((2, 3, 50)) + content[at + length :]


def _swap(content: bytes, rng: Random) -> bytes:
    a, b = sorted((_place(content, rng), _place(content, rng)))
    length = min(rng.choice((1, 8, 200)), b - a)
    return (
        content[:a]
        + content[b : b + length]
        + content[a + length : b]
        + content[a : a + length]
        + content[b + length :]
    )


def _fill(content: bytes, rng: Random) -> bytes:
    at, length = _place(content, rng), rng.choice((4, 32, 500))
    return content[:at] + rng.choice((b"\0", b"\xff", b"A", b"[", b"(")) * length + content[at + length :]


def _insert(content: bytes, rng: Random) -> bytes:
    at = _place(content, rng)
    return content[:at] + rng.randbytes(rng.choice((1, 4, 100))) + content[at:]


_BYTES: tuple[Mutation, ...] = (
    _flip,
    _flip,
    _integer,
    _integer,
    _real,
    _cut,
    _remove,
    _repeat,
    _swap,
    _fill,
    _insert,
)


# Text.


def _token(content: bytes, rng: Random) -> bytes:
    """One of the numbers becomes another."""
    places = [match.span() for match in _NUMBER.finditer(content[:200_000])]
    if not places:
        return _flip(content, rng)
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
        return _insert(content, rng)
    start, end = rng.choice(words).span()
    other = words[rng.randrange(len(words))].group()
    return content[:start] + rng.choice((rng.choice(TEXTS).encode(), other, b"")) + content[end:]


def _separators(content: bytes, rng: Random) -> bytes:
    old, new = (
        rng.choice((b",", b"\t", b" ", b";", b"\n")),
        rng.choice((b",", b"\t", b" ", b";", b"\r", b'"', b"")),
    )
    return content.replace(old, new, rng.choice((1, 5, -1)))


def _bracket(content: bytes, rng: Random) -> bytes:
    at = _place(content, rng)
    return (
        content[:at]
        + rng.choice((b"{", b"}", b'"', b"[", b"]", b"#", b"'")) * rng.choice((1, 1, 2000))
        + content[at:]
    )


_TEXT = (_token, _token, _token, _lines, _lines, _word, _separators, _bracket)


# JSON.


def _json(content: bytes, rng: Random) -> bytes:
    """One value somewhere in the tree becomes another, goes, comes twice or under another name."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return _token(content, rng)
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


# NumPy's files.


def _npy_parts(content: bytes) -> tuple[bytes, bytes]:
    """Header text and data of an .npy file; ValueError for anything else."""
    if content[:6] != b"\x93NUMPY" or len(content) < 12:
        raise ValueError
    wide = content[6] > 1
    length = int.from_bytes(content[8:12] if wide else content[8:10], "little")
    start = (12 if wide else 10) + length
    return content[start - length : start], content[start:]


def _npy(header: str | bytes, data: bytes, version: int = 1) -> bytes:
    text = header.encode("latin1", "replace") if isinstance(header, str) else header
    if len(text) > 0xFFFF:
        version = 2
    return (
        b"\x93NUMPY"
        + bytes([version, 0])
        + len(text).to_bytes(2 if version == 1 else 4, "little")
        + text
        + data
    )


_SHAPES = (
    "(1099511627776,)", "(-1, 17, 3)", "()", "(0, 17, 3)", "(17, 3)", "(1, 40, 17, 3)", "(9223372036854775807, 17, 3)",
    "(9223372036854775808, 17, 3)", "(True, 17, 3)", "(40.0, 17, 3)", "('40', 17, 3)", "[40, 17, 3]", "40", "None",
    "(1073741824, 17, 3)", "(" + "1, " * 70 + ")", "(" * 300 + ")" * 300, "(4611686018427387904, 4)", "(1,) * 10**9",
    "(4294967296, 4294967296, 17, 3)", "(340282366920938463463374607431768211456,)",
)  # fmt: skip
_TYPES = (
    "|O", "<f2", ">f4", "<f8", "<c16", "|V8", "<U10", "<M8[s]", "|S4", "|b1", "<i8", "<u1", "f", "x", "<f16",
    "|V0", "<U0", "<U1073741823", "2147483647f4", "(1000000,1000000)f4", "O,O", "f4,f4",
)  # fmt: skip


def _npy_header(content: bytes, rng: Random) -> bytes:
    """The header says something else than the data are."""
    try:
        header, data = _npy_parts(content)
    except ValueError:
        return _integer(content, rng)
    text = header.decode("latin1")
    match rng.randrange(6):
        case 0 | 1:
            text = re.sub(r"'shape': \([^)]*\)", f"'shape': {rng.choice(_SHAPES)}", text)
        case 2:
            text = re.sub(r"'descr': '[^']*'", f"'descr': {rng.choice(_TYPES)!r}", text)
        case 3:
            text = text.replace(
                "False", rng.choice(("True", "None", "0", "'x'", "__import__('os').getcwd()"))
            )
        case 4:
            huge = "{'descr': [('a', '<f4', (1000000, 1000000))], 'fortran_order': False, 'shape': (1,)}"
            more = ("{}", "(" * 5000, "[" * 200, huge, text * 50, " " * 70_000, "\n", text[:-20], "1" * 9000)
            text = rng.choice(more)
        case 5:
            return _npy(text, data, rng.choice((0, 2, 3, 9, 255)))
    return _npy(text, data)


def _npy_values(content: bytes, rng: Random) -> bytes:
    """Some of the numbers become NaN, infinite, huge, tiny or nothing; or all of them the same."""
    try:
        with np.errstate(all="ignore"):
            array = np.load(io.BytesIO(content), allow_pickle=False).copy()
    except Exception:
        return _real(content, rng)
    if array.dtype.kind not in "fiu" or array.size == 0:
        return _real(content, rng)
    if array.ndim == 0:
        array = array[None]
    flat, value = array.reshape(-1), rng.choice(_FLOATS)
    with np.errstate(all="ignore"):
        value = np.array(value).astype(array.dtype)
    match rng.randrange(5):
        case 0:
            flat[rng.randrange(len(flat))] = value
        case 1:
            array[..., : rng.randrange(1, array.shape[-1] + 1)] = value
        case 2:
            array[: rng.randrange(1, len(array) + 1)] = value
        case 3:
            with np.errstate(all="ignore"):
                factor = np.float64(rng.choice((-1, 0, 1e-30, 1e30, 1000)))  # no integer: 1000 is no uint8
                array = (array * factor).astype(array.dtype)
        case 4:
            array = (
                array[:, ::-1] if array.ndim > 1 and rng.random() < 0.5 else array[: rng.choice((0, 1, 2, 3))]
            )
    saved = io.BytesIO()
    np.save(saved, array)
    return saved.getvalue()


def _npz(content: bytes, rng: Random) -> bytes:
    """One member is mutated, renamed, dropped, doubled, or made a bomb; or the archive is written another way."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:
        return _integer(content, rng)
    if not members or sum(map(len, members.values())) > 20_000_000:  # a bomb already
        return _integer(content, rng)
    name = rng.choice(list(members))
    method = rng.choice(
        (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    )
    match rng.randrange(12):
        case 0:
            members[rng.choice((*members, "x.npy", "../x.npy", "/x.npy", "a/b.npy", "x", "joints.npy"))] = (
                members.pop(name)
            )
        case 1:
            del members[name]
        case 2:
            members[name], method = _bomb(members[name], rng), zipfile.ZIP_DEFLATED
        case 3 | 4 | 5:
            members[name] = _npy_header(members[name], rng)
        case 6 | 7 | 8:
            members[name] = _npy_values(members[name], rng)
        case _:
            members[name] = rng.choice(_BYTES)(members[name], rng)
    saved = io.BytesIO()
    with zipfile.ZipFile(saved, "w", method) as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return saved.getvalue()


def _bomb(member: bytes, rng: Random) -> bytes:
    """An array of the same kind with as many rows as make up to 150 MB of nothing."""
    try:
        header, data = _npy_parts(member)
        rows = re.search(r"'shape': \((\d+)", header.decode("latin1"))
        times = rng.choice((5_000_000, 150_000_000)) // max(len(data), 1)
        if rows is None or int(rows[1]) == 0 or times < 2:
            raise ValueError
    except ValueError:
        return b"\0" * 50_000_000
    text = header.decode("latin1").replace(f"({rows[1]}", f"({int(rows[1]) * times}", 1)
    return _npy(text, rng.choice((b"\0" * len(data), data)) * times)


# Compressed and binary formats.


def _squeezed(content: bytes, rng: Random) -> bytes:
    """A zlib stream of the content, or of very much of nothing."""
    bomb = content + b"\0" * rng.choice((0, 50_000_000, 150_000_000))
    return zlib.compress(bomb, 9)[: rng.choice((None, None, -1, 50))]


def _opcode(content: bytes, rng: Random) -> bytes:
    """An instruction of pickle's is put in: look-ups, huge claims, doubled stacks, builds."""
    at = rng.randrange(2, max(3, len(content)))
    four, eight = rng.choice(_EXTREMES).to_bytes(8, "little")[:4], rng.choice(_EXTREMES).to_bytes(8, "little")
    more = rng.choice(
        (b"2" * 50, b"j" + four, b"r" + four, b"h\x00", b"\x95" + eight, b"B" + four, b"\x8e" + eight, b"X" + four,
         b"\x8d" + eight, b"\x8b" + four, b"cbuiltins\neval\n", b"\x82\x01", b"Pabc\n", b"Q", b"b", b"R", b"\x81",
         b"\x85", b"(" * 500, b"]" * 500 + b"a" * 499, b"0", b"1", b"t", b"u", b"s", b"\x94", b"\x93", b"o", b"i",
         b"L" + b"9" * 6000 + b"L\n")
    )  # fmt: skip
    return content[:at] + more + content[at:]


_OF_SUFFIX: dict[str, tuple[Mutation, ...]] = {
    ".json": (_json, _json, _json, _json, _token, _bracket),
    ".npy": (_npy_header, _npy_values),
    ".npz": (_npz,),
    ".pkl": (_opcode, _opcode, _opcode, _squeezed, _integer),
    ".pt": (_npz, _opcode),
    ".c3d": (_integer, _real),
    ".mat": (_integer, _real),
    ".mp4": (_integer,),
    ".onnx": (_integer,),
    ".parquet": (_integer,),
    **dict.fromkeys((".csv", ".trc", ".bvh", ".txt", ".sensors", ".toml", ".asf", ".amc"), _TEXT),
}
