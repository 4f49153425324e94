"""Every adapter keeps its promises on its golden files, and docs/adapters.md says what they show."""

from functools import cache

import pytest

from golden import table
from golden.catalogue import CATALOGUE, Golden
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.reading.testing import Facts


@pytest.fixture(scope="module")
def facts(tmp_path_factory):
    """facts(golden): what it shows; each file is read once."""

    @cache
    def of(golden: int) -> Facts:
        return table.facts(CATALOGUE[golden], tmp_path_factory.mktemp("golden"))

    return lambda golden: of(CATALOGUE.index(golden))


def called(golden: Golden) -> str:
    return f"{golden.adapter}: {golden.form}"


@pytest.mark.parametrize("golden", CATALOGUE, ids=called)
def test_promises(facts, golden):
    found = facts(golden)
    assert found.adapter == golden.adapter
    assert found.guarded is (True if found.gives == "poses" else None)


def test_every_registered_adapter_has_a_golden_file():
    ours = {
        name for name, point in registry.registered("adapters").items() if point.value.startswith("pcnet3d.")
    }
    assert {golden.adapter for golden in CATALOGUE} == ours


def test_the_table_in_the_documents_is_what_the_files_show(facts):
    rows = [table.row(golden, facts(golden)) for golden in CATALOGUE]
    _, written, _ = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    assert written == table.table(rows), "rewrite it with PYTHONPATH=tests python -m golden.table"


def test_every_adapter_with_scores_has_their_meaning_in_the_documents(facts):
    scored = {golden.adapter for golden in CATALOGUE if facts(golden).scores}
    _, _, after = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    said = after[after.index("## Scores") :]
    assert {name for name in scored if f"| {name} |" not in said} == set()
