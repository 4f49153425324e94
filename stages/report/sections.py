"""What a report says in words and tables: whom it is about, and where everything comes from."""

from __future__ import annotations

from markupsafe import Markup

from ...pipeline.core.messages import how_many, rate_in_words
from ...pipeline.core.take import Take
from ...pipeline.running.sentences import camera_motion, camera_words, length_of
from ..drawing.page import box, joined, small, table
from ..drawing.provenance import provenance

_MOST = 40  # notices of one kind
_HEADINGS = {  # where not the person's own
    "camera": "towards the camera, and to the camera's left",
    "world": "those of the file's world",
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


def provenance_of(take: Take) -> Markup:
    """Inputs, how they were read and versions, as in every file of the run, how the camera stands and which way front
    is; then the repairs and the notes."""
    poses, rectified = take.need("poses"), take.need("rectified")
    lines = {
        "poses": f"person {poses.person}, frames {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.frame}",
        "rectified": f"{rectified.turned.sum()} of {how_many(len(poses), 'frame')}",
    }
    if not rectified.in_world:
        relative = "; front and right are relative to it" if rectified.camera == "moving" else ""
        lines["camera"] = f"it {camera_words(take)}{relative}"
        lines["front and right"] = _HEADINGS.get(rectified.level_heading, "the person's own")
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
