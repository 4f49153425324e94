"""Every adapter keeps its promises on its golden files, and docs/adapters.md says what they show."""

from functools import cache

import numpy as np
import pytest

from golden import table
from golden.catalogue import CATALOGUE, Golden
from golden.lifters import x3d
from pcnet3d.adapters import ddhpose, motionbert, read, videopose3d
from pcnet3d.pipeline.plugins import registry
from refusals import refused


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """shown(golden): its row of the table, once its adapter has kept all promises; each file is read once."""

    @cache
    def of(golden: int) -> list[str]:
        return table.row(CATALOGUE[golden], tmp_path_factory.mktemp("golden"))

    return lambda golden: of(CATALOGUE.index(golden))


def called(golden: Golden) -> str:
    return f"{golden.adapter}: {golden.form}"


@pytest.mark.parametrize("golden", CATALOGUE, ids=called)
def test_promises(shown, golden):
    assert shown(golden)[0] == golden.adapter


def test_every_registered_adapter_has_a_golden_file():
    ours = {
        name for name, point in registry.registered("adapters").items() if point.value.startswith("pcnet3d.")
    }
    assert {golden.adapter for golden in CATALOGUE} == ours


def test_the_table_in_the_documents_is_what_the_files_show(shown):
    rows = [shown(golden) for golden in CATALOGUE]
    _, written, _ = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    assert written == table.table(rows), "rewrite it with PYTHONPATH=tests python -m golden.table"


def test_every_adapter_with_scores_has_their_meaning_in_the_documents(shown):
    scored = {golden.adapter for golden in CATALOGUE if "scores" in shown(golden)[3]}
    _, _, after = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    rows = after[after.index("## Scores") :].splitlines()
    said = {name for row in rows if row.startswith("|") for name in row.split("|")[1].strip().split(", ")}
    assert scored <= said


@pytest.mark.parametrize("adapter", [motionbert, videopose3d, ddhpose], ids=lambda adapter: adapter.name)
def test_arrays_of_lifters(tmp_path, turning, adapter):
    """Other joints, dimensions or units are refused, frames that failed too unless they are taken for gaps."""
    path, joints = tmp_path / "x.npy", turning(600)
    joints = x3d(joints) if adapter is motionbert else joints.astype(np.float32)
    wrong = [(np.ones(shape, np.float32), "wrong-content") for shape in ((300, 16, 3), (300, 17, 2), (17, 3))]
    for array, code in wrong if adapter is motionbert else [*wrong, (1000 * joints, "wrong-axes")]:
        np.save(path, array)
        assert not adapter.sniff(path)
        with refused(code):
            read(path, adapter.name)
    for failed in (np.nan, 0.0):
        joints[100:110] = failed
        np.save(path, joints)
        with refused("wrong-content"):
            read(path, adapter.name)
        gone = np.isnan(read(path, adapter.name, missing="gap").joints)
        assert gone[100:110].all()
        assert gone.sum() == 10 * 17 * 3
