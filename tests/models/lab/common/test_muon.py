"""All matrices of a shape in one product: the steps of torch's own Muon."""

import pytest

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
from pcnet3d.models.lab.common.muon import BatchedMuon, orthogonal  # noqa: E402


def test_the_steps_are_those_of_torchs_muon():
    torch.manual_seed(0)
    shapes = [(24, 8), (8, 24), (24, 8), (12, 12)]
    matrices = [torch.randn(*shape) for shape in shapes]
    settings = {"lr": 0.02, "weight_decay": 0.1, "adjust_lr_fn": "match_rms_adamw", "ns_steps": 5}
    batched, single = ([torch.nn.Parameter(m.clone()) for m in matrices] for _ in range(2))
    optimisers = BatchedMuon(batched, **settings), torch.optim.Muon(single, **settings)
    for _ in range(3):
        gradients = [torch.randn(*shape) for shape in shapes]
        for parameters, optimiser in zip((batched, single), optimisers, strict=True):
            for parameter, gradient in zip(parameters, gradients, strict=True):
                parameter.grad = gradient.clone()
            optimiser.step()
    for ours, theirs, before in zip(batched, single, matrices, strict=True):
        moved = (theirs - before).norm()
        assert moved > 0.01
        assert (ours - theirs).norm() < 0.02 * moved  # bfloat16


def test_a_matrix_without_a_gradient_stays():
    still = torch.nn.Parameter(torch.ones(4, 4))
    BatchedMuon([still], lr=1.0).step()
    assert still.eq(1).all()


def test_singular_values_come_near_one():
    values = torch.linalg.svdvals(orthogonal(torch.randn(3, 20, 30), 5).float())
    assert (values > 0.5).all()
    assert (values < 1.5).all()
