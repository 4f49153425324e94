"""Found jumps against captured ones: paired, of the same feet, hops apart from what is invented."""

import numpy as np
import pytest

from golden import jumps as golden
from pcnet3d.models.lab.beds import Finished, see
from pcnet3d.models.lab.cases import grouped, joined
from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.evaluation.jumps import compared, true_flights
from pcnet3d.pipeline import Take
from pcnet3d.pipeline.core.measures import read_measures


@pytest.fixture(params=[30.0, 60.0])
def truth(request):
    poses = golden.jumping(fps=request.param)
    world = poses.joints + poses.root[:, None].astype(np.float32)
    return see(Clip("01_jump", "01", "asfamc", request.param, world), 0)


def test_figures_are_paired_and_the_rest_is_a_hop_or_invented(truth):
    first, second = true_flights(truth)
    middle = [(flight.off_s + flight.land_s) / 2 for flight in (first, second)]
    assert middle == pytest.approx([1.5, 3.3], abs=0.02)  # at its own rate
    found = {
        "start_s": [first.off_s + 0.01, 2.4, second.off_s],
        "flight_time_s": [first.land_s - first.off_s, 0.3, second.land_s - second.off_s + 0.02],
        "flight_time_error_s": [0.02, 0.02, 0.02],
    }
    result = grouped(compared(Finished(Take("t", measures=read_measures({"jumps": found})), truth, "")))
    assert [result[name] for name in ("true", "found", "hops", "invented")] == [[2], [2], [0], [1]]
    times = joined(result["flight time, ms"])
    assert times["error"] == pytest.approx([0, 20], abs=1)
    assert times["half"] == pytest.approx([32.9, 32.9], abs=0.1)
    assert dict(compared(Finished(Take("t", measures=()), truth, "")))["true"] == 2
