"""Sentences on whether right and left differ."""

from golden.measures import rows_of
from pcnet3d.pipeline.signals.angles import MIDLINE
from pcnet3d.pipeline.signals.foot_angles import ALL_OF_BOTH
from pcnet3d.stages.report.angles import sides_compared


def test_it_says_whether_the_sides_differ_by_more_than_their_errors():
    knee = {"symmetry_index_percent": -20.0, "symmetry_index_error_percent": 15.0, "within_error": True}
    hip = {"symmetry_index_percent": 30.0, "symmetry_index_error_percent": 6.0, "within_error": False}

    def compared(figures):
        return sides_compared(rows_of(figures))

    assert compared({}) == []
    assert (
        compared({"symmetry": {"knee_flexion": {"symmetry_index_percent": 50.0}}}) == []
    )  # no error is stated
    steps = {f"step_length_{key}": value for key, value in knee.items()}
    (same,) = compared({"symmetry": {"knee_flexion": knee}, "walking": steps})
    assert same == "No clear difference between right and left."
    # A man on one leg, whose right elbow bent five times as far, had no clear difference: the errors were large.
    assert compared({"symmetry": {"knee_flexion": knee}}) == []
    walking = {f"step_length_{key}": value for key, value in hip.items()}
    (apart,) = compared({"symmetry": {"knee_flexion": knee, "thigh_trunk_flexion": hip}, "walking": walking})
    assert compared({"symmetry": {"knee_flexion": {"symmetry_index_withheld": "sides-unlike"}}}) == []
    assert apart == (
        "Right and left differ in range of hip flexion (thigh against trunk) +30 ± 10 %, step length +30 ± 10 % "
        "(right minus left; 3 figures compared)."
    )


def test_one_difference_among_many_may_be_chance():
    """A man who balances was filmed by four cameras: each page named another difference of his sides, and most were
    none."""
    angles = [name for name in ALL_OF_BOTH if name not in MIDLINE]
    figures = {name: {"symmetry_index_percent": 2.0, "symmetry_index_error_percent": 20.0} for name in angles}
    figures[angles[0]] = {"symmetry_index_percent": 50.0, "symmetry_index_error_percent": 20.0}
    assert sides_compared(rows_of({"symmetry": figures})) == []
    figures[angles[0]] = {"symmetry_index_percent": 150.0, "symmetry_index_error_percent": 20.0}
    (said,) = sides_compared(rows_of({"symmetry": figures}))
    assert "differ in" in said
    assert "+150" in said
    assert said.count("±") == 1
