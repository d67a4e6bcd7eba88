import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from pipeline.depth.training.losses import scale_invariant, supervised_loss  # noqa: E402
from pipeline.depth.training.network import DepthResNet, ReflectPadFunction, depth_from_logit  # noqa: E402
from pipeline.depth.training.train import STAGES, collate, scheduled_rate  # noqa: E402


def _batch() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    image = torch.randn(2, 3, 64, 96, generator=generator)
    return image, 1.0 + 3.0 * torch.rand(2, 1, 64, 96, generator=generator)


def test_the_network_is_a_resnet_50_with_32_million_parameters_and_four_heads():
    network = DepthResNet()
    assert sum(p.numel() for p in network.encoder.parameters()) == 23_508_032
    assert 30e6 < sum(p.numel() for p in network.parameters()) < 35e6
    shapes = [tuple(depth.shape) for depth in network.eval()(torch.zeros(1, 3, 64, 96))]
    assert shapes == [(1, 1, 64, 96), (1, 1, 32, 48), (1, 1, 16, 24), (1, 1, 8, 12)]


def test_depth_runs_from_10_cm_to_10_m():
    depth_m = depth_from_logit(torch.tensor([-100.0, 0.0, 100.0]))
    assert depth_m.tolist() == pytest.approx([10.0, 1.0 / (0.1 + 0.5 * 9.9), 0.1], rel=1e-5)


def test_reflecting_pad_equals_torchs_own_both_ways():
    x = torch.randn(2, 3, 5, 7, dtype=torch.float64, requires_grad=True)
    weight = torch.randn(2, 3, 7, 9, dtype=torch.float64)
    ours, theirs = ReflectPadFunction.apply(x), torch.nn.functional.pad(x, (1, 1, 1, 1), mode="reflect")
    assert torch.equal(ours, theirs)
    gradients = [torch.autograd.grad((padded * weight).sum(), x)[0] for padded in (ours, theirs)]
    torch.testing.assert_close(*gradients)


def test_a_perfect_prediction_costs_next_to_nothing_and_a_worse_one_more():
    image, target = _batch()
    scales = [target[..., :: 2**s, :: 2**s] for s in range(4)]
    noise = [depth * torch.exp(0.3 * torch.randn_like(depth)) for depth in scales]
    assert supervised_loss(scales, target, image) < 0.02
    assert supervised_loss(noise, target, image) > 1.0


def test_a_common_scale_costs_the_root_of_15_percent_of_its_square():
    error, valid = torch.full((1, 1, 8, 8), 0.2), torch.ones(1, 1, 8, 8, dtype=torch.bool)
    assert scale_invariant(error, valid).item() == pytest.approx(10.0 * np.sqrt(0.15 * 0.04), rel=1e-3)


def test_unknown_target_pixels_neither_cost_nor_push():
    image, target = _batch()
    depths = [target[..., :: 2**s, :: 2**s].clone().requires_grad_() for s in range(4)]
    holed = target.clone()
    holed[..., :32, :] = torch.nan
    loss = supervised_loss([1.1 * depth for depth in depths], holed, torch.zeros_like(image))
    assert torch.isfinite(loss)
    (gradient,) = torch.autograd.grad(loss, depths[1])
    assert torch.isfinite(gradient).all()
    assert not gradient[..., :16, :].any()
    assert gradient[..., 16:, :].any()


def test_the_learning_rate_rises_once_and_ends_at_zero():
    rates = [scheduled_rate(4e-4, spent) for spent in np.linspace(0.0, 1.0, 101)]
    top = int(np.argmax(rates))
    assert np.all(np.diff(rates[: top + 1]) > 0)
    assert np.all(np.diff(rates[top:]) < 0)
    assert rates[top] == pytest.approx(4e-4)
    assert rates[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("stage", STAGES)
def test_batches_have_the_size_of_their_stage_and_no_target_in_the_padding(stage):
    rgb, depth_m = np.full((240, 320, 3), 128, np.uint8), np.full((240, 320), 3.0, np.float32)
    depth_m[:, :160] = 12.0
    image, target = collate([(rgb, depth_m)] * 2, stage)
    assert image.shape == (2, 3, *stage.size_px)
    assert target.shape == (2, 1, *stage.size_px)
    rows, columns = stage.size_px
    assert torch.isnan(target[..., : columns // 2]).all()
    assert torch.isnan(target[:, :, [0, -1]]).all()
    assert (target[:, :, rows // 16 : -rows // 16, columns // 2 :] == 3.0).all()
