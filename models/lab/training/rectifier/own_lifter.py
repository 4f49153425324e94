"""A rectifier for a lifter of your own:  pcnet3d lab train ANSWERS --truth TRUTH -o DIR

From a folder of the lifter's answers, and one with the truth of the same takes, to a network that goes on from the
shipped rectifier, and a page that compares both on people whom neither has seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .....pipeline.core.canonical import R_world_from_body
from .....pipeline.core.errors import InputError
from .....pipeline.core.rotations import geodesic_deg, is_finite, kabsch, rotate
from .....pipeline.files.arrays import load, write_arrays
from .....pipeline.files.atomic import refuse_unwritable, write_json, write_text
from .....pipeline.plugins.protocols import Rectifier
from .....pipeline.reading.mocap import joints as joint_files
from .....pipeline.reading.mocap.clip import Clip, write_mocap
from .....pipeline.reading.mocap.common import How
from .....pipeline.running.recipe import load_toml
from ....common.metrics import plain, relative
from ....rectifier.load import load_rectifier
from ....rectifier.onnx import PCNetRectifier
from ...common.toml_config import as_toml, checked
from ...evaluation.foreign import answer
from ...evaluation.people import by_person, mean, pooled
from ...evaluation.rectifiers import Take, judge
from ...evaluation.tables import Page, Table, written
from ...mocap.clips import lying, subject_of
from ...mocap.convert import resampled
from ...mocap.split import read_parts
from .train import TrainConfig, train

STEPS = 500  # ten minutes of one core
_RATE = 3e-4  # a quarter of the one that the shipped network began with, which is gone on with here
_HELD_OUT = 0.2  # share of the people who choose the weights, and of those who judge them
_FPS = 30.0  # of the motion capture that is trained on
_TURNED_DEG = 60.0  # of answers to a take from its truth: other axes than a camera's are turned by 90 or 180

_PAGE = Page(
    "A rectifier for a lifter",
    "Rotation and tilt of single frames in degrees, means over people with their 90 % interval (bootstrap). "
    "{tested} of {all} people judge and {chose} chose the weights; the others were trained on, {steps} steps.",
    [
        Table("", "rectifiers/*", ["rectifier"], {"rotation": "{rotation[said]}", "tilt": "{tilt[said]}"}),
        "The new one less the shipped one, rotation: {change[said]}. {verdict}",
    ],
)


@dataclass(frozen=True, eq=False)
class Pair:
    """A take and a lifter's answer to it. clip: the truth, in world axes. lifted: (T, 17, 3) CAMERA axes, relative to
    the pelvis, NaN where there is none. R_camera_from_world: (3, 3) or (T, 3, 3), world +Z up."""

    clip: Clip
    lifted: np.ndarray
    R_camera_from_world: np.ndarray

    @property
    def truth(self) -> np.ndarray:
        """(T, 17, 3) metres, CAMERA axes, relative to the pelvis."""
        return rotate(self.R_camera_from_world, relative(self.clip.joints.astype(np.float64)))

    @property
    def R_camera_from_body(self) -> np.ndarray:
        return self.R_camera_from_world @ R_world_from_body(self.clip.joints)

    @property
    def take(self) -> Take:
        """Its frames with an answer and a heading."""
        R, lies = self.R_camera_from_body, lying(self.clip.joints)
        fine = np.asarray(is_finite(self.lifted).all(-1) & is_finite(R).all(-1))
        return Take(self.lifted, self.truth, R, lies).some(fine)


def train_own_lifter(
    answers: Path,
    truth: Path,
    output: Path,
    *,
    split: Path | None = None,
    steps: int = STEPS,
    device: str = "cpu",
    minutes: float | None = None,
) -> dict[str, Any] | None:
    """Train and judge a rectifier for the lifter with these answers; -> figures of judged.md, None where `minutes`
    ended before. The network is output/NAME.onnx, NAME the answers' folder.

    answers, truth: as of read_pairs. split: a JSON file of train, val and test subjects (mocap.split); without it a
    fifth of the people each choose and judge. InputError for takes that do not fit, or fewer than three people.
    """
    pairs = read_pairs(answers, truth)
    refuse_unwritable(output)
    output.mkdir(parents=True, exist_ok=True)
    people = sorted({subject_of(pair.clip.name) for pair in pairs})
    if split is None:
        split = output / "split.json"
        write_json(split, _parts_of(people))
    write_mocap(output / "clips.npz", [resampled(pair.clip, _FPS) for pair in pairs])
    parts = read_parts(output / "clips.npz", split)
    names = {part: {clip.name for clip in clips} for part, clips in parts.clips.items()}
    of = {part: [pair for pair in pairs if pair.clip.name in named] for part, named in names.items()}
    for part in ("train", "val"):
        _write_takes(output / f"{part}.npz", of[part])
    config = _config(answers.resolve().name, output, split, of["train"], steps)
    train(config, as_toml(config), output, device, minutes)
    network = output / f"{config.name}.onnx"
    if not network.exists():
        return None
    shipped, own = load_rectifier("pcnet"), PCNetRectifier(network)
    figures = judged(of["test"], shipped, own)
    chose = len({subject_of(pair.clip.name) for pair in of["val"]})
    figures |= {"name": config.name, "steps": steps, "all": len(people), "chose": chose}
    write_text(output / "judged.md", written(figures, _PAGE))
    write_json(output / "judged.json", plain(figures))
    return figures


def read_pairs(answers: Path, truth: Path) -> list[Pair]:
    """Of each truth/NAME.npz with an answers/NAME.npy or .npz.

    An answer has (frames, 17, 3) joints, H36M17 in CAMERA axes, in any unit. The truth has `joints` (frames, J, 3) in
    metres, z up, as `pcnet3d lab mocap` reads them, `fps`, and `R_camera_from_world` (3, 3) or (frames, 3, 3). The
    person is the file's name up to the first "_". InputError for anything else, and for answers in other axes.
    """
    for folder in (answers, truth):
        if not folder.is_dir():
            raise InputError("cannot-open", f"Expected a folder at {folder}, found none.")
    files = {path.stem: path for path in sorted(answers.glob("*.np[yz]"))}
    known = {path.stem: path for path in sorted(truth.glob("*.npz"))}
    both = sorted(set(files) & set(known))
    if not both:
        raise InputError(
            "nothing-usable",
            f"Expected answers NAME.npy or NAME.npz in {answers} and the truth NAME.npz in {truth}; none is in both.",
        )
    pairs = [_pair(files[name], known[name], truth) for name in both]
    turned = float(np.median([_turned_deg(pair) for pair in pairs]))
    if turned > _TURNED_DEG:
        raise InputError(
            "wrong-axes",
            f"Expected answers in the camera's axes (x right, y down, z away), but those in {answers} are turned by "
            f"{turned:.0f} degrees from the truth; turn them, or check R_camera_from_world.",
        )
    return pairs


def judged(pairs: Sequence[Pair], shipped: Rectifier, own: Rectifier) -> dict[str, Any]:
    """{"rectifiers": {method: {figure: {"mean", "low", "high", "said"}}}, "change": of the rotation, "tested": people,
    "verdict"}."""
    values, people = {}, sorted({subject_of(pair.clip.name) for pair in pairs})
    for rectifier in (shipped, own):
        rows = []
        for pair in pairs:
            found = judge(rectifier, [pair.take])
            rows.append((subject_of(pair.clip.name), np.array([mean(found.rotation), mean(found.tilt)])))
        of = by_person(rows)
        values[rectifier.method] = np.array([of[person] for person in people])
    before, after = values.values()
    change = pooled((after - before)[:, 0], people)
    word = "better" if change["mean"] < 0 else "worse"
    sure = max(change["low"], change["high"]) < 0 or min(change["low"], change["high"]) > 0
    return {
        "rectifiers": {
            method: {name: pooled(of[:, i], people) for i, name in enumerate(("rotation", "tilt"))}
            for method, of in values.items()
        },
        "change": change,
        "tested": len(before),
        "verdict": f"It is {word} for these people."
        if sure
        else "So few people do not tell which is better; bring more, or keep the shipped one.",
    }  # fmt: skip


def _pair(answered: Path, known: Path, folder: Path) -> Pair:
    clip = joint_files.read(known, folder, How()).clip
    R = load(known, (3, 3), (len(clip), 3, 3), key="R_camera_from_world").astype(np.float64)
    if not np.allclose(R @ np.swapaxes(R, -1, -2), np.eye(3), atol=1e-3) or (np.linalg.det(R) < 0).any():
        raise InputError(
            "wrong-content", f"Expected rotations as R_camera_from_world in {known}, got other matrices."
        )
    return Pair(clip, relative(answer(answered, len(clip)).joints.astype(np.float64)), R)


def _turned_deg(pair: Pair) -> float:
    """Between all joints of the answer and of the truth."""
    take = pair.take
    if not len(take.R):
        raise InputError("nothing-usable", f"Expected joints in the answer to {pair.clip.name}; it has none.")
    R = kabsch(take.joints.reshape(-1, 3), take.truth.reshape(-1, 3))
    return float(geodesic_deg(R, np.eye(3)))


def _parts_of(people: Sequence[str]) -> dict[str, list[str]]:
    if len(people) < 3:
        raise InputError(
            "nothing-usable",
            f"Expected takes of three people or more, to train on, to choose by and to judge by; got {len(people)} "
            f"({', '.join(people)}), by the files' names up to the first '_'.",
        )
    drawn = np.random.default_rng(0).permutation(people).tolist()
    held = max(1, round(_HELD_OUT * len(people)))
    return {"val": drawn[:held], "test": drawn[held : 2 * held], "train": drawn[2 * held :]}


def _write_takes(path: Path, pairs: Sequence[Pair]) -> None:
    """As common.testbed_file reads them."""
    write_arrays(
        path,
        lifted=np.concatenate([pair.lifted for pair in pairs]).astype(np.float32),
        truth=np.concatenate([pair.truth for pair in pairs]).astype(np.float32),
        R_camera_from_body=np.concatenate([pair.R_camera_from_body for pair in pairs]),
        lying=np.concatenate([lying(pair.clip.joints) for pair in pairs]),
        take_start=np.cumsum([0, *(len(pair.clip) for pair in pairs)]),
        clip=np.array([pair.clip.name for pair in pairs]),
    )


def _config(name: str, output: Path, split: Path, trained: Sequence[Pair], steps: int) -> TrainConfig:
    """The shipped rectifier's, to go on with these takes."""
    source = Path(__file__).with_name("pcnet.toml")
    content = load_toml(source, "a training config")
    # Where nobody lies there is nothing to draw more often.
    if not any(lying(pair.clip.joints).any() for pair in trained):
        content["mixture"]["lying"] = 0.0
    every = min(content["schedule"].get("every", 250), max(steps // 4, 1))
    content["schedule"] |= {"steps": steps, "rate": _RATE, "warmup": min(50, steps), "every": every}
    content |= {
        "name": name, "start": "pcnet", "data": output / "clips.npz", "split": split,
        "lifted": [output / "train.npz"], "lifted_val": [output / "val.npz"],
    }  # fmt: skip
    return checked(content, TrainConfig, str(source))
