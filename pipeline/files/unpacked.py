"""How much a compressed file may unpack to before it counts as a bomb."""

from __future__ import annotations

import zlib

from ..core.errors import InputError

GZIP_OR_ZLIB = 32 + zlib.MAX_WBITS  # streams that zlib tells apart by their headers
_ROOM = 1 << 20  # bytes that any file may unpack to
_TIMES = 50  # and this often its size: a film of nobody but now and then shrinks to a twentieth, bombs to a thousandth


def check_size(size: int, packed: int, what: str) -> None:
    """InputError when `packed` bytes say that they unpack to a `size` that no measurement has."""
    if size > max(_ROOM, _TIMES * packed):
        raise InputError(
            "unsafe",
            f"expected {what} that unpacks to at most {_TIMES} times its {packed} bytes, got one that unpacks to "
            f"{f'{size} bytes' if size < 1 << 62 else 'more'}; write it again without compression.",
        )


def unpacked(packed: bytes, what: str) -> bytes:
    """Of one zlib or gzip stream. InputError when it is longer than check_size allows, before it is unpacked to more;
    zlib.error for damaged ones, EOFError for those that were cut short."""
    unpacking = zlib.decompressobj(GZIP_OR_ZLIB)
    most = max(_ROOM, _TIMES * len(packed))
    content = unpacking.decompress(packed, most)
    if not unpacking.eof:
        if len(content) == most:
            check_size(1 << 62, len(packed), what)
        raise EOFError("it was cut short")
    return content
