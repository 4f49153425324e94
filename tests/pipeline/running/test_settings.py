"""The options of a run: what each becomes, and what is refused in them."""

import re
import sys
from contextlib import suppress
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

from commands import recipe_of
from golden.detections import drawn_tracks
from pcnet3d.pipeline import InputError, Told, load_recipe
from pcnet3d.pipeline.cli import main
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.reading.settings import TOLD, RunOptions, flag_of
from pcnet3d.pipeline.running.recipe import HEEDED_BY_READING, Recipe, StageEntry, planned
from refusals import refused

VIDEO, POSES, KEYPOINTS = Path("v.mp4"), Path("p.npy"), Path("k.json")


def told(**given) -> dict[str, dict]:
    """The options of every stage of the run, those without any left out."""
    return {entry.use: entry.options for entry in planned(RunOptions(**given)).stages if entry.options}


def stages(**given) -> list[str]:
    return [entry.use for entry in planned(RunOptions(**given)).stages]


def test_what_is_given_decides_on_the_first_stages_which_have_their_own_defaults():
    assert stages(poses=POSES)[0] == "clean"
    assert stages(keypoints=KEYPOINTS)[:2] == ["lift", "clean"]
    assert stages(keypoints=KEYPOINTS, video=VIDEO)[:3] == ["calibrate", "lift", "clean"]
    assert stages(video=VIDEO)[:4] == ["detect", "calibrate", "lift", "clean"]
    assert told(video=VIDEO) == told(poses=POSES) == told(keypoints=KEYPOINTS) == {}


def test_what_is_told_is_for_a_stage_of_ours_or_heeded_by_reading():
    ours = (name for name, point in registry.registered("stages").items() if point.dist.name == "pcnet3d")
    by_stages = {of_told for name in ours for of_told in getattr(registry.load("stages", name), "reads", ())}
    assert {*TOLD.values()} - by_stages == {*HEEDED_BY_READING}


def test_an_option_goes_to_each_stage_that_it_is_for():
    assert told(video=VIDEO, detector="toy", lifter="geometric", also=("csv",)) == {
        "detect": {"detector": "toy"},
        "lift": {"lifter": "geometric"},
        "export": {"also": ("csv",)},
    }


def test_what_is_told_of_the_recording_is_no_stages_option():
    given = {
        "camera": "moving", "focal": 900, "image_size": "640x360", "stature": 1.7, "no_frames": True,
        "person": "2", "fps": 60, "check": "off", "handedness": "mirror",
    }  # fmt: skip
    assert told(keypoints=KEYPOINTS, **given) == {}
    options = RunOptions(keypoints=KEYPOINTS, **given)
    assert options.told == Told(
        "moving", 900, image_size=(640, 360), stature_m=1.7, images=False,
        fps=60, person="2", handedness="mirror", check="off",
    )  # fmt: skip
    assert told(video=VIDEO, person="2", fps=60, check="off", handedness="mirror") == {}
    assert RunOptions(gravity="0,1,0").told == Told(gravity=(0, 1, 0))


@pytest.mark.parametrize(
    ("given", "stage"),
    [
        ({"stature": 1.7}, "scale"),
        ({"focal": 900}, "place"),
        ({"pitch": 3, "roll": 0}, "rectify"),
        ({"camera": "moving"}, "rectify"),
        ({"image_size": "640x360"}, "clean"),
    ],
)
def test_what_no_stage_reads_is_refused(given, stage):
    bare = Recipe(stages=(StageEntry(use="trajectories"),))
    flag = re.escape(flag_of(next(iter(given))))
    with pytest.raises(InputError, match=f"{flag} is for the stage .*'{stage}'.*this run does not have"):
        planned(RunOptions(poses=POSES, **given), bare)


def test_a_given_recipe_has_all_that_the_options_ask_for():
    """It dropped them all without a word: six images of a person were in a report that was to have none."""
    options = RunOptions(
        keypoints=KEYPOINTS,
        lifter="geometric",
        also=("csv",),
        settings=["clean.spike=0.7", "trajectories.cutoff_hz=7"],
    )
    recipe = load_recipe().starting_with("lift")
    assert planned(options, recipe) == planned(options)
    assert planned(options, planned(options)) == planned(options)
    with pytest.raises(InputError, match=r"--lifter is for the stage 'lift'.*take its place"):
        planned(options, load_recipe())
    left_out = RunOptions(poses=POSES, settings=["record=off"])
    assert planned(left_out, planned(left_out)) == planned(left_out)
    with pytest.raises(InputError, match="one recipe"):
        planned(RunOptions(poses=POSES, recipe="mine.toml"), load_recipe())


@pytest.mark.parametrize("setting", ["rectify.camera=moving", "detect.fps=60", "report.frames=false"])
def test_what_is_told_of_the_recording_cannot_be_contradicted(setting):
    """One report had two cameras, one of which stood still."""
    with refused("name-unknown", setting.partition("=")[0].partition(".")[2]):
        planned(RunOptions(poses=POSES, settings=[setting]))


def test_settings_reach_their_stage_in_the_type_it_asks_for():
    given = ["clean.spike=0.7", "measures.unusable=yes", "measures.repeat=r_elbow_flexion,l_elbow_flexion"]
    assert told(keypoints=KEYPOINTS, settings=given) == {
        "clean": {"spike": 0.7},
        "measures": {"unusable": True, "repeat": ("r_elbow_flexion", "l_elbow_flexion")},
    }


def test_settings_of_reading_are_fields():
    options = RunOptions(settings=["read.check=off", "read.first_frame=7", "keypoints.track=true"])
    assert (options.check, options.first_frame) == ("off", 7)
    assert options.keypoints_options == {"track": "true"}
    assert options.settings == {}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("rectfy.pitch_deg=3", ["no stage 'rectfy'", "did you mean rectify"]),
        ("clean.spkie=3", ["'clean'", "'spkie'", "did you mean spike"]),
        ("clean.spike=wide", ["'clean'", "spike='wide'", "number"]),
        ("clean.spike=nan", ["'clean'", "spike='nan'", "finite"]),
        ("lift.lifter=mine", ["lift.lifter", "'lift'", "this run does not have"]),
        ("lift=off", ["lift=off", "'lift'", "this run does not have"]),
        ("read.fps=30", ["read.fps", "it is --fps"]),
        ("read.chek=off", ["read.chek", "did you mean check"]),
        ("read.check=of", ["read.check=of", "'off'"]),
        ("keypoints.track=true", ["--keypoints"]),
        ("read.keypoints_person=2", ["--keypoints"]),
        ("stature=1.8", ["STAGE.KEY=VALUE", "stature is --stature"]),
        ("stature", ["KEY=VALUE", "--set", "'stature'"]),
        *(
            (f"read.date={date}", ["read.date=YYYY-MM-DD", date])
            for date in ("31.3.2026", "2026-02-30", "today")
        ),
        ({"fps": "fast"}, ["--fps=fast", "number"]),
        ({"pitch": "inf"}, ["--set read.pitch=inf", "finite"]),
        ({"handedness": "ignroe"}, ["--set read.handedness=ignroe", "'ignore'"]),
        ({"image_size": "640"}, ["WIDTHxHEIGHT", "'640'"]),
        *(
            ({"time_range": span}, ["START before END"])
            for span in ("8", (8, 2), (8, 0), (None, 8), 8, [[1], [2]])
        ),
        ({"gravity": "0,1"}, ["--set read.gravity=X,Y,Z", "'0,1'"]),
        ({"ftps": 30}, ["'ftps'", "did you mean fps"]),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_sentence_with_its_reason(given, words):
    with refused(None, *words):
        planned(RunOptions(poses=POSES, **({"settings": [given]} if isinstance(given, str) else given)))


@pytest.mark.parametrize(
    ("field", "values", "flag"),
    [
        ("focal_px", [0, -5, np.inf, np.nan], "--focal"),
        ("stature_m", [0, 0.3, 175, -1.8, np.nan], "0.4 and 2.6 metres (--stature)"),
        ("image_size", [(0, 0), (640, 1)], "read.image_size"),
    ],
)
def test_a_figure_that_cannot_be_is_refused_where_it_is_told(field, values, flag):
    for value in values:
        with refused("bad-value", flag):
            Told(**{field: value})


def test_the_session_is_what_is_told_of_it():
    assert told(poses=POSES, title="Visit 1", person_id="P-07", date="2026-03-31") == {}  # of no stage alone
    assert RunOptions(date="20260331").date == "2026-03-31"


def test_a_runs_options_pass_through_20_functions_at_most(mmpose, tmp_path, monkeypatch):
    """Named functions of ours, from the command line on, that are given the options or what holds them."""
    passed: set[str] = set()

    def called(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event == "call" and "/site-packages/" not in code.co_filename and not code.co_name.startswith("<"):
            given = [*frame.f_locals.values()]
            held = [each for value in given for each in _held(value)]
            if any(isinstance(value, RunOptions) for value in (*given, *held)):
                passed.add(code.co_qualname)

    recipe = recipe_of(tmp_path / "short.toml", "clean", "scale", "rectify", "trajectories", "export")
    keypoints = drawn_tracks(tmp_path / "tracks.json", {0: range(90)})
    words = ["--poses", mmpose(), "--keypoints", keypoints, "--person", 0, "--fps", 30, "--time-range", "0:2"]
    words += ["--recipe", recipe, "--set", "rectify.rectifier=geometric", "-o", tmp_path / "out"]
    monkeypatch.setattr("sys.argv", ["pcnet3d", "run", *map(str, words)])
    sys.setprofile(called)
    try:
        with suppress(SystemExit):
            main()
    finally:
        sys.setprofile(None)
    assert (tmp_path / "out" / "summary.json").is_file()
    assert len(passed) <= 20, f"{len(passed)}: {sorted(passed)}"


def _held(value: object) -> list[object]:
    """The attributes of an object, without asking the object itself."""
    try:
        return [*object.__getattribute__(value, "__dict__").values()]
    except AttributeError:
        return []
