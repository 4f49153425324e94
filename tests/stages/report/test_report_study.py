"""The study's page: sorted by a click, escaped, readable on a telephone and on paper."""

import pytest

from pcnet3d.stages.study.batch.study import as_page

EVIL = '<script>document.title = "run"</script><img src=x onerror="document.title = 1">'


def said(text: str, weight: str = "warning") -> dict[str, str]:
    return {"code": "test.said", "weight": weight, "about": "", "text": text}


def study(subjects: int = 12) -> list[dict]:
    """Two visits of each, with a name that is a script, one that cannot be broken, and a failed take."""
    rows = [
        {
            "name": f"s{i}_{visit}",
            "subject": f"s{i}",
            "visit": visit,
            "condition": "",
            "state": "done",
            "report": f"takes/s{i}_{visit}/report.html",
            "notices": [said("careful")] * (i % 3),
            "frames": 100 + 37 * i,
            "duration_s": 3.3,
            "level_ok": i != 4,
            "up_bound_deg": None if i == 5 else float(i),
        }
        for i in range(subjects)
        for visit in ("before", "after")
    ]
    rows[-1] |= {"name": EVIL, "subject": EVIL, "visit": EVIL, "report": f"takes/{EVIL} #?/report.html"}
    rows[-1]["notices"], rows[1]["notices"] = [said(EVIL)], [said(EVIL, "repair")]
    rows[2]["name"] = "a_name_without_a_single_place_to_break_it_" * 2
    labels = {"name": "lost", "subject": EVIL, "visit": EVIL, "condition": ""}
    return [*rows, {**labels, "state": "failed", "exit_code": 2, "reason": EVIL}]


@pytest.fixture(scope="module")
def content() -> str:
    rows = study()
    return as_page(EVIL, rows)


def column(browser, section: str, number: int) -> list[str]:
    rows = f"[...document.querySelectorAll('section')].find(s => s.querySelector('h2').textContent === '{section}')"
    return browser.value(f"[...{rows}.querySelectorAll('tbody tr')].map(r => r.cells[{number}].textContent)")


def click(browser, section: str, heading: str) -> None:
    browser.value(
        f"[...[...document.querySelectorAll('section')].find(s => s.querySelector('h2').textContent === '{section}')"
        f".querySelectorAll('thead button')].find(b => b.textContent === '{heading}').click()"
    )


def test_a_click_on_a_heading_sorts_and_another_one_turns_it_round(content, opened):
    browser = opened(content)
    assert browser.complaints == []
    click(browser, "Takes", "frames")
    frames = [int(cell) for cell in column(browser, "Takes", 3)]
    assert frames == sorted(frames)
    assert len(set(frames)) == 12
    click(browser, "Takes", "frames")
    assert [int(cell) for cell in column(browser, "Takes", 3)] == sorted(frames, reverse=True)
    for _ in range(2):  # what is not known comes last either way
        click(browser, "Takes", "up known to within (°, 90 %)")
        assert column(browser, "Takes", 6)[-2:] == ["–", "–"]
    click(browser, "Takes", "subject")
    subjects = column(browser, "Takes", 1)
    assert subjects.index("s2") < subjects.index("s10")
    assert browser.complaints == []


def test_nothing_that_came_from_a_file_runs_or_loads(content, opened):
    browser = opened(content)
    browser.value("new Promise(done => setTimeout(done, 200))")
    assert browser.value("document.title") == EVIL
    assert browser.value("document.images.length") == 0
    assert browser.value("document.scripts.length") == 1
    assert [url.partition(":")[0] for url in browser.requested] == ["file"]
    assert browser.complaints == []
    assert EVIL in column(browser, "Takes", 0)
    assert EVIL in column(browser, "Failed takes", 4)
