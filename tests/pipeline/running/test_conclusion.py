"""What a command says: the result, how far it can be trusted, at most three notices, then what to open."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commands import pcnet3d, recipe_of
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import Z_UP, Take
from pcnet3d.pipeline.core.messages import set_verbose
from pcnet3d.pipeline.core.notices import notice, own_notice
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.running.sentences import conclude, length_of, point_to, trusted
from pcnet3d.stages import rectify
from pcnet3d.stages.export.stage import summary
from pcnet3d.stages.rectify import Rectify


@pytest.fixture(scope="module")
def take(scene):
    poses = scene.poses[0]
    return Take("walk", poses=poses, rectified=rectify(poses, "geometric"), findings=(), measures=())


def test_the_result_then_trust_then_the_files(take, tmp_path, capsys):
    conclude({"": take}, tmp_path)
    for name in ("take.rrd", "report.html"):
        (tmp_path / name).touch()
    point_to(tmp_path)
    what, trusted, bare, files = capsys.readouterr().out.splitlines()
    assert what == f"{len(take.poses)} frames, {take.poses.times[-1]:.1f} s at 30 a second."
    assert trusted.startswith("The poses are good. Up is known to within")
    assert bare == f"results in {tmp_path}"
    opened = (f"open {tmp_path / 'report.html'}", f"the recording: pcnet3d view {tmp_path}")
    assert files == f"results in {tmp_path}: {'; '.join(opened)}"


@pytest.fixture
def said(take, tmp_path, capsys):
    """said(notices, ...): what is said of takes with these, on stderr and on stdout."""

    def call(*notices, names=("",), verbose=False):
        set_verbose(verbose)
        conclude({name: take.saying(*own) for name, own in zip(names, notices, strict=True)}, tmp_path)
        set_verbose(False)
        out, err = capsys.readouterr()
        return err.splitlines(), out.splitlines()

    return call


WARNINGS = [own_notice(f"test.{name}", f"It is {name}.", "warning") for name in "abcd"]
NOTES = [own_notice("test.plain", "It is so.", "note"), own_notice("test.told", "Give --focal.", "note")]


def test_at_most_three_notices_are_said_the_gravest_and_those_to_act_on_first(said):
    advises = own_notice("test.z", "It is z (--fps).", "warning")
    again = own_notice("test.z", "It is z again.", "warning")
    err, out = said([*NOTES, *WARNINGS, advises, again])
    assert err == ["warning: It is z (--fps).", "warning: It is a.", "warning: It is b."]
    assert out[-1] == "5 more notes in the report (-v)"
    err, out = said([*NOTES, WARNINGS[0]])
    assert err == ["warning: It is a.", "note: Give --focal."]  # what changes no decision is not said
    assert out[-1] == "1 more note in the report (-v)"
    err, _ = said([notice("errors-unknown", what="it", reason=why) for why in ("so it is", "give --focal")])
    assert err == ["note: The errors of it are not known: give --focal."]
    weights = {"give --focal": "note", "so it is": "warning"}  # the graver one is said, wherever it comes
    err, _ = said(
        [notice("errors-unknown", weight=weight, what="it", reason=why) for why, weight in weights.items()]
    )
    assert err == ["warning: The errors of it are not known: so it is."]


def test_all_are_said_with_v(said):
    every = [*NOTES, *WARNINGS]
    err, out = said(every, verbose=True)
    assert [line.partition(": ")[2] for line in err] == [each.text for each in every]
    assert "more" not in out[-1]


def test_marks_and_what_the_verdict_says_are_not_said_again(said):
    err, out = said([notice("seam", rows=[3], where="here"), own_notice("test.x", "Why.", "suspicious")])
    assert err == []
    assert "Why" in out[1]
    assert out[-1].startswith("results in")


def test_a_fault_that_is_in_the_verdict_is_no_warning_too(said, take, tmp_path, capsys):
    fault = own_notice("test.swapped", "Arms are exchanged.", "suspicious")
    err, out = said([fault, replace(fault, weight="warning")])
    assert (err, "Arms are exchanged" in out[1]) == ([], True)
    tilted = replace(take.rectified, level_ok=False, level_reason="they lie")
    lying = take.with_(rectified=tilted).saying(notice("not-levelled", reason="they lie"))
    conclude({"": lying}, tmp_path)
    both = capsys.readouterr()
    assert (both.out + both.err).count("they lie") == 1


def test_a_photograph_has_no_length_and_is_not_suspicious(take):
    photo = take.with_(poses=take.poses.rows(0, 1), findings=(notice("too-few-frames"),))
    assert length_of(photo) == "1 frame"
    assert trusted(photo).startswith("The poses cannot be judged. ")


def test_what_is_said_of_everybody_is_said_once(said):
    err, _ = said(WARNINGS[:2], WARNINGS[:1], names=("person 1: ", "person 2: "))
    assert err == ["warning: It is a.", "warning: person 1: It is b."]


def test_who_was_visible_and_left_out_comes_first(said):
    left = notice("person-chosen", person="1", others=1, listed="2 (frames 0 to 9)")
    err, out = said([left])
    assert out[0] == left.text
    assert "--everyone" in out[0]
    assert err == []


@pytest.mark.parametrize(
    ("bound", "words"), [(0.84, "0.8"), (2.94, "2.9"), (2.97, "3"), (8.45, "8"), (0.0, "0.0")]
)
def test_a_bound_is_said_with_the_same_digits_everywhere(take, bound, words):
    known = take.with_(rectified=replace(take.rectified, up_bound_deg=np.full(len(take.poses), bound)))
    assert trusted(known).endswith(f"Up is known to within {words}° (90 %).")


@pytest.mark.parametrize(("gravity", "known"), [(None, False), ((0, 1, 0), True)])
def test_of_unusable_poses_up_is_not_known_by_the_poses(take, gravity, known):
    """Up was "known to within 8 degrees" by the posture of a body whose thighs vary by a third of their length."""
    unusable = take.with_(findings=(own_notice("test.flat", "No depth.", "unusable"),)).telling(
        gravity=gravity
    )
    judged = Rectify("geometric")(unusable)
    assert np.isfinite(judged.rectified.up_bound_deg).all() == known
    assert trusted(judged).endswith("rests on poses that are unusable.") is not known
    assert ("is known to within" in trusted(judged)) is known
    written = summary(judged)["rectification"]
    assert (written["up_error_deg"] is None, written["up_bound_deg"] is None) == (not known, not known)


def test_up_of_a_take_in_which_nobody_stands_is_known_unless_the_picture_is_turned(take):
    level = take.rectified.level
    laid = replace(take.rectified, level=level.with_(joints=level.joints[..., [2, 1, 0]]))
    assert trusted(take.with_(rectified=laid)).endswith(", unless the image is turned.")
    assert "turned" not in trusted(take)
    known = replace(laid, source=Z_UP, camera=None)
    assert "turned" not in trusted(take.with_(rectified=known))


def test_the_first_line_says_how_much_of_the_video_and_of_whom(take):
    """Half of a video was left out, and the first line said how long the rest was."""
    frames = len(take.poses)
    whole = Video(Path("film.mp4"), 320, 240, np.arange(2 * frames) / 30, "h264")
    part = take.with_(video=whole).saying(notice("joined-again", person="0", again="2"))
    assert f"{frames} of the {2 * frames} frames of the video (50 %)" in length_of(part)
    assert length_of(part).endswith(", person 0")
    assert "video" not in length_of(take.with_(video=replace(whole, part=(0, frames - 1))))


@pytest.fixture(scope="module")
def joints() -> np.ndarray:
    """(T, 17, 3) of the walker before a camera, until she stands still, digit for digit."""
    walk = walker(seconds=4)
    return camera_poses(walk, side_camera(walk)).joints[:54]


def _repeated(joints):
    joints[10:40:3] = joints[9:39:3]
    return joints


CHANGES = {
    "none": lambda joints: joints,
    "repeated": _repeated,
    "flat": lambda joints: joints * [1, 1, 1e-3],
    "lying": lambda joints: joints[..., [1, 0, 2]] * [1, -1, 1],
    "short": lambda joints: joints[:5],
}


@pytest.fixture
def run(joints, tmp_path):
    """run(change, *words): exit code, the line about trust and the folder."""

    def call(change, *words: str):
        np.save(tmp_path / "poses.npy", CHANGES[change](joints.copy()))
        recipe = recipe_of(tmp_path / "quick.toml", "rectify", "trajectories", "export")
        out = tmp_path / "out"
        given = ["--poses", tmp_path / "poses.npy", "--adapter", "videopose3d", "--fps", 30, "-o", out]
        done = pcnet3d("run", *given, f"--recipe={recipe}", *words)
        assert out.is_dir(), done.stderr
        return done.returncode, done.stdout.splitlines()[1], out

    return call


@pytest.mark.parametrize(
    ("change", "code"), [("none", 0), ("repeated", 3), ("flat", 4), ("lying", 3), ("short", 4)]
)
def test_whatever_the_poses_are_there_are_results(run, change, code, tmp_path):
    ended, last, out = run(change, "--set=read.handedness=ignore")
    assert ended == 0
    if change in ("none", "repeated", "flat"):  # whose faults are in the file, where inspect sees them
        assert pcnet3d("inspect", tmp_path / "poses.npy", "--adapter", "videopose3d").returncode == code
    assert ("The poses are good" in last) == (change in ("none", "short"))
    level_ok = json.loads((out / "summary.json").read_text())["rectification"]["level_ok"]
    assert level_ok == (change != "short")
