"""The paper's table, end to end on a tree of five people."""

import json
from importlib.resources import files

import numpy as np
import pytest

from pcnet3d.models.lab.mmfi import mmfi, split_of
from pcnet3d.models.lab.mocap.convert import read_folder
from pcnet3d.models.lab.mocap.mmfi import protocol
from pcnet3d.pipeline import InputError

PEOPLE = ("S01", "S02", "S03", "S05", "S31")


@pytest.fixture
def tree(mmfi_tree):
    return mmfi_tree({subject: ["A01", "A13", "A14"] for subject in PEOPLE})


def tiny_config():
    """The shipped one's text, of a small network."""
    text = files("pcnet3d.models.lab.training.rectifier").joinpath("mmfi.toml").read_text(encoding="utf-8")
    return text.replace("batch = 1024", "batch = 32").replace(
        "[net]", "[net]\nheads = 2\nwidth = 16\noutput = 8\n#"
    )


def subjects(names):
    return {name[:3] for name in names}


@pytest.mark.parametrize(("name", "test"), [("S2", {"S05"}), ("S3", {"S31"})])
def test_the_protocols_people(tree, name, test):
    split = split_of(read_folder(tree)[0], name, "P3")
    assert subjects(split["test"]) == test
    assert subjects(split["val"]) == {"S01"}
    assert subjects(split["train"]) == set(PEOPLE) - test - {"S01"}
    assert sum(len(split[part]) for part in ("train", "val", "test")) == 15
    assert {name[-3:] for name in split_of(read_folder(tree)[0], name, "P1")["train"]} == {"A13", "A14"}


def test_the_random_protocol_is_by_recording(tree):
    split = split_of(read_folder(tree)[0], "S1", "P3")
    test = {(name[:3], name[-3:]) for name in split["test"]}
    assert test <= protocol("S1").test
    assert subjects(split["test"]) & subjects(split["train"] + split["val"])
    assert not set(split["train"]) & set(split["test"])


def test_the_table(tree, tmp_path, capsys):
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
    from pcnet3d.models.lab.training.rectifier.train import read_config

    (tmp_path / "tiny.toml").write_text(tiny_config(), encoding="utf-8")
    out = tmp_path / "out"
    mmfi(tree, out, steps=3, config=tmp_path / "tiny.toml", device="cpu", threads=1)
    assert (out / "mmfi.md").read_text() in capsys.readouterr().out
    tested = json.loads((out / "mmfi.json").read_text())["rows"]
    rows = {(trained, part): row for part, of in tested.items() for trained, row in of.items()}
    assert set(rows) == {(a, b) for a in ("geometric", "S2", "S3") for b in ("S2", "S3")}
    assert all(row["frames"] == 3 * 40 for row in rows.values())
    for (trained, tested), row in rows.items():
        for name in ("rotation", "mpjpe", "unscaled", "pa_mpjpe", "turned only", "frobenius"):
            assert np.isfinite(list(row[name].values())).all(), name
        assert row.get("known people") == {
            ("S2", "S2"): 0, ("S2", "S3"): 1, ("S3", "S2"): 1, ("S3", "S3"): 0,
        }.get((trained, tested))  # fmt: skip
    assert rows["geometric", "S2"]["pa_mpjpe"]["p95"] < 0.1
    assert rows["geometric", "S2"]["rotation"]["mean"] < 15
    for trained in ("S2", "S3"):
        assert (out / trained / "pcnet.onnx").is_file()
        kept = read_config(out / trained / "pcnet.toml")
        assert (kept.targets, kept.schedule.steps, kept.split) == ("axes", 3, out / f"{trained}-P3.json")


def test_other_activities_are_another_run(tree, tmp_path, capsys):
    """Or a network trained on some would be in the table of the others."""
    pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
    pytest.importorskip("onnxscript", reason="export needs onnxscript, the extra 'train'")
    (tmp_path / "tiny.toml").write_text(tiny_config(), encoding="utf-8")
    settings = {"steps": 1, "config": tmp_path / "tiny.toml", "device": "cpu", "threads": 1}
    mmfi(tree, tmp_path / "out", protocols=["S2"], **settings)
    split = (tmp_path / "out" / "S2-P3.json").read_text()
    page = (tmp_path / "out" / "mmfi.md").read_text()
    with pytest.raises(InputError, match="another -o DIR"):
        mmfi(tree, tmp_path / "out", protocols=["S2"], activities="P1", **settings)
    assert (tmp_path / "out" / "S2-P3.json").read_text() == split
    assert (tmp_path / "out" / "mmfi.md").read_text() == page
