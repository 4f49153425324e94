"""Makes the takes of docs/start.md, reports and recordings:  python docs/gallery.py OUT [PICTURES]

Each take is a folder of OUT, made by the commands that are printed; a take whose folder is there is left as it is. All
but the walker need the data folder (PCNET3D_DATA). Into the folder PICTURES, which is docs for those of the page, the
program chromium draws the first screens of three reports, and the viewer the walker's recording (screenshot.py).
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
from screenshot import screenshot

PCNET3D = Path(sys.executable).with_name("pcnet3d")
SCREEN = (1000, 1000)  # pixels of the page that a picture shows
WIDTH = 640  # of the picture
DEMO_FRAME = 60  # of the walker, in the middle of a step
SHOWN = {
    "gallery-walk.jpg": "walk_crop/report.html",
    "gallery-skating.jpg": "skating/report.html",
    "gallery-lifters.jpg": "two_lifters/compare.html",
}


def commands(out: Path, data: Path) -> dict[str, list[str | Path]]:
    """The words of the command that makes each folder of `out`, in an order in which they can be run."""
    video = data / "video" / "walk_crop.mp4"
    boxing, skating = data / "native" / "motionbert", data / "native" / "mhformer" / "skating"
    made: dict[str, list[str | Path]] = {
        "walker": ["demo"],
        "walk_crop": ["run", video, "--detector", data / "models" / "movenet_lightning_int8.onnx"],
        "boxing": [
            "run", "--poses", boxing / "boxing_X3D.npy",
            "--keypoints", boxing / "boxing_alphapose-results.json", "--fps", "30",
        ],
        "skating": [
            "run", "--poses", skating / "output_3D" / "output_keypoints_3d.npz",
            "--keypoints", skating / "input_2D" / "keypoints.npz", "--fps", "25", "--camera", "moving",
        ],
        "walk_crop_blazepose": [
            "run", video, "--keypoints", out / "walk_crop" / "keypoints.npz",
            "--poses", data / "lifter" / "walk_crop.npz", "--adapter", "arrays", "-O", "key=blazepose_world",
            "-O", "layout=BLAZEPOSE33", "-O", "frame=CAMERA", "-O", "unit=m",
        ],
        "two_lifters": ["compare", out / "walk_crop", out / "walk_crop_blazepose"],
    }  # fmt: skip
    return {name: [*words, "-o", out / name] for name, words in made.items()}


def picture(page: Path, file: Path) -> None:
    """The page's first screen, as the program chromium shows it."""
    with TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        size = f"--window-size={SCREEN[0]},{SCREEN[1]}"
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", size)
        command = ["chromium", *options, f"--screenshot={shot}", page.resolve().as_uri()]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
        height = round(WIDTH * SCREEN[1] / SCREEN[0])
        small = cv2.resize(cv2.imread(str(shot)), (WIDTH, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(file), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


def main() -> None:
    out = Path(sys.argv[1])
    data = Path(os.environ["PCNET3D_DATA"])
    out.mkdir(parents=True, exist_ok=True)
    for name, words in commands(out, data).items():
        print("pcnet3d", shlex.join(map(str, words)), flush=True)
        if not (out / name).exists():
            subprocess.run([PCNET3D, *words], check=True)
    for folder in map(Path, sys.argv[2:]):
        folder.mkdir(parents=True, exist_ok=True)
        for name, page in SHOWN.items():
            picture(out / page, folder / name)
        screenshot(out / "walker" / "take.rrd", DEMO_FRAME, folder / "demo.png")


if __name__ == "__main__":
    main()
