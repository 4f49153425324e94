"""The hash of a folder."""

import hashlib
import os
import sys

import pytest

from pcnet3d.pipeline.files.digest import sha256


def test_a_folders_hash_is_of_names_with_slashes_in_their_order(tmp_path):
    """As on every system: Windows has other slashes, and paths are sorted by folders first and without case there."""
    for name in ("b/x", "b.txt", "C"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    empty = hashlib.sha256().hexdigest()
    listed = "".join(f"{name}\0{empty}\n" for name in ("C", "b.txt", "b/x"))
    assert sha256(tmp_path) == hashlib.sha256(listed.encode()).hexdigest()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
def test_a_folder_with_a_name_that_is_no_text_has_a_hash(tmp_path):
    (tmp_path / os.fsdecode(b"\xff.jpg")).write_bytes(b"")
    assert len(sha256(tmp_path)) == 64
