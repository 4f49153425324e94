"""Whether two versions of pcnet3d make the same of the same files, to be shown after the code was moved about.

    python tests/bench/same_results.py make DIR        # with one version installed, then with the other
    python tests/bench/same_results.py compare DIR_A DIR_B

`make` runs demo, run, batch and compare on the walker and on real files (PCNET3D_DATA). `compare` prints every
array of poses.npz and every column of kinematics.parquet that differs and by how much, and ends with exit code 1 if any
does.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def make(folder: Path) -> None:
    """The commands' results under folder."""
    folder.mkdir(parents=True, exist_ok=True)
    data = Path(os.environ["PCNET3D_DATA"])
    native = data / "native"
    boxer = ["--keypoints", native / "motionbert/boxing_alphapose-results.json"]
    commands = {
        "demo": ["demo"],
        "boxing": ["run", "--poses", native / "motionbert/boxing_X3D.npy", *boxer, "--fps", "30"],
        "cycling": ["run", "--poses", native / "motionbert/cycling_X3D.npy", "--fps", "24"],
        "skating": [
            "run", "--poses", native / "mhformer/skating/output_3D/output_keypoints_3d.npz", "--fps", "25",
        ],
        "batch": ["batch", native / "motionbert", "--set", "fps=24"],
        "compared": ["compare", folder / "boxing", folder / "boxing"],
    }  # fmt: skip
    for name, arguments in commands.items():
        ended = subprocess.run(
            ["pcnet3d", *map(str, arguments), "-o", folder / name], capture_output=True, text=True
        )
        print(f"{name}: exit code {ended.returncode}")


def differences(one: Path, other: Path) -> list[str]:
    """What differs between two folders of `make`, in words."""
    found = []
    for path in sorted({p.relative_to(f) for f in (one, other) for p in f.rglob("*")}):
        a, b = one / path, other / path
        if path.name not in ("poses.npz", "kinematics.parquet"):
            continue
        if not (a.exists() and b.exists()):
            found.append(f"{path} is in one of them only")
            continue
        left, right = ({"poses.npz": arrays, "kinematics.parquet": columns}[path.name](p) for p in (a, b))
        for name in sorted(left.keys() | right.keys()):
            if name not in left or name not in right:
                found.append(f"{path}: {name} is in one of them only")
            elif left[name].shape != right[name].shape or not _equal(left[name], right[name]):
                found.append(f"{path}: {name} differs{_by(left[name], right[name])}")
    return found


def arrays(path: Path) -> dict[str, np.ndarray]:
    """Of an .npz file."""
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def columns(path: Path) -> dict[str, np.ndarray]:
    """Of a .parquet file."""
    table = parquet.read_table(path)
    return {name: table[name].to_numpy() for name in table.column_names}


def _by(a: np.ndarray, b: np.ndarray) -> str:
    """How far at most, where both have values, if only values differ."""
    if a.shape != b.shape or a.dtype.kind not in "fi" or not np.array_equal(np.isnan(a), np.isnan(b)):
        return " in what it holds"
    return f" by at most {np.nanmax(np.abs(a - b)):.1g}, and is at most {np.nanmax(np.abs(a)):.3g}"


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")


if __name__ == "__main__":
    if sys.argv[1:2] == ["make"] and len(sys.argv) == 3:
        make(Path(sys.argv[2]))
    elif sys.argv[1:2] == ["compare"] and len(sys.argv) == 4:
        told = differences(Path(sys.argv[2]), Path(sys.argv[3]))
        print("\n".join(told) or "the same")
        sys.exit(1 if told else 0)
    else:
        sys.exit(__doc__)
