"""Charts and tables of pages: to scale, with their gaps and extremes, and with every value."""

import re

import numpy as np
import pytest

from pcnet3d.stages.drawing.charts import SLICES, Curve, of_side, over_time, ranges
from pcnet3d.stages.drawing.page import Link, Number, table


def test_a_table_escapes_and_aligns_its_columns():
    made = table(("name", "a <b>", "share"), [("x", 1234, Number("0.12 ± 0.3")), ("<i>", None, 1)])
    assert "a &lt;b&gt;" in made
    assert "&lt;i&gt;" in made
    assert re.findall(r"<td class=number>(.*?)</td>", made) == ["1234", "0.12 ± 0.3", "–", "1"]
    assert table(("name",), []) == ""
    linked = table(["a"], [[Link('<b>"', "x%22%3E?a=1&b=2")]])
    assert '<a href="x%22%3E?a=1&amp;b=2">&lt;b&gt;&#34;</a>' in linked
    assert "sortable" not in linked


def test_long_curves_keep_their_extremes_and_their_gaps():
    x = np.arange(18_000) / 30.0
    values = np.sin(x)
    values[7_003], values[12_345] = 9.0, -9.0
    values[3_000:6_000] = np.nan
    at, low, high = ranges(x, values)
    assert len(at) <= SLICES
    assert (np.nanmin(low), np.nanmax(high)) == (-9.0, 9.0)
    gap = (at >= 100) & (at < 198)
    assert np.isnan(low[gap]).all()
    assert np.isfinite(low[~gap & ((at < 98) | (at > 201))]).all()
    assert (low[np.isfinite(low)] <= high[np.isfinite(high)]).all()


@pytest.mark.parametrize("rows", [801, 1_000, 1_250, 17_999, 18_000])
def test_the_row_that_is_read_off_a_long_curve_holds_what_is_asked_for(rows):
    """As charts.js finds it: the row whose x is nearest."""
    x = np.arange(rows) / 30.0
    at, first, last = ranges(x, x)
    assert first[0] == x[0]
    assert last[-1] == x[-1]
    for share in (0.1, 0.5, 0.9):
        wanted = first + share * (last - first)
        nearest = np.abs(at - wanted[:, None]).argmin(axis=1)
        np.testing.assert_array_equal(nearest, np.arange(len(at)))


@pytest.mark.parametrize(
    "x", [np.arange(720) / 240, 0.005 + np.arange(300) / 100, 500 + np.arange(600) / 1000]
)
def test_every_row_of_values_has_an_x_of_its_own(x):
    """By it charts.js finds the row again: of rows with one time the arrow keys would not leave the first."""
    at = re.findall(r"<tr><td>([^<]+)<td>", over_time([Curve("a", np.sin(x))], x, "a over time"))
    assert len({*at}) == len(at) == len(x)
    np.testing.assert_allclose(np.array(at, dtype=float), x, atol=0.0051)


def line(drawn: str) -> np.ndarray:
    """(N, 2) points of the first curve of a chart, in pixels."""
    (path, *_) = re.findall(r'class="line" d="([^"]*)"', drawn)
    return np.array(re.findall(r"[ML]([-\d.]+) ([-\d.]+)", path), dtype=float)


@pytest.mark.parametrize(("rows", "pause_s"), [(100, 3.0), (5000, 3.0), (5000, 60.0), (20000, 600.0)])
def test_a_pause_of_the_recording_breaks_curve_and_band(rows, pause_s):
    """A straight line went across what the time stamps leave out; of long takes a slice did."""
    x = np.arange(rows) / 30 + pause_s * (np.arange(rows) >= rows // 2 + 5)
    drawn = over_time([Curve("a", np.sin(x), margin=np.full(rows, 0.1))], x, "a over time")
    shapes = re.findall(r' d="([^"]*)"', drawn)
    assert shapes
    longest = max(np.diff(np.array(re.findall(r"[ML]([-\d.]+) ", part), dtype=float)).max()
                  for shape in shapes for part in re.split("(?=M)", shape) if part.count("L") > 1)  # fmt: skip
    assert longest < 10
    steady = re.findall(r' d="([^"]*)"', over_time([Curve("a", np.sin(x))], np.arange(rows) / 30, "a"))
    assert sum(shape.count("M") for shape in steady) < sum(shape.count("M") for shape in shapes)


def test_a_chart_is_to_scale():
    """Pixels of the curve are one linear map of its values, upward; ticks stand where the map puts their numbers."""
    x, values = np.linspace(2, 7, 60), 30 * np.sin(np.linspace(0, 9, 60)) - 4
    drawn = over_time([Curve("a", values)], x, "a over time")
    at = line(drawn)
    across, upward = np.polyfit(x, at[:, 0], 1), np.polyfit(values, at[:, 1], 1)
    np.testing.assert_allclose(np.polyval(across, x), at[:, 0], atol=0.06)
    np.testing.assert_allclose(np.polyval(upward, values), at[:, 1], atol=0.06)
    assert across[0] > 0 > upward[0]
    ticks = re.findall(r'<text x="([\d.]+)" y="([\d.]+)"( dy="4")? text-anchor="\w+">([-\d.]+)<', drawn)
    assert len(ticks) >= 8
    for left, top, is_y, number in ticks:
        expected, pixel = (
            (np.polyval(upward, float(number)), top) if is_y else (np.polyval(across, float(number)), left)
        )
        assert float(pixel) == pytest.approx(expected, abs=0.15)


def test_the_values_of_a_chart_are_in_its_table():
    x = np.arange(40) / 10
    right, left = np.linspace(0, 60, 40), np.full(40, np.nan)
    left[5] = 12.34
    curves = [of_side("right", right, np.full(40, 5.0)), of_side("left", left)]
    rows = re.findall(r"<tr><td>(.*?)<td>(.*?)<td>(.*?)(?=<tr>|</tbody>)", over_time(curves, x, "knee"))
    assert len(rows) == 40
    assert rows[5] == ("0.50", "7.7 ± 5.0", "12.3")
    assert rows[6][2] == "–"
