"""Joint layouts as data: names (layouts.toml), bones and mirror pairs. "l_" and "r_" are the person's own left and
right."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .errors import InputError

_BONES = (
    ("pelvis", "r_hip"), ("r_hip", "r_knee"), ("r_knee", "r_ankle"),
    ("pelvis", "l_hip"), ("l_hip", "l_knee"), ("l_knee", "l_ankle"),
    ("pelvis", "spine"), ("spine", "thorax"), ("thorax", "nose"), ("nose", "head"),
    ("thorax", "l_shoulder"), ("l_shoulder", "l_elbow"), ("l_elbow", "l_wrist"),
    ("thorax", "r_shoulder"), ("r_shoulder", "r_elbow"), ("r_elbow", "r_wrist"),
    ("r_ankle", "r_heel"), ("r_heel", "r_big_toe"), ("r_ankle", "r_big_toe"), ("r_big_toe", "r_small_toe"),
    ("l_ankle", "l_heel"), ("l_heel", "l_big_toe"), ("l_ankle", "l_big_toe"), ("l_big_toe", "l_small_toe"),
)  # fmt: skip
# Drawn where a layout has no pelvis or thorax of its own.
_SHORTCUTS = (
    ("r_hip", "l_hip"),
    ("r_shoulder", "l_shoulder"),
    ("r_shoulder", "r_hip"),
    ("l_shoulder", "l_hip"),
)


@dataclass(frozen=True)
class Layout:
    """Names of a set of joints in the order of the array's joint axis."""

    name: str
    joints: tuple[str, ...]
    _index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(set(self.joints)) != len(self.joints):
            raise InputError("bad-value", f"Layout {self.name} names a joint twice.")
        object.__setattr__(self, "_index", {joint: i for i, joint in enumerate(self.joints)})

    def __len__(self) -> int:
        return len(self.joints)

    def __contains__(self, joint: str) -> bool:
        return joint in self._index

    def index(self, joint: str) -> int:
        """Position of a joint; InputError listing the layout's joints when there is none of that name."""
        if joint not in self._index:
            raise InputError(
                "name-unknown", f"Layout {self.name} has no joint '{joint}'; it has {', '.join(self.joints)}."
            )
        return self._index[joint]

    def indices(self, joints: Sequence[str]) -> list[int]:
        return [self.index(joint) for joint in joints]

    @property
    def is_body(self) -> bool:
        """Whether it is H36M17, with or without heels and toes behind."""
        count = len(H36M17)
        return self.joints[:count] == H36M17.joints and all(point in FEET for point in self.joints[count:])

    @property
    def mirror(self) -> np.ndarray:
        """(J,) index of each joint's partner on the other side; a joint in the middle is its own."""
        return np.array([self.index(_other_side(joint)) for joint in self.joints])

    @property
    def bones(self) -> tuple[tuple[str, str], ...]:
        """Pairs of joints that a drawing connects."""
        shortcuts = () if "pelvis" in self and "thorax" in self else _SHORTCUTS
        return tuple((start, end) for start, end in (*_BONES, *shortcuts) if start in self and end in self)


def _other_side(joint: str) -> str:
    return {"l_": "r_", "r_": "l_"}.get(joint[:2], joint[:2]) + joint[2:]


def _limb(side: str, *parts: str) -> tuple[str, ...]:
    return tuple(f"{side}_{part}" for part in parts)


# Of one side, from the trunk outwards.
LEG, ARM, _FOOT = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"), ("big_toe", "small_toe", "heel")
TRUNK_CORNERS = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")
LIMBS = tuple(joint for side in "rl" for joint in (*_limb(side, *LEG), *_limb(side, *ARM)))

_ORDERS = tomllib.loads(Path(__file__).with_name("layouts.toml").read_text(encoding="utf-8"))
LAYOUTS = {name: Layout(name, tuple(joints.split())) for name, joints in _ORDERS.items()}
(
    H36M17, H36M17_B, H36M17_C, COCO17, COCO18, COCO23, HALPE26, OPENPOSE18, BODY_25, BODY_25B, BLAZEPOSE33, MPI3DHP17,
    MHR70, SOMA30, SOMA77,
) = LAYOUTS.values()  # fmt: skip

# The orders of joints in 2D, by their number; of one number the more usual first.
IN_2D = (COCO17, OPENPOSE18, COCO18, COCO23, BODY_25, BODY_25B, HALPE26, BLAZEPOSE33, MHR70)
# Those that are the first joints of a body with face and hands, by the number of all.
WHOLE_BODIES = {133: COCO23, 136: HALPE26, 94: HALPE26, 68: HALPE26, 135: BODY_25B, 137: BODY_25, 308: MHR70}

# Heels and toes, which stand behind the joints of H36M17 where a source has them (body_in).
FEET = Layout("FEET", (*_limb("r", *_FOOT), *_limb("l", *_FOOT)))


def body_of(points: Iterable[str]) -> Layout:
    """H36M17, and behind it those of the points that are heels and toes, each with its partner on the other side."""
    points = set(points)
    feet = tuple(point for point in FEET.joints if {point, _other_side(point)} & points)
    return Layout(f"{H36M17.name} and feet", (*H36M17.joints, *feet)) if feet else H36M17


def layout_named(name: str | Layout) -> Layout:
    """The layout of that name, in any case, or the layout itself; InputError listing the names when there is none."""
    if isinstance(name, Layout):
        return name
    by_key = {key.lower(): layout for key, layout in LAYOUTS.items()}
    if name.lower() not in by_key:
        raise InputError("name-unknown", f"Expected a joint layout of {', '.join(LAYOUTS)}; got '{name}'.")
    return by_key[name.lower()]


def layouts_of(joints: int, where: str, layouts: Sequence[Layout] = IN_2D) -> Sequence[Layout]:
    """Those of the layouts that have so many joints, or are the body of so many with face and hands. InputError, which
    begins with `where`, when there is none."""
    if of_number := [layout for layout in layouts if len(layout) == joints]:
        return of_number
    body = WHOLE_BODIES.get(joints)
    if body is not None and body in layouts:
        return [body]
    numbers = ", ".join(map(str, sorted({*map(len, layouts)})))
    more = ", ".join(str(n) for n, body in sorted(WHOLE_BODIES.items()) if body in layouts)
    raise InputError(
        "wrong-content",
        f"{where}: expected people of {numbers} joints{f', or with hands and face {more}' * bool(more)}, got {joints}.",
    )
