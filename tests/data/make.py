"""Makes the sample of motion capture beside it out of the data folder:  PCNET3D_DATA=... python tests/data/make.py

The clips are copied as they are, in the order of the data folder, so that a test on a clip has the same numbers from
the sample as from the folder. The same folder gives the same arrays.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

# Mostly of skeletons that are the person's own. The comments say what the people do.
CLIPS = (
    # train
    "02_01", "02_02",  # walk
    "02_03",  # run
    "02_04",  # jump
    "05_02",  # dance
    "11_01",  # kick a ball
    "16_01", "16_02", "16_03", "16_04", "16_05",  # jump up, high, forwards
    "16_22", "38_02",  # walk
    "64_01",  # golf
    "118_02", "118_03", "118_06", "118_10", "118_30",  # jump from a crouch; the last four have labelled knee bends
    "14_04", "14_05",  # raise an arm, labelled
    # val
    "07_01", "07_02", "07_03", "07_04", "07_05", "07_06", "07_07", "07_08", "07_09", "07_10", "07_11",  # walk
    "08_01", "08_02", "08_03", "08_04", "08_05", "08_06", "08_07", "08_08", "08_09", "08_10", "08_11",  # walk
    "43_01",  # walk
    "131_01",  # dance
    # test
    "03_01",  # walk on uneven ground
    "06_01", "10_04", "39_01", "39_09", "49_01",  # walk
    "09_06",  # run
    "10_01",  # kick a ball
    "49_18",  # raise an arm
    # in no part
    "xq_jumpingjacks",  # arms over the head, knees up, squats
)  # fmt: skip
_OF_CLIPS = ("clip_name", "subject", "source")
_PARTS = ("train", "val", "test")


def sample(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, dict[str, list[str]]]]:
    """The arrays of cmu_mocap.npz and the content of splits.json, of CLIPS alone."""
    with np.load(folder / "cmu_mocap.npz", allow_pickle=False) as file:
        arrays = dict(file)
    chosen = np.flatnonzero(np.isin(arrays["clip_name"], CLIPS))
    if len(chosen) != len(CLIPS):
        sys.exit(f"Not in {folder}: {', '.join(sorted(set(CLIPS) - set(arrays['clip_name'][chosen])))}.")
    start = arrays["clip_start"]
    rows = np.concatenate([np.arange(start[i], start[i + 1]) for i in chosen])
    made = {
        **arrays,
        **{name: arrays[name][rows] for name in ("joints", "root")},
        **{name: arrays[name][chosen] for name in _OF_CLIPS},
        "clip_start": np.cumsum([0, *np.diff(start)[chosen]]),
    }
    people = {name.partition("_")[0] for name in CLIPS}
    listed = json.loads((folder / "splits.json").read_text(encoding="utf-8"))["cmu_mocap"]
    split = {part: sorted(people.intersection(listed[part])) for part in _PARTS}
    return made, {"cmu_mocap": split, "accad_mocap": {}, "tennis_mocap": {}}


def main() -> None:
    here = Path(__file__).parent
    arrays, splits = sample(Path(os.environ["PCNET3D_DATA"]))
    np.savez_compressed(here / "cmu_mocap.npz", **arrays)
    (here / "splits.json").write_text(json.dumps(splits, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
