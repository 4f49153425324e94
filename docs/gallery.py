"""Makes the takes that the pages of the guide show, and their pictures:  python docs/gallery.py OUT [PICTURES]

Each take is a folder of OUT, made by the commands that are printed; a take whose folder is there is left as it is. All
but the walker need the data folder (PCNET3D_DATA). Into the folder PICTURES, which is docs for those of the pages, the
program chromium draws first screens and parts of reports and what the terminal shows of a file, and the viewer the
walker's recording (screenshot.py).
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from rich.console import Console
from screenshot import screenshot

PCNET3D = Path(sys.executable).with_name("pcnet3d")
SCREEN = (1000, 1000)  # pixels of the page that a picture shows
WIDTH = 640  # of the picture of a first screen
DEMO_FRAME = 60  # of the walker, in the middle of a step
FILM_FRAME = 144  # of the walker, in the middle of the squat
FIRST_SCREENS = {
    "gallery-walk.jpg": "walk_crop/report.html",
    "gallery-skating.jpg": "skating/report.html",
    "gallery-lifters.jpg": "two_lifters/compare.html",
    "gallery-movements.jpg": "walker/report.html",
}
PARTS = {"gallery-trust.jpg": ("walk_crop_blazepose/report.html", ".gauge")}  # by CSS: how far to trust


def commands(out: Path, data: Path) -> dict[str, list[str | Path]]:
    """The words of the command that makes each folder of `out`, in an order in which they can be run."""
    video, walker = data / "video" / "walk_crop.mp4", out / "walker-input"
    skating = data / "native" / "mhformer" / "skating"
    made: dict[str, list[str | Path]] = {
        "walker": ["demo"],
        "walker_film": [
            "run", walker / "walker.mp4", "--poses", walker / "X3D.npy",
            "--keypoints", walker / "alphapose-results.json", "--stature", "1.75", "--also", "mp4",
        ],
        "walk_crop": ["run", video, "--detector", data / "models" / "movenet_lightning_int8.onnx"],
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


def drawn(page: Path, size: tuple[int, int] = SCREEN) -> np.ndarray:
    """(height, width, 3) BGR: the page's first screen, as the program chromium shows it."""
    with TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars")
        window = (f"--window-size={size[0]},{size[1]}", f"--screenshot={shot}", page.resolve().as_uri())
        subprocess.run(["chromium", *options, *window], check=True, capture_output=True, timeout=120)
        return np.asarray(cv2.imread(str(shot)))


def narrower(image: np.ndarray, width: int) -> np.ndarray:
    height = round(image.shape[0] * width / image.shape[1])
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)


def without_margin(image: np.ndarray) -> np.ndarray:
    """The rows between the first and the last that are not white."""
    drawn_on = np.flatnonzero((image < 250).any(axis=(1, 2)))
    return image[max(drawn_on[0] - 8, 0) : drawn_on[-1] + 8]


def part(page: Path, selector: str) -> np.ndarray:
    """One unfolded part of a report, without the rest of the page."""
    hidden, shown = "main > *, header > * { display: none !important }", "{ display: block !important }"
    style = f"<style>{hidden} {selector} {shown} .part {{ border: 0 }}</style></head>"
    text = page.read_text(encoding="utf-8").replace("</head>", style, 1)
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "part.html"
        copy.write_text(text.replace("<details class", "<details open class"), encoding="utf-8")
        return without_margin(drawn(copy, (800, 1600)))


def terminal(command: str, folder: Path) -> np.ndarray:
    """A command of pcnet3d in a folder, and what it prints."""
    done = subprocess.run([PCNET3D, *command.split()], cwd=folder, capture_output=True, text=True)
    console = Console(record=True, width=112, file=StringIO())
    console.print(f"$ pcnet3d {command}\n{done.stdout}", markup=False, highlight=False)
    with TemporaryDirectory() as temporary:
        page = Path(temporary) / "terminal.svg"
        console.save_svg(str(page), title="")
        return without_margin(drawn(page, (1000, 1000)))


def frame_of(video: Path, number: int) -> np.ndarray:
    frames = cv2.VideoCapture(str(video))
    frames.set(cv2.CAP_PROP_POS_FRAMES, number)
    return frames.read()[1]


def pictures(out: Path, data: Path) -> dict[str, np.ndarray]:
    """(height, width, 3) BGR each, by the name of its file."""
    made = {name: narrower(drawn(out / page), WIDTH) for name, page in FIRST_SCREENS.items()}
    made |= {name: part(out / page, selector) for name, (page, selector) in PARTS.items()}
    made["gallery-inspect.jpg"] = terminal("inspect broken_X3D.npy", data / "native" / "motionbert")
    made["gallery-film.jpg"] = narrower(frame_of(out / "walker_film" / "annotated.mp4", FILM_FRAME), 1000)
    return made


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
        for name, image in pictures(out, data).items():
            cv2.imwrite(str(folder / name), image, [cv2.IMWRITE_JPEG_QUALITY, 80])
        screenshot(out / "walker" / "take.rrd", DEMO_FRAME, folder / "demo.png")


if __name__ == "__main__":
    main()
