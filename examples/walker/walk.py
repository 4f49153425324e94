"""A parametric person who walks, squats and raises both arms, with everything about the motion known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import Z_UP
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import MadeBy, PoseSequence
from .motion import Motion
from .skeleton import skeleton

_INSTANT_S = 1e-4  # step of the second derivative of the closed form: right to 1e-3 m/s2


@dataclass(frozen=True, eq=False)
class Walk:
    """A take of the walker, in metres and degrees, in a Z-up world whose floor is z = 0.

    time_s: (T,). world, acceleration_mps2: (T, 17, 3), H36M17.
    heading_deg: (T,) where the person faces: 0 is north (+x), positive towards west (+y).
    angles_deg: (T,) by name, the angles that make the motion. All lie in the sagittal plane and are 0 when straight:
        `trunk_lean_deg` forward from the vertical; with `l_` and `r_`, `thigh_trunk_flexion_deg` between thigh and
        trunk line, `knee_flexion_deg`, `shoulder_flexion_deg` between upper arm and trunk line, `elbow_flexion_deg`,
        `foot_pitch_deg` toes above heel; `head_lean_deg`. Besides, `pelvis_turn_deg` of the hip axis to the left; the
        shoulder axis turns as far to the right.
    heel_strikes_s: by side "l" and "r", while walking at full speed.
    phases_s: start and end of "walk", "squat" and "arms".
    """

    time_s: np.ndarray
    world: np.ndarray
    acceleration_mps2: np.ndarray
    heading_deg: np.ndarray
    angles_deg: dict[str, np.ndarray]
    heel_strikes_s: dict[str, np.ndarray]
    phases_s: dict[str, tuple[float, float]]
    cadence_spm: float  # steps a minute
    speed_mps: float
    stature_m: float
    fps: float

    def __len__(self) -> int:
        return len(self.time_s)

    def joint(self, name: str) -> np.ndarray:
        """(T, 3) one joint in the world."""
        return self.world[:, H36M17.index(name)]

    @property
    def root(self) -> np.ndarray:
        """(T, 3) the pelvis in the world."""
        return self.joint("pelvis")

    def during(self, phase: str) -> np.ndarray:
        """(T,) True in "walk", "squat" or "arms"."""
        start, end = self.phases_s[phase]
        return (self.time_s >= start) & (self.time_s < end)

    @property
    def poses(self) -> PoseSequence:
        """The take as a pose sequence in the Z-up world."""
        return PoseSequence(
            self.world,
            H36M17,
            Z_UP,
            time_s=self.time_s,
            frame_index=np.arange(len(self)),
            person="walker",
            made_by=MadeBy("measured", "the example itself"),
        )


def walker(
    fps: float = 30.0,
    seconds: float = 8.0,
    speed_mps: float = 1.25,
    stature_m: float = 1.75,
    heading_deg: float = 0.0,
    turn_deg: float = -45.0,
) -> Walk:
    """A person who walks up to the world's origin, stops there, squats once and raises both arms.

    seconds: length of the take; its parts keep their shares of it.
    speed_mps: of walking; the cadence follows, as the stride is a fixed share of the stature.
    heading_deg: from the end of the walk on. turn_deg: how far the walk's path, a circular arc, turns to the left
    before that; 0 is a straight line. InputError for values that make no take.
    """
    if not (fps > 0 and seconds * fps >= 1 and speed_mps > 0 and stature_m > 0):
        raise InputError(
            "bad-value",
            "The walker needs a positive frame rate, length, speed and stature, "
            f"got {fps}, {seconds}, {speed_mps} and {stature_m}.",
        )
    motion = Motion(seconds, speed_mps, stature_m, heading_deg, turn_deg)
    time_s = np.arange(round(seconds * fps)) / fps
    moments = (time_s - _INSTANT_S, time_s, time_s + _INSTANT_S)
    before, now, after = (
        skeleton(motion.angles(t), motion.heading(t), motion.root(t), stature_m) for t in moments
    )
    return Walk(
        time_s=time_s,
        world=now,
        acceleration_mps2=(after - 2 * now + before) / _INSTANT_S**2,
        heading_deg=motion.heading(time_s),
        angles_deg=motion.angles(time_s),
        heel_strikes_s={side: motion.heel_strikes_s(side) for side in "lr"},
        phases_s=motion.phases_s,
        cadence_spm=120 * motion.strides_hz,
        speed_mps=speed_mps,
        stature_m=stature_m,
        fps=fps,
    )
