"""Numpy files from strangers: damaged, lying or dangerous ones end in an InputError, never in anything else."""

import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from golden.pickles import Trap
from pcnet3d.adapters import arrays, ddhpose, motionbert, videopose3d
from pcnet3d.adapters.kit.numpy import peek
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.arrays import keys, load

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


def refused(path: Path, *said: str, key: str | None = None) -> None:
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
    refused(npz, "'joints'", "reconstruction, other", key="joints")
    refused(npz, "single array (.npy)", "reconstruction, other")
    refused(npz, "(frames, 17, 3)", "(4, 5, 3)", key="other")


def test_key_for_a_nameless_array(npy):
    with pytest.raises(InputError, match="one without a name"):
        load(npy, key="joints")


@pytest.mark.parametrize("content", [b"x", b"{}", b"frame,x,y\n0,1,2\n", b"\x00" * 400])
def test_not_a_numpy_file(tmp_path, content):
    (tmp_path / "text.npy").write_bytes(content)
    refused(tmp_path / "text.npy", "neither an .npy nor an .npz")


def test_other_zip_archive(tmp_path):
    with zipfile.ZipFile(tmp_path / "weights.pt", "w") as archive:
        archive.writestr("archive/data.pkl", b"")
    refused(tmp_path / "weights.pt", "no numpy arrays", key="reconstruction")


@pytest.mark.parametrize(
    ("frames", "kind", "words"),
    [(0, "f8", "holds none"), *((4, kind, "array of numbers") for kind in ("U1", "?", "c8", "f4,f4"))],
)
def test_no_frames_or_no_numbers(tmp_path, frames, kind, words):
    np.save(tmp_path / "a.npy", np.zeros((frames, 17, 3), dtype=kind))
    refused(tmp_path / "a.npy", words)


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

    refused(tmp_path / "trap.npy", "unpickled")
    refused(tmp_path / "trap.npz", "unpickled", key="reconstruction")
    refused(tmp_path / "pickle.npy", "neither an .npy nor an .npz")
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
    refused(tmp_path / "lie.npy", "header promises")
    refused(tmp_path / "lie.npz", "header promises", key="reconstruction")


def test_changed_data_in_an_archive_are_noticed(npz, tmp_path):
    with zipfile.ZipFile(tmp_path / "stored.npz", "w") as archive:
        archive.writestr("reconstruction.npy", npy_bytes("(4, 17, 3)", bytes(4 * 17 * 3 * 4)))
    changed = bytearray((tmp_path / "stored.npz").read_bytes())
    changed[400] ^= 1
    (tmp_path / "stored.npz").write_bytes(changed)
    refused(tmp_path / "stored.npz", "damaged", key="reconstruction")
