"""A file of `pcnet3d lab testbed`: lifted takes with their truth."""

from pathlib import Path

import numpy as np

from pcnet3d.models.lab.synthetic import seen, views


def write_lifted(
    path: Path, standing: np.ndarray, frames: int = 60, names: tuple[str, ...] = ("01_01", "02_01")
) -> Path:
    """A lifter that is right up to the scale, and did not lift the first frame. standing: (17, 3) metres, +Z up."""
    R = views("wide", np.random.default_rng(0), frames)
    truth, _ = seen(np.tile(standing, (frames, 1, 1)), R)
    lifted = 0.6 * truth
    lifted[0] = np.nan
    np.savez(
        path, lifted=lifted, truth=truth, R_camera_from_body=R, lying=np.zeros(len(R)), clip=np.array(names),
        take_start=np.linspace(0, frames, len(names) + 1).astype(int),
    )  # fmt: skip
    return path
