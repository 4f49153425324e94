"""How far each wrist is from its shoulder, as columns of the take's kinematics."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pcnet3d.pipeline import InputError, PoseSequence, Take


@dataclass(frozen=True)
class Reach:
    """The stage. side: "l", "r" or "both". It takes the joints as the stage trajectories has filtered them."""

    side: str = "both"

    name: ClassVar[str] = "reach"
    needs: ClassVar[tuple[str, ...]] = ("filtered",)
    gives: ClassVar[tuple[str, ...]] = ("kinematics",)

    def __post_init__(self) -> None:
        if self.side not in ("l", "r", "both"):
            raise InputError("bad-value", f"Stage 'reach': expected side l, r or both, got '{self.side}'.")

    def __call__(self, take: Take) -> Take:
        sides = "lr" if self.side == "both" else self.side
        columns = {f"{side}_reach_distance": reach(take.need("filtered"), side) for side in sides}
        return take.with_(kinematics={**(take.kinematics or {}), **columns})


def reach(poses: PoseSequence, side: str) -> np.ndarray:
    """(T,) distance from shoulder to wrist in the poses' unit; NaN where one of them is missing."""
    arm = poses.joint(f"{side}_wrist").astype(np.float64) - poses.joint(f"{side}_shoulder")
    return np.linalg.norm(arm, axis=-1)
