"""The skeleton that plays in the page: what it holds is the take, and it and the charts are at one moment."""

import base64
import json
from dataclasses import replace
from html import unescape

import cv2
import numpy as np
import pytest
from markupsafe import Markup

from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.stages.drawing.charts import Curve, over_time
from pcnet3d.stages.drawing.page import charts, figure, page
from pcnet3d.stages.report.player import _chosen, skeleton_player


def held_of(markup: str) -> dict:
    return json.loads(unescape(str(markup).partition('data-held="')[2].partition('"')[0]))


def points_of(held: dict) -> np.ndarray:
    whole = (
        np.frombuffer(base64.b64decode(held["points"]), "<i2").astype(float).reshape(-1, held["joints"], 3)
    )
    return np.where(whole == -32768, np.nan, whole * held["step"])


def test_it_holds_the_joints_of_every_frame_on_their_floor(walk_take):
    held, level = held_of(skeleton_player(walk_take)), walk_take.filtered
    points, joints = points_of(held), level.joints
    assert held["times"] == pytest.approx(level.times, abs=1e-4)
    relative = points[:, :17] - points[:, :1]
    assert relative == pytest.approx(joints - joints[:, :1], abs=1e-3, nan_ok=True)
    ankles = points[:, H36M17.indices(("r_ankle", "l_ankle")), 2]
    assert np.nanpercentile(ankles, 2) == pytest.approx(0, abs=0.15)
    assert len(held["bones"]) >= len(H36M17.bones)
    assert "turned upright" in skeleton_player(walk_take)
    tilted = walk_take.with_(rectified=replace(walk_take.rectified, level_ok=False))
    assert "upright" not in skeleton_player(tilted)


def test_a_gap_is_no_pose(walk_take):
    joints = walk_take.filtered.joints.copy()
    joints[10:20] = np.nan
    gap = walk_take.with_(filtered=walk_take.filtered.with_(joints=joints))
    assert np.isnan(points_of(held_of(skeleton_player(gap)))[10:20, :17]).all()


def test_without_a_place_the_lower_foot_stands(walk_take):
    away = walk_take.filtered.with_(path=None)
    points = points_of(held_of(skeleton_player(walk_take.with_(filtered=away))))
    feet = points[:, H36M17.indices(("r_ankle", "l_ankle")), 2]
    assert feet.min(axis=1).max() < 0.2
    assert feet.min() > -0.01


def test_the_film_has_pictures_of_the_frames_at_their_times(walk_take, film):
    shown = held_of(skeleton_player(walk_take.with_(video=film())))["film"]
    assert len(shown["times"]) == len(shown["pictures"]) == len(walk_take.poses)
    assert shown["times"] == pytest.approx(walk_take.poses.times, abs=1e-3)
    assert all(each.startswith("data:image/jpeg;base64,") for each in shown["pictures"])
    assert "film" not in held_of(skeleton_player(walk_take))


def test_without_keypoints_the_film_is_of_whole_images(walk_take, film):
    """Of a video and a lifter's poses alone the page had pictures far below, of six frames."""
    video = film()
    (shown, *_) = held_of(skeleton_player(walk_take.with_(video=video, keypoints=None)))["film"]["pictures"]
    content = base64.b64decode(shown.partition(",")[2])
    height, width, _ = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).shape
    assert height / width == pytest.approx(video.size[1] / video.size[0], abs=0.01)


def test_the_film_of_a_long_take_is_of_key_frames_that_need_no_others(film):
    long = replace(film(), key_frames=tuple(range(0, 9000, 250)))
    assert set(_chosen(long, 100, 8900)) <= set(long.key_frames)
    assert len(_chosen(long, 0, 99)) == 60
    assert _chosen(replace(long, key_frames=(0,)), 0, 5000)[-1] == 5000


def test_the_player_and_the_charts_are_at_one_moment(walk_take, opened):
    times = walk_take.filtered.times
    drawn = charts([figure(over_time([Curve("a", np.sin(times))], times, "a over time"), "a")])
    browser = opened(page("walk", Markup(""), [("take", skeleton_player(walk_take)), ("a", drawn)]))
    middle = len(times) // 2
    browser.value(
        f"(i => {{ i.value = {middle}; i.dispatchEvent(new Event('input')) }})(document.querySelector('.player input'))"
    )
    at = browser.value("document.querySelector('.at').textContent")
    assert float(at.split()[0]) == pytest.approx(times[middle], abs=0.02)
    assert browser.value("document.querySelector('.player output').textContent") == f"{times[middle]:.2f} s"
    browser.value("document.querySelector('.chart svg').focus()")
    browser.press("ArrowRight")
    assert int(browser.value("document.querySelector('.player input').value")) == middle + 1
    assert browser.complaints == []


def test_it_plays_by_itself_until_it_is_touched_and_keys_turn_it(walk_take, opened):
    browser = opened(page("walk", Markup(""), [("take", skeleton_player(walk_take))]), 390)
    image, frame, button = (
        "document.querySelector('.player canvas').toDataURL()",
        "+document.querySelector('.player input').value",
        "document.querySelector('.player button').textContent",
    )
    assert browser.value(button) == "Pause"
    moved = "new Promise(r => (function look() { {} > 0 ? r(true) : setTimeout(look, 20) })())"
    assert browser.value(moved.replace("{}", frame))
    browser.value("document.querySelector('.player button').click()")
    assert browser.value(button) == "Play"
    before = browser.value(image)
    browser.value("document.querySelector('.player canvas').focus()")
    browser.press("ArrowLeft")
    assert browser.value(image) != before
    assert browser.value("document.documentElement.scrollWidth") <= 390
    assert browser.complaints == []
