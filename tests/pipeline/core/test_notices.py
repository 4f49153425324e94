"""Notices, refusals and figures: one catalogue of codes each, which the documents hold too; and the value of a take's
figures."""

import ast
import copy
import json
import pickle
import re
from pathlib import Path
from typing import get_args

import pytest

from pcnet3d.pipeline.cli import load_command
from pcnet3d.pipeline.core.errors import InputError, refusals
from pcnet3d.pipeline.core.figures import (
    ERRORS,
    FIGURES,
    GROUPS,
    TOGETHER,
    UNITS,
    WITHHELD,
    Audience,
)
from pcnet3d.pipeline.core.measures import Measure, Measures, Moments, Remark, read_measures, withheld, within
from pcnet3d.pipeline.core.notices import (
    About,
    Notice,
    Weight,
    catalogue,
    notice,
    own_notice,
    verdict,
    without_doubles,
)
from pcnet3d.pipeline.core.take import Take
from pcnet3d.pipeline.plugins import registry
from pcnet3d.pipeline.plugins.options import option_types
from pcnet3d.pipeline.reading.load import adapters
from pcnet3d.pipeline.reading.settings import RunOptions, reading_options

ROOT = Path(__file__).parents[3]
SOURCES = {
    path.relative_to(ROOT): path.read_text(encoding="utf-8")
    for room in ("pipeline", "adapters", "models", "stages", "examples")
    for path in sorted((ROOT / room).rglob("*.py"))
    if "lab" not in path.parts
}


def test_a_notice_has_its_sentence_and_plain_values():
    said = notice("duplicates", rows=[4], weight="suspicious", repeated=2, first=4)
    assert said.text == "2 rows repeat the row before exactly, first at row 4; speeds are wrong there."
    assert notice("duplicates", repeated=1, first=4).text.startswith("1 row repeats the row before")
    assert json.loads(json.dumps(said.as_dict())) == {
        "code": "duplicates",
        "weight": "suspicious",
        "about": "poses",
        "text": said.text,
        "rows": [4],
        "values": {"repeated": 2, "first": 4},
    }


def test_a_code_or_a_value_that_lacks_fails_where_the_notice_is_made():
    with pytest.raises(KeyError):
        notice("no-such-code")
    with pytest.raises(KeyError):
        notice("frames-without-joints", frames=2)


def test_other_packages_say_their_own_with_a_prefix():
    said = own_notice("mypackage.dark", "The video is dark: {no} value.", "warning", about="view", lux=3)
    assert (said.text, said.warns, said.values["lux"]) == ("The video is dark: {no} value.", True, 3)
    for code in ("dark", "mypackage.", ".dark"):
        with pytest.raises(ValueError, match="prefix"):
            own_notice(code, "Dark.")


def test_doubles_are_told_by_code_rows_and_values():
    first, second = (notice("seam", rows=[row], where="here") for row in (3, 5))
    assert without_doubles([first, second, notice("seam", rows=[3], where="here")]) == (first, second)
    assert Take("t").saying(first).saying(first, second).notices == (first, second)


def test_the_verdict_is_that_of_the_gravest():
    notes: list[Notice] = [notice("not-stated", what="its frame rate")]
    assert verdict(notes) == "good"
    assert (
        verdict([*notes, notice("flat", thickness_percent=1.0), notice("poses-smooth", window_s=0.5)])
        == "unusable"
    )


def test_every_code_is_said_somewhere_and_has_a_weight_and_a_subject():
    text = "\n".join(SOURCES.values())
    made = {code for code in catalogue() if f'"{code}"' in text or f'"{code.replace("-", "_")}"' in text}
    assert sorted(set(catalogue()) - made) == []
    assert {entry.weight for entry in catalogue().values()} == {*get_args(Weight)}
    assert {entry.about for entry in catalogue().values()} == {*get_args(About)}


COMMANDS = ("run", "inspect", "compare", "batch", "live", "view", "list", "demo")
OTHERS = {
    "--disable-rebase-keypoint",
    "--focus",
    "--format",
    "--pixel",
    "--fit",
    "--force-reinstall",
    "--no-nanny",
}  # of other programs, and of the lab
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z](?![\w-])")


def flags_of(command: str) -> set[str]:
    return {
        flag for option in load_command(command).params for flag in (*option.opts, *option.secondary_opts)
    }


def sayers(code: str) -> set[str]:
    """The commands that can say it, by where it is said."""
    files = {path for path, text in SOURCES.items() if f'"{code}"' in text}
    compares = all("compare" in path.parts for path in files)
    inspects = any({"inspect", "findings.py", "altered.py", "checks.py"} & set(path.parts) for path in files)
    return {"compare"} if compares else {"run", "inspect"} if inspects else {"run"}


@pytest.mark.parametrize("code", [code for code, entry in catalogue().items() if "-" in entry.text])
def test_a_notice_advises_what_the_commands_that_say_it_have(code):
    """`inspect` and `run` say findings: an option that `inspect` lacks is told as that of `run`."""
    template = catalogue()[code].text
    for command in sayers(code):
        told = (
            re.sub(r"\brun --", "--", template) if command == "run" else re.sub(r"\brun --\S+", "", template)
        )
        assert set(FLAG.findall(told)) - OTHERS <= flags_of(command), command
    for place, _, value in re.findall(r"--set ([a-z]+\.[a-z_]+)(=([a-z-]+))?", template):
        stage, _, key = place.partition(".")
        if stage == "read":
            assert key in reading_options()
            if value:
                RunOptions(poses="x.npy", settings={place: value})
        elif stage == "keypoints":
            assert any(key in option_types(each.read) for each in adapters().values())
        else:
            assert key in option_types(registry.load("stages", stage))
    for key in re.findall(r"-O ([a-z_]+)=", template):
        assert any(key in option_types(each.read) for each in adapters().values())


def test_a_refusal_names_options_that_some_command_has():
    """A download that failed advised --person-detector, which there is not."""
    known = set().union(OTHERS, *map(flags_of, COMMANDS))
    for path, source in SOURCES.items():
        calls = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
        raised = [call for call in calls if ast.unparse(call.func) in ("InputError", "notice")]
        parts = [part.value for call in raised for part in ast.walk(call) if isinstance(part, ast.Constant)]
        assert {flag for part in parts for flag in FLAG.findall(str(part))} <= known, path


class _OfOursError(InputError):
    pass


@pytest.mark.parametrize("kind", [InputError, _OfOursError])
@pytest.mark.parametrize("copied", [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_code_and_message_pass_between_processes(kind, copied):
    error = kind("bad-value", "Expected a positive rate, got -1.")
    error.add_note("row 3")
    again = copied(error)
    assert (type(again), again.code, str(again)) == (kind, "bad-value", "Expected a positive rate, got -1.")
    assert again.__notes__ == ["row 3"]


def test_every_refusal_has_a_code_of_the_table_and_every_code_is_used():
    """A code is written out where the error is raised, or is that of another refusal."""
    used = set()
    for room in ("pipeline", "adapters", "models", "stages", "examples", "docs"):
        for path in (ROOT / room).rglob("*.py"):
            for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(call, ast.Call) and ast.unparse(call.func).endswith("InputError"):
                    code, _ = call.args
                    either = [code.body, code.orelse] if isinstance(code, ast.IfExp) else [code]
                    used |= {
                        each.value if isinstance(each, ast.Constant) else ast.unparse(each) for each in either
                    }
    assert used == {*refusals(), "error.code"}


def test_what_is_not_in_the_catalogue_cannot_be_made():
    for rows in (
        [Measure("stpes", 3)],
        [Remark("mood", "good")],
        [Moments("lunches", (1.0,))],
        [withheld("few-strides", "stpes")],
        within("strolling", [Measure("steps", 3)]),
    ):
        with pytest.raises(KeyError):
            Measures(tuple(rows))
    with pytest.raises(KeyError):
        withheld("too-dark", "cadence")
    assert [withheld("few-frames", name).name for name in (*TOGETHER, "cadence", "")][-2:] == [
        "cadence_withheld",
        "withheld",
    ]


def test_every_row_of_the_catalogue_is_whole_and_names_one_quantity():
    for name, figure in FIGURES.items():
        assert figure.name == name
        assert {figure.unit in UNITS, figure.group in GROUPS, figure.error in ERRORS} == {True}, name
        assert figure.audience in get_args(Audience), name
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
    measures = read_measures(
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
