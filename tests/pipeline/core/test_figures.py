"""The catalogue of figures, and the value that holds a take's."""

import re
from pathlib import Path

import pytest

from golden.measures import rows_of
from pcnet3d.pipeline.core.figures import (
    ERRORS,
    FIGURES,
    GROUPS,
    TOGETHER,
    UNITS,
    WITHHELD,
)
from pcnet3d.pipeline.core.measures import Measure, Measures, Moments, Remark, withheld, within


def test_what_is_not_in_the_catalogue_cannot_be_made():
    for make in (
        lambda: Measure("stpes", 3),
        lambda: Remark("mood", "good"),
        lambda: Moments("lunches", (1.0,)),
        lambda: withheld("too-dark", "cadence"),
        lambda: withheld("few-strides", "stpes"),
        lambda: Measures(tuple(within("strolling", [Measure("steps", 3)]))),
    ):
        with pytest.raises(KeyError):
            make()
    assert [withheld("few-values", name).name for name in (*TOGETHER, "cadence", "")][-2:] == [
        "cadence_withheld",
        "withheld",
    ]


def test_every_row_of_the_catalogue_is_whole_and_names_one_quantity():
    for name, figure in FIGURES.items():
        assert (figure.name, figure.unit in UNITS, figure.group in GROUPS, figure.error in ERRORS) == (
            name, True, True, True,
        )  # fmt: skip
        assert figure.label
        assert figure.definition.endswith((".", ")")), name
    keys = [figure.key for figure in FIGURES.values()]
    labels = [figure.label for figure in FIGURES.values()]
    assert len(set(keys)) == len(keys)
    assert sorted({label for label in labels if labels.count(label) > 1}) == []
    assert FIGURES["mean_step_time"].key == "mean_step_time_s"
    assert FIGURES["cadence"].error_key == "cadence_error_spm"
    assert FIGURES["step_time_symmetry_index"].within_key == "step_time_within_error"
    assert FIGURES["walking_speed"].label_with_unit() == "speed (m/s)"


def test_a_group_answers_for_its_figures():
    measures = rows_of(
        {
            "walking": {
                "gait": "walking", "steps": 7, "cadence_withheld": "few-strides",
                "right": {"steps": 4, "landings_s": [1.0, 2.0], "stride_start_s": [1.0], "stride_stop_s": [2.0]},
            },
            "knee_bends": {"count": 2, "count_at_least": True, "start_s": [1.0, 3.0], "stop_s": [2.0, 4.0],
                           "peak_deg": [None, 80.0], "peak_error_deg": [None, 4.0]},
        }
    )  # fmt: skip
    walking, bends = measures.group("walking"), measures.group("knee_bends")
    assert (walking.count("steps"), walking.text("gait"), walking.withheld("cadence")) == (
        7,
        "walking",
        "few-strides",
    )
    assert walking.figure("cadence") is None
    right = measures.group("walking", "right")
    assert (right.count("steps"), right.times("landings"), right.spans) == (4, (1.0, 2.0), [(1.0, 2.0)])
    assert {row.side for row in right} == {"right"}
    assert bends.spans == [(1.0, 2.0), (3.0, 4.0)]
    assert [(peak.number, peak.value, peak.error) for peak in bends.repetitions("peak")] == [(1, 80.0, 4.0)]
    assert bends.figure("count").at_least
    assert not measures.group("jumps")
    assert measures.group("jumps", "left").count() == 0
    assert [*measures.groups] == ["walking", "knee_bends"]


def test_the_documents_have_every_code():
    text = (Path(__file__).parents[3] / "docs/movements.md").read_text(encoding="utf-8")
    codes = text.partition("### Why a figure is withheld")[2].partition("`camera-moves`")
    assert re.findall("`([a-z-]+)`", "".join(codes[1:])) == [*WITHHELD]
