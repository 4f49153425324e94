"""What a file of poses, a video or an image is, and what is wrong with it, before anything is computed."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.camera import pitch_roll_deg
from ..core.errors import InputError, readable
from ..core.messages import how_many, rate_in_words
from ..core.notices import EXIT_CODES, Notice, grave, notice, verdict
from ..core.pose import PoseSequence
from ..core.take import Take, Told
from ..plugins import registry
from ..reading.bounds import check_times, rate_doubts
from ..reading.findings import pose_findings, row_findings, swap_findings
from ..reading.load import load, read_video
from ..reading.people import choose_person
from ..signals.altered import altered
from ..signals.checks import Chirality, bone_spread, chirality, spread_of_bones
from ..signals.swaps import Swap, as_frames, find_swaps

_RECTIFIED = 600  # frames, a second of work; up needs no more

__all__ = ["Inspection", "Person", "inspect"]


@dataclass(frozen=True, eq=False)
class Person:
    """One person of a file.

    source: as the adapter gives it. poses: the same as `read` would give it, left and right as they are; None for 2D
    and where the reader refuses. swaps: rows in which limbs are exchanged, or both on one.
    """

    source: PoseSequence
    poses: PoseSequence | None
    findings: tuple[Notice, ...]
    swaps: tuple[Swap, ...] = ()

    @property
    def chirality(self) -> Chirality | None:
        return chirality(self.poses) if self.poses else None

    @property
    def verdict(self) -> str:
        """The gravest finding: "good", "suspicious" or "unusable"."""
        return verdict(self.findings)

    def figures(self) -> dict[str, Any]:
        """Plain values; None where unknown. Spreads and shares are fractions."""
        source, poses, sides = self.source, self.poses, self.chirality
        evidence = {} if sides is None else {name: _known(value) for name, value in asdict(sides).items()}
        return {
            "person": source.person,
            "verdict": self.verdict,
            "layout": source.layout.name,
            "frame": source.frame.name,
            "axes": list(source.frame.axes),
            "origin": source.frame.origin,
            "unit": source.frame.unit,
            "fps": None if source.time_s is None else _known(source.fps),
            "rows": len(source),
            "first_frame": int(source.frame_index[0]) if source.frames_known else None,
            "last_frame": int(source.frame_index[-1]) if source.frames_known else None,
            "seams": list(source.seams),
            "bone_spread": _known(bone_spread(poses)) if poses else None,
            "bone_spreads": spread_of_bones(poses) if poses else None,
            "stature_m": _known(implied_stature(poses.joints)) if poses and poses.frame.metric else None,
            "left_and_right": None if sides is None else {"verdict": sides.verdict, **evidence},
            "swaps": as_frames(source, self.swaps),
            "notices": [finding.as_dict() for finding in self.findings],
        }


@dataclass(frozen=True, eq=False)
class Inspection:
    """What `inspect` found. adapter: the name of the one that read the file."""

    path: Path
    adapter: str
    people: tuple[Person, ...]

    @property
    def verdict(self) -> str:
        """That of the worst person."""
        return max((person.verdict for person in self.people), key=list(EXIT_CODES).index)

    def figures(self) -> dict[str, Any]:
        people = [person.figures() for person in self.people]
        return {"file": self.path.name, "adapter": self.adapter, "verdict": self.verdict, "people": people}

    def __str__(self) -> str:
        people = how_many(len(self.people), "person", "people")
        lines = [f"{self.path}: {self.verdict}; adapter {self.adapter}, {people}"]
        for person in self.people:
            lines += ["", *_lines(person)]
        return "\n".join(lines)


def inspect(
    path: Path,
    adapter: str = "auto",
    options: dict[str, Any] | None = None,
    person: str | None = None,
) -> Inspection:
    """Read 3D poses or 2D keypoints as they are and look for what does not fit.

    adapter, options: as for read_all. person: only this one, "longest" or "largest". Raises InputError when a file
    cannot be read at all.
    """
    read = load(path, adapter, None, options or {})
    sources = read.people if person is None else (choose_person(read.people, person, str(path)),)
    people = []
    for source in sources:
        findings = [*row_findings(source), *altered(source)[1]]
        poses = None
        if source.time_s is not None:
            try:
                check_times(source.time_s, str(path))
            except InputError as error:
                findings.append(notice("refused", reason=str(error)))
        if source.frame.dims == 3:
            try:
                poses = read.normalised(source, told=Told(check="off"))
            except InputError as error:
                findings.append(notice("refused", reason=str(error)))
            else:
                for each in pose_findings(poses, source.frame.unit):
                    refused = each.code == "upside-down"  # by a run
                    findings.append(replace(each, weight="unusable") if refused else each)
                findings += _up_findings(poses, findings)
        looked_at = poses if poses is not None else source
        swaps = find_swaps(looked_at) if poses is not None or source.frame.dims == 2 else ()
        findings += swap_findings(looked_at, swaps)
        people.append(Person(source, poses, tuple(findings), swaps))
    return Inspection(path, read.adapter, tuple(people))


def _up_findings(poses: PoseSequence, findings: list[Notice]) -> list[Notice]:
    """What a run judges the poses by once it has rectified them, of some seconds in the middle. found: so far."""
    if verdict(findings) == "unusable":
        return []
    first = max((len(poses) - _RECTIFIED) // 2, 0)
    some = poses.rows(first, min(first + _RECTIFIED, len(poses)))
    rectified = registry.load("stages", "rectify")()(Take("inspect", poses=some, findings=tuple(findings)))
    return [*grave(rectified.notices)]


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _lines(person: Person) -> list[str]:
    source, facts = person.source, person.figures()
    frames = f"video frames {facts['first_frame']} to {facts['last_frame']}"
    lines = [
        f"person {source.person}: {person.verdict}",
        f"  layout     {source.layout.name}",
        f"  frame      {source.frame}",
        f"  rows       {len(source)}, {frames if source.frames_known else 'frame numbers unknown'}",
        f"  fps        {'unknown' if facts['fps'] is None else format(facts['fps'], '.4g')}",
    ]
    if person.poses is not None:
        stature = facts["stature_m"]
        lines += [
            f"  stature    {'unknown, the file has no scale' if stature is None else f'{stature:.2f} m by its limbs'}",
            f"  left/right {facts['left_and_right']['verdict']}: {person.chirality}",
            f"  bones      {_percent(facts['bone_spread'])} mean spread of length; by bone:",
            *_columns(facts["bone_spreads"]),
        ]
    return lines + [f"  {finding.weight + ':':<12}{finding.text}" for finding in person.findings]


def _columns(spreads: dict[str, float]) -> list[str]:
    cells = [f"{bone:<22}{_percent(spread):>5}" for bone, spread in spreads.items()]
    return ["             " + "   ".join(cells[i : i + 3]) for i in range(0, len(cells), 3)]


def _percent(share: float | None) -> str:
    return "unknown" if share is None else f"{100 * share:.0f} %"


_FOCAL_BY = {"told": "as told", "file": "by the video file", "lines": "by the lines", "prior": "a guess"}


@dataclass(frozen=True, eq=False)
class InspectedImages:
    """A video or an image, and what the stage `calibrate` says about its camera."""

    path: Path
    take: Take

    def figures(self) -> dict[str, Any]:
        """Plain values; None where unknown."""
        camera = self.take.need("camera")
        width, height = camera.image_size
        values: dict[str, Any] = {"file": str(self.path), "width": width, "height": height}
        if (video := self.take.video) is not None:
            values |= {
                "codec": video.codec, "rotation_deg": video.rotation_deg, "frames": len(video.time_s),
                "fps": video.fps, "capture_fps": video.capture_fps,
                "duration_s": float(video.time_s[-1] + np.nan_to_num(1 / video.fps)),
            }  # fmt: skip
        pitch, roll, error = None, None, None
        if camera.looks:
            look = camera.looks[0]
            pitch, roll = pitch_roll_deg(look.up).tolist()
            error = look.error_deg
        return values | {
            "pitch_deg": pitch, "roll_deg": roll, "up_error_deg": error, "reason": camera.reason or None,
            "focal_px": camera.focal_px, "focal_sd_px": camera.focal_sd_px, "focal_source": camera.focal_source,
        }  # fmt: skip

    def __str__(self) -> str:
        take, values, video = self.take, self.figures(), self.take.video
        size = f"{values['width']} x {values['height']} pixels"
        lines = [f"{self.path}: image, {size}"]
        if video is not None:
            turned = f", turned by {video.rotation_deg} degrees" if video.rotation_deg else ""
            rate = rate_in_words(video.fps, ", ")
            lines = [
                f"{self.path}: video, {video.codec}, {size}{turned}",
                f"{how_many(values['frames'], 'frame')}{rate}, {values['duration_s']:.1f} s",
                *(each.text for each in (*video.doubts, *rate_doubts(None, video))),
            ]
        has_up = values["pitch_deg"] is not None
        return "\n".join([
            *lines,
            f"pitch {values['pitch_deg']:.1f} and roll {values['roll_deg']:.1f} degrees, standard deviation of up "
            f"{values['up_error_deg']:.1f}" if has_up else f"pitch and roll are not known: {values['reason']}",
            *(each.text for each in take.notices),
            f"focal length {values['focal_px']:.0f} pixels, standard deviation {values['focal_sd_px']:.0f}, "
            f"{_FOCAL_BY[values['focal_source']]}",
        ])  # fmt: skip


def inspect_video(path: Path) -> InspectedImages:
    """A video file's facts and its camera. InputError when it is none, or cannot be read."""
    take = Take(path.name, video=read_video(path))
    return InspectedImages(path, registry.load("stages", "calibrate")()(take))


def inspect_image(path: Path) -> InspectedImages:
    """An image's camera. InputError when it is none, or cannot be read."""
    stage = registry.load("stages", "calibrate")()
    return InspectedImages(path, stage.of_image(path.name, _image(path)))


def is_image(path: Path) -> bool:
    """Whether a file begins like an image that OpenCV reads (PNG, JPEG, WebP, TIFF, BMP and others). Never raises."""
    import cv2

    return path.is_file() and cv2.haveImageReader(str(path))


def _image(path: Path) -> np.ndarray:
    """(H, W, 3) uint8 RGB. InputError when it is no image."""
    import cv2

    with readable(path, "an image"):
        content = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    if image is None:
        raise InputError(
            "file-damaged", f"Expected an image (PNG, JPEG, ...) in {path}; it cannot be decoded."
        )
    return np.ascontiguousarray(image[:, :, ::-1])
