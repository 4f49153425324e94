"""Contacts of the walker: right on what is known, the same in every unit, mirrored, at other frame rates."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.gait.contact import contacts, leg_lengths, window_features
from pcnet3d.models.gait.events import ON_FLOOR, stances
from pcnet3d.models.gait.gait import separation
from pcnet3d.models.lab.fits.contact import in_body
from pcnet3d.models.lab.mocap.contact import true_contact
from pcnet3d.pipeline import H36M17


def body_of(walk):
    return in_body(walk.world - walk.root[:, None], walk.time_s)


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=10, turn_deg=0)


@pytest.mark.parametrize("fps", [25, 30, 60, 120])
def test_initial_contacts_of_the_walker(fps):
    walk = walker(seconds=10, fps=fps, turn_deg=0)
    found = stances(contacts(body_of(walk), walk.time_s), walk.time_s)
    for side, strikes in walk.heel_strikes_s.items():
        starts = np.array([stance.start_s for stance in found[side]])
        assert np.nanmin(np.abs(starts[:, None] - strikes[1:]), axis=0).max() < 0.035


def test_who_stands_is_on_the_floor(walk):
    still = np.repeat(body_of(walk)[-1:], 60, axis=0)
    for probability in contacts(still, np.arange(60) / 30).values():
        assert (probability > 0.8).all()


def test_units_do_not_matter_and_a_mirror_exchanges_the_feet(walk):
    body = body_of(walk)
    found = contacts(body, walk.time_s)
    np.testing.assert_allclose(contacts(body * 700, walk.time_s)["r"], found["r"], atol=1e-6)
    mirrored = (body * (1, -1, 1))[:, mirror()]
    np.testing.assert_allclose(contacts(mirrored, walk.time_s)["l"], found["r"], atol=1e-9)


def test_a_unit_that_grows_as_the_person_comes_nearer_changes_no_contact(walk):
    body = body_of(walk)
    found = contacts(body, walk.time_s)
    near = contacts(body * (1 + 0.15 * walk.time_s)[:, None, None], walk.time_s)
    off = [np.abs((near[side] > ON_FLOOR).astype(int) - (found[side] > ON_FLOOR)) for side in "rl"]
    assert np.mean(off) < 0.02


def test_a_hidden_knee_hides_no_step(walk):
    body = body_of(walk)
    whole = separation(body, walk.time_s)
    body[40:50, H36M17.index("r_knee")] = np.nan
    np.testing.assert_allclose(separation(body, walk.time_s), whole, rtol=0.01, atol=1e-3)


def mirror():
    swap = {"r_": "l_", "l_": "r_"}
    return [H36M17.index(swap.get(name[:2], name[:2]) + name[2:]) for name in H36M17.joints]


def test_missing_legs_are_missing_contacts_and_nothing_crosses_a_seam(walk):
    body = body_of(walk)
    body[40:50, H36M17.index("r_ankle")] = np.nan
    found = contacts(body, walk.time_s)
    assert np.isnan(found["r"][40:50]).all()
    assert np.isfinite(found["r"][50:]).all()
    whole = window_features(body[60:], walk.time_s[60:], "r", (30,))
    other = body[60:].copy()
    other[30:, H36M17.index("l_knee")] += 0.2  # legs have other lengths in the other clip
    np.testing.assert_allclose(
        window_features(other, walk.time_s[60:], "r", (30,))[:30]
        * leg_lengths(other, walk.time_s[60:], (30,))[0],
        whole[:30] * leg_lengths(body[60:], walk.time_s[60:], (30,))[0],
    )


def test_true_stances_of_the_walker_are_those_of_a_gait_laboratory(walk):
    found = true_contact(walk.world, walk.time_s)
    lifted = true_contact(walk.world + np.array([3.0, -2.0, 7.0]), walk.time_s)
    for side, strikes in walk.heel_strikes_s.items():
        start, stop = found[side].T
        np.testing.assert_allclose(lifted[side], found[side], atol=1e-6)
        assert np.nanmin(np.abs(start[:, None] - strikes[1:]), axis=0).max() < 0.03
        share = np.nanmedian(stop - start) / np.median(np.diff(strikes))
        assert 0.6 < share < 0.67  # 0.62 in truth (Perry & Burnfield 2010)
