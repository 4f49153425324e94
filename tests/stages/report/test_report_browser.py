"""The report as a browser shows it: on a desk, on a telephone, on paper."""

import base64

import pytest
from markupsafe import Markup

from pcnet3d.pipeline.take import Event
from pcnet3d.stages.drawing.page import page
from pcnet3d.stages.report.stage import report


@pytest.fixture
def content(walk_take, film) -> str:
    long = "a_name_without_a_single_place_to_break_it_" * 8
    read = {"role": "poses", "file": f"{long}.npy", "adapter": "motionbert", "sha256": "0123456789abcdef" * 4}
    take = walk_take.with_(video=film(), inputs=(read,))
    return report(take.saying(Event("warning", f"careful with {long}")))


@pytest.mark.parametrize("width", [1280, 390, 320])
def test_it_opens_with_all_its_figures_and_not_a_word_in_the_console(content, opened, width):
    browser = opened(content, width)
    assert browser.complaints == []
    assert [url.partition(":")[0] for url in browser.requested] == ["file"]
    images = browser.value(
        "[...document.images].map(i => [i.complete, i.naturalWidth, i.getBoundingClientRect().width])"
    )
    assert len(images) == content.count("<img")
    assert len(images) > 30
    assert all(complete and natural > 50 and shown > 50 for complete, natural, shown in images)
    assert browser.value("document.documentElement.scrollWidth") <= width
    sizes = (
        "[...document.querySelectorAll('p,li,td,small')].map(e => parseFloat(getComputedStyle(e).fontSize))"
    )
    assert browser.value(f"Math.min(...{sizes})") >= 13


def test_charts_stand_side_by_side_on_a_desk_and_one_below_the_other_on_a_telephone(content, opened):
    columns = "new Set([...document.querySelectorAll('.charts figure')].map(f => f.getBoundingClientRect().left)).size"
    assert opened(content, 1280).value(columns) == 3
    assert opened(content, 390).value(columns) == 1


def test_it_prints(content, opened):
    browser = opened(content)
    pdf = base64.b64decode(browser.ask("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert pdf.startswith(b"%PDF")
    assert 3 <= pdf.count(b"/Type /Page\n") <= 12


def test_a_script_that_came_in_after_all_would_not_run(opened):
    """Also that the other tests would see a complaint and a request to another place."""
    head = (
        '<script>document.title = "run"</script><img src="https://example.com/x.png"><p onclick="x()">y</p>'
    )
    browser = opened(page("quiet", Markup(head), []))
    browser.value("new Promise(done => setTimeout(done, 200))")
    assert browser.value("document.title") == "quiet"
    assert len(browser.complaints) >= 2
