"""Accelerations of real recordings: lifts that differ by size, axes and heading agree, and bars are counted."""

import numpy as np
import pytest

from pcnet3d.models.lab.evaluation import real_motion as module
from pcnet3d.models.lab.evaluation.acceleration import PARTS
from pcnet3d.models.lab.evaluation.real_motion import _inside, _Lift, _row
from pcnet3d.models.lab.evaluation.sets import Question
from pcnet3d.models.lab.evaluation.tables import written
from pcnet3d.models.rectifier.geometric import Geometric
from pcnet3d.pipeline import rotate

TIME = np.arange(150) / 30


def swing(sd: float = 0.0, stated: float | None = None) -> _Lift:
    """Wrists and ankles (T, 4, 3) that swing once in 1.25 s, each its own way, with an error that changes slowly."""
    rng = np.random.default_rng(0)
    way = rng.normal(size=(4, 3))
    paths = 0.2 * np.sin(2 * np.pi * 0.8 * TIME)[:, None, None] * way + np.eye(4, 3)
    paths = paths + np.cumsum(rng.normal(0, sd * np.sqrt(2 / 45), paths.shape), axis=0)
    covariance = None if stated is None else np.broadcast_to(stated**2 * np.eye(3), (*paths.shape, 3))
    return _Lift(paths, covariance, TIME)


def test_a_heading_is_no_difference():
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    one = swing(stated=0.001)
    other = _Lift(rotate(turn, one.paths), one.covariance, TIME).turned_to(one.paths)
    for name, path in one.smoothed.items():
        for rmse, r in _row(path, other.smoothed[name], TIME).values():
            assert rmse == pytest.approx(0, abs=1e-3)
            assert r == pytest.approx(1, abs=1e-6)


def test_known_noise_is_nearer_to_the_truth_than_a_filter():
    lift, true = swing(0.03, stated=0.03), swing().paths
    rmse = {name: _row(path, true, TIME)["wrist, acceleration"][0] for name, path in lift.smoothed.items()}
    assert rmse["known noise"] < 0.7 * rmse["Butterworth 6 Hz"]


def test_bars_hold_differences_of_their_size_and_no_larger_ones():
    one, still = (
        swing(stated=0.05).motion,
        _Lift(0 * swing().paths, swing(stated=1e-4).covariance, TIME).motion,
    )
    assert _inside(one, swing(0.01, stated=0.05).motion) == {"velocity": 1.0, "acceleration": 1.0}
    assert _inside(swing(stated=1e-4).motion, still)["velocity"] < 0.3


@pytest.mark.data
def test_flipped_lifts_are_asked_for(data, monkeypatch):
    """Of the clips and of the take, whose first camera is enough."""
    asked = []

    class Spy:
        def lift(self, given):
            asked.append(given.flip)
            raise KeyboardInterrupt

    monkeypatch.setattr(module, "real_poses", lambda question: asked.append(question.flip) or [])
    monkeypatch.setattr(module, "load_lifter", lambda name: Spy())
    with pytest.raises(KeyboardInterrupt):
        module.tables(Question((Geometric(),), flip=True, people=None))
    assert asked == [True, True]


def test_the_page_has_a_line_for_each():
    row = {f"{part}, {name}": (1.0, np.nan) for part in PARTS for name in ("velocity", "acceleration")}
    text = written({
        "pcnet3d": "0", "lifter": "l", "flip": False,
        "clips": {"boxing: a, b": {"known noise": row}}, "take": {"pcnet3d": {"no motion": row}},
        "inside": {"boxing: a, b": {"velocity": 0.9, "acceleration": 1.0}},
    }, module.PAGE)  # fmt: skip
    assert "| boxing: a, b | known noise | 1.00 | 1.00 | 1.00 | 1.00 |" in text
    assert "| pcnet3d | no motion | 1.00 |" in text
    assert "| boxing: a, b | 90% | 100% |" in text
