"""What 3DPCNet is trained and judged on: bodies seen from somewhere, in CAMERA axes, one frame at a time.

Two sources: motion capture turned to a random view, with other proportions, limbs swung, joints missing or flipped in
depth; and lifted takes of the test bed, made by lifters that never saw the person.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ..pipeline.arrays import load_all
from ..pipeline.canonical import R_world_from_body
from ..pipeline.errors import InputError
from ..pipeline.frames import CAMERA, PC_CAMERA
from ..pipeline.layouts import H36M17
from ..pipeline.rotations import known, rotate, transpose, unit
from .bodies import BodyRange, combine, vary
from .metrics import relative
from .mocap import Clip

View = Literal["paper", "wide"]
# What R leads to: "body", gravity and the body's own heading (design.md section 4), or "axes", the data set's own fixed
# axes, as in the paper; these make sense where everybody was recorded facing -x.
Targets = Literal["body", "axes"]

_CAMERA_FROM_SOURCE = CAMERA.basis @ PC_CAMERA.basis.T  # the paper's axes: x away, y left, z up
_LIMBS = {f"{side}_{part}": side for side in "lr" for part in ("hip", "shoulder")}
_BELOW = {"hip": ("knee", "ankle"), "shoulder": ("elbow", "wrist")}
_UPPER = ("thorax", "nose", "head", *(f"{s}_{p}" for s in "lr" for p in ("shoulder", "elbow", "wrist")))
_FLIPPED = {
    f"{side}_{joint}": [f"{side}_{part}" for part in below]
    for side in "lr"
    for joint, below in {
        "hip": ("knee", "ankle"), "knee": ("ankle",), "shoulder": ("elbow", "wrist"), "elbow": ("wrist",),
    }.items()
}  # fmt: skip


@dataclass(frozen=True)
class Mixture:
    """Shares of a batch, and how far its bodies and joints are from the capture.

    lifted: share of lifted frames (of the files given to the training). wide: share of the others that is seen
    from `wide` views. combined: share of the others with the upper body of another frame. swung: share with limbs
    and trunk turned further. definitions_m: how far spine, thorax, nose and head move in the sagittal plane, standard
    deviation; estimators put them differently (formats.md section 1). noisy: share with Gaussian noise of up to
    noise_m, twice that in depth. missing: share with missing joints. flipped: share with a limb's depth turned over.
    roll_deg: the camera's roll added to lifted frames, uniform.
    """

    lifted: float
    wide: float
    combined: float
    swung: float
    definitions_m: float
    noisy: float
    noise_m: float
    missing: float
    flipped: float
    roll_deg: float
    unchanged: float
    hips: tuple[float, float] = BodyRange.hips
    shoulders: tuple[float, float] = BodyRange.shoulders

    def __post_init__(self) -> None:
        shares = ("lifted", "wide", "combined", "swung", "noisy", "missing", "flipped", "unchanged")
        if wrong := [name for name in shares if not 0 <= getattr(self, name) <= 1]:
            raise InputError(f"expected a share between 0 and 1 for {', '.join(wrong)}")

    @property
    def bodies(self) -> BodyRange:
        return BodyRange(unchanged=self.unchanged, hips=self.hips, shoulders=self.shoulders)


class Frames(NamedTuple):
    """joints, truth: (B, 17, 3) float32 CAMERA axes, relative to the pelvis; what the network gets (zeros where
    missing), and the same without what spoilt it. valid: (B, 17) float32, 1 or 0. R: (B, 3, 3) R_camera_from_body."""

    joints: np.ndarray
    valid: np.ndarray
    truth: np.ndarray
    R: np.ndarray


def paper_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of the published mixture (formats.md section 9, sampling)."""
    kind = rng.choice(3, size=count, p=(0.75, 0.15, 0.10))
    normal = rng.standard_normal((3, count))
    side = rng.choice((-90.0, 90.0), size=count)
    yaw = np.choose(kind, [rng.uniform(-70, 70, count), side + 10 * normal[0], 180 + 20 * normal[0]])
    # The back views' pitch and roll are not given there; they are drawn like the front's.
    pitch = np.choose(
        kind, [_clamp(12 * normal[1], 20), _clamp(8 * normal[1], 15), _clamp(12 * normal[1], 20)]
    )
    roll = np.choose(kind, [_clamp(4 * normal[2], 8), _clamp(3 * normal[2], 6), _clamp(4 * normal[2], 8)])
    return roll, pitch, yaw


def wide_angles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw (count,) in degrees of a camera that is really pitched and rolled (design.md section 4)."""
    return rng.uniform(-20, 20, count), rng.uniform(-60, 60, count), rng.uniform(-180, 180, count)


def views(view: View, rng: np.random.Generator, count: int) -> np.ndarray:
    """R_camera_from_body (count, 3, 3) of random views: "paper" = Rz(yaw) Ry(pitch) Rx(roll) and "wide" =
    Rx(roll) Ry(pitch) Rz(yaw), in the paper's axes."""
    roll, pitch, yaw = paper_angles(rng, count) if view == "paper" else wide_angles(rng, count)
    x, y, z = _about(0, roll), _about(1, pitch), _about(2, yaw)
    return _CAMERA_FROM_SOURCE @ (z @ y @ x if view == "paper" else x @ y @ z)


def seen(
    joints_world: np.ndarray, R_camera_from_body: np.ndarray, targets: Targets = "body"
) -> tuple[np.ndarray, np.ndarray]:
    """joints (B, 17, 3), +Z up, turned so that their R_camera_from_body is the one given -> (B, 17, 3) relative to
    the pelvis, and (B,) whether the frame has a heading at all. With targets "axes" the world's axes are the body's."""
    R = R_camera_from_body
    if targets == "body":
        R = R @ transpose(R_world_from_body(joints_world))
    return rotate(R, relative(joints_world.astype(np.float64))), np.asarray(known(R).all(axis=-1))


class Views:
    """Random training batches; the same generator gives the same batches."""

    def __init__(
        self, clips: Sequence[Clip], mixture: Mixture, lifted: Sequence[Path] = (), targets: Targets = "body"
    ) -> None:
        """lifted: files of `pcnet3d testbed`. InputError when the mixture wants lifted frames and there are none."""
        self.joints = np.concatenate([clip.joints for clip in clips])
        self.mixture = mixture
        self.targets: Targets = targets
        # A body mirrored in x = 0 faces the other way, which only its own heading follows.
        self.bodies = mixture.bodies if targets == "body" else replace(mixture.bodies, mirrored=0.0)
        self.lifted = read_lifted(lifted) if lifted else None
        if mixture.lifted and self.lifted is None:
            raise InputError(
                "Expected files of lifted takes, for the mixture wants them; make some with pcnet3d testbed."
            )

    def batch(self, rng: np.random.Generator, count: int) -> Frames:
        """`count` frames, a little less where a frame has no heading."""
        lifted = round(count * self.mixture.lifted)
        parts = [self._captured(rng, count - lifted)] if count > lifted else []
        if lifted and self.lifted is not None:
            parts.append(self._lifted(rng, lifted, self.lifted))
        joints, truth, R = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        valid = _valid(rng, len(joints), self.mixture.missing)
        valid &= known(joints)
        joints = np.where(valid[..., None], joints, 0)
        return Frames(*(a.astype(np.float32) for a in (joints, valid, truth, R)))

    def _captured(self, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        mixture = self.mixture
        motion = self._motion(rng, count)
        mixed = round(mixture.combined * count)
        if mixed:
            motion[:mixed] = combine(motion[:mixed], self._motion(rng, mixed))
        world = vary(motion, rng, self.bodies)[:, 0]
        if mixture.swung:
            world = swing(world, rng, mixture.swung)
        wide = rng.uniform(size=count) < mixture.wide
        R = np.where(wide[:, None, None], views("wide", rng, count), views("paper", rng, count))
        truth, fine = seen(world, R, self.targets)
        truth, R = truth[fine], R[fine]
        if mixture.definitions_m:
            truth = redefined(truth, rng, mixture.definitions_m)
        joints = _flipped(truth, rng, mixture.flipped) if mixture.flipped else truth
        if mixture.noisy:
            joints = _noisy(joints, rng, mixture.noisy, mixture.noise_m)
        return joints, truth, R

    def _motion(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """(count, 1, 17, 3) captured frames, drawn at random."""
        return self.joints[rng.integers(len(self.joints), size=count)][:, None]

    def _lifted(
        self, rng: np.random.Generator, count: int, takes: Lifted
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        row = rng.integers(len(takes.joints), size=count)
        joints, truth, R = takes.joints[row], takes.truth[row], takes.R[row]
        across, body = np.array([-1, 1, 1], dtype=np.float32), np.array([1, -1, 1], dtype=np.float32)
        mirrored = (rng.uniform(size=count) < 0.5)[:, None, None]
        joints, truth = (np.where(mirrored, x[:, H36M17.mirror] * across, x) for x in (joints, truth))
        R = np.where(mirrored, R * across[:, None] * body, R)
        roll = _about(2, rng.uniform(-self.mixture.roll_deg, self.mixture.roll_deg, count))
        return rotate(roll, joints), rotate(roll, truth), roll @ R


class Lifted(NamedTuple):
    """Lifted frames: joints and truth (N, 17, 3), CAMERA axes relative to the pelvis, the truth at the lift's scale;
    R (N, 3, 3) R_camera_from_body; lying (N,), of mocap.lying; clips, the takes' names."""

    joints: np.ndarray
    truth: np.ndarray
    R: np.ndarray
    lying: np.ndarray
    clips: tuple[str, ...]


def read_lifted(paths: Iterable[Path]) -> Lifted:
    """The frames of `pcnet3d testbed` files that were lifted and have a truth. InputError for anything else."""
    joints, truth, R, lying, clips = [], [], [], [], []
    for path in paths:
        try:
            held = load_all(path, "lifted", "truth", "R_camera_from_body", "lying", "clip")
        except InputError as error:
            raise InputError(f"Expected a file of pcnet3d testbed: {error}") from None
        one = [held[name].astype(np.float32) for name in ("lifted", "truth", "R_camera_from_body")]
        lies = held["lying"].astype(bool)
        rows = len(lies)
        if [a.shape for a in one] != [(rows, 17, 3)] * 2 + [(rows, 3, 3)] or held["clip"].ndim != 1:
            raise InputError(f"Expected a file of pcnet3d testbed at {path}, got arrays of other shapes.")
        clips.extend(str(name) for name in held["clip"])
        fine = known(one[0]).all(-1) & known(one[2]).all(-1)
        a, b, rotation = (array[fine] for array in one)
        scale = (a * b).sum((-2, -1)) / np.maximum((b * b).sum((-2, -1)), 1e-9)
        joints.append(a)
        truth.append(b * scale[:, None, None])
        R.append(rotation)
        lying.append(lies[fine])
    return Lifted(*map(np.concatenate, (joints, truth, R, lying)), clips=tuple(clips))  # type: ignore[call-arg]


def refuse_shared_subjects(train: Iterable[str], other: Iterable[str], what: str) -> None:
    """InputError when a clip of `train` and one of `other` are of one subject (a clip's name up to the first "_")."""
    shared = {name.partition("_")[0] for name in train} & {name.partition("_")[0] for name in other}
    if shared:
        raise InputError(
            f"Expected other subjects to train on than {what}, but both have {', '.join(sorted(shared))}."
        )


def swing(joints_world: np.ndarray, rng: np.random.Generator, share: float) -> np.ndarray:
    """joints (B, 17, 3), +Z up, with a share of the bodies leaning further and swinging whole limbs further.

    The upper body turns about the spine by about 10 degrees, arms about the shoulders by 20, legs about the hips
    by 10; knees and elbows keep their angles, so no joint bends the wrong way.
    """
    out = joints_world.copy()
    use = (rng.uniform(size=len(out)) < share)[:, None]

    def turn(about: str, moved: Iterable[str], std_deg: float) -> None:
        R = _from_vector(np.radians(std_deg) * _clamp(rng.standard_normal((len(out), 3)), 2) * use)
        centre, rows = out[:, [H36M17.index(about)]], H36M17.indices(list(moved))
        out[:, rows] = centre + rotate(R, out[:, rows] - centre)

    turn("spine", _UPPER, 10)
    for joint, side in _LIMBS.items():
        part = joint[2:]
        turn(joint, [f"{side}_{below}" for below in _BELOW[part]], {"hip": 10, "shoulder": 20}[part])
    return out.astype(joints_world.dtype)


def redefined(joints: np.ndarray, rng: np.random.Generator, std_m: float) -> np.ndarray:
    """joints (B, 17, 3) with spine, thorax, nose and head moved in the body's sagittal plane."""
    left = joints[:, H36M17.index("l_shoulder")] - joints[:, H36M17.index("r_shoulder")]
    trunk = unit(joints[:, H36M17.index("thorax")])
    front = unit(np.cross(left, trunk))
    plane = np.nan_to_num(np.stack([front, trunk], axis=-2))
    rows = H36M17.indices(("spine", "thorax", "nose", "head"))
    amounts = std_m * _clamp(rng.standard_normal((len(joints), len(rows), 2)), 2)
    out = joints.copy()
    out[:, rows] += amounts @ plane
    return out


def _valid(rng: np.random.Generator, count: int, share: float) -> np.ndarray:
    """(count, 17) with one to six joints missing in a share of the frames, never the pelvis."""
    some = rng.uniform(size=(count, 1)) < share
    missing = rng.uniform(size=(count, len(H36M17))) < rng.uniform(0.05, 0.35, (count, 1))
    missing[:, H36M17.index("pelvis")] = False
    return ~(some & missing)


def _flipped(joints: np.ndarray, rng: np.random.Generator, share: float) -> np.ndarray:
    """A share of the bodies with limb bones turned over in depth, as lifters do to what the picture cannot tell."""
    out = joints.copy()
    some = rng.uniform(size=len(out)) < share
    for joint, below in _FLIPPED.items():
        use = some & (rng.uniform(size=len(out)) < 0.2)
        at, rows = H36M17.index(joint), H36M17.indices(below)
        change = -2 * (out[:, rows[0], 2] - out[:, at, 2]) * use
        out[:, rows, 2] += change[:, None]
    return out


def _noisy(joints: np.ndarray, rng: np.random.Generator, share: float, most_m: float) -> np.ndarray:
    std = rng.uniform(0, most_m, (len(joints), 1, 1)) * (rng.uniform(size=(len(joints), 1, 1)) < share)
    return relative(joints + std * rng.standard_normal(joints.shape) * np.array([1, 1, 2]))


def _about(axis: int, angle_deg: np.ndarray) -> np.ndarray:
    """(B, 3, 3) rotations about a coordinate axis."""
    angle = np.radians(angle_deg)
    R = np.tile(np.eye(3), (len(angle), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[:, i, i] = R[:, j, j] = np.cos(angle)
    R[:, j, i] = np.sin(angle)
    R[:, i, j] = -R[:, j, i]
    return R


def _from_vector(vectors: np.ndarray) -> np.ndarray:
    """Rotation vectors (B, 3), radians -> (B, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vectors).as_matrix()


def _clamp(values: np.ndarray, most: float) -> np.ndarray:
    return np.clip(values, -most, most)
