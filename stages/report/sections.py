"""What a report says in words and tables: whom it is about, how up was found, and where everything comes from."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ...pipeline.core.messages import bound_in_words, how_many, rate_in_words
from ...pipeline.core.take import Take
from ...pipeline.running.sentences import camera_motion, camera_words, length_of, up_bound
from ..drawing.page import box, bullets, joined, small, table
from ..drawing.provenance import provenance

_MOST = 40  # notices of one kind
_HEADINGS = {
    "camera": "Front is towards the camera, and right is the camera's left.",
    "world": "Front and right are those of the file's world.",
}


def session_words(take: Take) -> Markup:
    """Whom and what the page is about, under its title: person and date, if given, the take's name, its length and the
    camera."""
    motion = camera_motion(take) if len(take.need("poses")) > 1 else ""
    parts = [
        f"Person {take.session.person_id}" if take.session.person_id else "",
        take.session.date,
        take.name if take.name != take.title else "",
        length_of(take),
        f"camera {motion}" if motion else "",
    ]
    return small(" · ".join(part for part in parts if part))


def gravity_words(take: Take) -> Markup:
    """How the camera stands, and which way the person faces; what up rests on says the box of trust."""
    rectified = take.need("rectified")
    if rectified.in_world:
        return Markup("")
    relative = "; front and right are relative to it" if rectified.camera == "moving" else ""
    lines = [
        f"The camera {camera_words(take)}{relative}.",
        _HEADINGS.get(rectified.level_heading, "Front and right are the person's own."),
    ]
    error = rectified.error_deg[rectified.level_ok & np.isfinite(rectified.error_deg)]
    if len(error) and up_bound(rectified) is not None:
        within = bound_in_words(float(np.median(error)))
        lines.append(
            f"The direction that the body faces is off by less than {within}° in half of the frames."
        )
    return bullets(lines)


def provenance_of(take: Take) -> Markup:
    """Inputs, how they were read and versions, as in every file of the run; then the repairs and the notes."""
    poses = take.need("poses")
    lines = {
        "poses": f"person {poses.person}, frames {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.frame}",
        "rectified": f"{take.need('rectified').turned.sum()} of {how_many(len(poses), 'frame')}",
    }
    if (video := take.video) is not None:
        turned = f", turned by {video.rotation_deg}°" if video.rotation_deg else ""
        lines["video"] = (
            f"{video.width} x {video.height} pixels, {how_many(len(video.time_s), 'frame')}"
            f"{rate_in_words(video.fps, ' at ')}, {video.codec}{turned}"
        )
    shown = {name: text for name, text in provenance(take).items() if not name.startswith("warning")}
    boxes = []
    for title, texts in (("Repairs", take.texts("repair")), ("Notes", take.texts("note"))):
        more = [f"and {len(texts) - _MOST} more, in summary.json"] * (len(texts) > _MOST)
        boxes.append(box(title, [*texts[:_MOST], *more]))
    return table(("", ""), [*(shown | lines).items()]) + joined(boxes)
