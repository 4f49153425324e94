"""Names that are HTML, of files, folders and people, on every page made of them: shown letter by letter, not obeyed."""

import re
from pathlib import Path

import numpy as np
import pytest

from golden.html import Page
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.stages import drawing
from pcnet3d.stages.study.compare.command import compare

PERSON = "<script>alert(1)</script>&quot;&lt;b&gt;\"'"
FILE = "<img src=x onerror=alert(1)>&quot;\"'.npy"
FOLDERS = ("<svg onload=alert(1)>&amp;", "<b>front&#60;")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two runs in folders of such names, of a person and files of such names, and their comparison."""
    walk = walker(seconds=2)
    folder = tmp_path_factory.mktemp("names")
    stages = ("rectify", "trajectories", "angles", "measures", "export", "report")
    recipe = Recipe(stages=tuple(StageEntry(use=stage) for stage in stages))
    for name in FOLDERS:
        (folder / f"of {name}").mkdir()
        file = folder / f"of {name}" / FILE
        np.save(file, camera_poses(walk, side_camera(walk)).joints)
        options = RunOptions(poses=file, adapter="videopose3d", fps=walk.fps, person_id=PERSON)
        run_files(options, folder / name, recipe.with_options("rectify", rectifier="geometric"))
    compare([folder / name for name in FOLDERS], output=folder / "compared")
    return folder


def harmless(page: Page) -> None:
    assert not {tag for tag, _ in page.tags} & {"iframe", "object", "embed", "base", "form", "link"}
    ours = [
        (Path(drawing.__file__).parent / name).read_text(encoding="utf-8")
        for name in ("fold.js", "charts.js", "player.js")
    ]
    assert page.scripts in ([], [ours[1]], ["".join(ours)])
    for tag, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href"):
            address = attributes.get(name) or "#"
            beside = tag == "a" and re.fullmatch(r"[\w.%-]+", address)  # a file of the run
            assert address.startswith(("data:image/", "#")) or beside, (tag, attributes)


@pytest.mark.parametrize("folder", FOLDERS)
def test_the_report_of_a_run(runs, folder):
    page = Page((runs / folder / "report.html").read_text(encoding="utf-8"))
    harmless(page)
    assert FILE in page.words
    assert PERSON in page.words
    assert [attributes for tag, attributes in page.tags if tag == "svg" and "onload" in attributes] == []


def test_the_page_of_a_comparison(runs):
    page = Page((runs / "compared" / "compare.html").read_text(encoding="utf-8"))
    harmless(page)
    for name in FOLDERS:
        assert name in page.words
