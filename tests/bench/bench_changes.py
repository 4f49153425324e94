"""How often keypoints that were changed by accident are doubted, and sound ones without cause.

    python tests/bench/bench_changes.py [--network FILE] [--because REASON]

Validation people before typical cameras and a noisy detector, whole takes and pieces of them. With a reason, which goes
into the ledger of looks at them, test people.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pcnet3d.models.lab.common.modules import run_command
from pcnet3d.models.lab.evaluation.evaluate import note_look
from pcnet3d.models.lab.evaluation.finished import at_rate
from pcnet3d.models.lab.evaluation.testbed import BEDS, MIN_FRAMES, SeenTake, see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.models.lifter import changes
from pcnet3d.pipeline.core.pose import PoseSequence

_PIECES_S = (1.0, 1.9, 3.0)
_SEED = 5
_RATE, _WIDTH, _ZOOM, _BACKWARDS = (
    "movement-against-rate",
    "image-stretched",
    "camera-zooms",
    "played-backwards",
)


def _scaled(width: float = 1.0, zoom: float = 0.0) -> Callable[[SeenTake], PoseSequence]:
    def edit(take: SeenTake) -> PoseSequence:
        middle = np.array(take.image_size) / 2
        rows = np.arange(len(take.keypoints)) - len(take.keypoints) / 2
        factor = np.array([width**0.5, width**-0.5]) * np.exp(zoom * rows)[:, None, None]
        return take.keypoints.with_(joints=(take.keypoints.joints - middle) * factor + middle)

    return edit


def _backwards(take: SeenTake) -> PoseSequence:
    keypoints = take.keypoints
    return keypoints.with_(joints=keypoints.joints[::-1], confidence=keypoints.confidence[::-1])


_EDITS = {
    "a third wider": (_WIDTH, _scaled(width=4 / 3)),
    "a quarter higher": (_WIDTH, _scaled(width=0.8)),
    "growing by 1 % a frame": (_ZOOM, _scaled(zoom=0.01)),
    "backwards": (_BACKWARDS, _backwards),
}
_SPEEDS = (3.0, 2.0, 1 / 2, 1 / 4, 1 / 8)


def main(
    network: Annotated[Path, typer.Option(help="The network.")] = changes.CHANGES,
    because: Annotated[str, typer.Option(help="Reason for a look at test people.")] = "",
) -> None:
    """Print the shares that are doubted."""
    changes.CHANGES = network
    if because:
        digest = hashlib.sha256(network.read_bytes()).hexdigest()[:12]
        note_look(Path(), "tests/bench/bench_changes.py", [f"changes@{digest}"], because)
    clips = [clip for clip in read_clips("test" if because else "val") if len(clip) >= MIN_FRAMES]
    said: dict[str, list[tuple[bool, bool]]] = {}

    def note(what: str, code: str, keypoints: PoseSequence, size: tuple[int, int]) -> None:
        for seconds in (np.inf, *_PIECES_S):
            rows = round(30 * seconds) if np.isfinite(seconds) else len(keypoints)
            for first in range(0, len(keypoints) - rows + 1, max(rows, 90)):
                codes = {
                    each.code for each in changes.change_doubts(keypoints.rows(first, first + rows), size)
                }
                wrong = bool(codes) if not code else bool(codes - {code})
                said.setdefault(f"{what}, {seconds:g} s", []).append((code in codes, wrong))

    for clip in clips:
        for bed in BEDS.values():
            take = see(clip, _SEED, views=bed)
            note("sound", "", take.keypoints, take.image_size)
        for what, (code, edit) in _EDITS.items():
            note(what, code, edit(take), take.image_size)
        for times in _SPEEDS:
            other = see(at_rate(clip, 30 / times), _SEED, views=bed)
            frames = other.keypoints.frame_index
            if len(frames) >= MIN_FRAMES // 2:
                note(
                    f"{times:.3g} times as fast",
                    _RATE,
                    other.keypoints.with_(time_s=frames / 30),
                    other.image_size,
                )
    for what, each in said.items():
        told, wrong = np.mean(each, axis=0)
        print(f"{what}: {told:.0%} of {len(each)} told, {wrong:.1%} doubted without cause")


if __name__ == "__main__":
    run_command(main)
