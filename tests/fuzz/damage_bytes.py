"""Bytes of any file, damaged."""

from __future__ import annotations

import struct
from collections.abc import Callable
from random import Random

import numpy as np

Mutation = Callable[[bytes, Random], bytes]

EXTREMES = (
    0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF,
)  # fmt: skip


def place(content: bytes, rng: Random) -> int:
    """Anywhere, more often near the beginning, where headers are."""
    end = len(content) if rng.random() < 0.5 else min(len(content), 1024)
    return rng.randrange(end) if end else 0


def flip(content: bytes, rng: Random) -> bytes:
    found = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8, 64)) if found else 0):
        found[place(content, rng)] ^= 1 << rng.randrange(8)
    return bytes(found)


def integer(content: bytes, rng: Random) -> bytes:
    """A number of 1, 2, 4 or 8 bytes, at its own alignment, becomes an extreme one."""
    width = rng.choice((1, 2, 4, 8))
    at = place(content, rng) // width * width
    value = (rng.choice(EXTREMES) + rng.choice((-1, 0, 0, 1))) % (1 << 8 * width)
    return content[:at] + value.to_bytes(width, rng.choice(("little", "big"))) + content[at + width :]


def real(content: bytes, rng: Random) -> bytes:
    width, code = rng.choice(((4, "f"), (8, "d")))
    at = place(content, rng) // width * width
    value = rng.choice((np.nan, np.inf, -np.inf, 1e38, -1.0, 0.0, 1e-40))
    return content[:at] + struct.pack(rng.choice("<>") + code, value) + content[at + width :]


def _cut(content: bytes, rng: Random) -> bytes:
    return content[: rng.choice((0, 1, 16, len(content) - 1, place(content, rng)))]


def _remove(content: bytes, rng: Random) -> bytes:
    at = place(content, rng)
    return content[:at] + content[at + rng.choice((1, 2, 8, 64, 1000)) :]


def _repeat(content: bytes, rng: Random) -> bytes:
    at, length = place(content, rng), rng.choice((1, 4, 50, 2000))
    return content[:at] + content[at : at + length] * rng.choice((2, 3, 50)) + content[at + length :]


def _swap(content: bytes, rng: Random) -> bytes:
    a, b = sorted((place(content, rng), place(content, rng)))
    length = min(rng.choice((1, 8, 200)), b - a)
    return (
        content[:a]
        + content[b : b + length]
        + content[a + length : b]
        + content[a : a + length]
        + content[b + length :]
    )


def _fill(content: bytes, rng: Random) -> bytes:
    at, length = place(content, rng), rng.choice((4, 32, 500))
    return content[:at] + rng.choice((b"\0", b"\xff", b"A", b"[", b"(")) * length + content[at + length :]


def insert(content: bytes, rng: Random) -> bytes:
    at = place(content, rng)
    return content[:at] + rng.randbytes(rng.choice((1, 4, 100))) + content[at:]


BYTES: tuple[Mutation, ...] = (
    flip, flip, integer, integer, real, _cut, _remove, _repeat, _swap, _fill, insert,
)  # fmt: skip
