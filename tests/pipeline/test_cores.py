"""How many threads may compute: what the system gives, or fewer where it is told."""

from pcnet3d.pipeline.cores import cores


def test_no_more_threads_than_are_given_or_told(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    given = cores()
    assert given >= 1
    for told, expected in (("1", 1), ("0", 1), (str(given + 1), given), ("many", given), ("", given)):
        monkeypatch.setenv("OMP_NUM_THREADS", told)
        assert cores() == expected, told
