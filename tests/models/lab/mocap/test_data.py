"""A data folder out of what anybody may download."""

import json
import re
from dataclasses import replace
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from commands import pcnet3d, refused, succeeded
from golden.acclaim import write_still
from pcnet3d.models.lab.mocap.clips import data_set, read_clips, read_mocap
from pcnet3d.models.lab.mocap.data import SPLITS, of_accad, of_tennis, with_whole_forearms
from pcnet3d.pipeline import H36M17

SAMPLE = Path(__file__).parents[3] / "data"


def test_the_sample_becomes_a_folder_by_which_a_row_of_the_readme_is_measured(tmp_path):
    done = succeeded(pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"))
    assert "55 clips of 19 people" in done.stdout
    for part in ("train", "val", "test"):
        made, sample = (read_clips(part, folder) for folder in (tmp_path / "data", SAMPLE))
        assert [clip.name for clip in made] == [clip.name for clip in sample]
        assert {data_set(clip) for clip in made} == {"cmu"}
    np.testing.assert_array_equal(made[0].joints, sample[0].joints)
    before = (tmp_path / "data" / "cmu_mocap.npz").stat().st_mtime_ns
    succeeded(pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"))
    assert (tmp_path / "data" / "cmu_mocap.npz").stat().st_mtime_ns == before
    asked = ("takes", "--sets", "cmu", "--because", "the first row", "-o", tmp_path / "takes")
    succeeded(pcnet3d("lab", "evaluate", *asked, PCNET3D_DATA=str(tmp_path / "data")))
    report = json.loads((tmp_path / "takes" / "evaluation.json").read_text())
    methods = report["takes"]["CMU test, lifted, upright, 2 s and more"]["methods"]
    means = {re.sub("@\\w+", "", name): of["by person"]["rotation"]["mean"] for name, of in methods.items()}
    assert means["geometric, a frame"] > means["pcnet, a frame"] > means["pcnet, a take, with its image"]
    added = report["acceleration"]["CMU test, lifted"]["lift"]
    assert 0 < added["geometric, a take"]["wrist"]["vertical"]["rmse"]["p50"] < 1
    with open(tmp_path / "data" / "cmu_mocap.npz", "ab") as file:
        file.write(b"changed since")
    refused(pcnet3d("lab", "data", "--cmu", SAMPLE, "-o", tmp_path / "data"), "its digest is another one")


def test_recordings_are_converted_with_whole_forearms(tmp_path):
    """Of CMU only those of people who are in a part."""
    acclaim = write_still(tmp_path / "acclaim")
    for person in ("07", "150"):
        folder = write_still(acclaim / person)
        (folder / "HDM_tr.asf").rename(folder / f"{person}.asf")
        (folder / "HDM_tr_kick_1.amc").rename(folder / f"{person}_01.amc")
    succeeded(pcnet3d("lab", "data", "--cmu", acclaim, "--hdm05", acclaim, "-o", tmp_path / "data"))
    (clip,) = read_mocap(tmp_path / "data" / "cmu_mocap.npz")
    assert (clip.name, clip.source) == ("07_01", "asfamc")
    everybody = read_mocap(tmp_path / "data" / "hdm05_subset.npz")
    assert len(everybody) == 3
    elbow, wrist = H36M17.indices(("l_elbow", "l_wrist"))
    length = np.linalg.norm(clip.joints[:, wrist] - clip.joints[:, elbow], axis=-1)
    longer = with_whole_forearms(clip).joints
    np.testing.assert_allclose(
        np.linalg.norm(longer[:, wrist] - longer[:, elbow], axis=-1), 1.38 * length, rtol=1e-5
    )
    np.testing.assert_allclose(length, 1.38 * 0.25, atol=1e-3)  # of golden.skeleton
    split = json.loads((tmp_path / "data" / "splits.json").read_text())
    assert split["cmu_mocap"] == {"train": [], "val": ["07"], "test": []}


def test_of_accad_and_tennis_people_are_named_as_the_splits_name_them(clips):
    """And Arena's short upper arms become as long as people's, beside forearms that stay."""
    clip = replace(clips["train"][0], name="Male1_A5_PickUpBox", subject="Male1", source="bvh")
    walk = of_accad(clip)
    assert (walk.name, walk.subject, walk.source) == ("accad-m1_bvh-a5-pickupbox", "accad-m1", "accad-bvh")
    serve = of_tennis(replace(clip, name="JAngel_Servicio", subject="JAngel"))
    assert (serve.name, serve.subject, serve.source) == ("tennis-jangel_Servicio", "tennis-jangel", "arena")

    def length(of, *bone):
        a, b = H36M17.indices(bone)
        return np.sqrt((np.linalg.norm(of.joints[:, a] - of.joints[:, b], axis=-1) ** 2).mean())

    for side in "lr":
        forearm = length(serve, f"{side}_elbow", f"{side}_wrist")
        assert forearm == pytest.approx(length(clip, f"{side}_elbow", f"{side}_wrist"), rel=1e-5)
        assert length(serve, f"{side}_shoulder", f"{side}_elbow") == pytest.approx(1.05 * forearm, rel=1e-5)


@pytest.mark.parametrize(
    ("words", "what"),
    [((), "mocap.cs.cmu.edu"), ((), "accad.osu.edu"), (("--cmu", "nowhere"), "all ASF/AMC files")],
)
def test_where_nothing_is_it_says_what_to_fetch_from_where(tmp_path, words, what):
    said = pcnet3d("lab", "data", *words, "-o", "data", cwd=tmp_path)
    refused(said, "download", what)
    assert not (tmp_path / "data" / "cmu_mocap.npz").exists()


@pytest.mark.data("accad_mocap.npz")
def test_the_people_of_each_part_are_those_of_the_data_folder(data):
    listed = json.loads((data / "splits.json").read_text())
    for file, parts in SPLITS.items():
        assert {part: listed[file].get(part, []) for part in parts} == parts


@pytest.mark.data("accad_mocap.npz")
def test_the_sample_is_what_its_program_makes_of_the_data_folder(data):
    arrays, splits = run_path(str(SAMPLE / "make.py"))["sample"](data)
    with np.load(SAMPLE / "cmu_mocap.npz") as file:
        assert set(file) == set(arrays)
        for name in file:
            np.testing.assert_array_equal(file[name], arrays[name])
            assert file[name].dtype == arrays[name].dtype
    assert json.loads((SAMPLE / "splits.json").read_text()) == splits
