"""What live has recorded."""

from __future__ import annotations

import numpy as np

GEOMETRIC = ["rectify.rectifier=geometric"]


def logged(path, entity: str, component: str) -> tuple[np.ndarray, list]:
    """Frame numbers and values of an entity, in order."""
    from rerun.chunk import RrdReader

    frames, values = [], []
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == f"/{entity}" and not chunk.is_static and component in batch.schema.names:
            frames += batch.column("frame").to_pylist()
            values += batch.column(component).to_pylist()
    order = np.argsort(frames)
    return np.array(frames)[order], [values[i] for i in order]


def kept(folder, images: int = 60) -> bool:
    """Whether all of the recording, and nothing else, is in the folder."""
    assert len(logged(folder / "live.rrd", "video", "VideoStream:sample")[0]) == images
    names = {path.name for path in folder.iterdir()}
    return names - {"keypoints.npz"} == {"live.rrd", "summary.json", *["video.ts"] * bool(images)}
