"""What there was and is not any more, with what to do instead.

A name of `REMOVED` is refused with its sentence wherever an unknown name is refused: commands and flags in
pipeline/cli.py, plug-ins in registry.py, `--set` in pipeline/reading/settings.py and pipeline/running/plan.py, reports
in models/lab/evaluation/evaluate.py, which are the only callers of `refuse_removed`.

To add a row: choose the kind, write the name as a user typed it, and one sentence that says what to do instead, in the
present, without a full stop. Names by kind:

- "commands": "imu". "flags": "COMMAND --FLAG", such as "live --stream".
- "settings": "STAGE.KEY" or "read.KEY", as `--set` and recipes have it; "STAGE.KEY=VALUE" if only a value went.
- "reports": of `pcnet3d lab evaluate`.
- a group of plug-ins ("adapters", "stages", "writers", "lifters", "detectors", "rectifiers"): the plug-in's name.

tests/pipeline/plugins/test_removed.py tries every row. The table is for those who used an unreleased version: it goes,
with this module and its five callers, with the first release.
"""

from __future__ import annotations

from typing import Literal

from ..core.errors import InputError

Kind = Literal[
    "commands",
    "flags",
    "settings",
    "adapters",
    "stages",
    "writers",
    "lifters",
    "detectors",
    "rectifiers",
    "reports",
]

_ARRAY = "save its joints as .npy, for --adapter arrays -O layout=MPI3DHP17 -O frame=CAMERA -O unit=mm"
_FILE = "lift with that program and give its file with --poses"

REMOVED: dict[Kind, dict[str, str]] = {
    "commands": {
        "imu": "pcnet3d compare RESULTS --imu FILE compares a run with a sensor",
        "calibrate": "pcnet3d inspect FILE shows pitch, roll and focal length of a video or an image",
        **{
            name: f"it is `pcnet3d lab {name}` now"
            for name in ("bench", "evaluate", "mmfi", "mocap", "testbed", "train")
        },
    },
    "flags": {
        "batch --outside": "leave it out; paths of a manifest may lead anywhere",
        "batch --primary": "test a primary outcome on study.parquet, by the recipe of docs/visits.md",
        "compare --device": "leave it out; compare uses no network",
        "compare --rectifier": "run with --set rectify.rectifier=NAME, and compare that run",
        "live --also": "give it to `pcnet3d run` of what live recorded",
        "live --realtime": "leave it out; live prints the latency of a file, too",
        "live --recipe": "give it to `pcnet3d run` of what live recorded",
        "live --stature": "give it to `pcnet3d run` of what live recorded",
        "live --view": "leave it out; `pcnet3d view` shows live.rrd, and --json prints every pose at once",
        "live --web": "leave it out; `pcnet3d view` shows live.rrd, and --json prints every pose at once",
        "live --stream": "--json prints poses on standard output, for a program that sends them on",
        "run --neutral": "leave it out; angles less those of standing were off by more than the angles themselves",
        "run --person all": "--everyone processes everybody, also of a video alone",
        "run --person pick": "--everyone processes everybody, and a run of one person says who else was visible",
    },
    "settings": {
        "calibrate.gravity_network": "give up as that network tells it, --set read.gravity=X,Y,Z in the camera's axes",
        "detect.person_kind": "leave it out; people's boxes are YOLOX's, with dets and labels",
        "lift.lifter_kind=blazepose": _FILE,
        "lift.lifter_kind=instanthmr": _FILE,
        "lift.lifter_kind=rtmw3d": _FILE,
        "measures.repeated": "--set measures.repeat=ANGLE counts the repetitions of any angle",
        **dict.fromkeys(
            ("angles.smoother=savgol", "trajectories.smoother=savgol"),
            "give butterworth, the usual filter, whose cut-off is --set trajectories.cutoff_hz=HZ",
        ),
        "trajectories.cutoff_hz=auto": "give a number of Hz, or leave it out for the usual 6",
        "trajectories.foot_lock": "leave it out; feet of an estimated path slide within its stated error",
        "read.swaps=repair": "correct the keypoints where they were made, or give read.swaps=mask",
    },
    "adapters": {
        **dict.fromkeys(
            ("alphapose", "coco", "mmpose2d", "openpose"),
            "leave it out; adapter json2d reads all JSON of 2D keypoints",
        ),
        "ddhpose_3dhp": _ARRAY,
        "display": "give the poses as the lifter gave them, before they were turned for display",
        "mpi3dhp": _ARRAY,
        "rtmw3d": "leave it out; adapter mmpose3d reads RTMW3D's results",
        "openpose3d": "leave it out; adapter json3d reads OpenPose's 3D results",
        "totalcapture": "give the BVH file of the data set",
        "totalcapture_imu": "write each sensor as a table of the columns that docs/visits.md names",
    },
    "writers": {"bids": "give --also csv and build the data set of it with a program for BIDS"},
    "reports": {
        "lifters": "`pcnet3d lab evaluate lifter --lifter FILE` judges one; compare its means by person",
        "motion": "`pcnet3d lab evaluate errors` judges accelerations by the smoother that runs have",
        "own-data": "it is `pcnet3d lab evaluate rectifiers --data FILE` now",
        "swaps": "leave it out; docs/files.md says how many exchanges are found",
        "visits": "leave it out; `pcnet3d compare` states the error of each difference of two visits",
    },
    "lifters": {"instanthmr": _FILE, "rtmw3d": _FILE},
}


def refuse_removed(kind: str, name: str) -> None:
    """InputError "name-unknown" with the sentence of that name, if it is one that was removed."""
    for group, sentences in REMOVED.items():
        if group == kind and name in sentences:
            raise InputError("name-unknown", f"{name} was removed: {sentences[name]}.")
