"""Refitting in steps: each has its own file, rests on those before, and is not taken twice."""

import shutil
from functools import partial
from inspect import signature
from pathlib import Path

import pytest

from pcnet3d.models.lab.evaluation import errors as report
from pcnet3d.models.lab.evaluation.runs import Configuration
from pcnet3d.models.lab.fits import refit as module
from pcnet3d.models.lab.fits.refit import Step, steps, take_steps
from refusals import refused


def test_a_stopped_refit_goes_on_where_it_was_and_later_steps_see_what_earlier_ones_put_in_their_place(
    tmp_path,
):
    def copies(source: Path, name: str, place: Path | None = None) -> Step:
        return Step(name, partial(shutil.copyfile, source), place)

    shipped, missing, source = (tmp_path / f"{name}.json" for name in ("shipped", "missing", "source"))
    source.write_text("1")
    out = tmp_path / "out"
    order = [copies(source, "1.json", shipped), copies(shipped, "sub/2.json"), copies(missing, "3.json")]
    with pytest.raises(FileNotFoundError):
        take_steps(out, order)
    assert shipped.read_text() == (out / "sub" / "2.json").read_text() == "1"
    source.write_text("2")
    missing.write_text("3")
    take_steps(out, order)
    assert (out / "1.json").read_text() == "1"  # not taken again
    assert (out / "3.json").read_text() == "3"
    (out / "networks.json").write_text('{"lifter": "another"}')
    with refused("files-apart"):
        take_steps(out, [])


def test_every_fitted_file_of_the_package_has_a_step_after_what_it_rests_on(tmp_path):
    order = steps()
    names = [step.made for step in order]
    for step in order:
        signature(step.do).bind(tmp_path / step.made)  # all that it is given
    assert len(set(names)) == len(names)
    placed = {step.place for step in order if step.place}
    assert placed == {*(Path(module.__file__).parents[2] / "angle_error").glob("*.json")}
    assert names == ["modes.json", "angles/joint_noise.json", "repeatability.json", "judged/evaluation.json"]


@pytest.mark.data
def test_errors_are_never_fitted_to_the_real_take():
    configurations = report.configurations(Configuration())
    assert set(report.FITTED) < set(configurations)
    assert not any(configurations[name].real for name in report.FITTED)
