"""A short sample of damaged files for every reader; `python -m fuzz` reads as many as you like (CONTRIBUTING.md)."""

import sys
from random import Random

import pytest

from fuzz.guarded import Worker
from fuzz.mutations import mutated
from fuzz.readers import REAL, names, read
from fuzz.run import fuzz
from pcnet3d.pipeline import InputError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is measured by Linux's /proc")
FILES = 8
WITH_REAL_FILES = [
    pytest.param(reader, marks=pytest.mark.data(*files), id=f"{reader} with real files")
    for reader, files in REAL.items()
]


@pytest.fixture(scope="module")
def worker():
    worker = Worker(read)
    yield worker
    worker.close()


@pytest.mark.parametrize("reader", [*names(), *WITH_REAL_FILES])
def test_damaged_files_have_words_or_are_read(reader, worker, tmp_path):
    found = fuzz(reader, range(FILES), tmp_path, worker)
    assert found.files == FILES
    assert not found.findings, found.line()


def test_the_same_number_gives_the_same_file():
    content = bytes(range(256)) * 20
    for suffix in (".npy", ".json", ".pkl", ".csv", ".bin"):
        assert mutated(content, suffix, Random("x 1")) == mutated(content, suffix, Random("x 1"))
    assert len({mutated(content, ".bin", Random(f"x {i}")) for i in range(50)}) > 40


def behaves(how: str) -> None:
    """What a bad reader could do."""
    if how == "crash":
        import ctypes

        ctypes.string_at(0)
    if how == "memory":
        bytearray(200_000_000)[::4096] = b"x" * len(range(0, 200_000_000, 4096))
    if how == "words":
        error = InputError("bad-value", "x")
        error.args = ("two\nlines",)
        raise error
    if how == "starved":
        try:
            bytearray(1 << 45)
        except MemoryError:
            raise InputError("bad-value", "damaged") from None
    if how == "refused":
        raise InputError("bad-value", "so it is")
    if how == "error":
        raise KeyError(how)


def test_a_guarded_reading_notices():
    worker = Worker(behaves)
    try:
        assert worker.read("memory").peak > 190_000_000
        assert worker.read("valid").peak < 10_000_000
        for how in ("words", "refused", "error"):
            assert worker.read(how).ended == how
        assert worker.read("starved").ended == "words"
        assert worker.read("crash").ended == "crash"
        assert worker.ended
    finally:
        worker.close()
