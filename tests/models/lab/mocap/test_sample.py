"""The sample of motion capture that tests read where the data folder is not."""

import json
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from pcnet3d.models.lab.mocap.clips import data_set, person, read_clips

FOLDER = Path(__file__).parents[3] / "data"


def test_it_is_of_cmu_alone_and_everybody_is_in_one_part():
    parts = [read_clips(part, FOLDER) for part in ("train", "val", "test")]
    assert {data_set(clip) for part in parts for clip in part} == {"cmu"}
    people = [{person(clip) for clip in part} for part in parts]
    assert len(set().union(*people)) == sum(map(len, people)) == 18


@pytest.mark.data("accad_mocap.npz")
def test_it_is_what_its_program_makes_of_the_data_folder(data):
    arrays, splits = run_path(str(FOLDER / "make.py"))["sample"](data)
    with np.load(FOLDER / "cmu_mocap.npz") as file:
        assert set(file) == set(arrays)
        for name in file:
            np.testing.assert_array_equal(file[name], arrays[name])
            assert file[name].dtype == arrays[name].dtype
    assert json.loads((FOLDER / "splits.json").read_text()) == splits
