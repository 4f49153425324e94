"""Two takes of one motion or of two visits: which of them, at which shift, and what changed by more than its error."""

import re
from dataclasses import replace

import numpy as np
import pytest

from golden.html import Page
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.angle_error.repeatability import shipped
from pcnet3d.pipeline.core.measures import read_measures
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.files.atomic import plain
from pcnet3d.pipeline.running.sentences import ERRORS_OF_ANGLES
from pcnet3d.pipeline.signals.angles import ANGLES
from pcnet3d.stages.study.compare.align import correlated
from pcnet3d.stages.study.compare.comparison import (
    WHY,
    as_figures,
    as_page,
    changes,
    compared,
    conclusion,
    figures,
    shift_in_words,
    summary,
)
from pcnet3d.stages.study.compare.side import one_clock


def with_run(side, **changes):
    """The side of a run with other values in these fields of its take."""
    return replace(side, run=side.run.with_(**changes))


def test_two_recordings_are_two_motions_and_one_recording_is_one(sides):
    found = compared(sides)
    (pair,) = found.pairs
    assert (pair.alignment, pair.agreement) == (None, {})
    assert "two motions" in shift_in_words(pair)
    assert "two motions" not in as_page(found).split("<section")[0]
    later = replace(sides[0], name="later", time_s=sides[0].time_s + 3.0)
    assert one_clock(later, sides[0])
    (pair,) = compared([sides[0], later]).pairs
    assert (pair.alignment.how, pair.alignment.shift_s) == ("time stamps", 0)
    apart = replace(later, time_s=sides[0].time_s + 100.0)  # which has no second in common
    assert compared([sides[0], apart]).pairs[0].alignment is None


def test_two_motions_that_are_compared_as_one_are_warned_of(sides):
    rng = np.random.default_rng(0)
    other = {name: rng.normal(0, 20, len(values)) for name, values in sides[1].angles.items()}
    found = compared([sides[0], replace(sides[1], angles=other)], "stamps")
    assert [each.code for each in found.notices] == ["angles-weak"]
    slow = replace(walking(sides[1], 1.25), name="slow")
    assert [each.code for each in compared([walking(sides[0], 1.0), slow], "correlate").notices]


def walking(side, stride_s):
    """The side as a walk of even strides."""
    phase = 2 * np.pi * side.time_s / stride_s
    swings = {name: 30 * np.sin(phase + np.pi * name.startswith("l_")) for name in side.angles}
    return replace(side, angles=swings)


def test_of_strides_that_fit_as_well_the_nearest_to_the_offset_is_taken(sides):
    """A walk whose first stride was lifted badly fits best where that stride lies outside of the other."""
    walk = walking(sides[0], 1.0)
    noise = np.random.default_rng(0).normal(0, 10, len(walk.time_s)) * (walk.time_s < 1)
    lifted = replace(
        walk, name="lifted", angles={name: values + noise for name, values in walk.angles.items()}
    )
    for offset_s in (0.0, 0.2, 1.0):
        found = correlated(lifted, walk, offset_s, 5.0)
        assert found.shift_s == pytest.approx(round(offset_s), abs=5e-3)
        assert found.runner_up > found.r
    (said,) = compared([walk, lifted], "correlate").notices
    assert (said.code, said.values["offset_s"]) == ("shift-ambiguous", 0.0)


def ranging(side, **ranges):
    """The side as a take with these ranges of motion, each known to 4 degrees: their width, or more of each."""
    of = {name: more if isinstance(more, dict) else {"p05_p95_deg": more} for name, more in ranges.items()}
    known = {name: {"p05_p95_error_deg": 4.0, **more} for name, more in of.items()}
    return with_run(side, measures=read_measures({"range_of_motion": known}))


def of_visit(side, low_deg, high_deg, speed):
    """The side as a take with one range of motion, known to 4 degrees, and one walking speed, known to 0.05 m/s."""
    ranges = {"r_knee_flexion": {"p05_deg": low_deg, "p95_deg": high_deg, "p05_p95_deg": high_deg - low_deg}}
    ranges["r_knee_flexion"] |= {"p05_p95_error_deg": 4.0}
    walking = {"walking_speed": speed, "walking_speed_error": 0.05, "steps": 4}
    measures = read_measures({"range_of_motion": ranges, "walking": walking})
    return replace(with_run(side, measures=measures), metric=True)


def test_a_difference_of_two_visits_stands_with_its_error(sides):
    visits = [of_visit(sides[0], 5.0, 55.0, 1.0), of_visit(sides[1], 5.0, 75.0, 1.1)]
    found = compared(visits)
    knee, speed = found.pairs[0].changes
    assert (knee.item, knee.difference, knee.error) == ("r_knee_flexion", 20.0, pytest.approx(np.hypot(4, 4)))
    assert not knee.within_error  # 20 of 1.645 * 5.7
    assert speed.within_error  # 0.10 of 1.645 * 0.071
    said = next(conclusion(found.pairs[0]))
    assert said == (
        "1 of 2 figures differs by more than chance; front minus side: range of right knee flexion +20 ± 9°"
    )
    page = as_page(found)
    assert "+20 ± 9 *</td>" in page
    assert "different or unknown places" in page
    assert re.search(r"<td[^>]*class=soft[^>]*>\+0\.10 ± 0\.12</td>", page)
    (entry,) = (one for one in figures(found)["pairs"]["front"]["changes"] if one["unit"] == "m/s")
    assert (entry["reference"], entry["value"], entry["within_error"]) == (1.0, 1.1, True)
    assert (entry["mdc90"], entry["differs"]) == (pytest.approx(0.12, abs=0.01), False)
    assert figures(found)["pairs"]["front"]["same_place"] is False


def lifted(side, by=None):
    """The side as of poses that the built-in lifter made, or another."""
    made_by = MadeBy("estimated", shipped_noise().lifter if by is None else by, in_run=True)
    return with_run(side, poses=side.run.poses.with_(made_by=made_by), angle_errors="judged")


def test_what_the_lifter_errs_alike_in_both_visits_is_not_in_the_difference(sides):
    """Differences of two visits were stated three times too large: 23 degrees of a knee's range where 8 do."""
    first, later = (of_visit(lifted(sides[0]), 5.0, high, 1.0) for high in (55.0, 65.0))
    later = replace(later, name="later")
    knee = changes(later, first, True)[0]
    assert knee.error == pytest.approx(
        shipped()["factors"]["again"]["range_of_motion.knee_flexion"] * np.hypot(4, 4)
    )
    assert not knee.within_error
    assert changes(later, first, False)[0].error > knee.error
    of_another = with_run(later, poses=lifted(later, "another").run.poses)
    assert changes(of_another, first, True)[0].error == pytest.approx(np.hypot(4, 4))
    of_file = with_run(later, angle_errors="file")  # shares of other errors than these
    assert changes(of_file, first, True)[0].error == pytest.approx(np.hypot(4, 4))
    page = as_page(compared([of_file, first]))
    assert all(ERRORS_OF_ANGLES[how] in page for how in ("judged", "file"))
    assert "about the same place" in as_page(compared([first, later]))


def test_a_figure_of_which_one_take_shows_another_part_is_not_compared(sides):
    """A thigh that one visit saw while it stood and the other while it ran, too, was said to have changed by 55
    degrees."""

    def visit(side, high_deg, unseen):
        seen = {"p05_p95_deg": high_deg}
        knee, thigh = ({**seen, "nan_share": share} for share in (0.0, unseen))
        return ranging(side, r_knee_flexion=knee, l_thigh_sagittal=thigh)

    first, later = visit(sides[0], 70.0, 0.0), visit(sides[1], 15.0, 0.77)
    by = {change.item: change for change in changes(later, first, True)}
    assert [by[name].differs for name in ("r_knee_flexion", "l_thigh_sagittal")] == [True, None]
    assert by["l_thigh_sagittal"].reason == "another-part"
    page = as_page(compared([later, first]))
    assert "+55; not judged: another part" in page
    assert WHY["another-part"] in page
    entries = {one["item"]: one for one in plain(as_figures(list(by.values())))}
    assert [entries["l_thigh_sagittal"][key] for key in ("error", "mdc90", "within_error", "differs")] == [
        None
    ] * 4
    alike = changes(visit(sides[1], 15.0, 0.1), first, True)
    assert all(change.differs for change in alike)


def test_what_doubtful_poses_differ_by_is_not_said_to_be_a_change(sides):
    """A walk and its stretched video: "double support -17 ± 5 %", and no word that the poses were suspicious."""

    def visit(side, high_deg, *findings):
        return with_run(ranging(side, r_knee_flexion={"p05_p95_deg": high_deg}), findings=findings)

    stretched = notice("limbs-copied", limb="leg")
    for findings, differs in (((), True), ((stretched,), None)):
        (pair,) = compared([visit(sides[0], 70.0), visit(sides[1], 15.0, *findings)]).pairs
        assert [change.differs for change in pair.changes] == [differs]
        assert [change.reason for change in pair.changes] == ["" if differs else "poses-doubtful"]
        assert (WHY["poses-doubtful"] in " ".join(conclusion(pair))) == (differs is None)


def test_why_a_difference_is_not_told(sides):
    """ "compared: nothing", and dashes without a reason."""
    both = {"p05_p95_deg": 50.0}
    first = with_run(
        sides[0],
        measures=read_measures({"range_of_motion": {"r_knee_flexion": both, "l_knee_flexion": both}}),
    )
    later = with_run(
        sides[1], measures=read_measures({"range_of_motion": {"r_knee_flexion": {"p05_p95_deg": 60.0}}})
    )
    right, left = changes(later, first, True)
    assert (right.reason, right.difference, right.differs) == ("error-unknown", 10.0, None)
    assert (left.reason, left.reference, left.differs) == ("in-one-take", 50.0, None)
    (said,) = summary([right, left], "")
    assert said == f"2 differences not judged: {WHY['error-unknown']} (1), {WHY['in-one-take']} (1)"
    of_length = [
        of_visit(sides[0], 5.0, 55.0, 1.0),
        replace(of_visit(sides[1], 5.0, 55.0, 1.0), metric=False),
    ]
    assert [change.reason for change in changes(*of_length, True)] == ["", "unit-unknown"]


def test_of_many_figures_one_that_chance_may_have_made_is_not_said_to_differ(sides):
    """By Benjamini and Hochberg: nine figures that are alike, and one beyond its own MDC90."""

    first = dict.fromkeys(list(ANGLES)[:10], 50.0)
    assert "r_knee_flexion" in first
    for more_deg, beyond, differ in ((5.0, 0, 0), (11.0, 1, 0), (40.0, 1, 1)):
        later = {**first, "r_knee_flexion": 50.0 + more_deg}
        found = changes(ranging(sides[1], **later), ranging(sides[0], **first), True)
        assert len(found) == 10
        assert sum(not change.within_error for change in found) == beyond
        assert sum(change.differs for change in found) == differ
        (said,) = summary(found, "front less side")
        assert said.startswith(("1 of 10", "none of 10")[not differ])


def test_estimators_of_one_recording_are_no_visits(sides):
    """Their errors are not independent, so nothing is said of changes."""
    visits = [of_visit(sides[0], 5.0, 55.0, 1.0), replace(of_visit(sides[0], 5.0, 75.0, 1.0), name="twin")]
    assert not any("chance" in said for said in conclusion(compared(visits).pairs[0]))


def test_names_that_are_html_are_shown_letter_by_letter_and_not_obeyed(sides):
    names = "<svg onload=alert(1)>&amp;", "<script>alert(1)</script>&quot;\"'"
    found = compared([replace(s, name=name) for s, name in zip(sides, names, strict=True)], "stamps")
    page = Page(as_page(found))
    assert not any(key.startswith("on") for _, attributes in page.tags for key in attributes)
    assert len(page.scripts) == 1  # ours
    assert all(name in page.words for name in names)
