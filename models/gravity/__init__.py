"""Which way is up: one answer from every source that knows something, with its error.

`votes` pools the frames' votes; `floor` is what standing feet say; `images` reads up and the focal length from an
image's straight lines (`segments` finds those, `lines` fits the directions of a built world to them), `geocalib` asks
a network instead, `view` does it for a video; `fusion` fuses all or decides between them. `levelling` makes a take of
a rectifier's frames, `moving` for a camera that moves, `people` for several people, `live` while the camera runs.
"""

from .votes import (
    LEAN_DEG,
    RAYLEIGH_90,
    TILT_SHARE,
    UNKNOWN_DEG,
    Evidence,
    TakeUp,
    Votes,
    direction,
    effective_number,
    level_feet,
    pool,
    robust_mean,
    stance,
    take_up,
)

__all__ = [
    "LEAN_DEG", "RAYLEIGH_90", "TILT_SHARE", "UNKNOWN_DEG", "Evidence", "TakeUp", "Votes", "direction",
    "effective_number", "level_feet", "pool", "robust_mean", "stance", "take_up",
]  # fmt: skip
