"""Files that claim, or unpack to, far more than they are: refused before memory is taken for it."""

import io
import json
import re
import struct
import tracemalloc
import zipfile
from contextlib import contextmanager

import numpy as np
import pytest

from golden import worlds
from golden.bodies import Person
from pcnet3d.adapters import read
from pcnet3d.adapters.kit import json as _json
from pcnet3d.pipeline import InputError, load_recipe
from pcnet3d.pipeline.files.arrays import load, load_all
from pcnet3d.pipeline.files.markers import parse_c3d
from pcnet3d.pipeline.files.opened import check_size

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


def npy(header: str, data: bytes = bytes(100)) -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data


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
        data = npy("{'descr': '|u1', 'fortran_order': False, 'shape': (1000000,), }\n", bytes(1_000_000))
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
