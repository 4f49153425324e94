"""VideoPose3D's own 2D files: Python objects in .npz, read without unpickling."""

import pickle
from io import BytesIO
from typing import ClassVar
from zipfile import ZipFile

import numpy as np
import pytest

from golden.pickles import Trap
from pcnet3d.adapters import detectron, read, read_all
from pcnet3d.pipeline import InputError
from refusals import refused

SYMMETRY = [[1, 3, 5, 7, 9, 11, 13, 15], [2, 4, 6, 8, 10, 12, 14, 16]]


@pytest.fixture
def save(tmp_path, moving):
    """save(positions, layout): prepare_data_2d_custom.py; of None the videos "a" and "b"."""

    def write(positions=None, layout="coco"):
        if positions is None:
            positions = {
                name: {"custom": [moving(17, number=number)[1][..., :2].astype("float32")]}
                for number, name in enumerate("ab")
            }
        metadata = {
            "layout_name": layout, "num_joints": 17, "keypoints_symmetry": SYMMETRY,
            "video_metadata": {name: {"w": 1920, "h": 1080} for name in positions},
        }  # fmt: skip
        path = tmp_path / "data_2d_custom_mine.npz"
        np.savez_compressed(path, positions_2d=positions, metadata=metadata)
        return path

    return write


def test_several_videos_have_to_be_named(save):
    for options, words in (({}, "holds the videos a, b"), ({"video": "c"}, "no video 'c'; it holds a, b")):
        with pytest.raises(InputError, match=words):
            read(save(), **options)
    with pytest.raises(InputError, match="layout 'coco', got 'h36m'"):
        read(save(layout="h36m"), video="a")


def test_a_file_that_would_run_something_is_refused(save, write, moving, tmp_path):
    mark = tmp_path / "was here"
    two = save({"a": {"custom": [Trap(mark)]}})
    detections = write("detectron", {"0": moving(17)})
    held = dict(np.load(detections, allow_pickle=True))
    held["keypoints"][5, 1] = Trap(mark)
    np.savez_compressed(detections, **held)
    mark.unlink(missing_ok=True)
    for path in (two, detections):
        with pytest.raises(InputError, match="refused"):
            read_all(path, gives="keypoints")
    assert not mark.exists()


class _Python2(pickle._Pickler):
    """Protocol 2 with text and bytes alike as Python 2's str."""

    dispatch: ClassVar = dict(pickle._Pickler.dispatch)

    def save_str(self, text):
        raw = text if isinstance(text, bytes) else text.encode("latin1")
        self.write(pickle.BINSTRING + len(raw).to_bytes(4, "little") + raw)

    dispatch[str] = dispatch[bytes] = save_str


def test_detections_of_python_2(write, moving):
    """Detectron 1's files, which VideoPose3D reads with encoding="latin1"."""
    _, points = moving(17)
    path = write("detectron", {"0": (range(12), points)})
    held = dict(np.load(path, allow_pickle=True))
    with ZipFile(path, "w") as archive:
        for name, array in held.items():
            stream = BytesIO()
            header = {"descr": "|O", "fortran_order": False, "shape": array.shape}
            np.lib.format.write_array_header_1_0(stream, header)
            content = BytesIO()
            _Python2(content, protocol=2).dump(array)
            stream.write(content.getvalue().replace(b"cnumpy._core.", b"cnumpy.core."))
            archive.writestr(f"{name}.npy", stream.getvalue())
    np.load(path, allow_pickle=True, encoding="latin1")["keypoints"]  # what it is meant to be
    np.testing.assert_allclose(read(path).joints, points[..., :2], atol=1e-4)


def test_plain_arrays_are_not_its_own(tmp_path):
    np.savez(tmp_path / "a.npz", boxes=np.zeros(3), keypoints=np.zeros(3), metadata=np.zeros(3))
    assert not detectron.sniff(tmp_path / "a.npz")
    with refused("wrong-content"):
        detectron.read(tmp_path / "a.npz")
