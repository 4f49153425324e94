"""The pose that the residual head corrects is judged as it is."""

import numpy as np
import pytest
import torch

from pcnet3d.models.lab.common.metrics import procrustes_error
from pcnet3d.models.lab.evaluation.rectifiers import Take, clean_takes
from pcnet3d.models.lab.mmfi import judge_net
from pcnet3d.models.lab.training.rectifier import Deployed, NetConfig, PCNet
from pcnet3d.pipeline import H36M17


class Telling(PCNet):
    """Answers the truth of the take, whose first frames come first: rotation and a corrected pose."""

    def __init__(self, take, corrected):
        super().__init__(NetConfig(width=8, output=8))
        self.take, self.corrected = take, corrected

    def forward(self, joints, valid):
        answer = super().forward(joints, valid)
        rows = [int(np.argmin(np.abs(self.take.joints - x).sum((1, 2)))) for x in joints.double().numpy()]
        R = torch.from_numpy(self.take.R[rows]).float()
        return answer._replace(R=R, canonical=torch.from_numpy(self.corrected[rows]).float())


def test_what_a_residual_head_makes_better_or_worse_is_seen(clips):
    """Joints moved by a few centimetres, as a lifter would: all taken away, kept, or made worse at a wrist."""
    clean = clean_takes(clips["test"], "wide")[0]
    joints = clean.truth + np.random.default_rng(3).normal(0, 0.03, clean.truth.shape)
    joints -= joints[:, :1]
    take = Take(joints, clean.truth, clean.R, clean.lying)

    def judged(corrected):
        canonical = np.einsum("tji,tkj->tki", take.R, corrected)
        return judge_net(Deployed(Telling(take, canonical).eval(), symmetric=False), [take])

    own_mm = 1000 * procrustes_error(joints, take.truth).mean()
    assert own_mm > 20
    kept = judged(joints)
    assert kept["pa_mpjpe"].mean == pytest.approx(own_mm, abs=0.1)
    assert kept["rotation"].mean < 0.1
    perfect = judged(take.truth)
    assert perfect["pa_mpjpe"].mean < 0.01
    assert perfect["turned only"].mean == pytest.approx(kept["mpjpe"].mean, abs=0.01)
    worse = joints.copy()
    worse[:, H36M17.index("l_wrist")] += 0.3
    assert judged(worse)["pa_mpjpe"].mean > own_mm + 5
