"""A finished run's folder, read back as the take that it holds. stages/export/stage.py writes what is read here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, Field, ValidationError

from ..core.camera import Background, Camera, FocalSource, view_rotation
from ..core.errors import InputError
from ..core.frames import IMAGE, LEVEL, Frame
from ..core.layouts import Layout, body_of
from ..core.measures import read_measures
from ..core.notices import About, Notice, Weight, grave
from ..core.pose import MadeBy, PoseSequence, Rectified, RootPath, Step
from ..core.take import AngleErrors, CameraMotion, Session, Take, Told
from .arrays import load_all
from .atomic import SUMMARY, read_object
from .names import KINEMATICS, OF_RECTIFIED, POSES


class _Sequence(BaseModel):
    """Fields of a PoseSequence by their names there."""

    person: str
    frames_known: bool
    seams: tuple[int, ...]
    made_by: MadeBy
    derived: frozenset[str]

    def fields(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _Sequence.model_fields}


class _Poses(_Sequence):
    """steps: of the take's history, so many are of the poses."""

    frame: Frame
    root_shared: tuple[float, float] | None  # of the path of `level`
    steps: int


class _Keypoints(_Sequence):
    layout: str


class _Rectification(BaseModel):
    """up_by_source: what each source of up says (stages/export/stage.py)."""

    method: str
    camera: CameraMotion | None
    level_heading: str
    level_ok: bool
    level_reason: str
    up_shares: dict[str, float]
    up_by_source: dict[str, dict[str, float]]
    steps: int


class _Camera(BaseModel):
    """Fields of a Camera by their names there."""

    image_size: tuple[int, int]
    focal_px: float
    focal_sd_px: Annotated[float, BeforeValidator(lambda px: np.nan if px is None else px)]
    focal_source: FocalSource
    reason: str = Field(alias="no_up_reason")
    background: Background | None


class _Notice(BaseModel):
    code: str
    weight: Weight
    about: About
    text: str
    rows: tuple[int, ...] | None
    values: dict[str, Any]

    def said(self) -> Notice:
        """The notice, which says what the run said, though another version's catalogue may have other words."""
        notice = Notice(self.code, self.weight, self.about, self.rows, self.values)
        try:
            same = notice.text == self.text
        except (KeyError, TypeError, ValueError):  # it lacks what this catalogue's sentence tells
            same = False
        return notice if same else replace(notice, values={**self.values, "text": self.text})


class _Summary(BaseModel):
    """What summary.json says of a take."""

    take: str
    session: Session
    told: Told
    inputs: tuple[dict[str, Any], ...]
    verdict: str | None
    notices: tuple[_Notice, ...]
    poses: _Poses
    keypoints: _Keypoints | None
    rectification: _Rectification
    camera: _Camera | None
    measures: dict[str, Any] | None
    cutoff_hz: float | None
    angle_errors: AngleErrors | None
    history: tuple[Step, ...]


def read_run(folder: str | Path) -> Take:
    """The take in the folder of a finished run, of one person.

    What no file of a run holds is None or empty: the video, the errors of smoothed poses, the stated errors of joints,
    the images that show which way is up, confidences of poses, and findings that do not make
    the poses doubtful. The pelvis path is in `rectified.level`. The error of an estimated path
    has its standard deviations along LEVEL's axes, without their correlations.

    Raises InputError where no run has finished, and for files that are damaged or of another version.
    """
    folder = Path(folder)
    try:
        summary = _Summary.model_validate(read_object(folder / SUMMARY))
        take = _take(summary, load_all(folder / POSES))
        return take.with_(kinematics=_kinematics(folder, len(take.need("poses"))))
    except ValidationError as error:
        first = error.errors()[0]
        reason = f"{SUMMARY}, {'.'.join(map(str, first['loc']))}: {first['msg']}"
    except KeyError as error:
        reason = f"{POSES} has no array {error}"
    except InputError as error:
        reason = str(error).rstrip(".")
    if not (folder / SUMMARY).is_file():
        if not folder.is_dir():
            there = "a file" if folder.exists() else "nothing"
            raise InputError(
                "cannot-open",
                f"Expected the folder of a finished `pcnet3d run` at {folder}, found {there} there.",
            )
        reason = f"it has no {SUMMARY}"
    inside = sorted(path.parent for path in folder.glob(f"*/{POSES}"))
    what = f"read one of the runs in it, such as {inside[0]}" if inside else "run it again"
    raise InputError(
        "format-unknown", f"Expected the folder of a finished `pcnet3d run` at {folder} ({reason}); {what}."
    )


def _take(summary: _Summary, arrays: dict[str, np.ndarray]) -> Take:
    notices = tuple(each.said() for each in summary.notices)
    judged = summary.verdict is not None
    keypoints = summary.keypoints
    poses = PoseSequence(
        arrays["source"],
        body_of(map(str, arrays["joint_names"])),
        summary.poses.frame,
        time_s=arrays["time_s"],
        frame_index=arrays["frame_index"],
        history=tuple(step for step in summary.history if step.name != "rectify")[: summary.poses.steps],
        **summary.poses.fields(),
    )
    rectified = _rectified(summary, arrays, poses)
    filtered = arrays.get("filtered")
    return Take(
        summary.take,
        keypoints=keypoints
        and PoseSequence(
            arrays["keypoints"],
            Layout(keypoints.layout, tuple(map(str, arrays["keypoints_names"]))),
            IMAGE,
            confidence=arrays["keypoints_confidence"],
            time_s=arrays.get("keypoints_time_s"),
            frame_index=arrays["keypoints_frame_index"],
            **keypoints.fields(),
        ),
        camera=None if summary.camera is None else Camera(**vars(summary.camera)),
        poses=poses,
        findings=grave(notices) if judged else None,
        rectified=rectified,
        filtered=None
        if filtered is None
        else rectified.level.with_(joints=filtered, path=None, history=summary.history),
        cutoff_hz=summary.cutoff_hz,
        angle_errors=summary.angle_errors,
        measures=None if summary.measures is None else read_measures(summary.measures),
        notices=tuple(each for each in notices if each not in grave(notices)) if judged else notices,
        inputs=summary.inputs,
        session=summary.session,
        told=summary.told,
    )


def _rectified(summary: _Summary, arrays: dict[str, np.ndarray], poses: PoseSequence) -> Rectified:
    fields, axes = summary.rectification, poses.frame
    root, sd = _where_known(arrays["root"]), _where_known(arrays["root_sd"])
    covariance = None if sd is None else sd[:, None] ** 2 * np.eye(3)
    path = None if root is None else RootPath(root, covariance, summary.poses.root_shared)
    own = {}  # up, of a camera that stands so, and its error, by source
    for name, source in fields.up_by_source.items():
        if source.keys() >= {"pitch_deg", "roll_deg"}:
            R = view_rotation(*(np.array(angle) for angle in (0.0, source["pitch_deg"], source["roll_deg"])))
            own[name] = axes.basis @ R[:, 2], source.get("error_deg") or np.nan
    held: dict[str, Any] = {name: arrays[name] for name in OF_RECTIFIED}
    return Rectified(
        level=poses.with_(
            joints=arrays["level"],
            frame=LEVEL.with_(unit=axes.unit),
            path=path,
            history=summary.history[: fields.steps],
        ),
        source=axes,
        up_own=own,
        **fields.model_dump(exclude={"up_by_source", "steps"}),
        **held,
    )


def _where_known(values: np.ndarray) -> np.ndarray | None:
    """The array, None where nothing of it is known."""
    return None if np.isnan(values).all() else values


def _kinematics(folder: Path, rows: int) -> dict[str, np.ndarray] | None:
    """The columns by name; None where the file is gone."""
    import pyarrow.lib
    import pyarrow.parquet as pq

    path = folder / KINEMATICS
    if not path.exists():
        return None
    try:
        with open(path, "rb") as file:  # pyarrow takes no path that is not UTF-8, and "a:b" for an address
            table = pq.read_table(file)
    except (OSError, ValueError, pyarrow.lib.ArrowException) as error:
        raise InputError("file-damaged", f"{KINEMATICS} is damaged: {error}") from None
    if table.num_rows != rows:
        raise InputError("file-damaged", f"{KINEMATICS} has {table.num_rows} rows, {POSES} {rows}")
    columns = (name for name in table.column_names if name not in ("frame", "time_s"))
    return {name: table[name].to_numpy() for name in columns}
