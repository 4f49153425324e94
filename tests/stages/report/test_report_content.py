"""What the report says and shows, without a browser."""

import re
from dataclasses import replace

import numpy as np
import pytest

from golden.html import Page
from golden.walks import GEOMETRIC, measured
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, PoseSequence
from pcnet3d.pipeline.core.figures import label_of
from pcnet3d.pipeline.core.notices import notice, own_notice
from pcnet3d.pipeline.core.take import Session
from pcnet3d.pipeline.signals.angles import ANGLES, MISSING, REASONS
from pcnet3d.stages.measures.stage import Measures as Stage
from pcnet3d.stages.report.stage import Report, report
from refusals import refused


@pytest.fixture(scope="module")
def content(walk_take) -> str:
    return report(walk_take)


def test_it_has_every_part_and_a_chart_for_every_angle(content):
    shown = Page(content)
    headings = re.findall(r"<h2>(.*?)</h2>", content)
    assert headings == [
        "Joint angles over time", "Input and steps",
    ]  # fmt: skip
    titles = re.findall(r"<figcaption>(.*?)</figcaption>", content)
    for name in ANGLES:
        words = label_of(name.removeprefix("r_").removeprefix("l_")).capitalize()
        assert f"{words} (°)" in titles
    assert len([tag for tag, _ in shown.tags if tag == "svg"]) >= len(titles)
    assert "60 frames, 2.0 s at 30 a second" in shown.words
    assert "geometric" in shown.words
    assert "CAMERA (x right, y down" in shown.words
    assert "<h1>walker</h1>" in content


def test_it_stands_alone(content):
    assert "url(" not in content
    (policy,) = [a["content"] for tag, a in Page(content).tags if tag == "meta" and a.get("http-equiv")]
    assert "default-src 'none'" in policy
    assert "script-src 'sha256-" in policy
    assert "http" not in policy


def test_texts_of_files_and_events_are_shown_not_obeyed(walk_take):
    nasty = '<script>alert("x")</script><img src=x onerror=alert(1)>'
    take = replace(walk_take, name=nasty, session=Session(nasty, nasty, nasty)).saying(
        own_notice("test.said", nasty),
        own_notice("test.said", nasty, "repair"),
        own_notice("test.said", nasty, "note"),
        own_notice("test.said", nasty, about="view"),
    )
    take = take.with_(
        inputs=({"role": "poses", "file": nasty, "adapter": nasty, "sha256": nasty},),
        filtered=take.filtered.noted(nasty, what=nasty),
        rectified=replace(take.rectified, method=nasty, level_heading=nasty, up_shares={nasty: 1.0}),
    )
    shown = Page(report(take))
    assert [tag for tag, _ in shown.tags].count("script") == 1  # ours, which reads the charts
    assert not [a for tag, a in shown.tags if tag == "img" and not (a["src"] or "").startswith("data:")]
    assert shown.words.count(nasty) >= 10
    (style,) = re.findall(r"<style>(.*?)</style>", report(take), re.DOTALL)
    assert not set("<&") & set(style)  # the title stands there too, for paper


def test_title_person_and_date_stand_at_the_head(walk_take):
    said = report(replace(walk_take, session=Session("Visit <1>", "P-07", "2026-03-31")))
    assert "<title>Visit &lt;1&gt;</title>" in said
    assert "<h1>Visit &lt;1&gt;</h1>" in said
    assert "Person P-07 · 2026-03-31 · walker" in said


def test_warnings_come_before_the_first_image(walk_take):
    take = walk_take.saying(own_notice("test.said", "the poses are odd"))
    take = take.with_(rectified=replace(take.rectified, level_ok=False, level_reason="the person lies"))
    said = report(take)
    for words in ("the poses are odd", "could not be levelled: the person lies"):
        assert 0 < said.index(words) < said.index("Joint angles over time</h2>")
    assert '<details class="gauge bad" open>' in said


def test_what_a_take_lacks_is_left_out(walk_take):
    bare = walk_take.with_(kinematics=None, keypoints=None, filtered=None)
    said = report(bare)
    assert "Joint angles" not in said
    with refused("needs-stage"):
        report(walk_take.with_(rectified=None))


def test_a_take_that_nothing_is_known_of_still_has_a_report(walk_take):
    nothing = np.full_like(walk_take.poses.joints, np.nan)
    rectified = walk_take.rectified
    take = walk_take.with_(
        poses=walk_take.poses.with_(joints=nothing),
        rectified=replace(
            rectified,
            level=rectified.level.with_(joints=nothing),
            R_source_from_body=np.full_like(rectified.R_source_from_body, np.nan),
            level_ok=False,
            level_reason="there is nothing",
        ),
        kinematics={
            name: np.full(len(nothing), np.nan) for name in walk_take.kinematics if "reason" not in name
        },
        keypoints=None,
    )
    assert "there is nothing" in report(take)


def test_the_stage_changes_nothing(walk_take, content, tmp_path):
    assert Report(tmp_path)(walk_take) is walk_take
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == content


def test_one_frame_has_no_empty_charts_and_its_angles_in_a_table():
    one = walker(seconds=1.0).poses
    joints = one.joints[:1].copy()
    joints[:, H36M17.index("r_wrist")] = np.nan
    one = PoseSequence(joints, H36M17, one.frame, time_s=one.time_s[:1])
    take = measured(one, GEOMETRIC)
    said = report(take)
    words = Page(report(take.with_(kinematics=None, filtered=None))).words
    assert "1 frame" in words
    assert "1 frame, 0.0 s" not in words
    assert not re.search(r"\bnan\b", words)
    assert "<svg" not in said.split("Joint angles</h2>")[1]
    assert "right knee flexion" in said
    assert REASONS[MISSING] in said
    assert "Movements</h2>" not in said


def test_why_no_figures_are_made_is_the_first_thing_said(walk_take):
    """It stood in the terminal alone: the page drew the angles of unusable poses and said no word."""
    take = walk_take.with_(findings=(own_notice("test.flat", "no depth", "unusable"),))
    said = report(Stage()(take))
    (first,) = re.findall(r'<div class="answer"><p>(.*?)</p>', said)
    assert Page(first).words == notice("figures-withheld").text
    assert said.count(first) == 1


def test_the_head_says_of_how_many_frames_the_person_was_followed_in_some(walk_take, film):
    """157 of 230 frames were called "157 frames"."""
    head = report(walk_take.with_(video=film(75)).telling(images=False))
    assert "60 of the 75 frames of the video (80 %), 2.0 s" in head
    assert "60 frames, 2.0 s" in report(walk_take.with_(video=film(60)).telling(images=False))
    part = replace(film(75), part=(5, 69))
    assert "60 of the 65 frames of this part of" in report(walk_take.with_(video=part).telling(images=False))
