"""How a lifter in training does on whole takes of people whom it never saw, every person with one weight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.core.rotations import rotate, transpose
from .....pipeline.reading.mocap.clip import Clip
from ....common.metrics import joint_error, procrustes_error, scaled
from ....lifter.features import ASSUMED_FOCAL, features
from ...evaluation.people import by_person
from ...evaluation.testbed import MIN_FRAMES, see
from ...mocap.clips import lying
from ...synthetic.bodies import STANDARD_SIZE_M, size_m
from ...synthetic.cameras import TYPICAL, WILD, ViewRange
from ...synthetic.keypoint_noise import EXACT_KEYPOINTS, Noise

_SEED = 1


class Condition(NamedTuple):
    """What the lifter is told and before what cameras. noise: of the detector, None as usual."""

    views: ViewRange
    noise: Noise | None = None
    focal_known: bool = False
    up_known: bool = False


CONDITIONS = {
    "wild": Condition(WILD),
    "typical": Condition(TYPICAL),
    "wild_up": Condition(WILD, up_known=True),
    "exact": Condition(WILD, EXACT_KEYPOINTS, focal_known=True),
}
SCORED = ("wild", "typical", "wild_up")  # those whose mean chooses


@dataclass(frozen=True, eq=False)
class Take:
    """One take before one camera. x: (1, T, CHANNELS) features. joints: (T, 17, 3) the answer, relative to the pelvis
    in the ray frame, metres of a standard body. upright: (T,) those that are judged."""

    person: str
    x: Tensor
    joints: np.ndarray
    upright: np.ndarray


def whole_takes(clips: Sequence[Clip]) -> dict[str, list[Take]]:
    """The clips of MIN_FRAMES frames or more in which somebody is upright, by condition; the same for every run.
    InputError where there is none."""
    judged = [clip for clip in clips if len(clip) >= MIN_FRAMES and not lying(clip.joints).all()]
    if not judged:
        raise InputError(
            "nothing-usable",
            f"Expected a clip to validate on of {MIN_FRAMES} frames or more in which somebody is upright, but there is "
            "none; add one to the split's val.",
        )
    return {name: [_take(clip, each) for clip in judged] for name, each in CONDITIONS.items()}


def _take(clip: Clip, condition: Condition) -> Take:
    seen = see(clip, _SEED, noise=condition.noise, views=condition.views)
    size = np.asarray(seen.image_size, dtype=float)
    focal = seen.focal_px if condition.focal_known else ASSUMED_FOCAL * size.max()
    up = np.tile(seen.up, (len(clip), 1)) if condition.up_known else None
    x, R_camera_from_ray = features(
        seen.keypoints.joints.astype(float), seen.keypoints.confidence, size, np.asarray(focal), up
    )
    truth = rotate(transpose(R_camera_from_ray), seen.truth) * (STANDARD_SIZE_M / size_m(seen.truth))
    there = x[:, 3 * 17 : 4 * 17].any(axis=-1)
    return Take(clip.subject, torch.from_numpy(x)[None], truth, ~seen.lying & there)


@torch.no_grad()
def judged(net: torch.nn.Module, takes: dict[str, list[Take]], device: torch.device) -> dict[str, float]:
    """MPJPE in mm of a standard body, the scale aligned in every frame, of every condition: means over the frames of a
    take, over a person's takes, over people; the mean of SCORED as the "score"; PA-MPJPE in wild views; and how large
    errors are against the stated deviations (root mean square; 1 is right)."""
    figures: dict[str, float] = {}
    for name, each in takes.items():
        people = by_person((take.person, _errors(net, take, device)) for take in each if take.upright.any())
        figures[name], pa, ratio = np.mean([*people.values()], axis=0)
        if name == "wild":
            figures |= {"pa": pa, "error_over_sd": ratio**0.5}
    return {name: float(value) for name, value in figures.items()} | {
        "score": float(np.mean([figures[name] for name in SCORED]))
    }


def _errors(net: torch.nn.Module, take: Take, device: torch.device) -> np.ndarray:
    """(3,) of a take's upright frames: MPJPE and PA-MPJPE in mm, and the mean square of errors over deviations."""
    joints, sd, _ = (
        part[0].float().cpu().numpy().astype(np.float64)[take.upright] for part in net(take.x.to(device))
    )
    truth = take.joints[take.upright]
    square = ((joints - truth) / np.concatenate([sd[..., :1], sd[..., :1], sd[..., 1:]], axis=-1))[:, 1:] ** 2
    mpjpe = 1000 * joint_error(scaled(joints, truth), truth).mean()
    return np.array([mpjpe, 1000 * procrustes_error(joints, truth).mean(), square.mean()])
