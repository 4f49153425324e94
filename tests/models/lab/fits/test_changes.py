"""What the network of changes is taught by: windows of keypoints, changed as their classes say."""

import numpy as np
import pytest

from pcnet3d.models.lab.fits import changes as module
from pcnet3d.models.lab.fits.changes import changed, trained
from pcnet3d.models.lifter.changes import CHANNELS, LIMBS, RATES, ROWS, WIDTHS, ZOOMS


@pytest.fixture(scope="module")
def take():
    """A body that swings and goes to the right."""
    rng = np.random.default_rng(0)
    body, swing = rng.normal(0, 50, (1, len(LIMBS), 2)), rng.normal(0, 10, (1, len(LIMBS), 2))
    time = np.arange(300)[:, None, None]
    return body + swing * np.sin(time / 5) + time * (1.0, 0.0), np.ones((300, len(LIMBS)), dtype=bool), 0.0


def only(monkeypatch, **shares):
    """Windows with these changes alone, each in so large a share of them."""
    for name in ("_FASTER", "_WIDER", "_ZOOMED"):
        monkeypatch.setattr(module, name, (shares.get(name, 0.0), getattr(module, name)[1]))
    for name in ("_BACKWARDS", "_EXCHANGED", "_BRIEF"):
        monkeypatch.setattr(module, name, shares.get(name, 0.0))


def test_what_is_not_changed_has_the_classes_of_nothing(take, monkeypatch):
    only(monkeypatch)
    features, classes = changed(take, np.random.default_rng(0))
    assert features.shape == (ROWS, CHANNELS)
    assert classes == (*(int(np.abs(each).argmin()) for each in (RATES, WIDTHS, ZOOMS)), 0)


def test_slow_motion_has_a_rate_between_its_own_and_real_time(take, monkeypatch):
    only(monkeypatch)
    points, seen, _ = take
    rates = [RATES[changed((points, seen, -1.0), np.random.default_rng(seed))[1][0]] for seed in range(40)]
    assert min(rates) == pytest.approx(-1.0, abs=0.1)
    assert max(rates) == pytest.approx(0.0, abs=0.1)


def test_brief_windows_are_empty_at_their_end(take, monkeypatch):
    only(monkeypatch, _BRIEF=1.0)
    rows = [int(changed(take, np.random.default_rng(seed))[0][:, -1].sum()) for seed in range(40)]
    assert 20 <= min(rows) < max(rows) < ROWS


def test_wider_bodies_are_of_higher_classes(take, monkeypatch):
    only(monkeypatch, _WIDER=1.0)
    shapes = {}
    for seed in range(40):
        features, classes = changed(take, np.random.default_rng(seed))
        body = features[0, : 2 * len(LIMBS)].reshape(-1, 2)
        shapes[classes[1]] = float(body[:, 0].std() / body[:, 1].std())
    order = [shapes[each] for each in sorted(shapes)]
    assert order == sorted(order)
    assert len(order) > 5


def test_a_clip_played_backwards_goes_the_other_way(take, monkeypatch):
    across = 2 * 2 * len(LIMBS) + 2  # of the hips' movement
    ways = []
    for share in (0.0, 1.0):
        only(monkeypatch, _BACKWARDS=share)
        features, classes = changed(take, np.random.default_rng(0))
        assert classes[3] == share
        ways.append(np.sign(np.median(features[1:, across])))
    assert ways[0] == -ways[1] != 0


def test_a_few_steps_of_training(take):
    torch = pytest.importorskip("torch")
    said = trained([take], 2, 0)(torch.zeros(3, ROWS, CHANNELS))
    assert [tuple(each.shape) for each in said] == [(3, len(RATES)), (3, len(WIDTHS)), (3, len(ZOOMS)), (3,)]
    assert all(bool(torch.isfinite(each).all()) for each in said)
