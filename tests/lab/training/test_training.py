import json

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from lab.training import train as training  # noqa: E402
from lab.training.losses import (  # noqa: E402
    berhu,
    scale_invariant,
    smoothness,
    supervised_loss,
)
from lab.training.network import (  # noqa: E402
    DepthNet,
    ReflectPadFunction,
    depth_from_logit,
)
from lab.training.train import (  # noqa: E402
    STAGES,
    Stage,
    TrainingConfig,
    collate,
    scheduled_rate,
    train,
)
from packetmesh.errors import InputError  # noqa: E402
from pipeline.depth.inference import DepthNetwork  # noqa: E402
from tests.lab.training.roomfiles import mirrored_m, write_rooms  # noqa: E402


def _batch() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    image = torch.randn(2, 3, 64, 96, generator=generator)
    return image, 1.0 + 3.0 * torch.rand(2, 1, 64, 96, generator=generator)


def test_the_network_is_a_resnet_50_with_32_million_parameters_and_four_heads():
    network = DepthNet()
    assert sum(p.numel() for p in network.encoder.parameters()) == 23_508_032
    assert 30e6 < sum(p.numel() for p in network.parameters()) < 35e6
    shapes = [tuple(depth.shape) for depth in network.eval()(torch.zeros(1, 3, 64, 96))]
    assert shapes == [(1, 1, 64, 96), (1, 1, 32, 48), (1, 1, 16, 24), (1, 1, 8, 12)]


def test_the_half_width_network_has_a_quarter_of_the_encoder_and_the_same_heads():
    network = DepthNet("half").eval()
    assert network.encoder.channels == (64, 128, 256, 512, 1024)
    assert 5.8e6 < sum(p.numel() for p in network.encoder.parameters()) < 6.0e6
    image = torch.zeros(1, 3, 64, 96)
    features = network.encoder(image)
    assert [f.shape[1] for f in features] == [64, 128, 256, 512, 1024]
    assert [tuple(f.shape[2:]) for f in features] == [(32, 48), (16, 24), (8, 12), (4, 6), (2, 3)]
    assert [tuple(depth.shape[2:]) for depth in network(image)] == [(64, 96), (32, 48), (16, 24), (8, 12)]


def test_the_half_width_network_strides_in_the_first_convolution_of_a_stage():
    strides = {
        width: [
            convolution.stride[0]
            for convolution in DepthNet(width).encoder.stages[1][0].residual
            if isinstance(convolution, torch.nn.Conv2d)
        ]
        for width in ("full", "half")
    }
    assert strides == {"full": [1, 2, 1], "half": [2, 1, 1]}


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


def test_berhu_is_linear_below_a_fifth_of_the_largest_error_and_quadratic_above():
    error = torch.tensor([[[[0.1, -0.2, 0.0, -1.0]]]])
    valid = torch.tensor([[[[True, True, False, True]]]])
    expected = (0.1 + 0.2 + (1.0 + 0.04) / 0.4) / 3
    assert berhu(error, valid).item() == pytest.approx(expected, rel=1e-6)


def test_the_loss_with_berhu_pulls_towards_the_target():
    image, target = _batch()
    scales = [target[..., :: 2**s, :: 2**s] for s in range(4)]
    far, near = (supervised_loss([f * d for d in scales], target, image, "berhu") for f in (1.5, 1.05))
    perfect = supervised_loss(scales, target, image, "berhu")
    assert perfect < 0.02 < near < far


def test_smoothness_counts_steps_of_disparity_less_where_the_image_has_an_edge():
    depth_m = torch.full((1, 1, 4, 4), 2.0)
    depth_m[..., 2:] = 1.0
    flat = torch.zeros(1, 3, 4, 4)
    edge = flat.clone()
    edge[..., 2:] = 1.5
    step = (1.0 - 0.5) / 0.75
    assert smoothness(depth_m, flat).item() == pytest.approx(step / 3, rel=1e-5)
    assert smoothness(depth_m, edge).item() == pytest.approx(step / 3 * np.exp(-1.5), rel=1e-5)
    assert smoothness(5.0 * depth_m, flat).item() == pytest.approx(step / 3, rel=1e-5)


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


@pytest.mark.parametrize("stage", [stage for stages in STAGES.values() for stage in stages])
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


@pytest.fixture
def rooms(tmp_path, monkeypatch):
    """A folder with one small shard a split, and stages so small that a step takes a tenth of a second."""
    data = write_rooms(tmp_path / "data")
    monkeypatch.setitem(training.STAGES, "cpu", (Stage(0.5, (64, 64), 4), Stage(np.inf, (64, 96), 2)))
    monkeypatch.setattr(training, "VALIDATION_IMAGES", 2)
    monkeypatch.setattr(training, "MEASURED_BATCHES", 1)
    return data


def _config(data, **options) -> TrainingConfig:
    small = {"minutes": 0.08, "width": "half", "device": "cpu", "processes": 1}
    return TrainingConfig(data, data.parent / "run", **(small | options))


def test_a_paused_training_continues_where_it_stopped_and_spends_its_budget(rooms):
    first = _config(rooms, pause_minutes=0.02)
    train(first)
    paused = torch.load(first.out / "last.pt", weights_only=True)["state"]
    assert 1.2 <= paused["elapsed_s"] < 4.8
    train(_config(rooms))
    finished = torch.load(first.out / "last.pt", weights_only=True)["state"]
    assert finished["step"] > paused["step"] > 0
    assert finished["elapsed_s"] >= 4.8
    log = [json.loads(line) for line in (first.out / "log.jsonl").read_text().splitlines()]
    steps = [entry["step"] for entry in log]
    assert steps == sorted(steps)
    assert any("val_abs_rel" in entry for entry in log if entry["step"] == paused["step"])
    assert max(entry.get("images_seen", 0) for entry in log) == finished["images_seen"]


@pytest.mark.filterwarnings("ignore:.*pin_memory")
def test_workers_that_feed_a_gpu_draw_different_batches_and_the_same_ones_again(rooms, monkeypatch):
    monkeypatch.setattr(training.os, "sched_getaffinity", lambda _: range(4))
    stage, gpu = Stage(1.0, (64, 96), 3), torch.device("cuda")
    runs = [iter(training.loader(_config(rooms), stage, training.ALONE, 0, gpu)) for _ in range(2)]
    (a, target_m), (b, _), (again, _) = next(runs[0]), next(runs[0]), next(runs[1])
    assert a.shape == b.shape == (3, 3, 64, 96)
    assert target_m.shape == (3, 1, 64, 96)
    assert not torch.equal(a, b)
    assert torch.equal(a, again)


def test_a_run_of_another_width_is_not_continued(rooms):
    config = _config(rooms)
    config.out.mkdir()
    training.start(config)
    with pytest.raises(InputError, match="width half, not full"):
        train(_config(rooms, width="full"))
    with pytest.raises(InputError, match="width half, not full"):
        train(_config(rooms, width="full", processes=2))


def test_processes_that_cannot_share_the_batches_evenly_are_refused(rooms):
    for processes in (0, 3, 4):
        with pytest.raises(InputError, match=f"^{processes} processes .*: use one of 1, 2\\.$"):
            train(_config(rooms, processes=processes))
    assert not (rooms.parent / "run").exists()


def test_a_gpu_that_is_not_there_and_a_folder_without_rooms_are_refused(rooms, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match="finds no GPU"):
        train(_config(rooms, device="cuda"))
    (rooms / "validation_0000_rgb.npy").unlink()
    with pytest.raises(InputError, match="no validation shards"):
        train(_config(rooms))


def test_an_export_without_rooms_is_refused_before_a_file_is_written(rooms):
    export = pytest.importorskip("lab.training.export")
    config = _config(rooms)
    config.out.mkdir()
    training.start(config)
    (rooms / "validation_0000_rgb.npy").unlink()
    with pytest.raises(InputError, match="no validation shards"):
        export.export(config.out / "last.pt", rooms, config.out / "network.onnx")
    assert [file.name for file in config.out.iterdir()] == ["last.pt"]


def test_an_exported_network_takes_bytes_says_what_it_is_and_gives_the_checkpoints_depth(rooms, monkeypatch):
    export = pytest.importorskip("lab.training.export")
    monkeypatch.setattr(export, "CALIBRATION_IMAGES", 2)
    monkeypatch.setattr(export, "COMPARED_IMAGES", 2)
    config = _config(rooms)
    config.out.mkdir()
    training.start(config)
    out = config.out / "network.onnx"
    errors = export.export(config.out / "last.pt", rooms, out)
    network = DepthNetwork(out)
    properties = network.description
    expected = {
        "kind": "relative",
        "normalised_inside": "true",
        "width": "half",
        "seed": "0",
        "initial": "random",
    }
    assert expected.items() <= properties.items()
    assert json.loads(properties["metrics"]) == errors
    assert properties["licence"] == "Apache-2.0"
    assert properties["data"] == "8 images in 1 shards (train)"
    rgb = np.load(rooms / "validation_0000_rgb.npy")[0]
    model = DepthNet("half").eval()
    model.load_state_dict(torch.load(config.out / "last.pt", weights_only=True)["model"])
    whole, eight_bits = (DepthNetwork(file).infer(rgb) for file in (out.with_suffix(".float.onnx"), out))
    assert whole.kind == eight_bits.kind == "relative"
    np.testing.assert_allclose(whole.z_m, mirrored_m(model, rgb), rtol=1e-3)
    assert np.median(np.abs(eight_bits.z_m / whole.z_m - 1.0)) < 0.05
    assert np.unique(eight_bits.z_m).size > 10_000


def test_a_missing_checkpoint_is_refused(rooms):
    export = pytest.importorskip("lab.training.export")
    with pytest.raises(InputError, match="no checkpoint at"):
        export.export(rooms / "last.pt", rooms, rooms / "out.onnx")
