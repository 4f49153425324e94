"""The same file in other clothes is the same: every table and JSON of the golden files, compressed, marked, with other
line ends, with decimal commas, or with an entry a line. A reader that is listed there is tested here."""

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

from golden.bodies import Person
from golden.catalogue import CATALOGUE, Golden
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.plugins.options import call

TEXTS = {".csv": "table", ".json": "JSON"}


def _semicolons(content: bytes) -> bytes:
    return re.sub(rb"(?<=\d)\.(?=\d)", b",", content.replace(b",", b";"))


def _loaded(content: bytes):
    try:
        return json.loads(content)
    except json.JSONDecodeError:
        pytest.skip("JSON Lines already")


def _lines(content: bytes) -> bytes:
    listed = _loaded(content)
    if not isinstance(listed, list) or not all(isinstance(entry, dict) for entry in listed):
        pytest.skip("no list of objects")
    return "\n".join(map(json.dumps, listed)).encode()


CLOTHES = {
    "gzip": (".csv.json", lambda content: gzip.compress(content)),
    "byte order mark": (".csv.json", lambda content: b"\xef\xbb\xbf" + content),
    "CRLF": (".csv.json", lambda content: content.replace(b"\n", b"\r\n")),
    "decimal commas": (".csv", _semicolons),
    "tabs": (".csv", lambda content: content.replace(b",", b"\t")),
    "JSON Lines": (".json", _lines),
    "indented": (".json", lambda content: json.dumps(_loaded(content), indent=2).encode()),
}


@pytest.fixture(scope="module")
def goldens(tmp_path_factory):
    """The golden tables and JSON files: (golden, path, what is read from it)."""
    found = []
    for i, golden in enumerate(CATALOGUE):
        path = golden.write(Person(), tmp_path_factory.mktemp(f"golden{i}"))
        if path.is_file() and path.suffix in TEXTS:
            found.append((golden, path, _read(golden, path)))
    return found


def _read(golden: Golden, path: Path):
    adapter = registry.load("adapters", golden.adapter)
    assert adapter.sniff(path), f"{golden.adapter}: {golden.form}"
    return call(adapter.read, path, what=golden.adapter, options=golden.options)


def _same(one, other) -> None:
    assert [type(each) for each in one] == [type(each) for each in other]
    for a, b in zip(one, other, strict=True):
        if not hasattr(a, "joints"):
            np.testing.assert_allclose(a.time_s, b.time_s)
            continue
        np.testing.assert_allclose(a.joints, b.joints, atol=1e-5)
        np.testing.assert_array_equal(a.frame_index, b.frame_index)
        assert (a.person, a.frames_known, a.layout, a.frame) == (b.person, b.frames_known, b.layout, b.frame)
        assert (a.time_s is None) == (b.time_s is None)
        assert [each.code for each in a.notices] == [each.code for each in b.notices]


@pytest.mark.parametrize("clothes", CLOTHES)
def test_other_clothes(goldens, tmp_path, clothes):
    suffixes, change = CLOTHES[clothes]
    tried = 0
    for golden, path, plain in goldens:
        if path.suffix not in suffixes:
            continue
        try:
            content = change(path.read_bytes())
        except pytest.skip.Exception:
            continue
        other = tmp_path / f"{tried}{path.suffix}"
        other.write_bytes(content)
        _same(plain, _read(golden, other))
        tried += 1
    assert tried > 3


def test_gzip_that_is_cut_short_or_a_bomb_is_refused(goldens, tmp_path):
    golden, path, _ = next(each for each in goldens if each[1].suffix == ".csv")
    adapter = registry.load("adapters", golden.adapter)
    packed = gzip.compress(path.read_bytes())
    bomb = gzip.compress(path.read_bytes() + b"\n" * 50_000_000)
    for content, code in ((packed[:-20], "file-damaged"), (bomb, "unsafe")):
        other = tmp_path / "walk.csv.gz"
        other.write_bytes(content)
        with pytest.raises(registry.InputError) as caught:
            adapter.read(other)
        assert caught.value.code == code
