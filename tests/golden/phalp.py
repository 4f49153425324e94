"""4D-Humans' pickles, in joblib's form and in pickle's own."""

import pickle
import zlib
from io import BytesIO
from typing import ClassVar

import numpy as np

from golden.bodies import placed
from pcnet3d.pipeline.core.layouts import BODY_25


class NumpyArrayWrapper:
    """joblib's, to be pickled under its name."""


NumpyArrayWrapper.__module__, NumpyArrayWrapper.__qualname__ = "joblib.numpy_pickle", "NumpyArrayWrapper"


class _Joblib(pickle._Pickler):
    """Arrays as joblib writes them: a wrapper, then padding and the bytes in the midst of the instructions."""

    dispatch: ClassVar = dict(pickle._Pickler.dispatch)

    def __init__(self, stream):
        super().__init__(stream, protocol=4)
        self.stream, self.kept = stream, []
        self.framer.write = stream.write
        self.write = stream.write
        self.framer.start_framing = lambda: None

    def save_global(self, obj, name=None):
        if obj is NumpyArrayWrapper:
            self.write(pickle.GLOBAL + b"joblib.numpy_pickle\nNumpyArrayWrapper\n")
            self.memoize(obj)
        else:
            super().save_global(obj, name)

    dispatch[type] = save_global

    def save(self, obj, save_persistent_id=True):
        if isinstance(obj, np.ndarray):
            wrapper = NumpyArrayWrapper()
            vars(wrapper).update(
                subclass=np.ndarray, shape=obj.shape, order="C", dtype=obj.dtype, allow_mmap=True,
                numpy_array_alignment_bytes=16,
            )  # fmt: skip
            self.kept.append(wrapper)  # an id that is free again would be taken for this one's
            super().save(wrapper)
            self.stream.write(bytes([3]) + b"\xff" * 3 + obj.tobytes())
        else:
            super().save(obj)


def as_joblib(content) -> bytes:
    stream = BytesIO()
    _Joblib(stream).dump(content)
    return stream.getvalue()


WRITERS = {
    "joblib": as_joblib,
    "joblib, compressed": lambda content: zlib.compress(as_joblib(content), 3),
    "protocol 2": lambda content: pickle.dumps(content, 2),
    "protocol 5": lambda content: pickle.dumps(content, 5),
}


def tracks(bodies: np.ndarray) -> dict:
    """PHALP's dict: person 1 in every frame, person 2 from frame 10, remembered but unseen from frame 30."""
    others = np.full((len(bodies), 19, 3), 7.0), np.zeros((len(bodies), 1, 3))
    body = np.concatenate([placed(bodies, BODY_25.joints), *others], axis=1) + 0.25
    frames = {}
    for t in range(len(bodies)):
        ids = [1, 2] if t >= 10 else [1]
        frames[f"outputs/_DEMO/walk/img/{t + 1:06d}.jpg"] = {
            "time": t,
            "tid": ids,
            "tracked_ids": [1] if t >= 30 else ids,
            "tracked_time": [0, 1] if t >= 30 else [0] * len(ids),
            "3d_joints": [body[t].astype(np.float32) for _ in ids],
            "camera": [np.array([0.1, 0.2, 40.0]) for _ in ids],
            "conf": [np.float64(0.9) for _ in ids],
        }
    return frames
