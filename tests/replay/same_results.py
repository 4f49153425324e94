"""Whether two versions of pcnet3d make the same of the same files, to be shown before and after code is moved about.

    PCNET3D_DATA=... python tests/replay/same_results.py make DIR     # with one version installed, then with the other
    python tests/replay/same_results.py compare DIR_A DIR_B

`make` runs the commands on real files and on motion capture as a simulated camera and detector see it, and keeps the
files of numbers. `compare` names every number that differs by more than 1e-6, relative or absolute (NaN equals NaN),
and apart from them keys that moved and text that changed; its exit code is 1 if a number differs or is missing. Only
the command line is used, so that the same script runs with both versions.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
from scipy.spatial.transform import Rotation

KEPT = {
    "poses.npz", "keypoints.npz", "testbed.npz", "kinematics.parquet", "study.parquet", "summary.json", "compare.json",
    "batch.json", "said.json", "measures.csv", "strides.csv", "changes.csv",
}  # fmt: skip
# Last words of keys that differ from one time to the next with the same version, and why.
NOT_COMPARED = {"seconds": "how long a take of a batch took", "stamp": "made of an input file's own time too"}
_TOLERANCE = 1e-6
_NOTHING = np.zeros(0)  # the values of a key that is not there

# Folder of the results: words after `pcnet3d`; those in capitals stand for others in _WORDS.
_COMMANDS = """
demo: demo
testbed/testbed.npz: testbed val
walk/poses: run DATA/video/walk_crop.mp4 --poses inputs/walk_crop.npy BLAZEPOSE --keypoints inputs/walk_crop.json
walk/video: run DATA/video/walk_crop.mp4 MOVENET
walk/keypoints: run --keypoints inputs/walk_crop.json --set read.image_size=884x300 --fps 30
native/boxing: run --poses MOTIONBERT/boxing_X3D.npy ALPHAPOSE
native/boxing_lifted: run ALPHAPOSE --set read.image_size=854x480 --stature 1.8
native/boxing_blazepose: run --poses inputs/boxing.npy BLAZEPOSE --keypoints inputs/boxing.json --fps 30
native/boxing_movenet: run --keypoints inputs/boxing.json --set read.image_size=854x480 --fps 30 --set read.swaps=mask
native/cycling: run --poses MOTIONBERT/cycling_X3D.npy --fps 24
native/broken: run --poses MOTIONBERT/broken_X3D.npy --fps 25
native/skating: run --poses MHFORMER/output_3D/output_keypoints_3d.npz SKATER
native/skating_lifted: run SKATER --set read.image_size=1280x720
native/demo_man: run --poses inputs/demo_man.npy BLAZEPOSE --keypoints inputs/demo_man.json --fps 30
native/demo_man_movenet: run --keypoints inputs/demo_man.json --set read.image_size=1768x994 --fps 30
native/sam3dbody: run --poses DATA/native/sam3dbody --fps 30
native/kimodo: run --poses DATA/native/kimodo/soma30_motion.npz --fps 30
batch: batch manifest.csv --workers 1
compare: compare walk/poses walk/keypoints
compare_cameras: compare real/cam01 real/cam02 real/cam03 real/cam04 --align stamps
"""
_REAL = {  # the same, of each camera of the real take
    "real/cam{0:02}": "run --keypoints inputs/cam{0:02}.json --set read.image_size={1}x1920 --fps 60 --focal {2}",
    "real/cam{0:02}_video": "run DATA/real/pose2sim/cam{0:02}.mp4 MOVENET",
}
_CAMERAS = ((1, 1080, 1681), (2, 1080, 1674), (3, 1088, 1681), (4, 1088, 1676))  # number, width, focal length
_WORDS = {
    "BLAZEPOSE": "--adapter arrays -O layout=BLAZEPOSE33 -O frame=CAMERA -O unit=m",
    "MOVENET": "--detector DATA/models/movenet_lightning_int8.onnx",
    "ALPHAPOSE": "--keypoints MOTIONBERT/boxing_alphapose-results.json --fps 30",
    "SKATER": "--keypoints MHFORMER/input_2D/keypoints.npz --fps 25",
    "MOTIONBERT": "DATA/native/motionbert",
    "MHFORMER": "DATA/native/mhformer/skating",
}  # DATA comes last, as a path may have spaces
_SEEN = "run --keypoints inputs/take{0:02}.json --set read.image_size=1280x720 --fps 30 "
_OPTIONS = (
    "", "--stature 1.75", "--focal {1}", "--stature 1.75 --set read.swaps=mask",
    "--set trajectories.smoother=butterworth --set angles.smoother=butterworth", "--camera moving",
    "--focal {1} --set read.pitch={2} --set read.roll={3}", "--set rectify.rectifier=geometric",
)  # fmt: skip
_CAPTURED = (
    "run --poses inputs/take{0:02}.npy --adapter arrays -O layout=H36M17 -O frame=Z_UP -O unit=m --fps 30"
)

_TAKES, _FEWEST, _MOST = 40, 60, 300  # simulated takes, and their frames
_SIZE = np.array([1280, 720])
# Rows of H36M17 (the data's README) in COCO's order, with the nose for eyes and ears.
_AS_COCO = [9, 9, 9, 9, 9, 11, 14, 12, 15, 13, 16, 4, 1, 5, 2, 6, 3]
_LEFT_LEG, _RIGHT_LEG = [11, 13, 15], [12, 14, 16]


def make(folder: Path) -> None:
    """Runs all commands and leaves the files of KEPT in folder/NAME, what was written to be read in folder/inputs."""
    data = Path(os.environ["PCNET3D_DATA"]).resolve()
    (folder / "inputs").mkdir(parents=True)
    _write_real(data, folder / "inputs")
    commands = _write_simulated(data, folder / "inputs")  # first, as the batch needs their keypoints
    commands |= {name.format(*c): line.format(*c) for c in _CAMERAS for name, line in _REAL.items()}
    for line in _COMMANDS.strip().splitlines():
        name, _, commands[name] = line.partition(": ")
    rows = [f"take{n},{n},inputs/take{n:02}.json,1280x720,30" for n in range(3)]
    (folder / "manifest.csv").write_text("\n".join(["name,subject,keypoints,image-size,fps", *rows]))
    for name, line in commands.items():
        started = time.monotonic()
        code = _run(folder, name, line, data)
        print(f"{name}: exit code {code}, {time.monotonic() - started:.1f} s", flush=True)
    for path in folder.rglob("*"):
        if path.is_file() and path.name not in KEPT and path.parent != folder / "inputs":
            path.unlink()
    shutil.rmtree(folder / "demo-input", ignore_errors=True)


def _run(folder: Path, name: str, line: str, data: Path) -> int:
    """The exit code of a command; that and what it said are left in said.json."""
    for short, words in _WORDS.items():
        line = line.replace(short, words)
    if line.startswith(("run", "batch")):
        line += " --set record=off --set report=off"
    words = [word.replace("DATA", str(data)) for word in line.split()]
    (folder / name).parent.mkdir(exist_ok=True)
    # 8-bit networks round otherwise with another number of threads; tables are as wide as the console.
    environment = os.environ | {"OMP_NUM_THREADS": "1", "COLUMNS": "200"}
    command = [Path(sys.executable).with_name("pcnet3d"), *words, "-o", name]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment, check=False)
    said = ended.stderr if ended.returncode else ended.stdout  # stderr has times of stages otherwise
    said = said.replace(str(data), "DATA").replace(str(folder.resolve()), "DIR")
    place = folder / name if (folder / name).is_dir() else folder / f"{name}_said"
    place.mkdir(exist_ok=True)
    (place / "said.json").write_text(json.dumps({"exit_code": ended.returncode, "said": said.splitlines()}))
    return ended.returncode


def _write_real(data: Path, inputs: Path) -> None:
    for name in ("walk_crop", "boxing", "demo_man"):
        with np.load(data / f"lifter/{name}.npz") as file:
            np.save(inputs / f"{name}.npy", file["blazepose_world"])
            _write_coco(inputs / f"{name}.json", file["movenet_kp2d"])
    with np.load(data / "real/pose2sim/truth.npz") as file:
        for camera in ("cam01", "cam02", "cam03", "cam04"):
            _write_coco(inputs / f"{camera}.json", file[f"openpose_body25b_{camera}"][:, :17])


def _write_coco(path: Path, points: np.ndarray) -> None:
    """points: (T, 17, 3) pixels and score."""
    rows = (points.reshape(len(points), -1).astype(float).round(3)).tolist()
    listed = [{"image_id": n, "category_id": 1, "keypoints": row, "score": 1.0} for n, row in enumerate(rows)]
    path.write_text(json.dumps(listed), encoding="utf-8")


def _write_simulated(data: Path, inputs: Path) -> dict[str, str]:
    """Clips of validation subjects, as seen; the commands for them, with one option or another."""
    clips, commands = list(_clips(data)), {}
    for n, index in enumerate(np.linspace(0, len(clips) - 1, _TAKES).round().astype(int)):
        points, *camera = _seen(clips[index], np.random.default_rng(n))
        _write_coco(inputs / f"take{n:02}.json", points)
        commands[f"simulated/take{n:02}"] = (_SEEN + _OPTIONS[n % len(_OPTIONS)]).format(n, *camera)
        if n % 10 == 0:  # the motion capture itself too
            np.save(inputs / f"take{n:02}.npy", clips[index])
            commands[f"captured/take{n:02}"] = _CAPTURED.format(n)
    return commands


def _clips(data: Path) -> Iterator[np.ndarray]:
    """(T, 17, 3) metres, world, z up, of each clip that is long enough."""
    splits = json.loads((data / "splits.json").read_text())
    for name in ("cmu_mocap", "accad_mocap", "tennis_mocap"):
        with np.load(data / f"{name}.npz") as file:
            world, starts = file["joints"] + file["root"][:, None], file["clip_start"]
            for clip, start, stop in zip(file["clip_name"], starts, starts[1:], strict=False):
                if clip.partition("_")[0] in splits[name]["val"] and stop - start >= _FEWEST:
                    yield world[start : min(stop, start + _MOST)].astype(float)


def _seen(world: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, float, float, float]:
    """(T, 17, 3) pixels and scores in COCO's order, as a tilted camera and a faulty detector see them; the camera's
    focal length in pixels, pitch and roll in degrees. world: (T, 17, 3) metres, z up."""
    focal_px, pitch, roll = (round(rng.uniform(*ends), 1) for ends in ((1000, 2000), (-5, 25), (-8, 8)))
    R_level_from_world = [[1, 0, 0], [0, 0, -1], [0, 1, 0]] @ _turn("z", rng.uniform(0, 360))
    R_camera_from_world = _turn("z", -roll) @ _turn("x", pitch) @ R_level_from_world
    joints = (world - world.mean(axis=(0, 1))) @ R_camera_from_world.T
    nearest = (np.abs(joints[..., :2]) * focal_px / (_SIZE / 2) - joints[..., 2:]).max()
    joints[..., 2] += nearest * rng.uniform(1.05, 1.5)
    pixels = (focal_px * joints[..., :2] / joints[..., 2:] + _SIZE / 2)[:, _AS_COCO]
    score = rng.uniform(0.2, 1.0, (*pixels.shape[:2], 1))
    noise_px = np.where(score < 0.25, 0.08, 0.01) * np.median(np.ptp(pixels[..., 1], axis=1))
    points = np.concatenate([pixels + noise_px * rng.standard_normal(pixels.shape), score], axis=-1)
    exchanged, hidden = rng.integers(0, len(world) - 15, 2)
    legs = points[exchanged : exchanged + 4]
    legs[:, _LEFT_LEG + _RIGHT_LEG] = legs[:, _RIGHT_LEG + _LEFT_LEG]
    points[hidden : hidden + 15, rng.choice(17, 2, replace=False)] = 0
    return points, focal_px, pitch, roll


def _turn(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


Leaves = dict[str, np.ndarray]  # by key: numbers as float64, or text


def _leaves(path: Path) -> Leaves:
    """All that a file holds, by array, column or dotted key."""
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as file:
            return {
                key: np.atleast_1d(file[key].astype(str if file[key].dtype.kind == "U" else float))
                for key in file.files
            }
    if path.suffix == ".csv":
        header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        return dict(_within({name: [_cell(row[n]) for row in rows] for n, name in enumerate(header)}))
    if path.suffix == ".parquet":
        table = parquet.read_table(path)
        held: dict[str, Any] = {name: table[name].to_pylist() for name in table.column_names}
        for name, said in (("file", table.schema.metadata), *((f.name, f.metadata) for f in table.schema)):
            held |= {
                f"metadata of {name}, {k.decode()}": _parsed(v.decode()) for k, v in (said or {}).items()
            }
        return dict(_within(held))
    return dict(_within(json.loads(path.read_text(encoding="utf-8"))))


def _cell(text: str) -> float | str | None:
    try:
        return float(text)
    except ValueError:
        return text or None


def _parsed(text: str) -> Any:
    return json.loads(text) if text.startswith(("{", "[")) else text


def _within(value: Any, key: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Leaves of what JSON can hold. None is NaN; the words of a list that has numbers too are a leaf of their own."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _within(inner, f"{key}.{name}".lstrip("."))
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for number, inner in enumerate(value):
            yield from _within(inner, f"{key}[{number}]")
    else:
        listed = value if isinstance(value, list) else [value]
        words = [inner for inner in listed if isinstance(inner, str)]
        numbers = np.array([inner if isinstance(inner, int | float) else np.nan for inner in listed], float)
        if words:
            yield key + " (words)" * bool(np.isfinite(numbers).any()), np.array(words)
        if not words or np.isfinite(numbers).any():
            yield key, numbers


def compare(one: Path, other: Path) -> bool:
    """Prints all that differs between two folders of `make`; whether every number is the same."""
    numbers: list[str] = []
    words: dict[str, list[str]] = {}  # the files, by what moved or changed in them
    names = {p.relative_to(f) for f in (one, other) for p in f.rglob("*") if p.name in KEPT}
    for name in sorted(names):
        if not ((one / name).exists() and (other / name).exists()):
            numbers.append(f"{name}: is in one folder only")
            continue
        a, b = (
            {key: v for key, v in _leaves(f / name).items() if _last(key) not in NOT_COMPARED}
            for f in (one, other)
        )
        for old, new in _moved(a, b).items():
            words.setdefault(f"{name.name}: {old} moved to {new}", []).append(str(name))
            b[old] = b.pop(new)
        for key in sorted(a.keys() | b.keys()):
            values = a.get(key, _NOTHING), b.get(key, _NOTHING)
            kinds = {_kind(held) for held in values if held is not _NOTHING}
            where, said = f"{name}: {key}", f"{name.name}: {key}"
            if "numbers" in kinds and "words" in kinds:
                numbers.append(f"{where}: numbers in one, words in the other")
            elif "numbers" in kinds and (difference := _apart(*values)):
                numbers.append(f"{where}: {difference}")
            for change in _changed(*values) if kinds != {"numbers"} else ():
                words.setdefault(f"{said}: {change}", []).append(str(name))
    for difference in numbers:
        print(difference)
    for change, files in words.items():
        print(f"{change} ({files[0]}{f' and {len(files) - 1} more' if files[1:] else ''})")
    print(
        f"{len(names)} files: {len(numbers)} differences of numbers, {len(words)} of text and names of keys"
    )
    return not numbers


def _last(key: str) -> str:
    return key.rpartition(".")[2]


def _moved(a: Leaves, b: Leaves) -> dict[str, str]:
    """{key in A only: key in B only} of those with the same values, by their own names or because no other has them."""
    found: dict[str, str] = {}
    for old in sorted(a.keys() - b.keys()):
        left = [new for new in sorted(b.keys() - a.keys()) if new not in found.values()]
        alike = [new for new in left if _kind(a[old]) == _kind(b[new]) and _same(a[old], b[new])]
        named = [new for new in alike if _last(new) == _last(old)]
        if len(named or alike) == 1:
            found[old] = (named or alike)[0]
    return found


def _kind(values: np.ndarray) -> str:
    return "words" if values.dtype.kind == "U" else "numbers" if np.isfinite(values).any() else "empty"


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return not (_changed(a, b) if a.dtype.kind == "U" else _apart(a, b))


def _changed(a: np.ndarray, b: np.ndarray) -> list[str]:
    """Each text that is in one of them only; how else they differ if they have the same."""
    left, right = (Counter(map(str, values.ravel()) if values.dtype.kind == "U" else ()) for values in (a, b))
    told = [f"- {text}" for text in (left - right).elements()]
    told += [f"+ {text}" for text in (right - left).elements()]
    if told or not (left or right):
        return told or ["holds nothing, in another shape"] * (
            a is _NOTHING or b is _NOTHING or a.shape != b.shape
        )
    return [] if np.array_equal(a, b) else ["other order"]


def _apart(a: np.ndarray, b: np.ndarray) -> str:
    """In how many values, in which rows and by how much numbers differ; empty where they do not."""
    if a is _NOTHING or b is _NOTHING:
        return f"is in {'B' if a is _NOTHING else 'A'} only"
    if a.shape != b.shape:
        return f"shape {a.shape} against {b.shape}"
    apart = ~np.isclose(a, b, _TOLERANCE, _TOLERANCE, equal_nan=True)
    if not apart.any():
        return ""
    rows = np.flatnonzero(apart.reshape(len(a), -1).any(axis=1))
    lost = int((np.isnan(a) != np.isnan(b)).sum())
    both = np.isfinite(a) & np.isfinite(b)
    largest = np.abs(a - b)[both].max(initial=0)
    said = f"{apart.sum()} of {a.size} values, in {len(rows)} rows from {rows[0]} to {rows[-1]}"
    return f"{said}, by at most {largest:.3g}" + (f"; {lost} are NaN in one only" if lost else "")


if __name__ == "__main__":
    if sys.argv[1:2] == ["make"] and len(sys.argv) == 3:
        make(Path(sys.argv[2]))
    elif sys.argv[1:2] == ["compare"] and len(sys.argv) == 4:
        sys.exit(0 if compare(Path(sys.argv[2]), Path(sys.argv[3])) else 1)
    else:
        sys.exit(__doc__)
