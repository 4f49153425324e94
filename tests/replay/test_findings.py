"""The findings of a trial stay mended; `python tests/replay/replay_findings.py` tells the same in words."""

import pytest

from replay.replay_findings import FINDINGS, NOT_HERE, Bench


@pytest.fixture(scope="module")
def bench(data, tmp_path_factory) -> Bench:
    return Bench(data, tmp_path_factory.mktemp("replay"))


@pytest.mark.data
@pytest.mark.parametrize("number", FINDINGS)
def test_a_finding_stays_mended(bench, number):
    _, look = FINDINGS[number]
    said, right = look(bench)
    assert right, said


def test_every_finding_is_replayed_or_says_why_not():
    assert sorted({*FINDINGS, *NOT_HERE}) == list(range(1, 35))
    assert not set(FINDINGS) & set(NOT_HERE)
