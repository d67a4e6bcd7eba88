import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from lab.training.completion.config import CompletionConfig  # noqa: E402
from lab.training.completion.export import export_completion  # noqa: E402
from lab.training.completion.losses import negative_log_likelihood, weighted  # noqa: E402
from lab.training.completion.network import CompletionNet  # noqa: E402
from lab.training.completion.train import train_completion  # noqa: E402
from packetmesh.errors import InputError  # noqa: E402
from pipeline.depth import complete  # noqa: E402
from pipeline.depth.slopes import CHANNELS_IN, CHANNELS_OUT, DISTANCES  # noqa: E402
from pipeline.types import DepthMap  # noqa: E402
from tests.lab.training.roomfiles import write_rooms  # noqa: E402


def test_the_loss_is_least_at_the_true_difference_and_the_mean_error_as_scale():
    error = torch.tensor([0.1, -0.3, 0.2, 0.0])
    ones = torch.ones(4)
    costs = {b: float(weighted(error, torch.full((4,), float(np.log(b))), ones)) for b in (0.05, 0.15, 0.5)}
    assert min(costs, key=costs.get) == 0.15
    assert costs[0.15] == pytest.approx(1.0 + np.log(0.15), abs=1e-5)
    assert float(weighted(error, torch.zeros(4), torch.tensor([0.0, 0.0, 0.0, 1.0]))) == 0.0


def test_an_answer_that_knows_the_truth_has_less_loss_than_one_that_is_off():
    rng = np.random.default_rng(0)
    log_z = torch.from_numpy(rng.normal(0.0, 0.3, (2, 32, 48)).astype(np.float32))
    log_z[0, :4] = torch.nan
    planes = torch.zeros(2, CHANNELS_IN, 32, 48)
    planes[:, 3, :, :20] = 1.0
    start = torch.zeros(2, 32, 48)
    known = torch.nan_to_num(log_z)
    output = torch.full((2, CHANNELS_OUT, 32, 48), -3.0)
    output[:, 0] = known
    for level, distance in enumerate(DISTANCES):
        output[:, 2 + 4 * level, :, :-distance] = known[..., distance:] - known[..., :-distance]
        output[:, 4 + 4 * level, :-distance] = known[:, distance:] - known[:, :-distance]
    best = negative_log_likelihood(output, planes, start, log_z)
    assert float(best) == pytest.approx(-3.0, abs=1e-4)
    for channel in range(0, CHANNELS_OUT, 2):
        off = output.clone()
        off[:, channel] += 0.05
        assert negative_log_likelihood(off, planes, start, log_z) > best


def test_a_few_steps_learn_and_the_file_completes_depth(tmp_path):
    write_rooms(tmp_path / "data")
    config = CompletionConfig(tmp_path / "data", tmp_path / "run", minutes=0.05, batch=2)
    train_completion(config)
    size = export_completion(tmp_path / "run" / "last.pt", tmp_path / "completion.onnx")
    assert size == (tmp_path / "completion.onnx").stat().st_size
    z_m = np.full((240, 320), 2.0, np.float32)
    z_m[100:140, 100:200] = np.nan
    sensor = DepthMap(z_m)
    completed = complete(sensor, np.zeros((240, 320, 3), np.uint8), tmp_path / "completion.onnx")
    assert np.isfinite(completed.depth.z_m).all()
    np.testing.assert_array_equal(completed.depth.z_m[sensor.valid], 2.0)


def test_the_file_answers_as_the_network_does(tmp_path):
    import onnxruntime

    torch.manual_seed(0)
    model = CompletionNet().eval()
    torch.nn.init.normal_(model.head.weight, 0.0, 0.1)
    torch.save(
        {
            "model": model.state_dict(),
            "state": {"step": 1, "images_seen": 16, "elapsed_s": 1.0},
            "config": dict.fromkeys(("minutes", "seed", "learning_rate", "batch"), "1"),
        },
        tmp_path / "last.pt",
    )
    export_completion(tmp_path / "last.pt", tmp_path / "completion.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "completion.onnx"))
    for height, width in ((128, 160), (96, 160), (160, 112)):  # any multiples of 16
        planes = torch.randn(1, CHANNELS_IN, height, width)
        (answer,) = session.run(None, {"planes": planes.numpy()})
        np.testing.assert_allclose(answer, model(planes).detach().numpy(), atol=1e-3)


def test_nothing_to_train_on_and_no_checkpoint_are_one_sentence(tmp_path):
    with pytest.raises(InputError, match="no train shards"):
        train_completion(CompletionConfig(tmp_path, tmp_path / "run"))
    with pytest.raises(InputError, match="no checkpoint"):
        export_completion(tmp_path / "last.pt", tmp_path / "completion.onnx")
    torch.save({"model": {}}, tmp_path / "last.pt")
    with pytest.raises(InputError, match="another network"):
        export_completion(tmp_path / "last.pt", tmp_path / "completion.onnx")
