"""Checkpoints of a training, as its folder holds them in parts."""

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import torch


def read_checkpoint(folder: Path) -> dict[str, Any]:
    """What was saved: net, average, optimisers, step, best."""
    listed = json.loads((folder / "checkpoint.json").read_text())
    content = b"".join((folder / name).read_bytes() for name in listed["parts"])
    return torch.load(io.BytesIO(content), weights_only=True)


def replace_checkpoint(folder: Path, content: bytes, **changes: Any) -> None:
    """Another content in the first part, whose checksum is right; changes: of what checkpoint.json says."""
    listed = json.loads((folder / "checkpoint.json").read_text())
    (folder / listed["parts"][0]).write_bytes(content)
    said = {"parts": listed["parts"][:1], "sha256": hashlib.sha256(content).hexdigest()}
    (folder / "checkpoint.json").write_text(json.dumps({**listed, **said, **changes}))


def saved(values: dict[str, Any]) -> bytes:
    """As torch.save writes it."""
    stream = io.BytesIO()
    torch.save(values, stream)
    return stream.getvalue()


def same(one: Any, other: Any) -> bool:
    """Bit for bit, all the way down."""
    if isinstance(one, torch.Tensor):
        return torch.equal(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other
