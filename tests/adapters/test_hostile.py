"""Strangers' numpy files, pickles and others that are damaged, lie, unpack to far more than they are or would run
something: each is refused in a sentence, at once, in little memory, and nothing of it is run."""

import io
import json
import pickle
import re
import struct
import time
import tracemalloc
import zipfile
import zlib
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from golden import worlds
from golden.bodies import Person
from golden.pickles import Trap
from laps import lap_s
from pcnet3d.adapters import arrays, ddhpose, motionbert, read, videopose3d
from pcnet3d.adapters.kit import json as _json
from pcnet3d.adapters.kit import pickles as _pickles
from pcnet3d.adapters.kit.pickles import loads
from pcnet3d.pipeline import InputError, load_recipe
from pcnet3d.pipeline.files.arrays import keys, load, load_all, peek
from pcnet3d.pipeline.files.markers import parse_c3d
from pcnet3d.pipeline.files.opened import check_size

POSES = ("frames", 17, 3)
ADAPTERS = [motionbert, ddhpose, videopose3d, arrays]
JOINTS = np.random.default_rng(0).normal(size=(4, 17, 3)).astype(np.float32)


@pytest.fixture
def npy(tmp_path: Path) -> Path:
    np.save(tmp_path / "poses.npy", JOINTS)
    return tmp_path / "poses.npy"


@pytest.fixture
def npz(tmp_path: Path) -> Path:
    np.savez_compressed(tmp_path / "poses.npz", reconstruction=JOINTS, other=JOINTS[:, :5])
    return tmp_path / "poses.npz"


def not_loaded(path: Path, *said: str, key: str | None = None) -> None:
    """Loading raises an InputError that says so, and no sniffing falls over the file."""
    with pytest.raises(InputError) as error:
        load(path, POSES, key=key)
    for words in (path.name, *said):
        assert words in str(error.value)
    assert peek(path, POSES, key=key) is None
    for adapter in ADAPTERS:
        assert not adapter.sniff(path)


@pytest.mark.parametrize("dtype", ["float16", "float32", "float64", ">f4", "int32"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_come_back_as_saved(tmp_path, dtype, order):
    saved = np.asarray(100 * JOINTS, dtype=dtype, order=order)
    np.save(tmp_path / "a.npy", saved)
    np.savez(tmp_path / "a.npz", stored=saved)
    np.savez_compressed(tmp_path / "b.npz", deflated=saved)
    for file, key in (("a.npy", None), ("a.npz", "stored"), ("b.npz", "deflated")):
        loaded = load(tmp_path / file, POSES, key=key)
        assert loaded.dtype == saved.dtype
        np.testing.assert_array_equal(loaded, saved)


def test_keys(npy, npz):
    assert keys(npy) == ()
    assert keys(npz) == ("reconstruction", "other")


def test_missing_keys_and_other_shapes_are_named(npz):
    not_loaded(npz, "'joints'", "reconstruction, other", key="joints")
    not_loaded(npz, "single array (.npy)", "reconstruction, other")
    not_loaded(npz, "(frames, 17, 3)", "(4, 5, 3)", key="other")


def test_key_for_a_nameless_array(npy):
    with pytest.raises(InputError, match="one without a name"):
        load(npy, key="joints")


@pytest.mark.parametrize("content", [b"x", b"{}", b"frame,x,y\n0,1,2\n", b"\x00" * 400])
def test_not_a_numpy_file(tmp_path, content):
    (tmp_path / "text.npy").write_bytes(content)
    not_loaded(tmp_path / "text.npy", "neither an .npy nor an .npz")


def test_other_zip_archive(tmp_path):
    with zipfile.ZipFile(tmp_path / "weights.pt", "w") as archive:
        archive.writestr("archive/data.pkl", b"")
    not_loaded(tmp_path / "weights.pt", "no numpy arrays", key="reconstruction")


@pytest.mark.parametrize(
    ("frames", "kind", "words"),
    [(0, "f8", "holds none"), *((4, kind, "array of numbers") for kind in ("U1", "?", "c8", "f4,f4"))],
)
def test_no_frames_or_no_numbers(tmp_path, frames, kind, words):
    np.save(tmp_path / "a.npy", np.zeros((frames, 17, 3), dtype=kind))
    not_loaded(tmp_path / "a.npy", words)


def test_objects_are_never_unpickled(tmp_path):
    marker = tmp_path / "marker"
    trapped = np.empty((1, 17, 3), dtype=object)
    trapped[:] = Trap(marker)
    np.save(tmp_path / "trap.npy", trapped, allow_pickle=True)
    np.savez(tmp_path / "trap.npz", reconstruction=trapped)
    (tmp_path / "pickle.npy").write_bytes(pickle.dumps(Trap(marker)))

    np.load(tmp_path / "trap.npy", allow_pickle=True)
    assert marker.exists(), "the trap does not work, so the rest of this test proves nothing"
    marker.unlink()

    not_loaded(tmp_path / "trap.npy", "unpickled")
    not_loaded(tmp_path / "trap.npz", "unpickled", key="reconstruction")
    not_loaded(tmp_path / "pickle.npy", "neither an .npy nor an .npz")
    for file in ("trap.npy", "trap.npz", "pickle.npy"):
        for adapter, options in (
            (motionbert, {}),
            (ddhpose, {}),
            (videopose3d, {}),
            (arrays, {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}),
        ):
            with pytest.raises(InputError):
                adapter.read(tmp_path / file, **options)
    assert not marker.exists()


def npy_bytes(shape: str, data: bytes, dtype: str = "<f4") -> bytes:
    """An .npy of version 1.0 with this header, whatever the data (NEP 1)."""
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (-(10 + len(header) + 1) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


@pytest.mark.parametrize(
    "shape", ["(1000000000000, 17, 3)", "(5, 17, 3)", "(3, 17, 3)", "(-4, 17, 3)", f"({10**30}, 17, 3)"]
)
def test_lying_header(tmp_path, shape):
    lie = npy_bytes(shape, JOINTS.tobytes())
    (tmp_path / "lie.npy").write_bytes(lie)
    with zipfile.ZipFile(tmp_path / "lie.npz", "w") as archive:
        archive.writestr("reconstruction.npy", lie)
    not_loaded(tmp_path / "lie.npy", "header promises")
    not_loaded(tmp_path / "lie.npz", "header promises", key="reconstruction")


def test_changed_data_in_an_archive_are_noticed(npz, tmp_path):
    with zipfile.ZipFile(tmp_path / "stored.npz", "w") as archive:
        archive.writestr("reconstruction.npy", npy_bytes("(4, 17, 3)", bytes(4 * 17 * 3 * 4)))
    changed = bytearray((tmp_path / "stored.npz").read_bytes())
    changed[400] ^= 1
    (tmp_path / "stored.npz").write_bytes(changed)
    not_loaded(tmp_path / "stored.npz", "damaged", key="reconstruction")


MOST = 20_000_000  # bytes


@contextmanager
def refused(words: str):
    """An InputError of one line with these words, in little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=words) as caught:
            yield
        assert tracemalloc.get_traced_memory()[1] < MOST
        assert str(caught.value).isprintable()
    finally:
        tracemalloc.stop()


def test_npz_that_is_a_bomb(tmp_path):
    np.savez_compressed(tmp_path / "x.npz", reconstruction=np.zeros((200_000, 17, 3), np.float32))
    with refused("unpacks to at most 50 times"):
        load(tmp_path / "x.npz", ("frames", 17, 3), key="reconstruction")
    with refused("unpacks to at most 50 times"):
        read(tmp_path / "x.npz", "videopose3d")
    with refused("unpacks to at most 50 times"):
        load_all(tmp_path / "x.npz")


def test_arrays_of_an_archive_may_not_share_their_bytes(tmp_path):
    """Entries that all point at one array unpack to many times the file without any of them being a bomb."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        data = npy_bytes("(1000000,)", bytes(1_000_000), "|u1")
        archive.writestr("a0000.npy", data)
        directory = archive.start_dir
        archive.filelist *= 1
        for number in range(1, 100):
            other = zipfile.ZipInfo(f"a{number:04d}.npy")
            for field in ("header_offset", "CRC", "compress_size", "file_size"):
                setattr(other, field, getattr(archive.filelist[0], field))
            archive.filelist.append(other)
        assert directory
    (tmp_path / "x.npz").write_bytes(content.getvalue())
    with refused("unpacks to at most 50 times"):
        load_all(tmp_path / "x.npz")


def test_what_measurements_shrink_to_is_no_bomb(tmp_path):
    seen = np.zeros((100_000, 17, 2), np.float32)  # nobody but in one frame in twenty
    seen[::20] = np.random.default_rng(0).normal(500, 100, (5000, 17, 2))
    np.savez_compressed(tmp_path / "x.npz", seen=seen)
    np.testing.assert_array_equal(load(tmp_path / "x.npz", key="seen"), seen)
    check_size(1_000_000, 10, "small files of any kind")


@pytest.mark.parametrize("text", ["[" * 1_000_000, "[" * 1_000_000 + "]" * 1_000_000, '{"a":' * 1_000_000])
def test_json_nested_a_million_deep(tmp_path, text):
    path = tmp_path / "x.json"
    path.write_text(text)
    with refused("x.json"):
        _json.load(path, "something")
    with refused("x.json"):
        list(_json.each(path, "something"))
    assert _json.beginning(path) is None


def test_toml_nested_deep(tmp_path):
    for text in ("a = " + "[" * 100_000, "a = " + "{b=" * 10_000):
        (tmp_path / "x.toml").write_text(text)
        with refused("x.toml"):
            load_recipe(tmp_path / "x.toml")


def c3d(real: bool, points: np.ndarray, processor: int = 84) -> bytes:
    """A C3D file of points (T, M, 3) with one analog channel. processor: 84 is Intel's."""
    frames, count = points.shape[:2]

    def f4(values) -> bytes:
        return np.asarray(values, "<f4").tobytes()

    def i2(values) -> bytes:
        return np.asarray(values).astype("<i2").tobytes()

    scale = -1.0 if real else 0.5
    header = b"\x02\x50" + i2([count, 1, 1, frames, 0]) + f4([scale]) + i2([4, 1]) + f4([50.0])
    rate = b"\x04\x01RATE" + i2([2 + 2 + 4 + 1]) + b"\x04\x00" + f4([50.0]) + b"\x00"
    labels = (
        b"\x06\x01LABELS" + i2([0]) + bytes([255, 2, 2, count]) + b"".join(b"P%d" % i for i in range(count))
    )
    parameters = b"\x00\x00\x02" + bytes([processor]) + b"\x05\xffPOINT" + i2([3]) + b"\x00" + rate + labels
    rows = np.zeros((frames, count, 4), np.float32)
    rows[..., :3] = points if real else points / scale
    rows[1, 0, 3] = -1
    flat = np.concatenate([rows.reshape(frames, -1), np.ones((frames, 1))], axis=1).ravel()
    return header.ljust(512, b"\0") + parameters.ljust(1024, b"\0") + (f4(flat) if real else i2(flat))


@pytest.mark.parametrize("real", [True, False])
def test_c3d_of_reals_and_of_whole_numbers(real):
    points = np.arange(5 * 3 * 3, dtype=np.float32).reshape(5, 3, 3)
    with pytest.raises(ValueError, match="DEC or MIPS"):
        parse_c3d(c3d(real, points, processor=86))
    file = parse_c3d(c3d(real, points))
    assert file.rate_hz == 50
    assert file.parameters["POINT:LABELS"] == ["P0", "P1", "P2"]
    assert np.isnan(file.points[1, 0]).all()
    points[1, 0] = np.nan
    np.testing.assert_array_equal(file.points, points)


def test_c3d_as_ezc3d_reads_it(tmp_path):
    points = 1000 * Person().standing(40)[:, :16]
    points[7, 3] = np.nan
    path = worlds.c3d(tmp_path / "x.c3d", worlds.POSE2SIM, points)
    ezc3d = pytest.importorskip("ezc3d")
    theirs, ours = ezc3d.c3d(str(path)), parse_c3d(path.read_bytes())
    np.testing.assert_array_equal(
        ours.points, np.moveaxis(theirs["data"]["points"][:3], 0, -1).swapaxes(0, 1)
    )
    assert ours.parameters["POINT:LABELS"] == theirs["parameters"]["POINT"]["LABELS"]["value"]
    assert ours.rate_hz == theirs["parameters"]["POINT"]["RATE"]["value"][0]


def test_c3d_that_claims_more_than_it_holds(tmp_path):
    points = 1000 * Person().standing(40)[:, :16]
    path = worlds.c3d(tmp_path / "x.c3d", worlds.POSE2SIM, points)
    whole = path.read_bytes()
    for at, value in ((2, -1), (4, -1), (6, 200), (8, -1), (16, 0), (16, -1), (16, 30_000), (0, 0x50FF)):
        path.write_bytes(whole[:at] + struct.pack("<h" if value < 0x5000 else "<H", value) + whole[at + 2 :])
        with refused(r"x\.c3d"):
            read(path, "c3d")


def test_a_sentence_that_quotes_a_file_stays_one_line(tmp_path):
    people = [{"image_id": "\x1b[2J\n\r\u202e" + "x" * 100_000, "keypoints": [1, 2, 3], "idx": 0}]
    (tmp_path / "x.json").write_text(json.dumps(people))
    with refused(r"x\.json") as _:
        read(tmp_path / "x.json", "json2d", gives="keypoints")
    shown = str(InputError("bad-value", "a\n\tb \x1b[2J \u202e" + "x" * 9000 + " the end"))
    assert re.fullmatch(r"a b \\x1b\[2J \\u202ex+ \.\.\. x+ the end", shown)
    assert len(shown) <= 1000


def test_texts_of_an_archive_are_characters(tmp_path):
    names = np.full(2, 0x110000, np.uint32).view("<U2")
    np.savez(tmp_path / "x.npz", joint_names=names)
    with refused("not characters"):
        load_all(tmp_path / "x.npz")


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
FROM_BUFFER = named("numpy._core.numeric", "_frombuffer")
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
    "objects as bytes": array(b"K\x01\x85", b"O8", b"]Na")[:-1].replace(HEAD, HEAD + FROM_BUFFER + b"(")
    + DTYPE
    + b"\x8c\x02i8K\x00K\x01\x87RK\x01\x85\x8c\x01CtR"
    + STOP,
    "a value put into an array": array(b"K\x01\x85", raw=b"C\x08abcdefgh")[:-1] + b"K\x00K\x01s" + STOP,
    "an array of itself": array(b"K\x01\x85", b"O8", b"]h\x00a").replace(b")R(", b")R\x94("),
}


def twice_in_tuples(depth: int) -> bytes:
    """As `twice`, in tuples, and what is on the stack beside it is kept."""
    return b")" + b"2\x86" * depth


def filled_twice(shape: bytes, dtype: bytes, raw: bytes) -> bytes:
    """An array of four numbers that then gets another state: its numbers would be freed as if they were objects."""
    kind = DTYPE + b"\x8c" + bytes([len(dtype)]) + dtype + b"K\x00K\x01\x87R"
    return (
        array(b"K\x04\x85", raw=b"C\x20" + b"A" * 32)[:-1] + b"(K\x01" + shape + kind + b"\x89" + raw + b"tb."
    )


def again(each: bytes, count: int = 20_000) -> bytes:
    return HEAD + b"X" + struct.pack("<I", 100_000) + b"x" * 100_000 + b"\x940(" + each * count + b"t" + STOP


SMALL = DTYPE + b"\x8c\x02f8K\x00K\x01\x87R"
REPEATED = {  # what is short and asks for much
    "an array filled twice": filled_twice(b"G" + struct.pack(">d", 1.0) + b"\x85", b"O8", b"]Na"),
    "an array filled twice, of many axes": filled_twice(b"(" + b"K\x01" * 65 + b"t", b"O8", b"]Na"),
    "an array filled twice, with as much": filled_twice(b"K\x04\x85", b"O8", b"](NNNNe"),
    "a shape of fractions": array(b"G" + struct.pack(">d", 1.0) + b"\x85", raw=b"C\x08abcdefgh"),
    "a place in an array in itself": HEAD + ARRAY + b")R" + twice_in_tuples(40) + b"K\x01s" + STOP,
    "a value put into an array of nothing": HEAD + ARRAY + b")RK\x00K\x01s" + STOP,
    "values put into a list": HEAD + b"]Na(K\x00K\x01u" + STOP,
    "a shape in itself": array(twice_in_tuples(40), raw=b"]"),
    "a buffer's shape in itself": HEAD
    + FROM_BUFFER
    + b"(C\x08abcdefgh"
    + SMALL
    + twice_in_tuples(40)
    + b"\x8c\x01CtR.",
    "a type in itself": HEAD + DTYPE + twice_in_tuples(40) + b"\x85R" + STOP,
    "a buffer's type in itself": HEAD
    + FROM_BUFFER
    + b"(C\x01a"
    + twice_in_tuples(40)
    + b"K\x01\x85\x8c\x01CtR.",
    "a type of many parts": HEAD
    + DTYPE
    + b"X"
    + struct.pack("<I", 300_000)
    + b"f8," * 100_000
    + b"\x85R"
    + STOP,
    "a type in itself in an array": array(b"K\x01\x85", b"O8", b"]" + twice_in_tuples(40) + b"a")[:-1]
    + b"\x940"
    + DTYPE
    + b"h\x00\x85R"
    + STOP,
    "a shape of many lengths": HEAD
    + WRAPPER
    + b")\x81}(\x8c\x05shape("
    + (b"\x8a\x08" + b"\x7f" * 8) * 50_000
    + b"t\x8c\x05dtype"
    + SMALL
    + b"\x8c\x05orderNub"
    + STOP,
    "a list in itself that is changed": HEAD + twice(40) + b"}b" + STOP,
    "a key in itself": HEAD + b"}" + twice_in_tuples(40) + b"Ns" + STOP,
    "a key in itself, of a dict of old": HEAD + b"(" + twice_in_tuples(40) + b"Nd" + STOP,
    "a set of itself": b"\x80\x04\x8f(" + twice_in_tuples(40) + b"\x90" + STOP,
    "a set of itself at once": b"\x80\x04(" + twice_in_tuples(40) + b"\x91" + STOP,
    "a text as bytes again and again": again(named("_codecs", "encode") + b"h\x00\x8c\x06latin1\x86R"),
    "a text as an object again and again": again(b"(" + named("_codecs", "encode") + b"h\x00\x8c\x06latin1o"),
    "hundreds of thousands of empty dicts": HEAD + b"(" + b"}" * 500_000 + b"t" + STOP,
    "objects again and again": HEAD
    + b"]("
    + b"N" * 100_000
    + b"e\x940("
    + array(struct.pack("<cI", b"J", 100_000) + b"\x85", b"O8", b"h\x00")[2:-1] * 1000
    + b"t"
    + STOP,
}


def test_big_endian_numbers_are_refused_by_name():
    with pytest.raises(InputError, match="lowest byte") as caught:
        loads(pickle.dumps(np.zeros(3, ">f8")), "x.pkl")
    assert caught.value.code == "wrong-content"


@pytest.mark.parametrize("kind", ["datetime64[s]", "f4,f4", complex])
def test_arrays_of_no_numbers_are_not_called_damaged(kind):
    with pytest.raises(InputError, match="arrays of numbers") as caught:
        loads(pickle.dumps({"a": np.zeros(3, dtype=kind)}), "x.pkl")
    assert caught.value.code == "wrong-content"


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


@pytest.mark.parametrize(
    "content", (BROKEN | ARRAYS | REPEATED).values(), ids=(BROKEN | ARRAYS | REPEATED).keys()
)
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
        _pickles.load(tmp_path / "x.pkl")
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
