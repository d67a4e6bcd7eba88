import json
import signal
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from lab.training import __main__ as command  # noqa: E402
from lab.training import train as training  # noqa: E402
from lab.training.dataset import Shards  # noqa: E402
from lab.training.network import DepthNet  # noqa: E402
from lab.training.train import Stage, TrainingConfig, TrainingState, train  # noqa: E402
from packetmesh.errors import InputError  # noqa: E402
from pipeline.depth.inference import DepthNetwork  # noqa: E402
from tests.lab.training.roomfiles import mirrored_m, write_rooms  # noqa: E402

FIRST, LAST = Stage(0.4, (64, 64), 4), Stage(np.inf, (64, 96), 2)


@pytest.fixture
def config(tmp_path, monkeypatch) -> TrainingConfig:
    """A short training on a small shard a split, judged every fifth of a second."""
    data = write_rooms(tmp_path / "data")
    monkeypatch.setitem(training.STAGES, "cpu", (FIRST, LAST))
    monkeypatch.setattr(training, "VALIDATION_IMAGES", 2)
    monkeypatch.setattr(training, "CHECKPOINT_EVERY_S", 0.2)
    return TrainingConfig(data, tmp_path / "run", minutes=0.08, width="lite0", device="cpu", processes=1)


def _load(file) -> dict:
    return torch.load(file, weights_only=True)


def _judged(config: TrainingConfig) -> list[dict[str, float]]:
    """The lines of the log with validation errors at the last stage's size, which halves the batch."""
    lines = [json.loads(line) for line in (config.out / "log.jsonl").read_text().splitlines()]
    return [e for e in lines if "val_abs_rel" in e and e["images_seen"] < FIRST.batch * e["step"]]


def test_the_best_network_at_the_final_size_is_kept_beside_the_last_one(config):
    train(replace(config, minutes=0.25))
    best, judged = _load(config.out / "best.pt"), _judged(config)
    assert len(judged) > 2
    least = min(judged, key=lambda entry: entry["val_abs_rel"])
    assert least == best["state"] | best["validation"]
    model = DepthNet(best["config"]["width"])
    model.load_state_dict(best["model"])
    assert training.validate(model, Shards(config.data, "validation"), LAST) == best["validation"]
    assert {file.name for file in config.out.iterdir()} == {"best.pt", "last.pt", "log.jsonl"}


def test_errors_at_a_smaller_size_do_not_count(config):
    train(replace(config, pause_minutes=0.02))
    assert "val_abs_rel" in (config.out / "log.jsonl").read_text()
    assert (config.out / "last.pt").exists()
    assert not (config.out / "best.pt").exists()


def test_only_a_lesser_error_replaces_the_best_network(config):
    config.out.mkdir()
    model = DepthNet("half")
    for step, abs_rel in enumerate((0.5, 0.6, float("nan"), 0.4, 0.4)):
        training.keep_best(config, model, TrainingState(step), {"val_abs_rel": abs_rel})
    assert _load(config.out / "best.pt")["state"]["step"] == 3


def test_a_folder_with_the_best_network_of_another_training_is_left_alone(config):
    config.out.mkdir()
    training.keep_best(config, DepthNet("half"), TrainingState(), {"val_abs_rel": 0.1})
    before = (config.out / "best.pt").read_bytes()
    with pytest.raises(InputError, match=r"best\.pt but no last\.pt"):
        train(config)
    assert (config.out / "best.pt").read_bytes() == before


def test_the_best_network_with_another_encoder_is_exported(config, monkeypatch):
    export = pytest.importorskip("lab.training.export")
    monkeypatch.setattr(export, "CALIBRATION_IMAGES", 2)
    monkeypatch.setattr(export, "COMPARED_IMAGES", 2)
    config.out.mkdir()
    torch.manual_seed(0)
    model = DepthNet("lite0").eval()
    started = replace(config, initial="efficientnet-lite0")
    training.keep_best(started, model, TrainingState(), {"val_abs_rel": 0.1})
    out = config.out / "network.onnx"
    export.export(config.out / "best.pt", config.data, out)
    rgb = np.load(config.data / "validation_0000_rgb.npy")[0]
    whole, eight_bits = (DepthNetwork(file) for file in (out.with_suffix(".float.onnx"), out))
    assert whole.description["width"] == "lite0"
    assert "ML Illustrated, Apache-2.0" in whole.description["licence"]
    ours_m = mirrored_m(model, rgb)
    whole_m, eight_bits_m = whole.infer(rgb).z_m, eight_bits.infer(rgb).z_m
    np.testing.assert_allclose(whole_m, ours_m, rtol=1e-3)
    assert np.median(np.abs(eight_bits_m / whole_m - 1.0)) < 0.05


def _signal_once(ready, number: signal.Signals) -> None:
    """Send the main thread a signal as soon as ``ready()``."""

    def wait() -> None:
        while not ready():
            time.sleep(0.01)
        signal.pthread_kill(threading.main_thread().ident, number)

    threading.Thread(target=wait, daemon=True).start()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_training_after_its_step_and_the_next_run_goes_on(config, capsys, number):
    usual = signal.getsignal(number)
    log = config.out / "log.jsonl"
    _signal_once(log.exists, number)
    train(replace(config, minutes=60.0))
    assert signal.getsignal(number) is usual
    stopped = _load(config.out / "last.pt")["state"]
    assert stopped["step"] >= json.loads(log.read_text().splitlines()[-1])["step"] > 0
    assert 0 < stopped["elapsed_s"] < 60.0
    assert capsys.readouterr().out.endswith(f"continues from {config.out / 'last.pt'}.\n")
    train(replace(config, minutes=stopped["elapsed_s"] / 60.0 + 0.01))
    assert _load(config.out / "last.pt")["state"]["step"] > stopped["step"]


def test_a_second_signal_acts_as_usual():
    with training.stop_on_signals() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_two_processes_stop_after_the_same_step(config, capfd):
    _signal_once((config.out / "last.pt").exists, signal.SIGTERM)
    train(replace(config, minutes=60.0, processes=2))
    out, err = capfd.readouterr()
    assert _load(config.out / "last.pt")["state"]["step"] == 1
    assert out.endswith(f"continues from {config.out / 'last.pt'}.\n")
    assert "Traceback" not in err


@pytest.mark.parametrize(("initial", "width"), [("random", "full"), ("random", "lite0")])
def test_the_command_takes_the_encoder_that_fits_the_weights_unless_told(config, monkeypatch, initial, width):
    words = ["train", "--data", config.data, "--out", config.out, "--device", "cpu", "--processes", "1"]
    words += ["--minutes", "0.001", "--initial", initial] + ["--width", width] * (width == "lite0")
    monkeypatch.setattr(sys, "argv", ["training", *map(str, words)])
    command.main()
    assert _load(config.out / "last.pt")["config"]["width"] == width


def test_the_command_refuses_weights_of_another_encoder_in_one_sentence(config, monkeypatch, capsys):
    words = ["train", "--data", config.data, "--out", config.out, "--width", "full"]
    monkeypatch.setattr(sys, "argv", ["training", *map(str, words), "--initial", "efficientnet-lite0"])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.endswith("encoder of width full: use width lite0.\n")
