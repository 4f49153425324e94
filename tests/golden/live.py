"""What live has recorded."""

from __future__ import annotations

import numpy as np

from golden.recordings import Recording

GEOMETRIC = ["rectify.rectifier=geometric"]


def logged(path, entity: str, component: str) -> tuple[np.ndarray, list]:
    """Frame numbers and values of an entity, in order."""
    frames, values = [], []
    for batch in Recording(path).batches(entity, component, static=False):
        frames += batch.column("frame").to_pylist()
        values += batch.column(component).to_pylist()
    order = np.argsort(frames)
    return np.array(frames)[order], [values[i] for i in order]


def kept(folder, images: int = 60) -> bool:
    """Whether all of the recording, and nothing else, is in the folder."""
    assert len(logged(folder / "live.rrd", "video", "VideoStream:sample")[0]) == images
    names = {path.name for path in folder.iterdir()}
    return names - {"keypoints.npz"} == {"live.rrd", "summary.json", *["video.ts"] * bool(images)}
