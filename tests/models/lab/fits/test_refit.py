"""Refitting in steps: each has its own file, rests on those before, and is not taken twice."""

import json
import shutil
from functools import partial
from inspect import signature
from pathlib import Path

import pytest

from pcnet3d.models.lab.evaluation import errors as report
from pcnet3d.models.lab.evaluation.runs import Question
from pcnet3d.models.lab.fits import refit as module
from pcnet3d.models.lab.fits.refit import Step, refit, steps
from pcnet3d.pipeline.core.errors import InputError


def copies(source: Path, name: str, place: Path | None = None) -> Step:
    return Step(name, partial(shutil.copyfile, source), place)


def test_a_stopped_refit_goes_on_where_it_was_and_later_steps_see_what_earlier_ones_put_in_their_place(
    tmp_path,
):
    shipped, missing = tmp_path / "shipped.json", tmp_path / "missing.json"
    (source := tmp_path / "source.json").write_text("1")
    order = [
        copies(source, "one.json", shipped),
        copies(shipped, "sub/two.json"),
        copies(missing, "three.json"),
    ]
    with pytest.raises(FileNotFoundError):
        refit(tmp_path / "out", order)
    assert shipped.read_text() == (tmp_path / "out" / "sub" / "two.json").read_text() == "1"
    source.write_text("2")
    missing.write_text("3")
    refit(tmp_path / "out", order)
    assert (tmp_path / "out" / "one.json").read_text() == "1"  # not taken again
    assert (tmp_path / "out" / "three.json").read_text() == "3"


def test_a_folder_of_other_networks_is_refused(tmp_path):
    refit(tmp_path, [])
    assert set(json.loads((tmp_path / "networks.json").read_text())) == {"lifter", "rectifier"}
    (tmp_path / "networks.json").write_text('{"lifter": "another"}')
    with pytest.raises(InputError, match="other networks") as refusal:
        refit(tmp_path, [])
    assert refusal.value.code == "files-apart"


def test_every_fitted_file_of_the_package_has_a_step_after_what_it_rests_on(tmp_path):
    order = steps()
    names = [step.made for step in order]
    for step in order:
        signature(step.do).bind(tmp_path / step.made)  # all that it is given
    assert len(set(names)) == len(names)
    placed = {step.place for step in order if step.place}
    package = Path(module.__file__).parents[2]
    fitted = {path for part in ("angle_error", "gait") for path in (package / part).glob("*.json")}
    assert placed == fitted
    assert (
        names.index("modes.json") < names.index("angles/joint_noise.json") < names.index("repeatability.json")
    )
    assert names.index("gait_error.json") > names.index("contact.json")
    assert names[-1] == "judged/errors.json"


@pytest.mark.data
def test_errors_are_never_fitted_to_the_real_take():
    configurations = report.asked(Question())
    assert set(report.FITTED) < set(configurations)
    assert not any(configurations[name].real for name in report.FITTED)
