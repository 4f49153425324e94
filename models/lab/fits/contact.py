"""Learn when feet are on the floor, a step of refit.

Of CMU's and ACCAD's train subjects: takes as captured, and as the shipped lifter sees them before either bed's cameras.
That lifter was trained on these people and lifts them a sixth better than others. The shipped contact.json was learned
from their straight walks in slower, shorter and limping styles too, which are not made any more. It needs PCNET3D_DATA
and the extra `train`; with OMP_NUM_THREADS=1 one machine makes the same file every time.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.lifted import ToLift
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.files.atomic import write_text
from ...angle_error.take_angles import smoothed
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ...gait.contact import ContactNet, windows
from ...lifter.builtin import lifted
from ..evaluation.testbed import BEDS, MIN_FRAMES, Bed, joints_of, see
from ..mocap.clips import Clip, data_set, read_clips
from ..mocap.contact import true_contact

_TILT_DEG = 4.0  # of up about each horizontal axis, as a take's one gravity is off
_SEED = 0
_HIDDEN = 64
_EPOCHS, _BATCH, _RATE, _DECAY = 8, 1024, 3e-3, 0.1
_JITTER = 0.08  # standard deviations of a feature, drawn anew in every batch; others are lifted less well
_MOVES = 3.0  # weight of frames in which a foot lands or leaves soon, or has just done so
_SOON_S = 0.4
_RUNS = 4.0  # weight of frames of runs, which are one in 25
_RUN_MPS = 1.9  # of the pelvis over the floor, mean of 0.5 s: faster than people walk
_RUN_S = 0.5


def examples(clips: Iterable[Clip], seed: int, bed: Bed) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features (N, F), contact (N,) 0 or 1, weight (N,): of both feet of every take, lifted with an up that is a
    little off, and as it was captured."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for clip in clips:
        seen = see(clip, seed, views=BEDS[bed])
        lift = joints_of(lifted(ToLift(seen.keypoints, seen.image_size)).poses, seen.truth)
        time_s = seen.time_s
        spells = true_contact(clip.joints, time_s)
        runs = np.where(floor_speed(clip.joints, clip.fps) > _RUN_MPS, _RUNS, 1.0)
        off = Rotation.from_rotvec([*rng.normal(0, np.radians(_TILT_DEG), 2), 0.0]).as_matrix()
        captured = relative(clip.joints.astype(np.float64))
        for level in (rotate(off @ seen.R_camera_from_world.T, lift), captured):
            body = in_body(level, time_s)
            for side in "rl":
                events = spells[side][np.isfinite(spells[side])]
                apart = np.abs(time_s[:, None] - events).min(axis=1, initial=np.inf)
                weight = runs * np.where(apart < _SOON_S, _MOVES, 1.0)
                # NaN are the ends of the take.
                start, stop = np.where(np.isnan(spells[side]), (-np.inf, np.inf), spells[side]).T
                contact = ((time_s[:, None] >= start) & (time_s[:, None] <= stop)).any(axis=1)
                for rows, features in windows(body, time_s, side):
                    parts.append((features.astype(np.float32), contact[rows], weight[rows]))
    features, contact, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
    return features, contact.astype(np.float64), weight


def floor_speed(joints: np.ndarray, fps: float) -> np.ndarray:
    """(T,) m/s at which the pelvis goes over the floor, mean of the half second around; joints (T, 17, 3) metres, +Z
    up."""
    root = joints[:, H36M17.index("pelvis"), :2]
    speed = np.linalg.norm(np.gradient(root, axis=0), axis=-1) * fps
    window = np.ones(max(1, round(_RUN_S * fps)))
    return np.convolve(speed, window, "same") / np.convolve(np.ones(len(speed)), window, "same")


def in_body(level: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, 17, 3) low-passed joints in BODY axes, by the definition of those; level: (T, 17, 3) with +Z up."""
    smooth = smoothed(level, time_s)
    return rotate(transpose(R_world_from_body(smooth)), smooth)


def trained(features: np.ndarray, contact: np.ndarray, weight: np.ndarray) -> ContactNet:
    """The network that says best which of the frames are contacts. features (N, F), contact (N,) 0 or 1, weight (N,) in
    the cross-entropy."""
    torch.manual_seed(_SEED)
    centre, scale = features.mean(axis=0), features.std(axis=0) + 1e-6
    x = torch.tensor((features - centre) / scale, dtype=torch.float32)
    y, w = (torch.tensor(values, dtype=torch.float32) for values in (contact, weight / weight.mean()))
    net = torch.nn.Sequential(
        torch.nn.Linear(x.shape[1], _HIDDEN), torch.nn.Tanh(), torch.nn.Linear(_HIDDEN, 1)
    )
    batches = len(x) // _BATCH
    optimiser = torch.optim.AdamW(net.parameters(), lr=_RATE, weight_decay=_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, _EPOCHS * batches)
    for _ in range(_EPOCHS):
        for rows in torch.randperm(len(x))[: batches * _BATCH].reshape(batches, _BATCH):
            said = net(x[rows] + _JITTER * torch.randn(_BATCH, x.shape[1]))[:, 0]
            loss = torch.nn.functional.binary_cross_entropy_with_logits(said, y[rows], w[rows])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    hidden, hidden_bias, out, out_bias = (
        part.detach().numpy().astype(np.float64) for part in net.parameters()
    )
    return ContactNet(centre, scale, hidden.T, hidden_bias, out[0], float(out_bias[0]))


def learn(output: Path) -> None:
    """Write the network that was learned."""
    clips = [clip for clip in read_clips("train") if data_set(clip) != "tennis" and len(clip) >= MIN_FRAMES]
    parts = [examples(clips, i, bed) for i, bed in enumerate(BEDS)]
    features, contact, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
    net = trained(features, contact, weight)
    content = {
        "made_by": "pcnet3d lab refit",
        "learned_on": f"{len(features):,} frames of feet of CMU and ACCAD train subjects, lifted and as captured",
        "seed": _SEED,
        "joints": f"{H36M17.name}, see contact.windows",
        **{name: np.round(value, 5).tolist() for name, value in vars(net).items()},
    }
    write_text(output, json.dumps(content) + "\n")
