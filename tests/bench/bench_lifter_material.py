"""What each kind of the lifter's training material is worth, on people of the validation:

    python tests/bench/bench_lifter_material.py DIR [STEPS [CHANGE ...]]

Trains a small network for single frames with everything that models/lab/training/lifter/lifter.toml has, and one with
each
CHANGE (a name in CHANGES; without any, all of them), all with the same steps and seed. Prints MPJPE in mm on each
part of the validation: as they are, with bodies turned about any axis (as people who lie and fall are), without a
nose, with a good detector's noise, with the errors that last as well (to a single frame more noise), and placed as in
real videos; then PA and rigid of the real take from OpenPose's keypoints, focal length unknown. Stopped, the same
command goes on.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from pcnet3d.models.common.metrics import joint_error, scaled
from pcnet3d.models.lab.common.training import load_weights
from pcnet3d.models.lab.evaluation.real_data import MOVING, openpose_keypoints, read_cameras, read_truth
from pcnet3d.models.lab.evaluation.real_take import lift_row
from pcnet3d.models.lab.mocap.clips import data_folder
from pcnet3d.models.lab.synthetic.on_device.draw import Draw
from pcnet3d.models.lab.synthetic.on_device.poses import PoseRange
from pcnet3d.models.lab.training import lifter as lifter
from pcnet3d.models.lab.training.lifter.net import LifterNet, NetConfig
from pcnet3d.models.lab.training.lifter.train import TrainConfig, clips_of, read_config, run
from pcnet3d.models.lab.training.lifter.windows import Batch, Material, Windows
from pcnet3d.models.lifter.features import ASSUMED_FOCAL, features
from pcnet3d.pipeline import CAMERA, remap, rotate
from pcnet3d.pipeline.files.video_frames import shown_size
from pcnet3d.pipeline.reading.load import read_video

WITHOUT: dict[str, dict[str, object]] = {
    "everything": {},
    "no limbs of other motions": {"poses.exchanged": 0.0},
    "no sampled limbs": {"poses.sampled": 0.0},
    "no turned or leaning bodies": {"poses.turned": 0.0, "poses.leaning": 0.0},
    "no swung or other trunks": {"poses.swung": 0.0, "combined": 0.0},
    "no real proportions, no other definitions": {"real": 0.0, "redefined": 0.0},
    "no typical cameras": {"typical": 0.0},
    "one quality of detector, nobody cut off or hidden": {"quality": 0.0, "truncated": 0.0, "occluded": 0.0},
    "every joint there": {"absent": {}},
}
WITHOUT["none of it"] = {key: value for changes in WITHOUT.values() for key, value in changes.items()}
WITH: dict[str, dict[str, object]] = {
    "half placed": {"placed": 0.5},
    "half good detectors": {"good": 0.5},
    "lasting errors": {"slow": 0.006},
}
WITH["all three"] = {key: value for changes in WITH.values() for key, value in changes.items()}
CHANGES = WITHOUT | WITH


def changed(material: Material, changes: dict[str, object]) -> Material:
    poses = {key[6:]: value for key, value in changes.items() if key.startswith("poses.")}
    rest = {key: value for key, value in changes.items() if not key.startswith("poses.")}
    return replace(material, poses=replace(material.poses, **poses), **rest)


def tests_of(config: TrainConfig) -> dict[str, Batch]:
    plain = Material(unchanged=1.0, mirrored=0.0, other_rates=0.0, derived=0.3, typical=0.5)
    kinds = {
        "": plain,
        ", turned": replace(plain, poses=PoseRange(turned=1.0)),
        ", no nose": replace(plain, absent={"nose": 1.0}),
        ", good": replace(plain, good=1.0),
        ", lasting": replace(plain, slow=0.01),
        ", placed": replace(plain, placed=1.0),
    }
    _, val = clips_of(config)
    return {
        f"{name}{kind}": Windows(clips, material).batch(Draw(1, 0), 4000, 1)
        for name, clips in val.items()
        for kind, material in kinds.items()
    }


def errors(net: LifterNet, batches: dict[str, Batch]) -> dict[str, float]:
    found = {}
    with torch.no_grad():
        for name, batch in batches.items():
            answer, truth = (part.numpy().astype(np.float64) for part in (net(batch.x)[0], batch.joints))
            found[name] = 1000 * float(joint_error(scaled(answer, truth), truth).mean())
    return found


def real_errors(net: LifterNet) -> dict[str, float]:
    """PA and rigid in mm of evaluation/real_take.py, mean of the cameras, every frame by itself."""
    folder = data_folder() / "real" / MOVING
    cameras = read_cameras(folder)
    truth = read_truth(folder, list(cameras))
    rows = []
    for name, camera in cameras.items():
        size = shown_size(read_video(camera.video))
        found = openpose_keypoints(truth.openpose[name], np.arange(len(truth.limbs)) / 60)
        keypoints = remap(found)
        x, R_camera_from_ray = features(
            keypoints.joints[:, None],
            keypoints.confidence[:, None],
            np.tile(np.array(size, dtype=float), (len(found), 1)),
            np.full(len(found), ASSUMED_FOCAL * max(size)),
        )
        with torch.no_grad():
            joints = rotate(R_camera_from_ray, net(torch.from_numpy(x))[0].numpy().astype(np.float64))[:, 0]
        rows.append(lift_row(keypoints.with_(joints=joints, frame=CAMERA), truth.limbs))
    return {
        f"real take {kind}": float(np.mean([row[f"{kind}_mm"] for row in rows])) for kind in ("pa", "rigid")
    }


def main(folder: Path, steps: int = 500, *names: str) -> None:
    torch.set_num_threads(1)
    shipped = read_config(Path(lifter.__file__).with_name("lifter.toml"))
    schedule = shipped.schedule.model_copy(
        update={"steps": steps, "cooldown": 0.4, "average": 0.99, "every": steps}
    )
    base = shipped.model_copy(
        update={
            "schedule": schedule,
            "single": steps,
            "frames": 2048,
            "net": NetConfig(width=24, trunk=192, dilations=(1, 3, 1, 3)),
        }
    )
    batches = tests_of(base)
    for row, name in enumerate(names or CHANGES):
        config = base.model_copy(update={"material": changed(base.material, CHANGES[name])})
        output = folder / name.replace(" ", "-")
        run(config, output, "cpu")
        net = load_weights(LifterNet(config.net), output / "best.pt")
        found = errors(net, batches) | real_errors(net)
        if row == 0:
            print(f"| | {' | '.join(found)} |\n|{' --- |' * (len(found) + 1)}")
        print(f"| {name} | {' | '.join(f'{value:.1f}' for value in found.values())} |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:3]), *sys.argv[3:])
