"""NumPy's files, pickles and compressed streams, damaged where a reader trusts them."""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from random import Random

import numpy as np

from fuzz.damage_bytes import BYTES, EXTREMES, integer, real

FLOATS = (np.nan, np.inf, -np.inf, 0.0, 1e30, -1e30, 3e38, 1e-40, 1.0)


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


def npy_header(content: bytes, rng: Random) -> bytes:
    """The header says something else than the data are."""
    try:
        header, data = _npy_parts(content)
    except ValueError:
        return integer(content, rng)
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


def npy_values(content: bytes, rng: Random) -> bytes:
    """Some of the numbers become NaN, infinite, huge, tiny or nothing; or all of them the same."""
    try:
        with np.errstate(all="ignore"):
            array = np.load(io.BytesIO(content), allow_pickle=False).copy()
    except Exception:
        return real(content, rng)
    if array.dtype.kind not in "fiu" or array.size == 0:
        return real(content, rng)
    if array.ndim == 0:
        array = array[None]
    flat, value = array.reshape(-1), rng.choice(FLOATS)
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


def npz(content: bytes, rng: Random) -> bytes:
    """One member is mutated, renamed, dropped, doubled, or made a bomb; or the archive is written another way."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:
        return integer(content, rng)
    if not members or sum(map(len, members.values())) > 20_000_000:  # a bomb already
        return integer(content, rng)
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
            members[name] = npy_header(members[name], rng)
        case 6 | 7 | 8:
            members[name] = npy_values(members[name], rng)
        case _:
            members[name] = rng.choice(BYTES)(members[name], rng)
    saved = io.BytesIO()
    with zipfile.ZipFile(saved, "w", method) as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return saved.getvalue()


def _bomb(member: bytes, rng: Random) -> bytes:
    """An array of the same kind with as many rows as make up to 100 MB of nothing."""
    try:
        header, data = _npy_parts(member)
        rows = re.search(r"'shape': \((\d+)", header.decode("latin1"))
        times = rng.choice((5_000_000, 100_000_000)) // max(len(data), 1)
        if rows is None or int(rows[1]) == 0 or times < 2:
            raise ValueError
    except ValueError:
        return b"\0" * 50_000_000
    text = header.decode("latin1").replace(f"({rows[1]}", f"({int(rows[1]) * times}", 1)
    return _npy(text, rng.choice((b"\0" * len(data), data)) * times)


def squeezed(content: bytes, rng: Random) -> bytes:
    """A zlib stream of the content, or of very much of nothing."""
    bomb = content + b"\0" * rng.choice((0, 50_000_000, 100_000_000))
    return zlib.compress(bomb, 9)[: rng.choice((None, None, -1, 50))]


def opcode(content: bytes, rng: Random) -> bytes:
    """An instruction of pickle's is put in: look-ups, huge claims, doubled stacks, builds."""
    at = rng.randrange(2, max(3, len(content)))
    four, eight = rng.choice(EXTREMES).to_bytes(8, "little")[:4], rng.choice(EXTREMES).to_bytes(8, "little")
    more = rng.choice(
        (b"2" * 50, b"j" + four, b"r" + four, b"h\x00", b"\x95" + eight, b"B" + four, b"\x8e" + eight, b"X" + four,
         b"\x8d" + eight, b"\x8b" + four, b"cbuiltins\neval\n", b"\x82\x01", b"Pabc\n", b"Q", b"b", b"R", b"\x81",
         b"\x85", b"(" * 500, b"]" * 500 + b"a" * 499, b"0", b"1", b"t", b"u", b"s", b"\x94", b"\x93", b"o", b"i",
         b"L" + b"9" * 6000 + b"L\n")
    )  # fmt: skip
    return content[:at] + more + content[at:]
