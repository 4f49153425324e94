"""What is known of a take's up and camera, once: summary.json, the recording's text and the report tell it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.camera import pitch_roll_deg
from ...pipeline.core.measures import SD_90
from ...pipeline.core.messages import bound_in_words
from ...pipeline.core.notices import Notice
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import rotate
from ...pipeline.core.take import AngleErrors, Take
from ...pipeline.signals.angles import sides_of
from ...pipeline.signals.checks import nobody_upright

# What up may rest on, by the name of the evidence.
SOURCES = {
    "frames": "the body's posture", "image": "the image's straight lines", "feet": "the feet's places",
    "floor": "the floor under the feet",
}  # fmt: skip


ERRORS_OF_ANGLES: dict[AngleErrors, str] = {
    "judged": "as measured for the built-in lifter",
    "disagreement": "from disagreement with the built-in lifter",
    "file": "from the given file",
    "none": "not known",
}


@dataclass(frozen=True)
class Source:
    """What one source of up says. pitch_deg, roll_deg: of the camera by it alone, with error_deg, the root mean square;
    None where it says nothing alone. share: its weight in the take's up, None when it was not heard. pull_deg: by how
    much it moves that."""

    pitch_deg: float | None = None
    roll_deg: float | None = None
    error_deg: float | None = None
    share: float | None = None
    pull_deg: float | None = None


@dataclass(frozen=True, eq=False)
class Facts:
    """What is known of a take's up and its camera, beside what the rectification says. Angles in degrees; NaN where
    unknown.

    up_bound_deg: least and most of the 90 % bound, None where it is not stated. camera_motion: how the camera moves and
    who says so, behind "camera"; "" for poses in a world's axes. standing_deg: pitch and roll of a camera that stands
    still, by the take's up; None for others and for takes that are not levelled. error_deg: median of the expected
    rotation errors, NaN of those. nobody_upright: why up may be quite another, None where it is not. up_of_unusable:
    why its error is not known, "" where that is not why.
    """

    rectified: Rectified
    camera_motion: str
    up_bound_deg: tuple[float, float] | None
    standing_deg: tuple[float, float] | None
    sources: dict[str, Source]
    error_deg: float
    nobody_upright: Notice | None
    up_of_unusable: str

    @property
    def up_of_world(self) -> str:
        """How well a world's own up is known, in a sentence; "" for poses in a camera's axes."""
        if not self.rectified.in_world:
            return ""
        if self.up_bound_deg is None:
            return "Given by the file; its error is not known."
        return "The source knows its own up."

    @property
    def camera_words(self) -> str:
        """How the camera stands, behind "the camera"."""
        if self.rectified.camera == "moving":
            return f"{self.camera_motion}, and up moves with it"
        if self.standing_deg is None:
            return self.camera_motion
        bound = bound_in_words(self.up_bound_deg[1]) if self.up_bound_deg else ""
        digits = 1 if "." in bound else 0
        pitch, roll = tilts = [round(of, digits) for of in self.standing_deg]
        within = f" ± {bound} degrees" if bound else ""
        by_pitch, by_roll = (
            f"by {of:.{digits}f}{within or ' degree' + 's' * (of != 1)}" for of in map(abs, tilts)
        )
        looks = f"{'down' if pitch > 0 else 'up'} {by_pitch}" if pitch else f"level{within}"
        turned = f"turned {'counter-' * (roll > 0)}clockwise {by_roll}" if roll else f"upright{within}"
        return f"{self.camera_motion}; it looks {looks} (pitch), and its image is {turned} (roll)"

    @property
    def bound_words(self) -> str | None:
        """The angle that nine in ten takes' up stays under, or the range of a moving camera's; None where the take is
        not levelled or it is not stated."""
        if not self.rectified.level_ok or self.up_bound_deg is None:
            return None
        least, most = map(bound_in_words, self.up_bound_deg)
        return most if least == most else f"{least} to {most}"

    @property
    def up_words(self) -> str:
        """How sure up is, in a sentence."""
        if self.up_of_world:
            return self.up_of_world
        if not self.rectified.level_ok:
            return "It is a guess; do not rely on it."
        if self.bound_words is None:
            return self.up_of_unusable or "Its error is not stated."
        unless = ", unless the image is turned" if self.nobody_upright else ""
        return f"Known to within {self.bound_words.replace(' to', '° to')}° (90 %){unless}."

    @property
    def rests_words(self) -> str:
        """What up rests on, in a sentence; empty where nothing was estimated."""
        shares = {name: source.share for name, source in self.sources.items() if source.share is not None}
        largest = sorted(shares.items(), key=lambda share: -share[1])
        parts = [f"{SOURCES.get(name, name)} ({100 * part:.0f} %)" for name, part in largest if part >= 0.005]
        return f"It is based on {', '.join(parts)}." if parts else ""


def facts_of(take: Take) -> Facts:
    """The facts of a take that is rectified; InputError of one that is not."""
    rectified = take.need("rectified")
    bound = rectified.up_bound_deg[rectified.turned & np.isfinite(rectified.up_bound_deg)]
    error = rectified.error_deg[rectified.level_ok & np.isfinite(rectified.error_deg)]
    return Facts(
        rectified,
        camera_motion=_camera_motion(take),
        up_bound_deg=(float(bound.min()), float(bound.max())) if len(bound) else None,
        standing_deg=_standing(take),
        sources=_sources(take),
        error_deg=float(np.median(error)) if len(error) else float("nan"),
        nobody_upright=nobody_upright(rectified),
        up_of_unusable=next((each.text for each in take.notices if each.code == "up-of-unusable"), ""),
    )


def errors_of_angles(how: AngleErrors | None) -> str:
    """A sentence: the source of the errors of a take's angles and what is made from them; empty without angles."""
    words = "Errors of angles, and of ranges, repetitions and symmetry with them"
    return "" if how is None else f"{words}: {ERRORS_OF_ANGLES[how]}."


def angle_bands(take: Take, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """(T, N) an angle by its name without a side, right before left, and how far its 90 % band reaches to each side of
    it, NaN where either is not known; None where the take has no value."""
    columns, nothing = take.kinematics or {}, np.full(len(take.need("poses")), np.nan)
    values, sds = (
        np.stack([columns.get(f"{part}_{ending}", nothing) for part in sides_of(name)], axis=1)
        for ending in ("deg", "sd_deg")
    )
    return (values, SD_90 * sds) if np.isfinite(values).any() else None


def length_unit(poses: PoseSequence) -> str:
    """The unit of length as it stands behind a figure."""
    return poses.frame.unit if poses.frame.metric else "units"


def shared_up(rectified: Rectified) -> np.ndarray:
    """(T, 3) the up that BODY and LEVEL share, in the source's axes."""
    return np.broadcast_to(rectified.R_source_from_level[..., :, 2], rectified.up_votes.shape)


def up_of_camera(take: Take) -> np.ndarray:
    """(T, 3) the take's up in CAMERA axes; NaN where it is not levelled or the poses are not a camera's."""
    rectified, frame = take.need("rectified"), take.need("poses").frame
    up = shared_up(rectified)
    if frame.family != "camera" or not rectified.level_ok:
        return np.full_like(up, np.nan)
    return rotate(frame.basis.T, up)


def mean(values: np.ndarray) -> float:
    """Of those that are known of (T,); NaN where none is."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def listed(options: Mapping[str, object]) -> str:
    """Names and values in a line: "a 1, b 2"."""
    return ", ".join(f"{key} {value}" for key, value in options.items())


def _camera_motion(take: Take) -> str:
    if take.need("rectified").camera is None:
        return ""
    if take.told.moving or take.told.standing:
        return f"{'moves' if take.moving else 'stands still'}, as you stated"
    if take.camera is not None and take.camera.background is not None:
        return f"{take.camera.background.words}, judging by the background"
    return "is assumed to stand still (nothing shows whether it does)"


def _standing(take: Take) -> tuple[float, float] | None:
    rectified = take.need("rectified")
    if rectified.camera != "static" or not rectified.level_ok:
        return None
    pitch, roll = pitch_roll_deg(rotate(take.need("poses").frame.basis.T, shared_up(rectified)[:1])[0])
    return (float(pitch), float(roll)) if np.isfinite(pitch) else None


def _sources(take: Take) -> dict[str, Source]:
    rectified, to_camera = take.need("rectified"), take.need("poses").frame.basis.T
    alone = {
        name: (float(pitch), float(roll), error_deg)
        for name, (up, error_deg) in rectified.up_own.items()
        for pitch, roll in [pitch_roll_deg(rotate(to_camera, up[None])[0])]
    }
    names = dict.fromkeys([*rectified.up_shares, *alone, *rectified.up_pulls])
    return {
        name: Source(
            *alone.get(name, (None, None, None)),
            share=rectified.up_shares.get(name),
            pull_deg=rectified.up_pulls.get(name),
        )
        for name in names
    }
