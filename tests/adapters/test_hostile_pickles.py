"""Pickles written to do harm: each is refused in a sentence, at once, and nothing of them is run."""

import io
import pickle
import time
import tracemalloc
import zlib

import numpy as np
import pytest

from laps import lap_s
from pcnet3d.adapters.kit import pickles as _pickles
from pcnet3d.adapters.kit.pickles import load, loads
from pcnet3d.pipeline import InputError

HEAD, STOP = b"\x80\x04", b"."


class Calls:
    def __init__(self, function, *args):
        self.what = function, args

    def __reduce__(self):
        return self.what


def named(module: str, name: str) -> bytes:
    """The instruction that asks for a name."""
    return f"c{module}\n{name}\n".encode()


def number(size: int) -> bytes:
    return size.to_bytes(8, "little")


def twice(depth: int) -> bytes:
    """A list of a list twice, of a list twice, ... which is 2 to the power of depth in full."""
    return b"]\x94" + b"".join(b"](h%ch%ce\x94" % (i, i) for i in range(depth))


ARRAY = named("numpy._core.multiarray", "_reconstruct")
DTYPE = named("numpy", "dtype")
WRAPPER = named("joblib.numpy_pickle", "NumpyArrayWrapper")
FORBIDDEN = {
    "os.system": pickle.dumps(Calls(__import__("os").system, "touch /nowhere")),
    "eval": pickle.dumps(Calls(eval, "1")),
    "exec in a dict's key": pickle.dumps({("a", 1): [Calls(exec, "1")]}),
    "getattr": pickle.dumps(Calls(getattr, "", "join")),
    "numpy.load": pickle.dumps(Calls(np.load, "x.npy")),
    "numpy.fromfile": pickle.dumps(Calls(np.fromfile, "/etc/passwd")),
    "the loader of objects": HEAD + named("numpy._core.multiarray", "fromstring") + STOP,
    "a name of several parts": HEAD + named("numpy", "ndarray.tofile") + STOP,
    "a name on the stack": HEAD + b"\x8c\x02os\x8c\x06system\x93" + STOP,
    "a class of our own": HEAD + named("pcnet3d.adapters.kit.pickles", "_Array") + STOP,
    "an object by its class": HEAD + b"(" + named("subprocess", "Popen") + b"o" + STOP,
    "an instance of old": HEAD + b"(isubprocess\nPopen\n" + STOP,
    "an extension's number": HEAD + b"\x82\x01" + STOP,
}
BROKEN = {
    "a persistent name": HEAD + b"Phome\n" + STOP,
    "a persistent name on the stack": HEAD + b"\x8c\x01xQ" + STOP,
    "bytes of a terabyte": HEAD + b"\x8e" + number(1 << 40) + b"x" + STOP,
    "text of a terabyte": HEAD + b"\x8d" + number(1 << 40) + b"x" + STOP,
    "an array of bytes of a terabyte": b"\x80\x05\x96" + number(1 << 40) + b"x" + STOP,
    "an array of bytes of two gigabytes": b"\x80\x05\x96" + number(1 << 31) + b"x" + STOP,
    "a number of megabytes": HEAD + b"\x8b" + (4 << 20).to_bytes(4, "little") + b"\x7f" * (4 << 20) + STOP,
    "a number in digits": HEAD + b"L" + b"9" * 4000 + b"L\n" + STOP,
    "a memo far out": HEAD + b"Nr" + b"\xff\xff\xff\x7f" + b"j\xfe\xff\xff\x7f" + STOP,
    "nested deep": HEAD + b"]" * 100_000 + b"a" * 99_999 + STOP,
    "a list in itself": HEAD + b"]\x94h\x00a" + STOP,
    "a state for a class of ours": HEAD + ARRAY + b"N}\x8c\x05numpyK\x01s\x86b" + STOP,
    "a state for a function of ours": HEAD + named("_codecs", "encode") + b"}\x8c\x01xK\x01sb" + STOP,
    "a state for dict": HEAD + named("collections", "OrderedDict") + b")R}\x8c\x01xK\x01sb" + STOP,
    "slots for joblib's wrapper": HEAD + WRAPPER + b")\x81N}\x8c\x05numpyK\x01s\x86b" + STOP,
    "a class in place of a value": HEAD + b"]" + ARRAY + b"a" + STOP,
    "a set": pickle.dumps({1, 2}),
    "an unhashable key": HEAD + b"}]Ns" + STOP,
    "an array of objects in the bytes": pickle.dumps({"a": np.zeros(3, dtype="datetime64[s]")}),
    "a structured array": pickle.dumps(np.zeros(3, dtype="f4,f4")),
    "complex numbers": pickle.dumps(np.zeros(3, dtype=complex)),
    "nothing": b"",
    "no end": HEAD + b"N",
}


def array(shape: bytes, dtype: bytes = b"f8", raw: bytes = b"C\x04abcd") -> bytes:
    """An array of that shape (instructions), with a state of its own."""
    kind = DTYPE + b"\x8c" + bytes([len(dtype)]) + dtype + b"K\x00K\x01\x87R"
    return HEAD + ARRAY + b")R(K\x01" + shape + kind + b"\x89" + raw + b"tb" + STOP


HUGE = b"\x8a\x08" + number(1 << 60)
ARRAYS = {
    "a shape that the bytes are not": array(HUGE + b"\x85"),
    "a negative shape": array(b"J\xff\xff\xff\xff\x85"),
    "a shape of text": array(b"\x8c\x01x\x85"),
    "objects that are too few": array(HUGE + b"\x85", b"O8", b"]"),
    "a type of a gigabyte": array(b"K\x01\x85", b"S1073741824"),
    "a type of many": array(b"K\x01\x85", b"(9999,9999)f8"),
    "no type": array(b"K\x01\x85", b"nonsense"),
    "records of objects": array(b"K\x01\x85", b"O,O"),
    "objects in place of numbers": array(b"K\x01\x85", b"f8", b"]"),
    "numbers in place of objects": array(b"K\x04\x85", b"O8"),
    "an array of itself": array(b"K\x01\x85", b"O8", b"]h\x00a").replace(b")R(", b")R\x94("),
}


def test_claims_that_nothing_is_taken_for_are_harmless():
    assert loads(HEAD + b"\x95" + number(1 << 40) + b"N" + STOP, "x.pkl") is None  # a frame of a terabyte
    assert loads(array(HUGE + b"K\x00\x86", b"O8", b"]"), "x.pkl") == []  # no objects in a huge shape
    assert loads(HEAD + ARRAY + b")R" + STOP, "x.pkl").size == 0  # an array that was never filled


def test_names_are_refused_before_anything_is_called():
    for compressed in [False, True]:
        for content in FORBIDDEN.values():
            with pytest.raises(InputError, match=r"^x\.pkl: expected arrays and plain containers"):
                loads(zlib.compress(content) if compressed else content, "x.pkl")


@pytest.fixture(scope="module")
def lap() -> float:
    return lap_s()


@pytest.mark.parametrize("content", (BROKEN | ARRAYS).values(), ids=(BROKEN | ARRAYS).keys())
def test_tricks_are_refused_at_once_and_in_little_memory(content, lap):
    tracemalloc.start()
    start = time.process_time()
    with pytest.raises(InputError, match=r"x\.pkl") as caught:
        loads(content, "x.pkl")
    seconds, (_, peak) = time.process_time() - start, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert str(caught.value).isprintable()
    assert peak < 40_000_000
    assert seconds < 100 * lap  # with every allocation traced


def test_what_is_named_twice_is_made_once(lap):
    start = time.process_time()
    value = loads(HEAD + twice(60) + STOP, "x.pkl")
    assert time.process_time() - start < 20 * lap
    assert value[0] is value[1]


def test_hashes_that_collide_are_refused():
    """Integers that differ by 2**61 - 1 have one hash: a dict of them takes the square of their number."""
    keys = {i * ((1 << 61) - 1): None for i in range(1, 6)}
    with pytest.raises(InputError, match="64 bits"):
        loads(pickle.dumps({key << 64: None for key in keys}), "x.pkl")


def test_classes_of_ours_are_as_before():
    before = {name: dict(vars(each)) for name, each in vars(_pickles).items() if isinstance(each, type)}
    for content in BROKEN.values():
        with pytest.raises(InputError):
            loads(content, "x.pkl")
    assert {
        name: dict(vars(each)) for name, each in vars(_pickles).items() if isinstance(each, type)
    } == before


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    stream, packing = io.BytesIO(), zlib.compressobj(9)
    stream.write(packing.compress(HEAD))
    for _ in range(6):
        stream.write(packing.compress(bytes(10_000_000)))
    stream.write(packing.flush())
    (tmp_path / "x.pkl").write_bytes(stream.getvalue())
    tracemalloc.start()
    with pytest.raises(InputError, match="unpacks to at most"):
        load(tmp_path / "x.pkl")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * 50 * len(stream.getvalue()) + 10_000_000


def test_plain_values_and_arrays_come_through():
    value = {"a": [1, 2.5, "x", None, True, b"y", (1, 2)], "b": np.arange(6.0).reshape(2, 3), "c": -(1 << 63)}
    for protocol in range(2, 6):
        found = loads(pickle.dumps(value, protocol), "x.pkl")
        assert found["a"] == value["a"]
        np.testing.assert_array_equal(found["b"], value["b"])
        assert found["c"] == value["c"]
