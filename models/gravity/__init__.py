"""Which way is up: one answer from every source that knows something, with its error.

`seen` is a person's frames, `sampling` asks a rectifier about as many of them as inform, and `evidence` what any
source says about up: `votes` pools the frames', `floor` reads it off feet that stand, `images` reads it off an
image's straight lines (`segments` finds those, `lines` fits the directions of a built world to them), `view` does it
for a video. `fusion` fuses all or decides between them, `moving` does it for each
frame of a camera that moves. `levelling` makes a take of it, `known` says what a lift may rest on, `people` of
several people, `live` while the camera runs.
"""

from .evidence import Evidence, TakeUp, direction, fuse, told_up
from .floor import level_feet, stance
from .known import known_moving_up, known_up
from .levelling import Levelled, level_moving, level_static, level_world, why_not
from .people import level_people
from .sampling import take_rotation
from .seen import Seen
from .votes import LEAN_DEG, TILT_SHARE, UNKNOWN_DEG, Votes, effective_number, pool, take_up

__all__ = [
    "LEAN_DEG", "TILT_SHARE", "UNKNOWN_DEG", "Evidence", "Levelled", "Seen", "TakeUp", "Votes", "direction",
    "effective_number", "fuse", "known_moving_up", "known_up", "level_feet", "level_moving", "level_people",
    "level_static", "level_world", "pool", "stance", "take_rotation", "take_up", "told_up", "why_not",
]  # fmt: skip
