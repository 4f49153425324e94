"""`pcnet3d run --person pick`: a sheet of everybody, under the names that --person takes."""

import numpy as np
import pytest

from commands import pcnet3d
from pcnet3d.pipeline.inspect.contact_sheet import MOST, Shown, draw_people
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take


@pytest.fixture
def pick(tmp_path):
    """pick(*words): exit code, lines of stdout, stderr, and what is in the output's folder."""

    def call(*words):
        (tmp_path / "here").mkdir(exist_ok=True)
        done = pcnet3d("run", *words, "--person", "pick", "-o", tmp_path / "here" / "out")
        return done.returncode, done.stdout.splitlines(), done.stderr, list((tmp_path / "here").iterdir())

    return call


def cells(path) -> np.ndarray:
    """The sheet's pictures, (N, 220, 220, 3)."""
    import cv2

    sheet = cv2.imread(str(path))
    assert sheet is not None
    lines, columns = sheet.shape[0] // 264, sheet.shape[1] // 220
    return np.stack(
        [
            sheet[264 * y : 264 * y + 220, 220 * x : 220 * x + 220]
            for y in range(lines)
            for x in range(columns)
        ]
    )


def test_everybody_is_on_the_sheet_and_nothing_else_is_written(mmpose, pick):
    file = mmpose(ghost=3)
    code, said, _, (sheet,) = pick("--poses", file, "--fps", 30)
    assert code == 0
    assert sheet.name == "out-people.png"
    assert [line.partition(":")[0] for line in said[:-1]] == ["person 0", "person 1", "person 2"]
    assert said[1] == "person 1: 0.50 to 2.97 s, 75 frames"
    assert "give --person NAME" in said[-1]
    drawn = cells(sheet)
    assert len(drawn) == 3
    assert all(len(np.unique(cell.reshape(-1, 3), axis=0)) > 3 for cell in drawn)
    take = open_take(RunOptions(poses=file, fps=30, person="1"))
    assert (len(take.poses), take.poses.times[0]) == (75, 0.5)


def test_who_cannot_be_read_is_named_with_the_reason(mmpose, pick):
    _, said, _, _ = pick("--poses", mmpose(mirrored=("1",)), "--fps", 30)
    assert "mirrored" in said[1]
    assert said[0].startswith("person 0: 0.00 to")


def test_of_a_part_only_those_in_it_have_a_time(mmpose, pick):
    _, said, _, _ = pick("--poses", mmpose(), "--fps", 30, "--time-range", ":0.4")
    assert said[0] == "person 0: 0.00 to 0.40 s, 13 frames"
    assert "--time-range" in said[1]


def test_of_a_crowd_those_seen_longest_are_shown(scene, tmp_path):
    track = scene.poses[0]
    crowd = [Shown(str(i), track.rows(0, 10 + i % (MOST + 10))) for i in range(MOST + 10)]
    draw_people(crowd, None, tmp_path / "people.png")
    assert len(cells(tmp_path / "people.png")) == MOST
