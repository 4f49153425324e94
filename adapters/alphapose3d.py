"""3D joints in AlphaPose's alphapose-results.json: `pred_xyz_jts` of its SMPL model, HybrIK's.

Beside the keypoints that adapter json2d reads, each entry of the list has 24 joints in SMPL's order: camera axes about
SMPL's pelvis, in units of the depth that the network covers, which is 2 m unless a config says BBOX_3D_SHAPE. Nose and
top of the head are made of the shoulders and the neck, for SMPL's joints end at the skull. The person's place is not in
the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import H36M17, Layout
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.skeletons import SMPL, h36m17_named
from .kit.clock import Moments
from .kit.json import field, first_person, name_of, numbers, people
from .kit.people import People

name = "alphapose3d"
gives = "poses"
made_by = MadeBy("estimated", "AlphaPose")
reads = "alphapose-results.json of AlphaPose's SMPL model: 3D joints (pred_xyz_jts) in camera axes"

_KEY = "pred_xyz_jts"
_SMPL = Layout("SMPL24", (*SMPL, "l_hand", "r_hand"))
_SHAPE = (len(_SMPL), 3)
_STATURE_M = (0.9, 2.6)


def sniff(path: Path) -> bool:
    first = first_person(path)
    return first is not None and first[1] and _KEY in first[0]


def read(path: Path, track: bool = False, unit_m: float = 2.0) -> tuple[PoseSequence, ...]:
    """One sequence a tracked person, named by its `idx`: H36M17 in CAMERA, metres; frame_index = image number.

    track: ignore `idx` and join each body to the nearest of the frames before, by their boxes.
    unit_m: the file's unit in metres, the third number of the config's BBOX_3D_SHAPE over 1000.
    InputError when the file is not of this form, when a body is no human's in that unit, and when a person is in a
    frame twice because nobody was tracked.
    """
    moments, sightings = Moments(str(path)), People(str(path))
    for moment, entry, where in people(path, "AlphaPose's results", moments):
        field(entry, "image_id", where)
        joints = numbers(field(entry, _KEY, where), f"{where}, {_KEY}")
        if joints.shape != _SHAPE:
            raise InputError(
                "wrong-content", f"{where}: expected {_KEY} of shape {_SHAPE}, got {joints.shape}."
            )
        person = None if track else name_of(entry)
        box = numbers(entry.get("box") or [], f"{where}, box")  # left, top, width and height
        corners = np.concatenate([box[:2], box[:2] + box[2:]]) if box.shape == (4,) else None
        sightings.add(moment, unit_m * joints, person=person, box=corners)
    everybody = []
    for poses in sightings.poses(_SMPL, CAMERA.with_(origin="body model"), moments.clock()):
        joints = h36m17_named(poses.joints, list(_SMPL.joints))
        stature = implied_stature(joints)
        if not _STATURE_M[0] < stature < _STATURE_M[1]:
            raise InputError(
                "wrong-axes",
                f"{path}: expected a body of human size, got limbs of a person of {stature:.2g} m; give the file's "
                "unit in metres with unit_m= (-O unit_m=2.2), the third number of the config's BBOX_3D_SHAPE over "
                "1000.",
            )
        made = poses.with_(joints=joints, layout=H36M17, confidence=None)
        derived = {"nose": "before the neck's end, as the shoulders face", "head": "along the neck"}
        everybody.append(made.deriving("smpl", derived))
    return tuple(everybody)
