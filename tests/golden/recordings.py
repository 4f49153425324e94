"""Recordings, read back; those of live too."""

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np

GEOMETRIC = ["rectify.rectifier=geometric"]


class Recording:
    """What is in an .rrd file, by entity and component."""

    def __init__(self, path: Path) -> None:
        from rerun.chunk import RrdReader

        reader = RrdReader(path)
        self.chunks = reader.stream().to_chunks()
        self.views = [
            chunk for store in reader.blueprints() for chunk in reader.stream(store=store).to_chunks()
        ]

    @property
    def entities(self) -> set[str]:
        return {chunk.entity_path.strip("/") for chunk in self.chunks} - {"__properties"}

    def batches(self, entity: str, component: str, static: bool) -> Iterator:
        for chunk in self.chunks:
            batch = chunk.to_record_batch()
            if (
                chunk.entity_path == f"/{entity}"
                and chunk.is_static == static
                and component in batch.schema.names
            ):
                yield batch

    def static(self, entity: str, component: str) -> list:
        (batch,) = self.batches(entity, component, static=True)
        return batch.column(component)[0].as_py()

    def over_time(self, entity: str, component: str) -> tuple[np.ndarray, np.ndarray, list]:
        """Frame numbers (T,), nanoseconds (T,) and the values of each row; one chunk or it fails."""
        (batch,) = self.batches(entity, component, static=False)
        frame, video_time = (
            batch.column(name).to_numpy(zero_copy_only=False) for name in ("frame", "video_time")
        )
        return frame, video_time.astype(np.int64), batch.column(component).to_pylist()

    def blueprint(self, component: str) -> list:
        """Every value of that component in the blueprint, such as the views' names."""
        batches = [chunk.to_record_batch() for chunk in self.views]
        return [
            value
            for batch in batches
            if component in batch.schema.names
            for row in batch.column(component).to_pylist()
            for value in row
        ]


def logged(path, entity: str, component: str) -> tuple[np.ndarray, list]:
    """Frame numbers and values of an entity, in order."""
    frames, values = [], []
    for batch in Recording(path).batches(entity, component, static=False):
        frames += batch.column("frame").to_pylist()
        values += batch.column(component).to_pylist()
    order = np.argsort(frames)
    return np.array(frames)[order], [values[i] for i in order]


def kept(folder, images: int = 60) -> bool:
    """Whether what live records of a camera, with so many images, and nothing else, is in the folder."""
    names = {path.name for path in folder.iterdir()}
    if images:
        with av.open(str(folder / "video.ts")) as video:
            assert sum(1 for _ in video.decode(video=0)) == images
    return names - {"keypoints.npz"} == {"summary.json", *["video.ts"] * bool(images)}
