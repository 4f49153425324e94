"""A file's bytes, damaged: anywhere, in its numbers, or where its format keeps what a reader trusts.

`mutated(content, suffix, rng)` gives the same bytes for the same state of `rng`, a random.Random.
"""

from __future__ import annotations

from random import Random

from fuzz.damage_binary import npy_header, npy_values, npz, opcode, squeezed
from fuzz.damage_bytes import BYTES, Mutation, integer, real
from fuzz.damage_text import TEXT, bracket, json_tree, token

_MOST = 2_000_000  # bytes of a mutated file, bombs apart


_OF_SUFFIX: dict[str, tuple[Mutation, ...]] = {
    ".json": (json_tree, json_tree, json_tree, json_tree, token, bracket),
    ".npy": (npy_header, npy_values),
    ".npz": (npz,),
    ".pkl": (opcode, opcode, opcode, squeezed, integer),
    ".c3d": (integer, real),
    ".mp4": (integer,),
    ".onnx": (integer,),
    ".parquet": (integer,),
    **dict.fromkeys((".csv", ".trc", ".bvh", ".txt", ".toml", ".yml", ".yaml"), TEXT),
}


def mutated(content: bytes, suffix: str, rng: Random) -> bytes:
    """The content after one to three mutations, those of the format and those of any bytes."""
    special = _OF_SUFFIX.get(suffix, ())
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        pool = special if special and rng.random() < 0.65 else BYTES
        content = rng.choice(pool)(content, rng)[: max(_MOST, 2 * len(content))]
    return content
