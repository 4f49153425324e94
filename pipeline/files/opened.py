"""Strangers' files, opened: how they begin, which is all that recognising them may read, the text of a whole one, and
how much a compressed one may unpack to before it counts as a bomb.

Text is UTF-8; it may be compressed with gzip, and begin with a byte order mark.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from ..core.errors import InputError, naming, readable

_GZIP = b"\x1f\x8b"
_GZIP_OR_ZLIB = 32 + zlib.MAX_WBITS  # streams that zlib tells apart by their headers
_ROOM = 1 << 20  # bytes that any file may unpack to
_TIMES = 50  # and this often its size: a film of nobody but now and then shrinks to a twentieth, bombs to a thousandth


def first_bytes(path: Path, count: int, packed: bytes = _GZIP) -> bytes:
    """At most `count` bytes of a file, unpacked where it begins with these; none of anything else and of what cannot be
    read. Never raises."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            start = file.read(count)
        return (
            zlib.decompressobj(_GZIP_OR_ZLIB).decompress(start, count) if start.startswith(packed) else start
        )
    except (OSError, zlib.error):
        return b""


def first_lines(path: Path, count: int) -> list[str]:
    """The lines that begin within so many bytes of a text, the last one maybe cut off; none of anything else. Never
    raises."""
    text = first_bytes(path, count).decode("utf-8-sig", errors="ignore")
    return [] if "\0" in text else text.splitlines()


@contextmanager
def opened_text(path: Path, what: str) -> Iterator[TextIO]:
    """A text, opened, with its line ends as they are. what: in words, for InputError when it cannot be read."""
    with readable(path, what), path.open("rb") as file:
        start = file.read(len(_GZIP))
        file.seek(0)
        stream: io.BufferedIOBase = file
        if start == _GZIP:
            try:
                with naming(path):
                    content = unpacked(file.read(), "a text")
            except (zlib.error, EOFError):
                raise InputError(
                    "file-damaged",
                    f"Expected {what} in {path}, but its gzip data are damaged or cut short; copy it again.",
                ) from None
            stream = io.BytesIO(content)
        with io.TextIOWrapper(stream, "utf-8-sig", newline="") as text:
            yield text


def whole_text(path: Path, what: str) -> str:
    """All of a text; InputError, saying that `what` was expected, when it cannot be read, or is empty."""
    with opened_text(path, what) as file:
        text = file.read()
    if not text.strip():
        raise InputError("file-damaged", f"Expected {what} in {path}, but the file is empty; copy it again.")
    return text


def check_size(size: int, packed: int, what: str) -> None:
    """InputError when `packed` bytes say that they unpack to a `size` that no measurement has."""
    if size > max(_ROOM, _TIMES * packed):
        raise InputError(
            "unsafe",
            f"expected {what} that unpacks to at most {_TIMES} times its {packed} bytes, got one that unpacks to "
            "more; write it again without compression.",
        )


def unpacked(packed: bytes, what: str) -> bytes:
    """Of one zlib or gzip stream. InputError when it is longer than check_size allows, before it is unpacked to more;
    zlib.error for damaged ones, EOFError for those that were cut short."""
    unpacking = zlib.decompressobj(_GZIP_OR_ZLIB)
    most = max(_ROOM, _TIMES * len(packed))
    content = unpacking.decompress(packed, most)
    if not unpacking.eof:
        check_size(most + (len(content) == most), len(packed), what)
        raise EOFError("it was cut short")
    return content
