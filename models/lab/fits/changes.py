"""Learn what accidents do to keypoints:  python -m pcnet3d.models.lab.fits.changes

On motion capture of train subjects before virtual cameras and detectors of different noise, bodies of other proportions
and some that lie among them, whose keypoints are changed as users change them by accident. Some changes come together,
for one must not hide another. It needs PCNET3D_DATA and the extra `train`. 20 minutes to an hour of one core.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ....pipeline.core.extras import needed_for
from ....pipeline.core.rotations import is_finite
from ....pipeline.files.atomic import whole_file
from ....pipeline.reading.mocap.clip import Clip
from ...lifter import CHANGES
from ...lifter.changes import CHANNELS, LIMBS, RATES, ROWS, WIDTHS, ZOOMS, features, held
from ..common.modules import run_command
from ..evaluation.finished import at_rate
from ..evaluation.testbed import BEDS, lay_down, see
from ..mocap.clips import read_clips
from ..synthetic.bodies import BodyRange
from ..synthetic.keypoint_noise import EXACT_KEYPOINTS, GOOD

_NOISES = (None, GOOD, replace(GOOD, std=0.006), replace(EXACT_KEYPOINTS, std=0.003))
_LEAST = 40  # frames of a clip
_LAID = 2  # of so many passes over the clips the last one's bodies lie
_SLOW = 3  # of so many takes one is captured in slow motion, at rates down to
_SLOWEST = -2.1
# Shares of windows that are changed, and how far: a little beyond the outermost classes.
_FASTER, _WIDER, _ZOOMED = (0.3, 1.1), (0.4, 0.55), (0.25, 0.0225)
_BACKWARDS, _EXCHANGED, _BRIEF = 0.3, 0.1, 0.5
_BRIEFEST = 20  # rows
_BATCH, _RATE, _DECAY, _WARM = 96, 2e-3, 0.02, 100
_WIDTH, _HIDDEN = 64, 128

# Points (T, 13, 2) from the image's middle, held, whether they are seen, and the logarithm of their rate.
Take = tuple[np.ndarray, np.ndarray, float]


def takes(passes: int, seed: int) -> Iterator[Take]:
    """Every clip of the train subjects, seen so many times."""
    clips = [clip for clip in read_clips("train") if len(clip) >= _LEAST]
    beds = tuple(BEDS.values())
    for number in range(passes):
        for i, clip in enumerate(clips):
            rng = np.random.default_rng([seed, number, i])
            body: Clip = lay_down(clip, rng) if passes >= _LAID and number == passes - 1 else clip
            noise, bodies = _NOISES[(number // 2 + i) % len(_NOISES)], BodyRange() if number % 2 else None
            slow = rng.uniform(_SLOWEST, 0) if (number + i) % _SLOW == 0 else 0.0
            body = replace(at_rate(body, body.fps * np.exp(-slow)), fps=body.fps * np.exp(-slow))
            take = see(body, seed + number, noise=noise, bodies=bodies, views=beds[(number + i) % len(beds)])
            points = (
                take.keypoints.joints[:, take.keypoints.layout.indices(LIMBS.joints)]
                - np.array(take.image_size) / 2
            )
            seen = is_finite(points)
            yield held(points, seen).astype(np.float32), seen, slow


def changed(take: Take, rng: np.random.Generator) -> tuple[np.ndarray, tuple[int, int, int, int]]:
    """Features (ROWS, CHANNELS) of a window of it, and the classes of RATES, WIDTHS and ZOOMS and whether it is played
    backwards."""
    points, seen, slow = take
    rate, width, zoom = (
        rng.uniform(-most, most) if rng.uniform() < share else 0.0
        for share, most in (_FASTER, _WIDER, _ZOOMED)
    )
    rate = rng.uniform(slow, 0) if slow else rate
    step = np.exp(rate - slow)
    needed = int(np.ceil(ROWS * step)) + 1
    if needed < len(points):
        first = int(rng.integers(0, len(points) - needed + 1))
        points, seen = points[first : first + needed], seen[first : first + needed]
    at = np.arange(min(ROWS, int((len(points) - 1) / step) + 1)) * step
    if rng.uniform() < _BRIEF and len(at) > _BRIEFEST:
        at = at[: rng.integers(_BRIEFEST, len(at))]
    # Frames that were left out, or between which a program has interpolated.
    if not slow and rng.uniform() < 0.5:
        at = np.round(at)
    before = np.minimum(at.astype(int), len(points) - 1)
    after, share = np.minimum(before + 1, len(points) - 1), (at - before)[:, None, None]
    points, seen = (1 - share) * points[before] + share * points[after], seen[before] & seen[after]
    if backwards := rng.uniform() < _BACKWARDS:
        points, seen = points[::-1], seen[::-1]
    mirrored, exchanged = rng.uniform() < 0.5, rng.uniform() < _EXCHANGED
    if mirrored:
        points = points * (-1.0, 1.0)
    if mirrored != exchanged:
        points, seen = points[:, LIMBS.mirror], seen[:, LIMBS.mirror]
    points = points * (np.exp(width / 2), np.exp(-width / 2))
    points = points * np.exp(zoom * (np.arange(len(points)) - len(points) / 2))[:, None, None]
    classes = (
        int(np.abs(of - value).argmin()) for of, value in ((RATES, rate), (WIDTHS, width), (ZOOMS, zoom))
    )
    return features(points, seen), (*classes, int(backwards))  # type: ignore[return-value]


def network() -> Any:
    """Convolutions over time, and what their answers are on average and how they vary over the window."""
    import torch
    from torch import Tensor, nn

    class Net(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.first = nn.Conv1d(CHANNELS, _WIDTH, 7, stride=3, padding=3)
            self.convolutions = nn.ModuleList(
                nn.Conv1d(_WIDTH, _WIDTH, 3, padding=k, dilation=k) for k in (1, 2, 4)
            )
            self.norms = nn.ModuleList(nn.GroupNorm(1, _WIDTH) for _ in range(3))
            self.hidden = nn.Linear(2 * _WIDTH, _HIDDEN)
            self.out = nn.Linear(_HIDDEN, len(RATES) + len(WIDTHS) + len(ZOOMS) + 1)

        def forward(self, x: Tensor) -> tuple[Tensor, ...]:
            x = x.transpose(1, 2)
            there = x[:, -1:, ::3]
            y = torch.relu(self.first(x))
            for convolution, norm in zip(self.convolutions, self.norms, strict=True):
                y = y + torch.relu(convolution(norm(y * there)))
            rows = there.sum(dim=-1).clamp(min=1)
            mean = (y * there).sum(dim=-1) / rows
            spread = (((y * there - mean[..., None]) ** 2 * there).sum(dim=-1) / rows + 1e-6).sqrt()
            found = self.out(torch.relu(self.hidden(torch.cat([mean, spread], dim=1))))
            rate, width, zoom, backwards = found.split([len(RATES), len(WIDTHS), len(ZOOMS), 1], dim=1)
            return rate, width, zoom, backwards[:, 0]

    return Net()


def trained(of: list[Take], steps: int, seed: int) -> Any:
    """The network after so many steps, each of windows drawn from the takes by the root of their length."""
    with needed_for("Training"):
        import torch
        from torch.nn import functional

    torch.manual_seed(seed)
    rng, net = np.random.default_rng(seed), network()
    share = np.sqrt([len(points) * np.exp(slow) for points, _, slow in of])
    share /= share.sum()
    optimiser = torch.optim.AdamW(net.parameters(), lr=_RATE, weight_decay=_DECAY)
    for step in range(steps):
        for group in optimiser.param_groups:
            group["lr"] = _RATE * min(1.0, step / _WARM) * (1 - step / steps) + 1e-5
        windows = [changed(of[i], rng) for i in rng.choice(len(of), _BATCH, p=share)]
        x = torch.tensor(np.stack([each for each, _ in windows]))
        true = torch.tensor([classes for _, classes in windows])
        *said, backwards = net(x)
        loss = functional.binary_cross_entropy_with_logits(backwards, true[:, 3].float())
        loss = loss + sum(functional.cross_entropy(each, true[:, i]) for i, each in enumerate(said))
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
    return net


def export(net: Any, path: Path) -> None:
    """Write it as ONNX: "features" (N, ROWS, CHANNELS) -> logits "rate", "width", "zoom" (N, K), "backwards" (N,)."""
    import onnx
    import torch

    from ..common.onnx_file import to_onnx

    free = ({0: torch.export.Dim("batch")},)
    outputs = ("rate", "width", "zoom", "backwards")
    model = to_onnx(net, {"features": torch.zeros(2, ROWS, CHANNELS)}, free, outputs)
    with whole_file(path) as partial:
        onnx.save(model, str(partial))


def main(
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")] = CHANGES,
    passes: Annotated[int, typer.Option(min=1, help="Over all clips.")] = 16,
    steps: Annotated[int, typer.Option(min=1, help="Of training.")] = 24_000,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
) -> None:
    """Learn what accidents do to keypoints."""
    export(trained(list(takes(passes, seed)), steps, seed), output)


if __name__ == "__main__":
    run_command(main)
