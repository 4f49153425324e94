"""Everything that reads a file, each with files to damage: the golden ones, our own, and real ones where they are.

A corpus is a folder of seeds, one folder a seed: in it the file or folder that is read, and what lies beside it.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz.mutations import mutated
from golden import cameras
from golden.bodies import Person
from golden.catalogue import CATALOGUE

_LARGEST = 1_500_000  # bytes of a real file that is worth damaging again and again


@dataclass(frozen=True)
class Seed:
    """reader: whose. name: what is read, in a folder of its own. options: of the adapter."""

    reader: str
    folder: Path
    name: str
    options: dict[str, Any]

    @property
    def path(self) -> Path:
        return self.folder / self.name


@dataclass(frozen=True)
class Reader:
    """write(folder) -> what is read, of a reader that is no adapter; read(path)."""

    write: Callable[[Path], Path]
    read: Callable[[Path], object]


def read_as_adapter(name: str, path: Path, options: dict[str, Any], rng: Random) -> object:
    """What `pcnet3d run` and `inspect` do with a file whose adapter is known, or with "auto" now and then."""
    from pcnet3d.pipeline.plugins.options import call
    from pcnet3d.pipeline.reading.load import adapters, find_adapter, read_all

    adapter = adapters()[name]
    sniffed = adapter.sniff(path)
    assert sniffed in (True, False)
    if rng.random() < 0.1:
        find_adapter(path, gives=rng.choice((None, adapter.gives)))
    if adapter.gives not in ("poses", "keypoints"):
        return call(adapter.read, path, what=name, options=options)
    believing = rng.random() < 0.5
    handedness = "ignore" if believing else "refuse"
    people = read_all(path, name, fps=30 if believing else None, handedness=handedness, **options)
    assert people
    for poses in people:
        assert not np.isinf(poses.joints).any()
    return people


def _by(module: str, name: str) -> Callable[[Path], object]:
    """A function of the package, which is imported when it is called."""
    return lambda path: getattr(import_module(f"pcnet3d.{module}"), name)(path)


def _recipe(folder: Path) -> Path:
    from importlib.resources import files

    shutil.copyfile(str(files("pcnet3d.pipeline.running").joinpath("default.toml")), folder / "recipe.toml")
    return folder / "recipe.toml"


def _read_recipe(path: Path) -> object:
    from pcnet3d.pipeline import load_recipe

    return load_recipe(path).build()


def _run(folder: Path) -> Path:
    from pcnet3d.pipeline.reading.settings import RunOptions
    from pcnet3d.pipeline.running.recipe import Recipe
    from pcnet3d.pipeline.running.run import run_files

    np.save(folder / "poses.npy", Person().turning(90))
    stages = ("clean", "scale", "rectify", "trajectories", "angles", "measures", "export")
    recipe = Recipe(stages=tuple({"use": stage} for stage in stages)).with_options(
        "rectify", rectifier="geometric"
    )
    run_files(RunOptions(poses=folder / "poses.npy", adapter="videopose3d", fps=30), folder / "run", recipe)
    return folder / "run"


def _summary(folder: Path) -> Path:
    """A run of which the summary alone is left: the rest is not read for the study's table."""
    run = _run(folder)
    for file in run.iterdir():
        if file.name != "summary.json":
            file.unlink()
    return run


def _onnx(name: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        from importlib.resources import files

        shutil.copyfile(str(files("pcnet3d.models").joinpath(name)), folder / Path(name).name)
        return folder / Path(name).name

    return write


def _read_rectifier(path: Path) -> object:
    from pcnet3d.models import load_rectifier

    return load_rectifier(str(path)).rotation(Person().turning(3))


def _read_lifter(path: Path) -> object:
    from golden.lifts import lift
    from pcnet3d.models.lifter.builtin import _open
    from pcnet3d.pipeline import H36M17, PoseSequence
    from pcnet3d.pipeline.core.frames import IMAGE

    _open.cache_clear()
    flat = 400 + 300 * Person().turning(5)[..., :2]
    return lift(PoseSequence(flat, H36M17, IMAGE), (1000, 1000), model=str(path))


def _truth(folder: Path) -> Path:
    np.savez(folder / "truth.npz", joints=Person().standing(40), fps=30.0)
    return folder / "truth.npz"


def _run_keypoints(folder: Path) -> Path:
    from golden.detections import WRITERS, moving

    return WRITERS["keypoints"](folder, {"0": moving(17, range(24))})


def _read_run_keypoints(path: Path) -> object:
    from pcnet3d.pipeline.files.detections import load_detections

    return load_detections(path).people()


def _manifest(folder: Path) -> Path:
    for name in ("a", "b"):
        np.save(folder / f"{name}.npy", Person().standing(30))
    lines = ["name,subject,visit,condition,poses,adapter,fps,pitch,handedness,also"]
    lines += [
        f"take {name},s1,{visit},shod,{name}.npy,videopose3d,30,0.5,refuse,geometric;body"
        for visit, name in enumerate("ab")
    ]
    (folder / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "manifest.csv"


def _read_manifest(path: Path) -> object:
    from pcnet3d.stages.study.batch.manifest import read_entries

    return read_entries(path, {})


def _read_study(path: Path) -> object:
    """A finished take of a batch into the study's table and page."""
    from pcnet3d.stages.study.batch.study import as_page, figures, write_table

    labels = {"name": "a", "condition": "", "state": "done", "exit_code": 0, "reason": ""}
    (row,) = figures(path)
    rows = [{**labels, "subject": subject, "visit": visit, **row} for subject in "ab" for visit in "12"]
    write_table(rows, path.parent / "study.parquet")
    page = as_page("Study", rows)
    assert "<script>alert" not in page
    return page


def _read_camera(path: Path) -> object:
    """Whichever camera of the file, to the video's size, and what is seen through it."""
    from pcnet3d.pipeline.core.intrinsics import undistorted
    from pcnet3d.pipeline.files.camera_file import _cameras, read_camera

    for name in _cameras(path):
        camera = read_camera(path, name, (1920, 1080))
        assert not np.isinf(undistorted([[0, 0], [960, 500], [np.nan, 1], [1919, 1079]], camera)).any()
    return read_camera(path, name)


OTHERS = {
    "manifest": Reader(_manifest, _read_manifest),
    "take of a study": Reader(_summary, _read_study),
    "detections of a run": Reader(_run_keypoints, _read_run_keypoints),
    "recipe": Reader(_recipe, _read_recipe),
    "run folder": Reader(_run, _by("stages.study.compare.side", "load_side")),
    "rectifier": Reader(_onnx("rectifier/pcnet.onnx"), _read_rectifier),
    "lifter": Reader(_onnx("lifter/lifter.onnx"), _read_lifter),
    "truth": Reader(_truth, _by("stages.study.compare.side", "read_truth")),
    **{f"camera file, {form}": Reader(write, _read_camera) for form, write in cameras.WRITERS.items()},
}

# Real files by reader, in the data folder.
REAL = {
    "motionbert": ("native/motionbert/boxing_X3D.npy", "native/motionbert/broken_X3D.npy"),
    "json2d": ("native/motionbert/boxing_alphapose-results.json",),
    "videopose3d": ("native/mhformer/skating/output_3D/output_keypoints_3d.npz",),
    "vis2d": ("native/mhformer/skating/input_2D/keypoints.npz",),
    "video": ("video/walk_crop.mp4",),
    "rectifier": ("models/pose_landmark_lite.onnx",),
}


def names() -> list[str]:
    return [*sorted({golden.adapter for golden in CATALOGUE}), *OTHERS]


def write_seeds(reader: str, folder: Path) -> None:
    """Every seed of a reader, in a folder each."""
    goldens = [golden for golden in CATALOGUE if golden.adapter == reader]
    for i, golden in enumerate(goldens):
        _seed(folder / str(i), golden.write(Person(), _made(folder / str(i))), golden.options)
    if reader in OTHERS:
        _seed(folder / "0", OTHERS[reader].write(_made(folder / "0")), {})
    data = Path(os.environ.get("PCNET3D_DATA", "nowhere"))
    for name in REAL.get(reader, ()):
        if (data / name).is_file() and (data / name).stat().st_size < _LARGEST:
            place = _made(folder / f"real-{Path(name).stem}")
            shutil.copyfile(data / name, place / Path(name).name)
            _seed(place, place / Path(name).name, {})


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True)
    return folder


def _seed(folder: Path, path: Path, options: dict[str, Any]) -> None:
    said = {"path": path.relative_to(folder).as_posix(), "options": options}
    (folder / "seed.json").write_text(json.dumps(said), encoding="utf-8")


def seeds(reader: str, corpus: Path) -> list[Seed]:
    found = []
    for folder in sorted(folder for folder in corpus.iterdir() if folder.is_dir()):
        said = json.loads((folder / "seed.json").read_text(encoding="utf-8"))
        found.append(Seed(reader, folder, said["path"], said["options"]))
    return found


def damage(reader: str, corpus: Path, number: int, place: Path) -> tuple[Seed, Path]:
    """The seed of that number with one of its files damaged, in the folder `place`; and which file that is."""
    rng = Random(f"{reader} {number}")
    seed = rng.choice(seeds(reader, corpus))
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(seed.folder, place)
    path = place / seed.name
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    file = rng.choice(files[:1] + files)
    file.write_bytes(mutated(file.read_bytes(), file.suffix, rng))
    return replace(seed, folder=place), file


def read(file: tuple[Seed, int]) -> object:
    """A seed, damaged or not, and its number."""
    seed, number = file
    if seed.reader in OTHERS:
        return OTHERS[seed.reader].read(seed.path)
    return read_as_adapter(seed.reader, seed.path, seed.options, Random(number))
