"""Lifting: 2D keypoints of any detector become a 3D skeleton, with our own network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..models.lifter import lift
from ..pipeline.layouts import H36M17, remap
from ..pipeline.pictures import shown_size
from ..pipeline.take import Event, Take


@dataclass(frozen=True)
class Lift:
    """The stage. image_size: the picture's width and height in pixels, for a take without a video; focal_px: the
    focal length, if known; flip: average with the lift of the mirrored person."""

    image_size: tuple[int, int] | None = None
    focal_px: float | None = None
    flip: bool = False

    name: ClassVar[str] = "lift"
    needs: ClassVar[tuple[str, ...]] = ("keypoints",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)

    def __call__(self, take: Take) -> Take:
        assert take.keypoints is not None
        size = self.image_size or (shown_size(take.video) if take.video else None)
        poses = lift(remap(take.keypoints, H36M17), size, self.focal_px, self.flip)
        said = poses.history[-1].options
        events = [Event("note", f"The poses are our own lift of the 2D keypoints (network {said['model']}).")]
        if not said["focal_known"]:
            text = f"The focal length is unknown and taken for {said['focal_px']:.0f} pixels (--focal)."
            events.append(Event("note", text))
        if said["frames_without_joints"]:
            text = f"{said['frames_without_joints']} frames have no keypoints for too long to be lifted."
            events.append(Event("warning", text))
        return take.with_(poses=poses).saying(*events)
