"""Whether two versions of pcnet3d make the same of the same files, to be shown before and after code is changed.

    export PCNET3D_DATA=...
    python tests/replay/same_results.py make DIR_A --inputs INPUTS         # with one version installed,
    python tests/replay/same_results.py make DIR_B --inputs INPUTS         # then with the other
    python tests/replay/same_results.py compare DIR_A DIR_B --expected FILE

`make` runs the commands of the table below and keeps their files of numbers. The commands read files of the data
folder, and those of INPUTS, which the first `make` writes: files of every format that is read, motion capture as a
simulated camera and detector see it, films. Later ones, of any version, read the same bytes. Only the command line is
used: --program is the pcnet3d to run, by default the one beside this Python. --jobs N runs N commands at once, and
--only GLOB those alone whose name fits.

`compare` names all that differs: numbers that do so by more than 1e-6, relative or absolute (NaN equals NaN), and
apart from them text that changed. Of a command that only one version carries out it says that and
no more. Its exit code is 1 if a number differs or is missing. What is expected to differ stands in a TOML file, where
an asterisk stands for any characters, and is counted instead of printed:

    "*/summary.json:measures.punches.*" = "punches are no longer counted"
    "read/display_*:exit code" = "the adapter went"
"""

from __future__ import annotations

import argparse
import csv
import fnmatch
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet as parquet

KEPT = {
    "poses.npz", "keypoints.npz", "testbed.npz", "kinematics.parquet", "study.parquet", "summary.json", "compare.json",
    "imu.json", "batch.json", "measures.csv", "strides.csv", "changes.csv", "repeatability.csv",
    "kinematics.csv", "markers.trc", "angles.mot", "skeleton.bvh", "markers.c3d", "skeleton.glb",
    "poses.nc",
}  # fmt: skip
# Last words of keys that differ from one time to the next with the same version, and why.
NOT_COMPARED = {
    "seconds": "how long a take of a batch took",
    "stamp": "made of an input file's own time too",
    "captured_s": "when live was given an image",
    "latency_ms": "how long live took for an image",
    "latency_p50_ms": "the same",
    "latency_p95_ms": "the same",
}
_TOLERANCE = 1e-6
_CARRIED_OUT = (0, 3, 4)  # exit codes; 3 and 4 are inspect's verdicts
_EXIT_CODE = "exit code"
_SAID = "said"  # the folder with a file for each command: its exit code and what it printed
# What names an object in a list.
_ITEM_NAMES = ("code", "name", "role", "measure", "figure", "joint", "file")

# Name of the command, which is the folder of its results: words after `pcnet3d`. Those in capitals stand for others in
# _WORDS.
_COMMANDS = """
demo: demo
testbed/testbed.npz: lab testbed val

video/walk: run DATA/video/walk_crop.mp4 MOVENET
video/walk_poses: run DATA/video/walk_crop.mp4 --poses INPUTS/walk_crop.npy BLAZEPOSE --keypoints INPUTS/walk_crop.json
video/roof: run DATA/video/sports2d_demo.mp4 MOVENET --time-range :4
video/followed: run INPUTS/followed.mp4 MOVENET
video/followed_said: run INPUTS/followed.mp4 MOVENET --camera moving
video/two_people: run INPUTS/two_people.mp4 --keypoints INPUTS/two_people.json EVERYONE
video/lens: run DATA/real/pose2sim/cam01.mp4 MOVENET --set calibrate.camera_file=INPUTS/cam01_lens.json
video/photographed: run DATA/real/pose2sim_static/cam01.mp4 MOVENET --set read.pitch=18 --set read.roll=13

keypoints/walk: run --keypoints INPUTS/walk_crop.json --set read.image_size=884x300 --fps 30
keypoints/boxing: run ALPHAPOSE --set read.image_size=854x480 --stature 1.8
keypoints/skating: run SKATER --set read.image_size=1280x720
keypoints/roof: run --keypoints INPUTS/demo_man.json --set read.image_size=1768x994 --fps 30

poses/boxing: run --poses MOTIONBERT/boxing_X3D.npy ALPHAPOSE
poses/boxing_blazepose: run --poses INPUTS/boxing.npy BLAZEPOSE --keypoints INPUTS/boxing.json --fps 30
poses/boxing_part: run --poses MOTIONBERT/boxing_X3D.npy --fps 30 --time-range 2:7 --stature 1.8
poses/cycling: run --poses MOTIONBERT/cycling_X3D.npy --fps 24
poses/broken: run --poses MOTIONBERT/broken_X3D.npy --fps 25
poses/skating: run --poses MHFORMER/output_3D/output_keypoints_3d.npz SKATER
poses/roof: run --poses INPUTS/demo_man.npy BLAZEPOSE --keypoints INPUTS/demo_man.json --fps 30
poses/sam3dbody: run --poses DATA/native/sam3dbody --fps 30 --person 1
poses/kimodo: run --poses DATA/native/kimodo/soma30_motion.npz --fps 30
captured/truth: run --poses INPUTS/take30.bvh -O made_by=measured
poses/geometric: run --poses MOTIONBERT/boxing_X3D.npy --fps 30 --set rectify.rectifier=geometric
poses/written: run --poses DATA/native/kimodo/soma30_motion.npz --fps 30 ALSO

live: live DATA/video/walk_crop.mp4 MOVENET --json
batch: batch INPUTS/study/manifest.csv --workers 1
batch_folder: batch INPUTS/study/folder --set fps=30 --workers 1

compare/estimators: compare poses/boxing poses/boxing_blazepose keypoints/boxing
compare/motions: compare simulated/take00 simulated/take10
compare/cameras: compare real/cam01 real/cam02 real/cam03 real/cam04 --align stamps
compare/truth: compare simulated/take00 --truth INPUTS/take00.npz
compare/truth_trc: compare simulated/take10 --truth INPUTS/take10.trc
compare/truth_c3d: compare simulated/take20 --truth INPUTS/take20.c3d
compare/truth_bvh: compare captured/truth captured/take30 --align correlate
imu/wrist: compare strapped/measured WRIST
imu/wrist_and_pelvis: compare strapped/lifted WRIST PELVIS

inspect/video: inspect DATA/video/walk_crop.mp4 --json
inspect/motionbert: inspect MOTIONBERT/boxing_X3D.npy --json
inspect/broken: inspect MOTIONBERT/broken_X3D.npy --json
inspect/mhformer: inspect MHFORMER/output_3D/output_keypoints_3d.npz --json
inspect/sam3dbody: inspect DATA/native/sam3dbody --json
inspect/alphapose: inspect MOTIONBERT/boxing_alphapose-results.json --json
"""
_REAL = {  # the same, of each camera of the real take
    "real/cam{0:02}": "run --keypoints INPUTS/cam{0:02}.json --set read.image_size={1}x1920 --fps 60 --focal {2}",
    "real/cam{0:02}_feet": "run --keypoints INPUTS/cam{0:02}/openpose --set read.image_size={1}x1920 --fps 60",
    "real/cam{0:02}_video": "run DATA/real/pose2sim/cam{0:02}.mp4 MOVENET",
}
_CAMERAS = ((1, 1080, 1681), (2, 1080, 1674), (3, 1088, 1681), (4, 1088, 1676))  # number, width, focal length
_WORDS = {
    "BLAZEPOSE": "--adapter arrays -O layout=BLAZEPOSE33 -O frame=CAMERA -O unit=m",
    "MOVENET": "--detector DATA/models/movenet_lightning_int8.onnx",
    "ALPHAPOSE": "--keypoints MOTIONBERT/boxing_alphapose-results.json --fps 30",
    "SKATER": "--keypoints MHFORMER/input_2D/keypoints.npz --fps 25",
    "EVERYONE": "--everyone",
    "ALSO": "--also csv --also trc --also mot --also c3d --also netcdf --also bvh --also glb",
    "WRIST": "--imu INPUTS/r_forearm.csv --segment r_forearm",
    "PELVIS": "--imu INPUTS/pelvis.csv --segment pelvis",
    "MOTIONBERT": "DATA/native/motionbert",
    "MHFORMER": "DATA/native/mhformer/skating",
}  # DATA and INPUTS come last, as paths may have spaces
_ONLY_NUMBERS = " --set record=off --set report=off"  # of `run` and `batch`
_SEEN = "run --keypoints INPUTS/take{0:02}.json --set read.image_size={4} --fps 30 "
_OPTIONS = (
    "", "--stature 1.75", "--focal {1}", "--stature 1.75 --set read.handedness=ignore",
    "--set trajectories.cutoff_hz=6", "--camera moving",
    "--focal {1} --set read.pitch={2} --set read.roll={3}", "--set rectify.rectifier=geometric",
)  # fmt: skip
_CAPTURED = "run --poses INPUTS/{}.npy --adapter arrays -O layout=H36M17 -O frame={} -O unit=m --fps {}"

_TAKES, _FEWEST, _MOST = 40, 60, 300  # simulated takes, and their frames
_WRITTEN = "commands.txt"  # of the inputs: a line for each command that is made along with them; written last


def make(folder: Path, inputs: Path, program: Path, jobs: int = 1, only: str = "*") -> None:
    """Runs the commands and leaves the files of KEPT in folder/NAME, exit codes and what was printed in folder/said."""
    data = Path(os.environ["PCNET3D_DATA"]).resolve()
    if not (inputs / _WRITTEN).exists():
        _write_inputs(data, inputs)
    commands = _parsed_table((inputs / _WRITTEN).read_text(encoding="utf-8")) | _parsed_table(_COMMANDS)
    commands |= {name.format(*c): line.format(*c) for c in _CAMERAS for name, line in _REAL.items()}
    commands = {name: line for name, line in commands.items() if fnmatch.fnmatch(name, only)}
    later = {name for name, line in commands.items() if _reads_results(line, commands)}
    folder.mkdir(parents=True)
    runner = _Runner(folder.resolve(), inputs.resolve(), data, program.absolute())
    started, codes = time.monotonic(), Counter[int]()
    with ThreadPoolExecutor(jobs) as pool:
        for names in (commands.keys() - later, later):
            ordered = [name for name in commands if name in names]
            for code in pool.map(lambda name: runner.run(name, commands[name]), ordered):
                codes[code] += 1
    kept = {folder / file for file in _files(folder)}
    for path in folder.rglob("*"):
        if path.is_file() and path not in kept:
            path.unlink()
    shutil.rmtree(folder / "demo-input", ignore_errors=True)
    spent = os.times()
    print(
        f"{codes.total()} commands, by exit code {dict(sorted(codes.items()))}: {time.monotonic() - started:.0f} s, "
        f"{spent.children_user + spent.children_system:.0f} s of processors"
    )


def _reads_results(line: str, names: Iterable[str]) -> bool:
    """Whether the command's words name what another one leaves, which has to be run before."""
    return any(f"{word}/".startswith(f"{name}/") for word in line.split()[1:] for name in names)


def _parsed_table(text: str) -> dict[str, str]:
    """{name of a command: its words}"""
    lines = (line.partition(": ") for line in text.splitlines() if line)
    return {name: words for name, _, words in lines}


@dataclass(frozen=True)
class _Runner:
    """Runs commands of a program in a folder."""

    folder: Path
    inputs: Path
    data: Path
    program: Path

    def run(self, name: str, line: str) -> int:
        """The exit code of the command; it is left in said/NAME.json with what was printed."""
        started, ended = time.monotonic(), self._run(name, line)
        code = ended.returncode
        # The stages' times are on stderr otherwise.
        printed = _printed(self._as_elsewhere(ended.stdout if code in _CARRIED_OUT else ended.stderr))
        content = {"exit_code": code, **printed}
        place = self.folder / _SAID / f"{name}.json"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(content), encoding="utf-8")
        print(f"{name}: exit code {code}, {time.monotonic() - started:.1f} s", flush=True)
        return code

    def _run(self, name: str, line: str) -> subprocess.CompletedProcess[str]:
        command = line.partition(" ")[0]
        line += _ONLY_NUMBERS if command in ("run", "batch") else ""
        for short, words in _WORDS.items():
            line = line.replace(short, words)
        words = line.split()
        for short, path in self._places().items():
            words = [word.replace(short, path) for word in words]
        if command != "inspect":
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            words += ["-o", name]
        # 8-bit networks round otherwise with another number of threads; tables are as wide as the console.
        environment = os.environ | {"OMP_NUM_THREADS": "1", "COLUMNS": "200"}
        return subprocess.run(
            [self.program, *words],
            cwd=self.folder,
            capture_output=True,
            text=True,
            env=environment,
            check=False,
        )

    def _places(self) -> dict[str, str]:
        return {"DATA": str(self.data), "INPUTS": str(self.inputs), "FOLDER": str(self.folder)}

    def _as_elsewhere(self, text: str) -> str:
        """What was printed, as it is with other folders."""
        for short, path in self._places().items():
            text = text.replace(path, short)
        return text


def _printed(text: str) -> dict[str, Any]:
    """One JSON object, or lines of text, of which those that are JSON stand apart as columns."""
    if text.startswith("{\n"):
        return {"printed": json.loads(text)}
    lines = text.splitlines()
    rows = [dict(_within(json.loads(line))) for line in lines if line.startswith("{")]
    columns = {
        key: [cell for row in rows for cell in (row[key].ravel().tolist() if key in row else [None])]
        for key in dict.fromkeys(chain(*rows))
    }
    return {"said": [line for line in lines if not line.startswith("{")], "streamed": columns}


def _write_inputs(data: Path, inputs: Path) -> None:
    """All that commands read besides the data folder, and their list; by the version of this Python."""
    sys.path.append(str(Path(__file__).parents[1]))  # for tests/golden
    inputs.mkdir(parents=True)
    _write_real(data, inputs)
    _write_films(data, inputs)
    commands = _write_simulated(inputs) | _write_golden(inputs) | _write_strapped(inputs)
    _write_study(inputs, commands)
    lines = "".join(f"{name}: {line}\n" for name, line in commands.items())
    (inputs / _WRITTEN).write_text(lines, encoding="utf-8")


def _write_real(data: Path, inputs: Path) -> None:
    from golden import detections

    for name in ("walk_crop", "boxing", "demo_man"):
        with np.load(data / f"lifter/{name}.npz") as file:
            np.save(inputs / f"{name}.npy", file["blazepose_world"])
            _write_coco(inputs / f"{name}.json", file["movenet_kp2d"])
    lens = json.loads((data / "real/pose2sim/cameras.json").read_text(encoding="utf-8"))["cameras"]["cam01"]
    (fx, fy), (cx, cy) = lens["focal_px"], lens["principal_point_px"]
    content = {
        "cameraMatrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]],
        "distCoeffs": lens["distortion"],
        "image_size": (1080, 1920),
    }
    (inputs / "cam01_lens.json").write_text(json.dumps(content), encoding="utf-8")
    with np.load(data / "real/pose2sim/truth.npz") as file:
        for camera in ("cam01", "cam02", "cam03", "cam04"):
            points = file[f"openpose_body25b_{camera}"]
            _write_coco(inputs / f"{camera}.json", points[:, :17])
            (inputs / camera).mkdir()
            detections.openpose(inputs / camera, {"0": (np.arange(len(points)), points)})


def _write_coco(path: Path, points: np.ndarray) -> None:
    """points: (T, 17, 3) pixels and score."""
    rows = (points.reshape(len(points), -1).astype(float).round(3)).tolist()
    listed = [{"image_id": n, "category_id": 1, "keypoints": row, "score": 1.0} for n, row in enumerate(rows)]
    path.write_text(json.dumps(listed), encoding="utf-8")


def _write_films(data: Path, inputs: Path) -> None:
    """A film of a camera that follows a woman, cut out of one that stands still; and one of two people, with their
    keypoints."""
    import av

    from golden import detections, films, numbered

    with av.open(str(data / "video/sports2d_demo.mp4")) as container:
        images = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)][62:160]
    lefts = 4 * np.linspace(217, 0, len(images)).round().astype(int)  # she walks from the right to the left
    views = [image[272:992, left : left + 900] for image, left in zip(images, lefts, strict=True)]
    films.film_of(inputs / "followed.mp4", views, np.arange(len(views)) * 1000 / 30, crf=18)
    numbered.numbered_film(inputs / "two_people.mp4")
    walker = numbered.joints_px()
    people = (0.7 * walker + [-20, 90], 0.7 * walker[::-1] + [220, 70])
    scene = {str(n): (np.arange(len(walker)), detections.scored(person)) for n, person in enumerate(people)}
    detections.coco_results(inputs, scene).rename(inputs / "two_people.json")


def _write_golden(inputs: Path) -> dict[str, str]:
    """A file of each form that is read, of people who walk; the commands for them."""
    from golden.catalogue import CATALOGUE
    from golden.walking import FPS, SIZE, Walking
    from pcnet3d.adapters import read_all
    from pcnet3d.pipeline.reading.load import adapters

    number, commands = Counter[str](), {}
    for golden in CATALOGUE:
        number[golden.adapter] += 1
        name = f"{golden.adapter}_{number[golden.adapter]}"
        (inputs / "read" / name).mkdir(parents=True)
        path = golden.write(Walking(), inputs / "read" / name)
        place = f"INPUTS/{path.relative_to(inputs).as_posix()}"
        gives = adapters()[golden.adapter].gives
        if gives not in ("poses", "keypoints"):
            continue  # other commands read films and sensors
        options = [
            f"{key}={','.join(map(str, np.atleast_1d(value)))}" for key, value in golden.options.items()
        ]
        alone = [f"--adapter {golden.adapter}"] * golden.by_name + [f"-O {option}" for option in options]
        commands[f"inspect/{name}"] = " ".join([f"inspect {place} --json", *alone])
        of_2d = [
            f"--set read.image_size={SIZE[0]}x{SIZE[1]}",
            *(f"--set keypoints.{option}" for option in options),
        ]
        several = len(read_all(path, golden.adapter, **golden.options)) > 1
        words = [f"run --{gives} {place} --fps {FPS}", *(alone if gives == "poses" else of_2d)]
        commands[f"read/{name}"] = " ".join(words + ["EVERYONE"] * several)
    return commands


def _write_simulated(inputs: Path) -> dict[str, str]:
    """Clips of validation subjects, as seen; the commands for them, with one option or another."""
    from golden.detections import AS_COCO
    from pcnet3d.models.lab.beds import see
    from pcnet3d.models.lab.clips import read_clips
    from pcnet3d.models.lab.synthetic import TYPICAL
    from pcnet3d.pipeline.core.camera import pitch_roll_deg

    clips, commands = [clip for clip in read_clips("val") if len(clip) >= _FEWEST], {}
    for n, index in enumerate(np.linspace(0, len(clips) - 1, _TAKES).round().astype(int)):
        clip = replace(clips[index], joints=clips[index].joints[:_MOST])
        seen = see(clip, n, views=TYPICAL)
        found = np.dstack([seen.keypoints.joints, seen.keypoints.confidence])
        _write_coco(inputs / f"take{n:02}.json", np.nan_to_num(found[:, AS_COCO]))
        camera = (round(of, 1) for of in (seen.focal_px, *pitch_roll_deg(seen.up).tolist()))
        words = _SEEN + _OPTIONS[n % len(_OPTIONS)]
        commands[f"simulated/take{n:02}"] = words.format(n, *camera, "{}x{}".format(*seen.image_size))
        if n % 10 == 0:  # the motion capture itself too
            _write_captured(inputs, f"take{n:02}", clip.joints.astype(float))
            commands[f"captured/take{n:02}"] = _CAPTURED.format(f"take{n:02}", "Z_UP", 30)
    return commands


def _write_captured(inputs: Path, name: str, world: np.ndarray) -> None:
    """(T, 17, 3) metres, z up, at 30 frames a second, in the formats of motion capture."""
    from golden import worlds
    from pcnet3d.pipeline import H36M17

    np.save(inputs / f"{name}.npy", world)
    np.savez(inputs / f"{name}.npz", joints=world, joint_names=H36M17.joints, fps=30)
    markers = world[:, H36M17.indices(list(worlds.POSE2SIM.values()))]
    worlds.trc(inputs / f"{name}.trc", worlds.POSE2SIM, worlds.y_up(markers))
    worlds.c3d(inputs / f"{name}.c3d", worlds.POSE2SIM, 1000 * markers, rate=30.0)
    worlds.bvh(inputs / f"{name}.bvh", worlds.y_up(world), fps=30)


def _write_strapped(inputs: Path) -> dict[str, str]:
    """The walker with inertial sensors; the commands for the walker as measured and as a faulty lifter has it."""
    from golden import sensors
    from golden.strapped import strapped
    from pcnet3d.examples.walker.camera import camera_poses, side_camera
    from pcnet3d.examples.walker.walk import walker

    walk = walker(fps=60, seconds=8)
    for segment in ("r_forearm", "pelvis"):
        sensors.write_csv(inputs / f"{segment}.csv", strapped(walk, segment))
    noise_m = 0.008 * np.random.default_rng(0).standard_normal(walk.world.shape)
    np.save(inputs / "measured.npy", walk.world)
    np.save(inputs / "lifted.npy", camera_poses(walk, side_camera(walk)).joints + noise_m)
    return {
        "strapped/measured": _CAPTURED.format("measured", "Z_UP", 60),
        "strapped/lifted": _CAPTURED.format("lifted", "CAMERA", 60),
    }


def _write_study(inputs: Path, commands: Mapping[str, str]) -> None:
    """Two visits of three people, a take that fails, and a folder of poses without a manifest."""
    from golden.lifters import x3d
    from golden.walking import Walking

    study = inputs / "study"
    (study / "folder").mkdir(parents=True)
    rows = ["name,subject,visit,keypoints,image-size,fps"]
    for n in range(6):
        shutil.copy(inputs / f"take{n:02}.json", study)
        size = commands[f"simulated/take{n:02}"].partition("image_size=")[2].split()[0]
        rows.append(f"take{n},{n // 2},{'first' if n % 2 == 0 else 'second'},take{n:02}.json,{size},30")
    (study / "cut_off.json").write_text((study / "take00.json").read_text("utf-8")[:10_000], "utf-8")
    rows.append(f"cut_off,3,first,cut_off.json,{size},30")
    (study / "manifest.csv").write_text("\n".join(rows), "utf-8")
    for n, first in enumerate((0, 120)):
        np.save(study / "folder" / f"walk{n}.npy", x3d(Walking().turning(300)[first : first + 120]))


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
        return dict(_within({name: table[name].to_pylist() for name in table.column_names}))
    if path.suffix == ".json":
        return dict(_within(json.loads(path.read_text(encoding="utf-8"))))
    if path.suffix in (".trc", ".mot", ".bvh"):
        cells = path.read_text(encoding="utf-8").split()
        return dict(_within({"content": [_cell(cell) for cell in cells]}))
    return {"content": np.frombuffer(path.read_bytes(), np.uint8).astype(float)}


def _numbered(names: Iterable[str]) -> list[str]:
    """The names, the second of those that are the same with #2 after it, and so on."""
    times = Counter[str]()
    numbered = []
    for name in names:
        times[name] += 1
        numbered.append(name if times[name] == 1 else f"{name}#{times[name]}")
    return numbered


def _cell(text: str) -> float | str | None:
    try:
        return float(text)
    except ValueError:
        return text or None


def _within(value: Any, key: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Leaves of what JSON can hold. None is NaN; the words of a list that has numbers too are a leaf of their own. What
    is in a list of objects that name themselves has that name in its key, else its number."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _within(inner, f"{key}.{name}".lstrip("."))
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for name, inner in zip(_names_within(value), value, strict=True):
            yield from _within(inner, f"{key}[{name}]")
    else:
        listed = value if isinstance(value, list) else [value]
        words = [inner for inner in listed if isinstance(inner, str)]
        numbers = np.array([inner if isinstance(inner, int | float) else np.nan for inner in listed], float)
        if words:
            yield key + " (words)" * bool(np.isfinite(numbers).any()), np.array(words)
        if not words or np.isfinite(numbers).any():
            yield key, numbers


def _names_within(listed: list[Any]) -> list[str]:
    for name in _ITEM_NAMES:
        if all(isinstance(item, dict) and isinstance(item.get(name), str) for item in listed):
            return _numbered(item[name] for item in listed)
    return [str(number) for number in range(len(listed))]


class Difference(NamedTuple):
    """file: its path in the folder; of a command that one version alone carries out, its name, with the key _EXIT_CODE.
    key: as in `_leaves`. of_numbers: or of text and names of keys. group: the beginning of the key that no key of the
    other file has, where this one is in one file only."""

    file: str
    key: str
    what: str
    of_numbers: bool = True
    group: str = ""

    @property
    def line(self) -> str:
        """What is printed, the same for all takes that differ in the same."""
        if self.key == _EXIT_CODE:
            return f"{self.file}: {self.key} {self.what}"
        kind = _SAID if self.file.startswith(f"{_SAID}/") else self.file.rpartition("/")[2]
        return ": ".join(part for part in (kind, self.group or self.key, self.what) if part)


def compare(one: Path, other: Path, expected: Mapping[str, str] | None = None) -> bool:
    """Prints all that differs between two folders of `make`; whether every number is the same, those aside that are
    expected: {pattern of FILE:KEY: the reason}."""
    expected = expected or {}
    patterns = {pattern: _compiled(pattern) for pattern in expected}
    swallowed = dict.fromkeys(expected, 0)
    unexpected: dict[bool, dict[str, list[str]]] = {
        True: {},
        False: {},
    }  # files by line, of numbers and of the rest
    for each in _differences(one, other):
        where = f"{each.file}:{each.key}"
        fitting = next((pattern for pattern, compiled in patterns.items() if compiled.fullmatch(where)), None)
        if fitting is not None:
            swallowed[fitting] += 1
        else:
            unexpected[each.of_numbers].setdefault(each.line, []).append(each.file)
    texts = {line: files for line, files in unexpected[False].items() if line not in unexpected[True]}
    for line, several in (unexpected[True] | texts).items():
        files = list(dict.fromkeys(several))
        more = f" and {len(files) - 1} more" if files[1:] else ""
        print(line if line.startswith(f"{files[0]}: ") else f"{line} ({files[0]}{more})")
    for pattern, count in swallowed.items():
        print(f"{count} expected: {pattern}: {expected[pattern]}")
    numbers = sum(map(len, unexpected[True].values()))
    print(
        f"{len(_files(one) | _files(other))} files: {numbers} differences of numbers, {len(texts)} of text "
        f"and names of keys, {sum(swallowed.values())} expected"
    )
    return not numbers


def _compiled(text: str) -> re.Pattern[str]:
    """An asterisk is any characters; brackets, which keys have, are themselves."""
    return re.compile(".*".join(map(re.escape, text.split("*"))), re.DOTALL)


def _files(folder: Path) -> set[str]:
    paths = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    return {path.as_posix() for path in paths if path.name in KEPT or path.parts[0] == _SAID}


def _differences(one: Path, other: Path) -> Iterator[Difference]:
    """All between two folders, in the order of their files."""
    files = sorted(_files(one) | _files(other))
    commands = [
        file.removeprefix(f"{_SAID}/").removesuffix(".json") for file in files if file.startswith(_SAID)
    ]
    in_one_only = set()
    for name in commands:
        ends = [_end(folder / _SAID / f"{name}.json") for folder in (one, other)]
        if len({state for state, _ in ends}) > 1:
            in_one_only.add(name)
            yield Difference(name, _EXIT_CODE, f"{ends[0][1]} in A, {ends[1][1]} in B")
    for file in files:
        owners = [name for name in commands if f"{file}/".startswith((f"{name}/", f"{_SAID}/{name}.json/"))]
        if owners and max(owners, key=len) in in_one_only:
            continue
        a, b = one / file, other / file
        if not (a.exists() and b.exists()):
            yield Difference(file, "", f"is in {'A' if a.exists() else 'B'} only")
        elif a.read_bytes() != b.read_bytes():
            yield from _differences_of_files(file, a, b)


def _end(said: Path) -> tuple[str, str]:
    """Whether the command was not run, refused or carried out; its exit code, if refused with the last line."""
    if not said.exists():
        return "not run", "not run"
    content = json.loads(said.read_text(encoding="utf-8"))
    if content["exit_code"] in _CARRIED_OUT:
        return "carried out", str(content["exit_code"])
    sentences = [line.strip(" │") for line in content.get("said", ()) if not line.startswith(("╭", "╰"))]
    return "refused", " ".join([str(content["exit_code"]), *(f"({line})" for line in sentences[-1:])])


def _differences_of_files(file: str, one: Path, other: Path) -> Iterator[Difference]:
    a, b = (
        {key: values for key, values in _leaves(path).items() if _last(key) not in NOT_COMPARED}
        for path in (one, other)
    )
    shapes = Counter(
        (a[key].shape, b[key].shape) for key in a.keys() & b.keys() if a[key].shape != b[key].shape
    )
    for name, leaves, others in (("A", a, b), ("B", b, a)):
        elsewhere = {part for key in others for part in _beginnings(key)}
        for key in sorted(leaves.keys() - others.keys()):
            group = next((part for part in _beginnings(key) if part not in elsewhere), key)
            yield Difference(file, key, f"is in {name} only", _kind(leaves[key]) == "numbers", group)
    for key in sorted(a.keys() & b.keys()):
        kinds = {_kind(a[key]), _kind(b[key])}
        same_change = shapes[a[key].shape, b[key].shape]  # as of all columns of a table that has more rows
        group = f"{same_change} keys" if same_change > 2 else ""
        if "numbers" in kinds and "words" in kinds:
            yield Difference(file, key, "numbers in one, words in the other")
        elif "words" in kinds:
            for change in _changed(a[key], b[key]):
                yield Difference(file, key, change, of_numbers=False)
        elif difference := _apart(a[key], b[key]):
            yield Difference(file, key, difference, "numbers" in kinds, group)


def _beginnings(key: str) -> list[str]:
    """Of measures.kicks[left].count: measures, measures.kicks, measures.kicks[left] and all of it."""
    return [key[: at.start()] for at in re.finditer(r"(?<=.)[.[]", key)] + [key]


def _last(key: str) -> str:
    return key.rpartition(".")[2]


def _kind(values: np.ndarray) -> str:
    return "words" if values.dtype.kind == "U" else "numbers" if np.isfinite(values).any() else "empty"


def _changed(a: np.ndarray, b: np.ndarray) -> list[str]:
    """Each text that is in one of them only; how else they differ if they have the same."""
    left, right = (Counter(map(str, values.ravel()) if values.dtype.kind == "U" else ()) for values in (a, b))
    changes = [f"- {text}" for text in (left - right).elements()]
    changes += [f"+ {text}" for text in (right - left).elements()]
    return changes or ["other order"] * (not np.array_equal(a, b))


def _apart(a: np.ndarray, b: np.ndarray) -> str:
    """In how many values, in which rows and by how much numbers differ; empty where they do not."""
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


def _main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("folder", type=Path)
    making.add_argument("--inputs", type=Path, required=True)
    making.add_argument("--program", type=Path, default=Path(sys.executable).with_name("pcnet3d"))
    making.add_argument("--jobs", type=int, default=1)
    making.add_argument("--only", default="*")
    comparing = commands.add_parser("compare")
    comparing.add_argument("folders", type=Path, nargs=2)
    comparing.add_argument("--expected", type=Path)
    asked = parser.parse_args()
    if asked.command == "make":
        if asked.folder.exists():
            parser.error(f"expected a new folder, got {asked.folder}, which exists")
        make(asked.folder, asked.inputs, asked.program, asked.jobs, asked.only)
        return 0
    expected = tomllib.loads(asked.expected.read_text(encoding="utf-8")) if asked.expected else {}
    if not all(isinstance(reason, str) for reason in expected.values()):
        parser.error(f'expected lines of "FILE:KEY" = "reason" in {asked.expected}, got others')
    return 0 if compare(*asked.folders, expected) else 1


if __name__ == "__main__":
    sys.exit(_main())
