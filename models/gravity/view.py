"""A video's camera, from its images: focal length and up, at one time or along the way; and whether it moves, by what
stands still in the world: the corners of the background, outside people."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, TREMBLE, Background, Camera, Look
from ...pipeline.core.intrinsics import Intrinsics, undistorted, undistorted_image
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Video
from ...pipeline.files.video_frames import OnePass, images_at, images_from
from ...pipeline.running.progress import counted
from .images import TOLD_SPREAD, ImageUp, Unknown, up_from_images

_SIDE = 640  # pixels of the longer side of what is looked at
_CORNERS, _APART = 200, 7  # at most, and pixels between them
_FEWEST = 25  # corners that have to be found again
_BACK = 0.7  # pixels: where a corner that is followed there and back may end
_WINDOW, _LEVELS = (31, 31), 4  # of the pyramid: corners are found again some 80 pixels away
_STILL = 0.5 / _SIDE  # compression, and a tripod on a floor on which somebody walks: up to 0.3 pixels
# Of the corners: most are still before a tripod; of few that are found again nothing is told. Most move as one picture
# where it is the camera that moves: in videos by cameras that move 0.62 of them and more, in the median of their
# glimpses; where a crowd moves before one that stands still, 0.28.
_MOST, _FEW, _ONE_PICTURE = 0.5, 0.2, 0.5
_SAME = 2.0  # pixels: corners that move as one picture does that is shifted, turned and scaled
# Of the image, that lies between those corners: with less, in the median of glimpses, no picture moves. Before a
# plain wall all corners are on a person's clothes and shadow, with up to 0.08 of it; of cameras that move, 0.26.
_SPREAD = 0.14
_ZOOM = 0.05  # a second, of the picture's scale; and in all, of one that grows, or shrinks, most of the time
_DRIFT = 0.5  # of the way: net of it, below which a picture trembles to and fro
# Standard deviation of an assumed focal length as a share of it. Lenses are far oftener longer than those of phones
# than shorter: of lenses from 0.65 to 2 longer sides, evenly by their logarithm, nine in ten lie within 1.645 of it.
ASSUMED_FOCAL_SD = 0.75
# Of a focal length that the video file states: the sensor's crop and stabilisation are not told.
FILE_SPREAD = 0.08
# A told focal length is held against what lines make of one that is free by a factor of 1.6 about it, and is
# contradicted from so many standard deviations and so large a logarithm on; by rendered rooms and streets.
_FREE, _BEYOND, _LEAST = 0.5, 3.0, 0.15
_LOOKS = 3  # images of a camera that stands still
_EVERY = 10  # video frames between the images of one that moves
# By which it is seen how the background moves, and between the two images of each.
_GLIMPSES, _SOON_S = 10, 0.1
_REACH = 0.09  # of a person's longer side about the bones: flesh, clothes, hair, hands
_BOXES = 6  # along a bone
Boxes = Mapping[int, np.ndarray]  # frame: (N, 4) left, top, right, bottom in pixels of the people there


@dataclass(frozen=True)
class Shift:
    """How the background moves from one image to another of one camera: the median of its corners, in longer sides of
    the image to the right and down. still: the share of the corners that stay; together: of those that move as one
    picture. spread: the share of the image that lies between the latter. zoom: the logarithm of the growth."""

    right: float
    down: float
    still: float
    together: float
    spread: float
    zoom: float


def shift(first: np.ndarray, second: np.ndarray, boxes: Sequence[np.ndarray]) -> Shift | None:
    """From one image (H, W, 3) uint8 RGB to another of the same size. boxes: of the people in both, each (N, 4) left,
    top, right, bottom in pixels. None where too few corners are found again: a plain wall, a cut, another place."""
    import cv2

    scale = _SIDE / max(first.shape[:2])
    size = (round(first.shape[1] * scale), round(first.shape[0] * scale))
    before, after = (
        cv2.resize(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
        for image in (first, second)
    )
    background = np.full(before.shape, 255, np.uint8)
    for left, top, right, bottom in np.concatenate(list(boxes)) * scale:
        background[max(int(top), 0) : max(int(bottom) + 1, 0), max(int(left), 0) : max(int(right) + 1, 0)] = 0
    corners = cv2.goodFeaturesToTrack(before, _CORNERS, 0.01, _APART, mask=background)
    if corners is None or len(corners) < _FEWEST:
        return None
    options: dict[str, Any] = {"winSize": _WINDOW, "maxLevel": _LEVELS}
    there, followed, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, corners.copy(), **options)
    again, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, there.copy(), **options)
    fine = (
        (followed[:, 0] > 0) & (returned[:, 0] > 0) & (np.linalg.norm(again - corners, axis=-1)[:, 0] < _BACK)
    )
    if fine.sum() < max(_FEWEST, _FEW * len(corners)):
        return None
    way = (there - corners)[fine, 0] / _SIDE
    picture, together = cv2.estimateAffinePartial2D(
        corners[fine, 0], there[fine, 0], ransacReprojThreshold=_SAME
    )
    zoom = 0.0 if picture is None else float(np.log(np.hypot(*picture[:, 0])))
    right, down = np.median(way, axis=0)
    still = (np.linalg.norm(way, axis=1) < _STILL).mean()
    around = cv2.convexHull(corners[fine, 0][together[:, 0] > 0])
    spread = cv2.contourArea(around) / before.size
    return Shift(float(right), float(down), float(still), float(together.mean()), float(spread), zoom)


def stands(images: Mapping[int, np.ndarray], boxes: Mapping[int, np.ndarray]) -> bool:
    """Whether images {video frame: (H, W, 3) uint8 RGB}, seconds apart, show that a camera stands still. boxes: {video
    frame: those of `shift`}."""
    shifts = [shift(images[a], images[b], [boxes[a], boxes[b]]) for a, b in pairwise(sorted(images))]
    return bool(shifts) and all(each is not None and each.still > _MOST for each in shifts)


@dataclass(frozen=True)
class Glimpse:
    """Two images `apart_s` seconds from each other, the first at `time_s`. onward: from the first image to that of the
    next glimpse, None where the place is not found again there."""

    time_s: float
    apart_s: float
    shift: Shift
    onward: Shift | None = None


def background_of(glimpses: Sequence[Glimpse]) -> Background | None:
    """How the background moves; None where there are too few glimpses of it, its corners move each their own way, or
    they lie close together. glimpses: in order of time."""
    if not glimpses:
        return None
    if np.median([each.shift.still for each in glimpses]) > _MOST:
        return Background("still")
    together, spread = np.median([(each.shift.together, each.shift.spread) for each in glimpses], axis=0)
    if together < _ONE_PICTURE or spread < _SPREAD:
        return None
    apart = np.array([each.apart_s for each in glimpses])
    speeds = np.array([[each.shift.right, each.shift.down] for each in glimpses]) / apart[:, None]
    at = np.array([each.time_s for each in glimpses])
    lasts = np.diff(at, append=at[-1] + apart[-1])
    # Where the place is found again in the next glimpse its way is measured: of a camera that shakes, speeds that last
    # until then add up to many times that.
    steps = lasts[:, None] * speeds
    for row, onward in enumerate(each.onward for each in glimpses):
        if (
            onward is not None
            and max(onward.together, onward.still) >= _ONE_PICTURE
            and onward.spread >= _SPREAD
        ):
            steps[row] = onward.right, onward.down
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    reach = float(np.hypot(*np.ptp(path, axis=0)))
    speed = float(np.median(np.hypot(*speeds.T)))
    zoom = np.array([each.shift.zoom for each in glimpses]) / apart
    way = float(np.hypot(*steps.T).sum())
    grown, changed = abs((lasts * zoom).sum()), np.abs(lasts * zoom).sum()
    if abs(np.median(zoom)) > _ZOOM or grown > max(_ZOOM, _DRIFT * changed):
        return Background("zooming", speed, reach)
    if reach < TREMBLE or (np.hypot(*path[-1]) < _DRIFT * way and reach < 10 * TREMBLE):
        return Background("hand-held", speed, reach)
    return Background("panning", speed, reach)


def camera_of(
    video: Video,
    people: Sequence[PoseSequence] = (),
    span: tuple[int, int] | None = None,
    focal_px: float | None = None,
    camera: Literal["static", "moving"] | None = None,
    intrinsics: Intrinsics | None = None,
    images: OnePass | None = None,
) -> Camera:
    """A video's camera by its images. people: their 2D keypoints, whose boxes are not looked at. span: first and last
    frame of the take, else of the video. focal_px: where it is known; intrinsics: of a calibrated camera. camera: what
    is told of it; otherwise the background says whether it moves, and where that cannot be told it is taken for one
    that stands still. images: of the video, for others that look at some in the same pass. InputError for a video that
    cannot be decoded."""
    first, last = span or (0, len(video.time_s) - 1)
    if intrinsics is not None:
        focal_px = intrinsics.pinhole_focal_px
        people = [poses.with_(joints=undistorted(poses.joints, intrinsics)) for poses in people]
    focals = focal_px, video.focal_px
    frames = sorted({*np.linspace(first, last, 2 * _LOOKS + 1).round().astype(int)[1::2].tolist()})
    boxes = _boxes(people, frames)
    ask = (images or OnePass(video)).ask
    looks = ask(frames, lambda _, image: undistorted_image(image, intrinsics))()
    still = stands(looks, boxes)
    background = Background("still") if still else _background(video, people, (first, last))
    moves = background is not None and background.moves
    if camera == "moving" or (camera is None and moves) or not looks:
        frames = list(range(first, last + 1, _EVERY))
        pictures = ((frame, undistorted_image(image, intrinsics)) for frame, image in _every(video, frames))
        view = moving_camera(pictures, video.size, _boxes(people, frames), *focals)
    else:
        view = static_camera(looks, boxes, *focals)
    view = replace(view, intrinsics=intrinsics, background=background)
    # Of a camera that shakes other frames have another up than the images that were looked at.
    shaken = []
    for look in view.looks:
        more = view.shake_rad**2 * (np.eye(3) - np.outer(look.up, look.up))
        shaken.append(replace(look, covariance=look.covariance + more))
    return replace(view, looks=tuple(shaken))


def _background(video: Video, people: Sequence[PoseSequence], span: tuple[int, int]) -> Background | None:
    """How the background moves within a tenth of a second, at several times of the span."""
    soon = max(1, round(_SOON_S * video.fps)) if video.fps > 0 else 1
    starts = np.linspace(span[0], max(span[1] - soon, span[0]), _GLIMPSES).round().astype(int)
    pairs = [(int(start), int(start) + soon) for start in np.unique(starts)]
    frames = sorted({frame for pair in pairs for frame in pair})
    images, boxes = images_at(video, frames), _boxes(people, frames)

    def moved(start: int, end: int) -> Shift | None:
        return shift(images[start], images[end], [boxes[start], boxes[end]])

    glimpses, before = list[Glimpse](), span[0]
    for start, end in pairs:
        if start not in images or end not in images or (way := moved(start, end)) is None:
            continue
        if glimpses:
            glimpses[-1] = replace(glimpses[-1], onward=moved(before, start))
        times_s = video.time_s[[start, end]]
        glimpses.append(Glimpse(float(times_s[0]), float(np.diff(times_s)[0]), way))
        before = start
    return background_of(glimpses)


def _every(video: Video, frames: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
    """These frames of a video and their images, in one pass."""
    wanted = set(frames)
    with counted("calibrate", len(frames)) as tell:
        done = 0
        for number, image in images_from(video, frames[0], frames[-1]):
            if number in wanted:
                yield number, image
                done += 1
                tell(done)


def _boxes(people: Sequence[PoseSequence], frames: Sequence[int]) -> Boxes:
    """Boxes along everybody's limbs in these frames, from the nearest row that has joints; a box about the whole of a
    person whose arms are out would hide half of the room."""
    boxes: dict[int, list[np.ndarray]] = {frame: [] for frame in frames}
    for poses in people:
        rows = np.flatnonzero(is_finite(poses.joints).any(axis=1))
        for frame in frames if len(rows) else ():
            joints = poses.joints[rows[np.abs(poses.frame_index[rows] - frame).argmin()]]
            visible = joints[is_finite(joints)]
            reach = _REACH * float((visible.max(axis=0) - visible.min(axis=0)).max())
            lines = [joints[poses.layout.indices(bone)] for bone in poses.layout.bones]
            along = np.linspace(0, 1, _BOXES)[:, None]
            points = np.concatenate([visible, *(a + along * (b - a) for a, b in lines)])
            points = points[is_finite(points)]
            boxes[frame].append(np.concatenate([points - reach, points + reach], axis=-1))
    return {frame: np.concatenate([np.zeros((0, 4)), *around]) for frame, around in boxes.items()}


def static_camera(
    images: Mapping[int, np.ndarray],
    boxes: Boxes,
    told_px: float | None = None,
    file_px: float | None = None,
) -> Camera:
    """Of a camera that stood still. images: {video frame: (H, W, 3) uint8 RGB}, a few of a take. told_px, file_px: a
    focal length that the user, or the video file, states."""
    height, width = next(iter(images.values())).shape[:2]
    view = _looked_at(images, boxes, known_camera((width, height), told_px, file_px))
    against = None if told_px is None else _focal_against(images, boxes, told_px)
    return replace(view, focal_against_px=against)


def _focal_against(images: Mapping[int, np.ndarray], boxes: Boxes, told_px: float) -> float | None:
    """The focal length in pixels by straight lines, where it is beyond doubt not the told one."""
    answer = _lines_of(images, boxes, told_px, _FREE)
    if isinstance(answer, Unknown):
        return None
    apart, sd = abs(np.log(answer.focal_px / told_px)), answer.focal_sd_px / answer.focal_px
    return answer.focal_px if apart > max(_BEYOND * np.hypot(sd, TOLD_SPREAD), _LEAST) else None


def moving_camera(
    images: Iterable[tuple[int, np.ndarray]],
    size: tuple[int, int],
    boxes: Boxes,
    told_px: float | None = None,
    file_px: float | None = None,
) -> Camera:
    """Of a camera that pans or is carried, an answer for each image that gives one; the focal length that the first of
    them tells serves the others. images: video frame and (H, W, 3) uint8 RGB. size: their width and height. The others
    are arguments of static_camera."""
    before = known_camera(size, told_px, file_px)
    looks: list[Look] = []
    reasons = ["no frame could be decoded"]
    for frame, image in images:
        camera = _looked_at({frame: image}, boxes, before)
        looks += camera.looks
        reasons += [camera.reason] if camera.reason else []
        if camera.focal_source != before.focal_source:
            before = replace(camera, looks=(), reason="")
    return replace(before, looks=tuple(looks), reason="" if looks else max(set(reasons), key=reasons.count))


def known_camera(size: tuple[int, int], told_px: float | None, file_px: float | None) -> Camera:
    """What is known of a camera before an image is looked at: its focal length, its error, and who says so."""
    if told_px is not None:
        return Camera(size, told_px, told_px * TOLD_SPREAD, "told")
    if file_px is not None:
        return Camera(size, file_px, file_px * FILE_SPREAD, "file")
    focal = PRIOR_FOCAL * max(size)
    return Camera(size, focal, focal * ASSUMED_FOCAL_SD, "prior")


def _lines_of(
    images: Mapping[int, np.ndarray], boxes: Boxes, focal_px: float | None, spread: float
) -> ImageUp | Unknown:
    """`up_from_images` of them, in order."""
    frames = sorted(images)
    around = [boxes.get(frame, np.zeros((0, 4))) for frame in frames]
    return up_from_images([images[frame] for frame in frames], focal_px, around, spread)


def _looked_at(images: Mapping[int, np.ndarray], boxes: Boxes, before: Camera) -> Camera:
    """The camera with what the lines of images of one place say of it; where these do not tell up, with the reason."""
    # What fits draw an unknown focal length to is narrower than what is stated of it where no image tells it.
    known_px, spread = None, PRIOR_FOCAL_SPREAD
    if before.focal_source != "prior":
        known_px, spread = before.focal_px, before.focal_sd_px / before.focal_px
    answer = _lines_of(images, boxes, known_px, spread)
    if isinstance(answer, Unknown):
        return replace(before, reason=answer.reason)
    view = replace(before, looks=(replace(answer.look, frame=min(images)),))
    # What is told stays. Lines that say no more about the focal length than was known before leave it as it was, too.
    if before.focal_source == "told" or answer.focal_sd_px / answer.focal_px >= 0.8 * spread:
        return view
    source = "lines" if before.focal_source == "prior" else before.focal_source
    return replace(view, focal_px=answer.focal_px, focal_sd_px=answer.focal_sd_px, focal_source=source)
