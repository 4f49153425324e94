"""Which flights are jumps, and what they leave of a run."""

from itertools import pairwise

import numpy as np
import pytest

from golden.motions import motion_with
from pcnet3d.models.gait.gait import Gait, Stance, Step
from pcnet3d.models.place.flights import Airborne, Flight
from pcnet3d.stages.measures.jumps import jumping, without_leaps

TIMES = np.arange(0, 6, 1 / 30)
NO_GAIT = Gait({"r": [], "l": []}, [])


def flight(off_s, land_s, clear=0.0, feet=2):
    return Flight(off_s, land_s, 5.8, 0.18, feet, feet, clear)


def run(*later: float) -> Gait:
    lands = [1.0, 1.4, 1.8, 2.15, *(later or (2.95, 3.35, 3.75))]
    feet = {side: [Stance(side, at, at + 0.25) for at in lands[first::2]] for first, side in enumerate("rl")}
    steps = [Step("lr"[i % 2], start, stop) for i, (start, stop) in enumerate(pairwise(lands))]
    return Gait(feet, [steps])


@pytest.mark.parametrize(("joint", "count"), [("l_knee", 0), ("l_wrist", 1)])
def test_a_flight_of_legs_that_are_not_known_is_no_jump(joint, count):
    """A policeman "jumped at least once": a detector had laid his legs on the car behind him for five frames."""
    motion = motion_with({}, TIMES, unknown={joint: (TIMES > 1.8) & (TIMES < 1.95)})
    assert len(jumping(motion, Airborne((flight(1.6, 2.1),)), NO_GAIT)) == count


@pytest.mark.parametrize(("clear", "count"), [(0.1, 0), (0.24, 1)])
def test_a_hop_among_the_steps_of_a_run_is_a_jump_by_how_high_the_feet_get(clear, count):
    """Who hopped in a run, the ankle 0.4 m up, did not jump: a flight of 0.28 s was a stride."""
    hop = Airborne((flight(1.8, 2.05, clear, 1),))
    assert len(jumping(motion_with({}, TIMES), hop, run())) == count


def test_a_leap_is_no_step_of_the_run_that_it_ends():
    """A leap over a hurdle made the fourth step of a run, and its flight of 0.5 s the run's mean."""
    assert run().kind == "running"
    assert [len(walk) for walk in without_leaps(run(), [flight(2.4, 2.9)]).walks] == [3, 2]
    assert without_leaps(run(), []).walks == run().walks


def test_no_foot_lands_in_the_air():
    """A foot reached ahead in a leap, and was the fourth step of a run."""
    grounded = without_leaps(run(2.5), [flight(2.35, 2.85)])
    assert [len(walk) for walk in grounded.walks] == [3]
    stood = [stance.start_s for of in grounded.feet.values() for stance in of]
    assert sorted(stood) == [1.0, 1.4, 1.8, 2.15]
