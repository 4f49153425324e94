"""Everybody in a recording on one sheet, each under the name that chooses them, as a PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.messages import how_many
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..core.take import Video
from ..files.images import write_png
from ..files.video_frames import images_at
from .image import draw_bones, from_the_front

MOST = 48  # people on a sheet

_COLUMNS = 6
_CELL, _FOOTER = 220, 44  # pixels
_ROOM = 1.35  # around the person, in sizes of the joints' box
_BLACK, _GREY, _WHITE = (0, 0, 0), (235, 235, 235), (255, 255, 255)


@dataclass(frozen=True, eq=False)
class Shown:
    """One of the people: the name that chooses them, and their 2D keypoints or 3D poses, or why there are none."""

    name: str
    track: PoseSequence | None
    reason: str = ""

    @property
    def words(self) -> str:
        """When they are seen."""
        if self.track is None:
            return self.reason
        times, frames = self.track.times, how_many(len(self.track), "frame")
        return f"{times[0]:.2f} to {times[-1]:.2f} s, {frames}"


def draw_people(people: Sequence[Shown], video: Video | None, path: Path) -> None:
    """Write the sheet: at most MOST people, those who are seen longest, in the order they came in.

    Each is cut out of the video where there is one and keypoints say where they are, else drawn as a skeleton.
    InputError when the video cannot be decoded or the file not be written.
    """
    import cv2

    longest = sorted(range(len(people)), key=lambda i: -_frames(people[i]))[:MOST]
    people = [people[i] for i in sorted(longest)]
    rows = [None if one.track is None else _clear_row(one.track) for one in people]
    frames = {
        int(one.track.frame_index[row])
        for one, row in zip(people, rows, strict=True)
        if one.track is not None and row is not None and one.track.frame.dims == 2
    }
    images = images_at(video, frames) if video is not None else {}
    columns = min(_COLUMNS, len(people))
    lines = -(-len(people) // columns)
    sheet = np.full((lines * (_CELL + _FOOTER), columns * _CELL, 3), 255, dtype=np.uint8)
    for i, (one, row) in enumerate(zip(people, rows, strict=True)):
        y, x = i // columns * (_CELL + _FOOTER), i % columns * _CELL
        if one.track is not None and row is not None:
            sheet[y : y + _CELL, x : x + _CELL] = _thumbnail(one.track, row, images)
        cv2.rectangle(sheet, (x, y), (x + _CELL - 1, y + _CELL - 1), _WHITE, 2)
        _write(sheet, f"--person {one.name}", (x + 6, y + _CELL + 18), 0.55, 2)
        _write(sheet, one.words, (x + 6, y + _CELL + 36), 0.4, 1)
    write_png(path, sheet)


def _frames(one: Shown) -> int:
    return 0 if one.track is None else len(one.track)


def _clear_row(track: PoseSequence) -> int | None:
    """The middle one of the rows in which the person is seen best; None where they never are."""
    there = is_finite(track.joints)
    seen = np.where(there, np.where(np.isnan(track.confidence), 1.0, track.confidence), 0.0).sum(axis=1)
    if not seen.any():
        return None
    best = np.flatnonzero(seen >= 0.95 * seen.max())
    return int(best[len(best) // 2])


def _thumbnail(track: PoseSequence, row: int, images: dict[int, np.ndarray]) -> np.ndarray:
    """(_CELL, _CELL, 3) BGR of the person in that row, in the video's image where there is one."""
    flat = from_the_front(track.joints[row], track.frame) if track.frame.dims == 3 else track.joints[row]
    inside = flat[is_finite(flat)]
    low, high = inside.min(axis=0), inside.max(axis=0)
    side = max(_ROOM * float((high - low).max()), 1e-9)
    scale, corner = _CELL / side, (low + high - side) / 2
    image = images.get(int(track.frame_index[row])) if track.frame.dims == 2 else None
    canvas = np.full((_CELL, _CELL, 3), _GREY, dtype=np.uint8)
    if image is not None:
        canvas = _cut(image, scale, corner)
    draw_bones(canvas, (flat - corner) * scale, track.layout, edge=1)
    return canvas


def _cut(image: np.ndarray, scale: float, corner: np.ndarray) -> np.ndarray:
    """(_CELL, _CELL, 3) BGR of the square from the corner on; grey beside the image (H, W, 3) RGB."""
    import cv2

    move = np.array([[scale, 0, -scale * corner[0]], [0, scale, -scale * corner[1]]])
    cut = cv2.warpAffine(
        image, move, (_CELL, _CELL), flags=cv2.INTER_AREA, borderMode=cv2.BORDER_CONSTANT, borderValue=_GREY
    )
    return np.ascontiguousarray(cut[..., ::-1])


def _write(sheet: np.ndarray, text: str, at: tuple[int, int], size: float, thick: int) -> None:
    """Text as wide as a cell at most; the font has no letters beyond ASCII."""
    import cv2

    font, text = cv2.FONT_HERSHEY_SIMPLEX, text.encode("ascii", "replace").decode()
    while text and cv2.getTextSize(text, font, size, thick)[0][0] > _CELL - 12:
        text = text[:-1]
    cv2.putText(sheet, text, at, font, size, _BLACK, thick, cv2.LINE_AA)
