"""What a trial by its users found wrong, done again: each finding with what is said now, and whether that is right.

    python tests/replay/replay_findings.py [NUMBER ...]

prints a line for each and ends with exit code 1 if any is NOT right. PCNET3D_DATA names the folder of real data.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cached_property
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

if __name__ == "__main__":  # pytest has tests/ on its path
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from golden import bodies, detections, jumps
from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import aimed, camera_poses, side_camera
from pcnet3d.examples.walker.imu import Faults, strapped, write_csv
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import Pipeline, Take
from pcnet3d.pipeline.cli import main
from pcnet3d.pipeline.core.layouts import BODY_25B
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.inspect.inspect import inspect
from pcnet3d.pipeline.signals.rates import fall_doubts, pace_doubts
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.rectify import Rectify, rectify
from pcnet3d.stages.trajectories import Trajectories, smooth

Answer = tuple[str, bool]  # what is said now, and whether that is right
_SHORT = ("clean", "scale", "rectify", "trajectories", "angles", "measures", "export")
_EXCHANGED = 43  # the frame of walk_crop's MoveNet keypoints in which the legs are exchanged, by eye
_LEGS = [(13, 14), (15, 16), (11, 12)]  # left and right of COCO's hips, knees and ankles
NOT_HERE = {
    **dict.fromkeys((17, 18, 19, 20, 21, 23), "how a page looks is for the eye"),
    **dict.fromkeys((27, 31), "a page of the documentation"),
    22: "options of the command line",
    30: "a wish for recipes",
    33: "no recording here shows it",
    34: "see pcnet3d evaluate real-take",
}


@dataclass(frozen=True)
class Bench:
    """data: the folder of real data, see tests/conftest.py. folder: an empty one to work in."""

    data: Path
    folder: Path

    def command(self, *words: object) -> tuple[int, str]:
        """Exit code of `pcnet3d WORDS`, and everything it prints, without line breaks."""
        said = StringIO()
        code: Any = 0
        with (
            patch.object(sys, "argv", ["pcnet3d", *map(str, words)]),
            redirect_stdout(said),
            redirect_stderr(said),
        ):
            try:
                main()
            except SystemExit as end:
                code = end.code or 0
        return int(code), " ".join(said.getvalue().split())

    def recipe(self, *stages: str) -> Path:
        path = self.folder / f"{'-'.join(stages)}.toml"
        path.write_text("".join(f'[[stages]]\nuse = "{stage}"\n' for stage in stages))
        return path

    def run(self, name: str, *words: object, stages: tuple[str, ...] = _SHORT) -> dict[str, Any]:
        """summary.json of a short run; of the same name it is done once."""
        out = self.folder / name
        if not out.exists():
            code, said = self.command("run", *words, "--recipe", self.recipe(*stages), "-o", out)
            assert code == 0, said
        return json.loads((out / "summary.json").read_text())

    def refused(self, *words: object) -> str:
        """What a run that has to be refused says; "" where it is not."""
        code, said = self.command(
            "run", *words, "--recipe", self.recipe(*_SHORT), "-o", self.folder / "refused"
        )
        return said if code == 2 else ""

    def points(self, clip: str) -> np.ndarray:
        """(T, 17, 3) MoveNet's keypoints of a clip: pixels and score."""
        return np.load(self.data / f"lifter/{clip}.npz")["movenet_kp2d"].astype(float)

    def keypoints(self, clip: str, points: np.ndarray | None = None) -> Path:
        """MoveNet's of a clip, or others for it, as a COCO file."""
        folder = self.folder / f"keypoints_{clip}{'' if points is None else '_changed'}"
        folder.mkdir(exist_ok=True)
        points = self.points(clip) if points is None else points
        return detections.coco_tracks(folder, {"0": (np.arange(len(points)), points)})

    @property
    def walk_words(self) -> tuple[object, ...]:
        video = self.data / "video/walk_crop.mp4"
        return video, "--keypoints", self.keypoints("walk_crop"), "--set", "calibrate=off"

    @property
    def walk(self) -> dict[str, Any]:
        return self.run("walk", *self.walk_words)

    @property
    def boxing_file(self) -> Path:
        return self.data / "native/motionbert/boxing_X3D.npy"

    @property
    def boxing(self) -> dict[str, Any]:
        return self.run("boxing", "--poses", self.boxing_file, "--fps", 30)

    @property
    def cycling(self) -> dict[str, Any]:
        return self.run("cycling", "--poses", self.data / "native/motionbert/cycling_X3D.npy", "--fps", 24)

    @cached_property
    def walker(self) -> Any:
        return walker(seconds=14)

    @cached_property
    def walker_run(self) -> Path:
        np.save(self.folder / "walker.npy", camera_poses(self.walker, side_camera(self.walker)).joints)
        words = ("--poses", self.folder / "walker.npy", "--adapter", "videopose3d", "--fps", 30)
        self.run("walker", *words, stages=("rectify", "trajectories", "export"))
        return self.folder / "walker"


def swaps(bench: Bench) -> Answer:
    """The walk as it is, and with the legs of the trial's two frames exchanged and the others put right."""
    points, (video, *_) = bench.points("walk_crop"), bench.walk_words
    for frame in (_EXCHANGED, 65, 95):
        for left, right in _LEGS:
            points[frame, [left, right]] = points[frame, [right, left]]
    words = (video, "--keypoints", bench.keypoints("walk_crop", points), "--set", "calibrate=off")
    told = [_exchanged(summary) for summary in (bench.walk, bench.run("exchanged", *words))]
    frames = [
        {
            frame
            for listed in re.findall(r"in frames ([-, 0-9]+)", said)
            for first, last in re.findall(r"(\d+)(?:-(\d+))?", listed)
            for frame in range(int(first), int(last or first) + 1)
        }
        for said in told
    ]
    return " | ".join(told), frames[0] <= {_EXCHANGED} and frames[1] <= {65, 95}


def _exchanged(summary: dict[str, Any]) -> str:
    said = [each["text"] for each in summary["notices"] if "exchanged" in each["text"]]
    return " ".join(said) or "nothing is exchanged"


def contradictory_gravity(bench: Bench) -> Answer:
    words = ("--poses", bench.boxing_file, "--fps", 30)
    reaction = bench.refused(*words, "--set", "read.gravity=0,-9.81,0")
    pitch = bench.refused(*words, "--set", "read.pitch=80", "--set", "read.roll=0")
    return f"{reaction} | {pitch}", "negate it" in reaction and "pitch" in pitch


def outside_the_image(bench: Bench) -> Answer:
    """The walk with its image cut off above the knees."""
    points = bench.points("walk_crop")
    height = int(np.median(points[:, 11:13, 1])) + 5
    words = (
        "--keypoints",
        bench.keypoints("walk_crop"),
        "--fps",
        30,
        "--set",
        f"read.image_size=884x{height}",
    )
    found = bench.run("cut", *words)
    said = " ".join(each["text"] for each in found["notices"] if each["code"] == "not-in-image")
    ranges = found["measures"]["range_of_motion"]
    return said, bool(said) and not any("p05_p95_deg" in ranges[f"{side}_knee_flexion"] for side in "rl")


def towards_the_camera(bench: Bench) -> Answer:
    walk = walker(seconds=12, turn_deg=0)
    poses = camera_poses(walk, aimed(walk.root.mean(axis=0), 6.0, 0.0, 0.0, 0.0))
    flat = poses.with_(joints=poses.joints * np.array([1.0, 1.0, 0.15], np.float32), root=None)
    take = Pipeline((Rectify(), Trajectories(), Angles(), Measures()))(Take("towards", poses=flat))
    assert take.measures is not None
    walking = nested(take.measures)["walking"]
    return walking.get("reason", ""), "steps" not in walking and "line of sight" in walking["reason"]


def false_steps(bench: Bench) -> Answer:
    words = ("--keypoints", bench.keypoints("demo_man"), "--fps", 30, "--set", "read.image_size=1768x994")
    walking = bench.run("demo_man", *words)["measures"]["walking"]
    landings = [time for side in ("right", "left") for time in walking.get(side, {}).get("landings_s", ())]
    counted = walking.get("counted", walking.get("reason"))
    said = f"{counted}, cadence {walking.get('cadence_spm', walking.get('cadence_reason', 'none'))}"
    strides = sum(walking.get(side, {}).get("strides", 0) for side in ("right", "left"))
    return said, all(time > 3 for time in landings) and ("cadence_spm" not in walking or strides >= 3)


def ducks(bench: Bench) -> Answer:
    bends = bench.boxing["measures"]["knee_bends"]
    peaks = bends.get("peak_deg", [])
    said = f"{bends['count']} knee bends to {peaks} degrees, of them squats {bends.get('squats', 0)}"
    known = len(bends.get("peak_error_deg", peaks)) == len(peaks)  # nobody has judged this lifter: no errors
    return said, known and bends.get("squats", 0) == sum(peak >= 70 for peak in peaks)


def told_rates(bench: Bench) -> Answer:
    """As the network detects in the video, and with keypoints that are given."""
    clip = bench.folder / "cut.mp4"
    _cut(bench.data / "video/walk_crop.mp4", clip, 25)
    network = bench.data / "models/movenet_lightning_int8.onnx"
    stages = ("detect", "lift", "clean", "scale", "rectify", "trajectories", "export")
    detected = bench.run("at_60", clip, "--detector", network, "--fps", 60, stages=stages)["notices"]
    given = bench.run("given_at_60", *bench.walk_words, "--fps", 60)["notices"]
    refused = bench.refused(*bench.walk_words, "--fps", 3000)
    told = ["fps-contradicts" in [each["code"] for each in said] for said in (detected, given)]
    return f"{detected[0]['text']} | {refused}", all(told) and "1 to 1000" in refused


def _cut(video: Path, clip: Path, frames: int) -> None:
    import cv2

    film = cv2.VideoCapture(str(video))
    size = int(film.get(cv2.CAP_PROP_FRAME_WIDTH)), int(film.get(cv2.CAP_PROP_FRAME_HEIGHT))
    out = cv2.VideoWriter(str(clip), cv2.VideoWriter.fourcc(*"mp4v"), film.get(cv2.CAP_PROP_FPS), size)
    for _ in range(frames):
        out.write(film.read()[1])
    out.release()


def slow_motion(bench: Bench) -> Answer:
    """A walk and a jump, eight times too slow; and both in real time."""
    walk = walker(seconds=8)
    poses = camera_poses(walk, side_camera(walk))
    slow = poses.with_(time_s=poses.times * 8, root=None)
    said = [*pace_doubts(smooth(rectify(slow).level)[0]), *fall_doubts(jumps.jumping(8))]
    real = [*pace_doubts(smooth(rectify(poses).level)[0]), *fall_doubts(jumps.jumping(1))]
    return " | ".join(each.text for each in said), [each.code for each in said] == [
        "gait-against-rate",
        "falls-slowly",
    ] and not real


def symmetry(bench: Bench) -> Answer:
    rows = {
        name: row
        for name, row in bench.walk["measures"]["symmetry"].items()
        if "symmetry_index_percent" in row
    }
    within = [name for name, row in rows.items() if row.get("within_error")]
    known = all("symmetry_index_error_percent" in row and "within_error" in row for row in rows.values())
    return f"{len(rows)} indices with errors, {len(within)} of them within theirs", bool(rows) and known


def impossible_ranges(bench: Bench) -> Answer:
    file = bench.data / "native/motionbert/cycling_X3D.npy"
    found = bench.cycling
    beyond = [
        name for name, row in found["measures"]["range_of_motion"].items() if "beyond_anatomy_frames" in row
    ]
    said = f"inspect and run: {found['verdict']}; beyond anatomy: {', '.join(beyond) or 'none'}"
    return said, found["verdict"] == inspect(file).verdict != "good" and bool(beyond)


def digits(bench: Bench) -> Answer:
    """Of the walk: four steps, so a cadence with its error or none. Files hold all digits; pages end where the error
    begins."""
    walking = bench.walk["measures"]["walking"]
    cadence = walking.get("cadence_spm")
    stated = cadence is None or "cadence_error_spm" in walking
    error = walking.get("cadence_error_spm")
    said = (
        walking.get("cadence_reason", f"cadence {cadence} ± {error}")
        if "steps" in walking
        else walking["reason"]
    )
    return said, stated


def full_disk(bench: Bench) -> Answer:
    full = shutil._ntuple_diskusage(10**9, 10**9, 1000)  # type: ignore[attr-defined]
    words = (bench.folder / "cut.mp4", "--detector", bench.data / "models/movenet_lightning_int8.onnx")
    _cut(bench.data / "video/walk_crop.mp4", words[0], 25)
    with (
        patch.object(shutil, "disk_usage", lambda path: full),
        patch(
            "pcnet3d.models.detector.video.images_ahead", side_effect=AssertionError("was detected before")
        ),
    ):
        code, said = bench.command("run", *words, "-o", bench.folder / "full")
    return said, code == 2 and "The run needs about" in said


def killed(bench: Bench) -> Answer:
    """A detection that is killed at frame 15 of 25, then the same command with --resume."""
    clip, out = bench.folder / "killed.mp4", bench.folder / "killed"
    _cut(bench.data / "video/walk_crop.mp4", clip, 25)
    network = bench.data / "models/movenet_lightning_int8.onnx"
    recipe = bench.recipe("detect", "lift", "clean", "scale", "rectify", "trajectories", "export")
    words = ["run", clip, "--detector", network, "--recipe", recipe, "-o", out]
    script = """
import os, signal
from pcnet3d.models.detector import video as detect_video
from pcnet3d.pipeline.cli import main
from pcnet3d.pipeline.running import interrupt
shown = detect_video.images_ahead
def killing(*asked):
    for number, picture in shown(*asked):
        if number == 15:
            os.kill(os.getpid(), signal.SIGKILL)
        yield number, picture
detect_video.images_ahead, interrupt._KEEP_S, interrupt._KEEP_RARELY = killing, 0.0, 0
main()
"""
    subprocess.run([sys.executable, "-c", script, *map(str, words)], capture_output=True, timeout=60)
    kept = (bench.folder / ".killed.keypoints.npz").exists()
    code, _ = bench.command(*words, "--resume")
    left = [path.name for path in bench.folder.iterdir() if path.name.startswith(".killed")]
    said = f"keypoints kept: {kept}; --resume ends with {code} and leaves {left or 'nothing'} behind"
    return said, kept and code == 0 and not left


def sensors_side_by_side(bench: Bench) -> Answer:
    run = bench.walker_run
    for seed, segment in enumerate(("r_forearm", "l_shank", "pelvis")):
        write_csv(bench.folder / f"{segment}.csv", strapped(bench.walker, segment, Faults(), seed=seed))
    for segment in ("r_forearm", "l_shank"):
        pelvis = ("--imu", bench.folder / "pelvis.csv", "--segment", "pelvis")
        code, said = bench.command(
            "imu", run, "--imu", bench.folder / f"{segment}.csv", "--segment", segment, *pelvis
        )
        assert code == 0, said
    found = list(json.loads((run / "imu/imu.json").read_text())["segments"])
    return f"imu.json holds {found}", found == ["r_forearm", "l_shank"]


def option_of_a_batch(bench: Bench) -> Answer:
    folder = bench.folder / "poses_alone"
    folder.mkdir()
    np.save(folder / "walk.npy", bodies.turning(20).astype(np.float32))
    code, said = bench.command(
        "batch", folder, "--set", "fps=30", "--set", "detector=movenet", "-o", bench.folder / "batch"
    )
    return said, code == 2 and "no take has a use for it" in said and not (
        bench.folder / "batch/takes"
    ).exists()


def broken_files_of_a_batch(bench: Bench) -> Answer:
    folder = bench.folder / "broken"
    folder.mkdir()
    np.save(folder / "X3D.npy", np.zeros((10, 17, 3), np.float32))
    (folder / "X3D.npy").write_bytes((folder / "X3D.npy").read_bytes()[:70])
    (folder / "empty.npy").write_bytes(b"")
    code, said = bench.command("batch", folder, "-o", bench.folder / "of_broken")
    return said, code == 2 and "0 takes done" in said and "2 failed" in said


def quaternions(bench: Bench) -> Answer:
    """x y z w under the names w x y z; and no quaternions at all."""
    run, sensor = bench.walker_run, strapped(bench.walker, "r_forearm", Faults())
    write_csv(bench.folder / "xyzw.csv", sensor)
    text = (bench.folder / "xyzw.csv").read_text()
    cells = [line.split(",") for line in text.splitlines()]
    moved = [cells[0], *([*row[:4], *row[5:], row[4]] for row in cells[1:])]
    (bench.folder / "xyzw.csv").write_text("\n".join(",".join(row) for row in moved))
    of = ("--segment", "r_forearm")
    code, named = bench.command("imu", run, "--imu", bench.folder / "xyzw.csv", *of)
    write_csv(bench.folder / "norm.csv", replace(sensor, R_world_from_sensor=None))
    ended, said = bench.command("imu", run, "--imu", bench.folder / "norm.csv", *of)
    told = re.search(r"no orientation[^;]*", said)
    good = (code, ended) == (2, 0) and "quaternions' numbers seem to be" in named and told is not None
    return f"{named} | {told[0] if told else said}", good


def missing_packages(bench: Bench) -> Answer:
    path = bench.folder / "annot.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(600))
    with patch("pcnet3d.pipeline.reading.describe.find_spec", lambda name: None):
        _, said = bench.command("inspect", path)
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    return said, "pcnet3d[hdf5]" in said and "pcnet3d[c3d]" in readme


def causes_by_name(bench: Bench) -> Answer:
    """Millimetres, y up, nothing but NaN, exchanged arguments, a thousand people in a frame."""
    folder = bench.folder / "causes"
    folder.mkdir()
    body = bodies.facing_camera() + np.random.default_rng(0).normal(0, 0.003, (60, 17, 3))
    body = (body - body[:, :1]).astype(np.float32)
    one = {"category_id": 1, "keypoints": list(range(1, 52)), "score": 2.0, "box": [0, 0, 9, 9]}
    crowd = [{"image_id": "0.jpg", **one, "idx": person} for person in range(1000)]
    (folder / "crowd.json").write_text(json.dumps(crowd))
    y_up = body * np.float32([1, -1, -1])
    saved = {
        "mm": 1000 * body,
        "y_up": y_up,
        "nan": np.full_like(body, np.nan),
        "poses": body + np.float32([0.1, 0, 0]),
    }
    for name, joints in saved.items():
        np.save(folder / f"{name}.npy", joints)
    expected = {
        "unit=mm": ("--poses", folder / "mm.npy", "--fps", 30),
        "frame=GL_CAMERA": ("--poses", folder / "y_up.npy", "--adapter", "motionbert", "--fps", 30),
        "Every coordinate in it is NaN": ("--poses", folder / "nan.npy", "--fps", 30),
        "give them with --keypoints": ("--poses", folder / "crowd.json", "--fps", 30),
        "at most": ("--keypoints", folder / "crowd.json", "--fps", 30, "--set", "read.image_size=640x480"),
    }
    found = []
    for words, given in expected.items():
        out = bench.folder / "cause"
        _, said = bench.command("run", *given, "--recipe", bench.recipe(*_SHORT), "-o", out, "--force")
        found.append(words in said)
    names = [words for words, there in zip(expected, found, strict=True) if there]
    return f"{sum(found)} of {len(found)} are named: {', '.join(names)}", all(found)


def names_of_columns(bench: Bench) -> Answer:
    """Of MotionBERT's poses, without a scale, and the same with a stature."""
    import pyarrow.parquet as pq

    words = ("--poses", bench.boxing_file, "--fps", 30)
    summaries = bench.boxing, bench.run("boxing_in_metres", *words, "--stature", 1.8)
    schemas = [
        pq.read_schema(bench.folder / name / "kinematics.parquet") for name in ("boxing", "boxing_in_metres")
    ]
    units = [schema.metadata[b"length_unit"].decode() for schema in schemas]
    keys = [set(_keys(summary["measures"])) for summary in summaries]
    said = f"{len(schemas[0].names)} and {len(schemas[1].names)} columns in {units[0]} and {units[1]}, the same names"
    return said, schemas[0].names == schemas[1].names and keys[0] == keys[1] and units == ["arbitrary", "m"]


def _keys(group: dict[str, Any]) -> list[str]:
    """The keys that have lengths in them; others come and go with their errors."""
    deeper = [key for value in group.values() if isinstance(value, dict) for key in _keys(value)]
    return [key for key in group if "length" in key or "speed" in key] + deeper


def unfiltered(bench: Bench) -> Answer:
    done = smooth(rectify(read(bench.boxing_file, fps=10)).level)[0].history[-1].options
    return str(done), done.get("unfiltered") is True


def openpose_folders(bench: Bench) -> Answer:
    frames, points = np.arange(12), np.full((12, 25, 3), 0.7)
    points[..., :2] = np.random.default_rng(0).uniform(100, 500, (25, 2))
    (bench.folder / "openpose").mkdir()
    folder = detections.openpose(bench.folder / "openpose", {"0": (frames, points)})
    for number, file in enumerate(sorted(folder.iterdir())):
        file.rename(folder / f"cam01.{number:04d}.json")
    poses = read(folder)
    truth = np.load(bench.data / "real/pose2sim/truth.npz")
    name = next(key for key in truth.files if truth[key].ndim >= 3 and truth[key].shape[-2:] == (25, 3))
    real = truth[name].reshape(-1, 25, 3)[:20].astype(float)
    (bench.folder / "body_25b").mkdir()
    found = read(detections.openpose(bench.folder / "body_25b", {"0": (np.arange(20), real)}))
    said = f"cam01.0000.json: {len(poses)} frames; {found.layout.name} is known"
    return said, len(poses) == 12 and found.layout == BODY_25B


FINDINGS: dict[int, tuple[str, Callable[[Bench], Answer]]] = {
    1: ("exchanged legs", swaps),
    2: ("contradictory gravity", contradictory_gravity),
    3: ("joints outside the image", outside_the_image),
    4: ("walking at the camera", towards_the_camera),
    5: ("false steps", false_steps),
    6: ("ducks called squats", ducks),
    7: ("rates against the file's", told_rates),
    8: ("slow motion", slow_motion),
    9: ("symmetry without an error", symmetry),
    10: ("impossible ranges", impossible_ranges),
    11: ("false precision", digits),
    12: ("a full disk", full_disk),
    13: ("a run that is killed", killed),
    14: ("one sensor after another", sensors_side_by_side),
    15: ("an option that no take has a use for", option_of_a_batch),
    16: ("broken files in a folder", broken_files_of_a_batch),
    24: ("quaternions", quaternions),
    25: ("missing packages", missing_packages),
    26: ("causes by name", causes_by_name),
    28: ("names of columns", names_of_columns),
    29: ("unfiltered in silence", unfiltered),
    32: ("OpenPose's folders", openpose_folders),
}


def replay(numbers: list[int], data: Path) -> bool:
    """Prints a line for each finding; whether all are right."""
    right = True
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(data, Path(folder))
        for number in numbers:
            if number in NOT_HERE:
                print(f"{number}. not in this replay: {NOT_HERE[number]}")
                continue
            name, look = FINDINGS[number]
            try:
                said, good = look(bench)
            except Exception as error:  # a crash is no answer
                said, good = f"{type(error).__name__}: {error}", False
            said = " ".join(said.split())
            print(f"{number}. {name}: {said[:400]}: {'ok' if good else 'NOT'}", flush=True)
            right &= good
    return right


if __name__ == "__main__":
    if not os.environ.get("PCNET3D_DATA"):
        sys.exit("Set PCNET3D_DATA to the folder of real data.")
    wanted = [int(number) for number in sys.argv[1:]] or sorted({*FINDINGS, *NOT_HERE})
    sys.exit(0 if replay(wanted, Path(os.environ["PCNET3D_DATA"])) else 1)
