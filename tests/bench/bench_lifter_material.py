"""What each kind of the lifter's training material is worth, on people of the validation:

    python tests/bench/bench_lifter_material.py DIR [steps]

Trains a small network for single frames with everything that models/lifter/training/lifter.toml has, and one without
each kind, all with the same steps and seed; prints MPJPE in mm on each part of the validation, as they are, with bodies
turned about any axis (as people who lie and fall are), and without a nose. Stopped, the same command goes on.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from pcnet3d.models.common.metrics import joint_error, scaled
from pcnet3d.models.common.training import load_weights
from pcnet3d.models.lifter.training.net import LifterNet, NetConfig
from pcnet3d.models.lifter.training.train import TrainConfig, clips_of, read_config, run
from pcnet3d.models.lifter.training.windows import Batch, Material, Windows
from pcnet3d.models.synthetic.on_device.draw import Draw
from pcnet3d.models.synthetic.on_device.poses import PoseRange

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


def main(folder: Path, steps: int = 600) -> None:
    torch.set_num_threads(1)
    shipped = read_config(Path(__file__).resolve().parents[2] / "models" / "lifter.toml")
    schedule = shipped.schedule.model_copy(
        update={"steps": steps, "cooldown": 0.4, "average": 0.99, "every": steps}
    )
    base = shipped.model_copy(
        update={
            "schedule": schedule,
            "single": steps,
            "frames": 2048,
            "net": NetConfig(width=256, dilations=(1, 3, 1, 3)),
        }
    )
    batches = tests_of(base)
    print(f"| | {' | '.join(batches)} |\n|{' --- |' * (len(batches) + 1)}")
    for name, changes in WITHOUT.items():
        config = base.model_copy(update={"material": changed(base.material, changes)})
        output = folder / name.replace(" ", "-")
        run(config, output, "cpu")
        net = load_weights(LifterNet(config.net), output / "best.pt")
        found = errors(net, batches)
        print(f"| {name} | {' | '.join(f'{value:.1f}' for value in found.values())} |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:3]))
