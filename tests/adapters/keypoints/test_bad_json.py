"""JSON that cannot be read: one sentence that names the file, whatever is wrong with it."""

import json

import numpy as np
import pytest

from golden.catalogue import recognised
from golden.detections import between_shoulders
from pcnet3d.adapters import json2d
from pcnet3d.adapters.kit.json import beginning
from pcnet3d.pipeline import InputError

FORMS = (
    "alphapose", "alphapose_open", "coco_results", "coco_annotations", "mmpose_inferencer", "mmpose_demo"
)  # fmt: skip
BAD = {
    "empty": (b"", "empty"),
    "blank": (b" \n ", "empty"),
    "not UTF-8": (b'[{"image_id": "\xff.jpg"}]', "UTF-8"),
    "UTF-16": ("[]".encode("utf-16"), "expected"),
    "text": (b"hello", "line 1, column 1"),
    "deeply nested": (b"[" * 50_000 + b"]" * 50_000, "no detector writes"),
    "long integer": (b"[" + b"9" * 9000 + b"]", "no detector writes"),
    "number": (b"3", "expected a list"),
    "text value": (b'"a"', "expected a list"),
    "list of numbers": (b"[1, 2]", "entry 0: expected an object with"),
    "list of nothing": (b"[null]", "entry 0: expected an object with"),
    "empty object": (b"{}", "expected"),
    "other object": (b'{"images": 3, "instance_info": 3, "1.jpg": {"people": 3}}', "expected"),
    "deep with commas": (b"[1," * 30_000, "results"),
    "other objects": (b'[{"image_id": 3}, {"frame_id": 1, "instances": {"a": 1}}]', "expected"),
    "instances of another kind": (b'[{"frame_id": 1, "instances": [[1, 2]]}]', "expected"),
    "3D instances": (b'[{"frame_id": 1, "instances": [{"keypoints": [[1, 2, 3], [4, 5, 6]]}]}]', "expected"),
    "no objects": (b'{"images": [1], "annotations": [2], "instance_info": [3]}', "expected"),
}


def test_noise_is_nobodys(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for noise, _ in BAD.values():
        for path in (tmp_path / "noise.json", folder / "walk_000000000000_keypoints.json"):
            path.write_bytes(noise)
        for place in (tmp_path / "noise.json", folder):
            assert recognised(place) == []


def test_refused(tmp_path):
    for content, message in BAD.values():
        path = tmp_path / "results.json"
        path.write_bytes(content)
        with pytest.raises(InputError, match=message) as caught:
            json2d.read(path)
        assert str(path) in str(caught.value)
        assert len(str(caught.value)) < 400 + len(str(path))


@pytest.mark.parametrize("form", FORMS)
def test_truncated_file_is_recognised_and_refused(write, moving, form):
    person = between_shoulders(moving(18)) if form == "alphapose_open" else moving(17)
    path = write(form, {"0": person})
    whole = path.read_bytes()
    for share in (0.7, 0.9):  # the demos' metadata, which tell nothing, take half of so short a file
        path.write_bytes(whole[: int(share * len(whole))])
        assert json2d.sniff(path)
        with pytest.raises(InputError, match="is incomplete or damaged at line 1"):
            json2d.read(path)
    path.write_bytes(whole[:-1])
    with pytest.raises(InputError, match="is incomplete"):
        json2d.read(path)


def test_any_beginning_of_json_is_read(tmp_path):
    """Wherever a file is cut, what is kept is JSON, and agrees with the whole as far as it goes."""
    whole = {
        "a": 'b, [c "d" {\\',
        "e": [{"f": [1, 2.5, [3, {"g": None}]], "h": "i"}, {"f": [4, -5e3]}],
        "j": True,
    }
    for text in (json.dumps(whole), json.dumps(whole, indent="\t")):
        for length in range(text.index(",") + 20, len(text) + 1):
            (tmp_path / "cut.json").write_text(text[:length])
            kept = beginning(tmp_path / "cut.json")
            assert kept["a"] == whole["a"]
            assert list(kept) == list(whole)[: len(kept)]
            values = [entry.get("f", [])[:2] for entry in kept.get("e", [])]
            for value, entry in zip(values, whole["e"], strict=False):
                assert value == entry["f"][: len(value)]
        assert kept == whole


@pytest.mark.parametrize("name", ["\U0001f600", "C:\\data\\a", '"\\"'])
def test_images_of_any_name_are_recognised(tmp_path, name):
    path = tmp_path / "results.json"
    path.write_text(json.dumps([{"image_id": name, "keypoints": [1.0]}] * 3000))
    assert len(beginning(path)) > 100


def test_only_the_beginning_is_read(tmp_path):
    path = tmp_path / "large.json"
    path.write_text("[" + json.dumps({"image_id": 1, "keypoints": [0.5] * 51}) + (", " + "7" * 50) * 20_000)
    assert path.stat().st_size > 1_000_000
    content = beginning(path)
    assert content[0]["image_id"] == 1
    assert len(json.dumps(content)) <= 1 << 16
    assert np.unique(content[1:]).tolist() == [int("7" * 50)]
