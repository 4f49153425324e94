"""The report as a browser shows it: on a desk, on a telephone, on paper."""

import base64

import pytest
from markupsafe import Markup

from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.core.notices import notice, own_notice
from pcnet3d.stages.drawing.page import page
from pcnet3d.stages.report.stage import report


@pytest.fixture(scope="module")
def content(walk_take, film) -> str:
    long = "a_name_without_a_single_place_to_break_it_" * 8
    read = {"role": "poses", "file": f"{long}.npy", "adapter": "motionbert", "sha256": "0123456789abcdef" * 4}
    take = walk_take.with_(video=film(), inputs=(read,))
    return report(take.saying(own_notice("test.said", f"careful with {long}")))


@pytest.fixture
def unfolded(content, opened):
    """The report in a browser of some width, all its parts open."""

    def in_browser(width: int = 1280):
        browser = opened(content, width)
        browser.value("document.querySelectorAll('.part').forEach(part => part.open = true)")
        return browser

    return in_browser


@pytest.mark.parametrize("width", [1280, 390])
def test_the_first_screen_has_the_answer_the_film_beside_the_skeleton_and_the_verdict(content, opened, width):
    browser = opened(content, width)
    tops = browser.value(
        "['.answer', '.player img', '.player canvas', '.gauge', '.part'].map(q => document.querySelector(q))"
        ".map(e => e && [e.getBoundingClientRect().top, e.getBoundingClientRect().left])"
    )
    answer, film_at, skeleton, gauge, part = tops
    assert answer is None or answer[0] < film_at[0]
    assert abs(film_at[0] - skeleton[0]) < 2
    assert film_at[1] < skeleton[1]
    assert skeleton[0] < gauge[0] < part[0]
    assert gauge[0] < 900
    assert browser.value("document.querySelectorAll('.part[open]').length") == 0


def test_on_a_telephone_picture_and_skeleton_are_whole_on_the_first_screen(walk_take, film, opened):
    """Under an answer of 38 words and six figures with long names they began at its lower edge."""
    times = {"start_s": [0.2, 1.0], "peak_at_s": [0.5, 1.3], "stop_s": [0.8, 1.6]}
    peaks = {"peak_deg": [101.0, 160.0], "peak_error_deg": [9.0, 9.0], **times}
    bends = {"count": 12, "count_at_least": True, **peaks}
    raises = {"count": 8, **peaks}
    names = ("r_thigh_trunk_flexion", "l_thigh_trunk_flexion", "thorax_pelvis_rotation", "trunk_lean_frontal")
    names += ("trunk_lean_sagittal", "r_shoulder_elevation")
    ends = {"p05_deg": -24.0, "p95_deg": 13.0, "p05_error_deg": 6.0, "p95_error_deg": 6.0}
    figures = {
        "knee_bends": bends, "arm_raises": {"right": raises, "left": raises},
        "range_of_motion": dict.fromkeys(names, ends),
    }  # fmt: skip
    without_scale = notice("no-scale", lengths="Lengths have no unit")
    take = walk_take.with_(video=film(), measures=read_measures(figures)).saying(without_scale)
    browser = opened(report(take), 390)
    assert browser.value("document.querySelectorAll('.figures .large').length") == 6
    bottom = "document.querySelector('.player .screens').getBoundingClientRect().bottom"
    assert browser.value(bottom) < 844
    lines = "[...document.querySelectorAll('.option')].map(s => [s.textContent, s.getClientRects().length])"
    assert browser.value(lines)[0] == ["--stature", 1]  # options do not break


@pytest.mark.parametrize("width", [1280, 390, 320])
def test_it_opens_with_all_its_figures_and_not_a_word_in_the_console(content, unfolded, width):
    browser = unfolded(width)
    assert browser.complaints == []
    assert [url.partition(":")[0] for url in browser.requested] == ["file"]
    images = browser.value(
        "[...document.images].map(i => [i.complete, i.naturalWidth, i.getBoundingClientRect().width])"
    )
    assert len(images) == content.count("<img")
    assert len(images) == 1  # the film
    assert all(complete and natural > 50 and shown > 50 for complete, natural, shown in images)
    charts = browser.value(
        "[...document.querySelectorAll('.chart > svg')].map(s => s.checkVisibility() && s.clientWidth)"
    )
    assert len(charts) >= 12
    assert all(shown is False or shown > 250 for shown in charts)  # those within details are not shown
    assert browser.value("document.documentElement.scrollWidth") <= width
    sizes = (
        "[...document.querySelectorAll('p,li,td,small')].map(e => parseFloat(getComputedStyle(e).fontSize))"
    )
    assert browser.value(f"Math.min(...{sizes})") >= 13
    lefts = "[...document.querySelectorAll('.charts figure')].map(f => f.getBoundingClientRect().left)"
    assert len(set(browser.value(lefts))) == (3 if width > 600 else 1)  # side by side on a desk
    browser.value("document.querySelectorAll('details').forEach(d => d.open = true)")
    beyond = "[...document.querySelectorAll('.table')].filter(t => t.scrollWidth > t.clientWidth + 1).length"
    assert browser.value("document.querySelectorAll('.table').length") >= 1
    assert width > 600 or browser.value(beyond) == 0  # no column is hidden on a telephone


def test_it_prints(content, opened):
    browser = opened(content)
    pdf = base64.b64decode(browser.ask("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert pdf.startswith(b"%PDF")
    assert 3 <= pdf.count(b"/Type /Page\n") <= 6


def test_values_are_read_off_under_the_pointer_in_every_chart_of_time(unfolded):
    browser = unfolded()
    chart = "[...document.querySelectorAll('figure')].find(f => f.textContent.startsWith('{}')).querySelector('.chart')"
    knee, thigh = chart.format("Knee flexion"), chart.format("Hip flexion")
    table = f"[...{knee}.querySelectorAll('tbody tr')].map(r => [...r.cells].map(c => c.textContent))"
    browser.value(f"{knee}.scrollIntoView({{block: 'center'}})")
    left, top, width, height = browser.value(
        f"(r => [r.left, r.top, r.width, r.height])({knee}.querySelector('.axis').getBoundingClientRect())"
    )
    move = {"type": "mouseMoved", "x": left + width / 2, "y": top + height / 2}
    browser.ask("Input.dispatchMouseEvent", **move)
    said = "[...{}.querySelectorAll('.key span output')].map(o => o.textContent)"
    rows = {row[0]: row[1:] for row in browser.value(table)}
    at = browser.value(f"{knee}.querySelector('.at').textContent")
    assert at.endswith(" s")
    assert float(at.split()[0]) == pytest.approx(float(list(rows)[-1]) / 2, abs=0.02)
    assert browser.value(said.format(knee)) == rows[at.split()[0]]
    assert all(browser.value(said.format(thigh)))
    left_of = f"{thigh}.querySelector('{{}}').getBoundingClientRect().left"
    cursor, axis = (browser.value(left_of.format(part)) for part in (".cursor", ".axis"))
    assert cursor - axis == pytest.approx(width / 2, abs=4)
    browser.ask("Input.dispatchMouseEvent", type="mouseMoved", x=1, y=1)
    assert browser.value(said.format(knee)) == ["", ""]
    assert browser.complaints == []


def test_arrow_keys_move_the_cursor(unfolded):
    browser = unfolded()
    chart = "document.querySelector('.chart[data-over^=time]')"
    at = f"{chart}.querySelector('.at').textContent"
    # The film, which plays by itself, is taken back to its beginning and stays there.
    browser.value(
        "(i => { i.value = 0; i.dispatchEvent(new Event('input')) })(document.querySelector('.player input'))"
    )
    browser.value(f"{chart}.querySelector('svg').focus()")
    rows = browser.value(
        f"[...{chart}.querySelectorAll('tbody tr')].map(r => [...r.cells].map(c => c.textContent))"
    )
    for key, row in (("ArrowRight", 1), ("ArrowRight", 2), ("ArrowRight", 3), ("ArrowLeft", 2)):
        browser.press(key)
        assert browser.value(at) == f"{rows[row][0]} s"
    for _ in range(3):
        browser.press("ArrowLeft")
    assert browser.value(at) == f"{rows[0][0]} s"
    browser.value("document.activeElement.blur()")
    assert browser.value(at) == ""
    assert browser.complaints == []


def test_it_is_dark_where_that_is_asked_for_but_not_on_paper(content, opened):
    browser = opened(content)

    def brightness(media: str, scheme: str) -> tuple[float, float]:
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.ask("Emulation.setEmulatedMedia", media=media, features=features)
        numbers = (
            "getComputedStyle(document.body).{}.match(/[0-9]+/g).map(Number).reduce((a, b) => a + b) / 3"
        )
        return browser.value(numbers.format("backgroundColor")), browser.value(numbers.format("color"))

    try:
        for media, scheme, is_dark in (("screen", "light", 0), ("screen", "dark", 1), ("print", "dark", 0)):
            paper, ink = brightness(media, scheme)
            assert (ink - paper > 150) if is_dark else (paper - ink > 150), (media, scheme)
    finally:
        browser.ask("Emulation.setEmulatedMedia", media="", features=[])


def test_a_script_that_came_in_after_all_would_not_run(opened):
    """Also that the other tests would see a complaint and a request to another place."""
    head = (
        '<script>document.title = "run"</script><img src="https://example.com/x.png"><p onclick="x()">y</p>'
    )
    browser = opened(page("quiet", Markup(head), []))
    browser.value("new Promise(done => setTimeout(done, 200))")
    assert browser.value("document.title") == "quiet"
    assert len(browser.complaints) >= 2
