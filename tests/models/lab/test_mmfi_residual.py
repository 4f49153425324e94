"""The pose that the residual head corrects is judged as it is."""

import numpy as np
import pytest

from pcnet3d.models.common.metrics import procrustes_error
from pcnet3d.models.lab.evaluation.people import every_value
from pcnet3d.models.lab.evaluation.rectifiers import Take, clean_takes, judge
from pcnet3d.pipeline import H36M17

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
from pcnet3d.models.lab import mmfi as module  # noqa: E402
from pcnet3d.models.lab.training.rectifier.net import NetConfig, PCNet  # noqa: E402
from pcnet3d.models.lab.training.rectifier.train import Deployed  # noqa: E402


@pytest.fixture
def take(clips):
    """Every frame with its joints moved by a few centimetres, as a lifter would."""
    clean = clean_takes(clips["test"], "wide")[0]
    joints = clean.truth + np.random.default_rng(3).normal(0, 0.03, clean.truth.shape)
    joints -= joints[:, :1]
    return Take(joints, clean.truth, clean.R, clean.lying)


def judged_net(*asked, **named):
    return every_value(module.judge_net(*asked, **named))


class Telling(PCNet):
    """Answers the truth of the take, whose first frames come first: rotation and a corrected pose."""

    def __init__(self, take, corrected):
        super().__init__(NetConfig(width=8, output=8, heads=2))
        self.take, self.corrected, self.at = take, corrected, {}

    def forward(self, joints, valid):
        answer = super().forward(joints, valid)
        rows = [int(np.argmin(np.abs(self.take.joints - x).sum((1, 2)))) for x in joints.double().numpy()]
        R = torch.from_numpy(self.take.R[rows]).float()
        return answer._replace(R=R, canonical=torch.from_numpy(self.corrected[rows]).float())


def canonical(take, joints):
    return np.einsum("tji,tkj->tki", take.R, joints)


def own_error(take):
    """(T,) PA-MPJPE of the input in mm."""
    return 1000 * procrustes_error(take.joints.astype(np.float64), take.truth)


def test_a_residual_that_takes_all_noise_away_is_seen(take):
    judged = judged_net(Telling(take, canonical(take, take.truth)).eval(), take, symmetric=False)
    assert judged["pa_mpjpe"].max() < 0.01
    assert own_error(take).mean() > 20


def test_a_residual_that_does_nothing_changes_nothing(take):
    judged = judged_net(Telling(take, canonical(take, take.joints)).eval(), take, symmetric=False)
    change = np.abs(judged["pa_mpjpe"] - own_error(take)).max()
    assert max(change, judged["rotation"].max()) < 0.1


def test_a_residual_that_makes_it_worse_is_seen(take):
    wrong = canonical(take, take.joints)
    wrong[:, H36M17.index("l_wrist")] += 0.3
    judged = judged_net(Telling(take, wrong).eval(), take, symmetric=False)
    assert (judged["pa_mpjpe"] - own_error(take)).mean() > 5


@pytest.mark.parametrize(("residual", "symmetric"), [("off", True), ("free", False)])
def test_it_judges_what_the_deployed_network_answers(take, residual, symmetric, monkeypatch):
    class InTorch:
        """What is exported, as a Rectifier: it tells a rotation only."""

        @torch.no_grad()
        def rotation(self, joints):
            joints = torch.from_numpy(joints.astype(np.float32))
            return [x.double().numpy() for x in deployed(joints, torch.ones(joints.shape[:2]))]

    monkeypatch.setattr(module, "_CHUNK", 7)
    torch.manual_seed(0)
    config = NetConfig(width=16, output=8, heads=2, residual=residual, align=True)
    net = PCNet(config).eval()
    torch.nn.init.normal_(net.rotation.weight, std=0.3)
    if residual != "off":
        torch.nn.init.normal_(net.residual.weight, std=0.1)
    deployed = Deployed(net, symmetric)
    one, other = every_value(judge(InTorch(), [take])), judged_net(net, take, symmetric)
    np.testing.assert_allclose(one["rotation"], other["rotation"], atol=0.02)
    np.testing.assert_allclose(one["expected"], other["expected"], rtol=1e-3)
    moved = np.abs(one["pa_mpjpe"] - other["pa_mpjpe"]).max()
    assert moved < 0.01 if residual == "off" else moved > 1
