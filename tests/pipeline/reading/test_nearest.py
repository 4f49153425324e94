"""A file that no adapter recognises is answered with the nearest ones, and what it lacks to be one of theirs."""

import json

import numpy as np
import pytest

from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.find import adapters, find_adapter
from refusals import refused


def _said(path) -> str:
    with pytest.raises(InputError) as caught:
        find_adapter(path)
    assert caught.value.code == "format-unknown"
    return str(caught.value)


def test_arrays_are_compared_by_shape(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((50, 14, 3)))
    said = _said(tmp_path / "a.npy")
    assert "of 3D poses, arrays (expects (frames, 17, 3))" in said
    assert "of 2D keypoints, array2d (expects (frames, 17, 3))" in said


def test_json_and_tables_by_names(tmp_path):
    listed = [{"frame_id": 3, "instances": [{"score": 1, "points": [1, 2]}]}]
    (tmp_path / "a.json").write_text(json.dumps(listed))
    said = _said(tmp_path / "a.json")
    assert "json2d (lacks keypoints)" in said
    (tmp_path / "a.csv").write_text("frame,left_knee_x,left_knee_y,right_wrist_x,right_wrist_y\n1,2,3,4,5\n")
    assert "table2d (lacks likelihood)" in _said(tmp_path / "a.csv")


def test_what_is_like_nothing_names_none(tmp_path):
    (tmp_path / "a.bin").write_bytes(bytes(range(256)))
    assert "Nearest" not in _said(tmp_path / "a.bin")


def test_devices_and_pipes_are_no_files(tmp_path):
    import os

    os.mkfifo(tmp_path / "pipe")
    with refused("cannot-open"):
        find_adapter(tmp_path / "pipe")


def test_every_adapter_of_ours_has_marks():
    for name, adapter in adapters().items():
        hold_none = name in ("c3d", "ultralytics")  # whose files hold no names in the open
        if adapter.gives in ("poses", "keypoints") and not hold_none:
            assert adapter.marks, name
