import math
from importlib.util import find_spec

import cv2
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from torch.nn import functional as F  # noqa: E402

from lab.training.efficientnet import EfficientNetLite0  # noqa: E402
from lab.training.initial import (  # noqa: E402
    EFFICIENTNET,
    initial_network,
    load_efficientnet,
    packaged_file,
)
from lab.training.network import DepthNet  # noqa: E402
from packetmesh.errors import InputError  # noqa: E402
from pipeline.depth.preprocessing import MEAN, STANDARD_DEVIATION  # noqa: E402

needs_package = pytest.mark.skipif(
    find_spec(EFFICIENTNET[0].replace("-", "_")) is None, reason=f"{EFFICIENTNET[0]} is not installed"
)
STRIDED = (1, 3, 5, 11)
"""The package's blocks that halve the image."""
LEVEL_ENDS = (0, 2, 4, 10, 15)
"""Its last blocks at strides 2, 4, 8, 16 and 32."""
HAMPER, SHOPPING_BASKET, DESK = 588, 790, 526
"""Classes of ImageNet."""


@pytest.fixture(scope="module")
def saved() -> dict[str, torch.Tensor]:
    return torch.load(packaged_file(*EFFICIENTNET), weights_only=True)


@pytest.fixture(scope="module")
def encoder() -> EfficientNetLite0:
    encoder = EfficientNetLite0().eval()
    load_efficientnet(encoder, packaged_file(*EFFICIENTNET))
    return encoder


def _normalised(rgb: np.ndarray) -> torch.Tensor:
    scaled = (rgb / 255.0 - MEAN) / STANDARD_DEVIATION
    return torch.from_numpy(scaled.transpose(2, 0, 1)[None].astype(np.float32))


def _square(rgb: np.ndarray) -> np.ndarray:
    """The middle of a 480 x 640 photograph in 224 x 224."""
    return cv2.resize(rgb[:, 80:560], (224, 224), interpolation=cv2.INTER_AREA)


def _features_of_the_package(saved: dict[str, torch.Tensor], rgb: np.ndarray) -> list[torch.Tensor]:
    """TensorFlow's network straight from the names of the package, with its own input scaling."""

    def convolved(x: torch.Tensor, name: str, stride: int = 1) -> torch.Tensor:
        weight = saved[f"{name}.weight"]
        size, groups = weight.shape[-1], x.shape[1] // weight.shape[1]
        total = [max((math.ceil(n / stride) - 1) * stride + size - n, 0) for n in (x.shape[3], x.shape[2])]
        pad = [side for both in total for side in (both // 2, both - both // 2)]
        return F.conv2d(F.pad(x, pad), weight, None, stride, groups=groups)

    def normed(x: torch.Tensor, name: str) -> torch.Tensor:
        mean, variance, scale, shift = (
            saved[f"{name}.{part}"][:, None, None]
            for part in ("running_mean", "running_var", "weight", "bias")
        )
        return (x - mean) * scale / (variance + 0.001).sqrt() + shift

    x = torch.from_numpy((rgb.astype(np.float32) - 127.0) / 128.0).permute(2, 0, 1)[None]
    x = normed(convolved(x, "_conv_stem", 2), "_bn0").clamp(0, 6)
    features = []
    for index in range(16):
        name, inner = f"_blocks.{index}", x
        if index:
            inner = normed(convolved(x, f"{name}._expand_conv"), f"{name}._bn0").clamp(0, 6)
        stride = 2 if index in STRIDED else 1
        inner = normed(convolved(inner, f"{name}._depthwise_conv", stride), f"{name}._bn1").clamp(0, 6)
        inner = normed(convolved(inner, f"{name}._project_conv"), f"{name}._bn2")
        x = x + inner if x.shape == inner.shape else inner
        if index in LEVEL_ENDS:
            features.append(x)
    return features


def _classified(saved: dict[str, torch.Tensor], feature: torch.Tensor) -> torch.Tensor:
    """Probabilities (1000,) of ImageNet's classes by the package's classifier from its last features."""
    x = F.conv2d(feature, saved["_conv_head.weight"])
    parts = (saved[f"_bn1.{part}"] for part in ("running_mean", "running_var", "weight", "bias"))
    x = F.batch_norm(x, *parts, eps=0.001).clamp(0, 6).mean(dim=(2, 3))
    return F.linear(x, saved["_fc.weight"], saved["_fc.bias"]).softmax(dim=1)[0]


def test_the_encoder_is_lite0_and_gives_the_features_that_the_decoder_joins():
    network = DepthNet("lite0").eval()
    classifier = 320 * 1280 + 2 * 1280 + 1280 * 1000 + 1000
    assert sum(p.numel() for p in network.encoder.parameters()) == 4_652_008 - classifier
    image = torch.zeros(1, 3, 64, 96)
    shapes = [tuple(f.shape[1:]) for f in network.encoder(image)]
    assert shapes == [(16, 32, 48), (24, 16, 24), (40, 8, 12), (112, 4, 6), (320, 2, 3)]
    assert network.encoder.channels == tuple(shape[0] for shape in shapes)
    assert [tuple(depth.shape[2:]) for depth in network(image)] == [(64, 96), (32, 48), (16, 24), (8, 12)]


@needs_package
def test_every_feature_of_the_package_comes_out_of_our_encoder_up_to_the_border(saved, encoder):
    rgb = np.random.default_rng(0).integers(0, 256, (96, 160, 3), np.uint8)
    with torch.no_grad():
        ours, theirs = encoder(_normalised(rgb)), _features_of_the_package(saved, rgb)
    assert [f.shape for f in ours] == [f.shape for f in theirs]
    for our, their in zip(ours, theirs, strict=True):
        assert float((our - their).abs().max() / their.std()) < 1e-4


@needs_package
@pytest.mark.parametrize(
    ("photograph", "expected"), [("kinect_basket", {HAMPER, SHOPPING_BASKET}), ("kinect_desk", {DESK})]
)
def test_a_real_photograph_is_recognised_from_our_encoders_features(
    shared_data, saved, encoder, photograph, expected
):
    file = shared_data / photograph / "color.png"
    if not file.exists():
        pytest.skip(f"no {photograph} in {shared_data}; set PACKETMESH_SHARED_DATA")
    rgb = cv2.cvtColor(cv2.imread(str(file)), cv2.COLOR_BGR2RGB)
    with torch.no_grad():
        shares = _classified(saved, encoder(_normalised(_square(rgb)))[-1])
    assert int(shares.argmax()) in expected
    assert float(shares[list(expected)].sum()) > 0.5


@needs_package
def test_the_variance_that_the_stem_remembers_is_that_of_pixels_over_128(shared_data, encoder):
    """Pixels over ImageNet's deviations, which other packages of this network want, have five times it."""
    files = sorted(shared_data.glob("*/*.png")) + sorted(shared_data.glob("*/*.jpg"))
    colors = [cv2.imread(str(f)) for f in files if f.name != "depth.png"]
    if len(colors) < 5:
        pytest.skip(f"too few photographs in {shared_data}; set PACKETMESH_SHARED_DATA")
    images = torch.cat([_normalised(cv2.resize(c, (224, 224))[..., ::-1]) for c in colors])
    pad, convolution, norm, _ = encoder.stem
    with torch.no_grad():
        variance = convolution(pad(images - encoder.offset)).var(dim=(0, 2, 3))
    alive = norm.running_var > 1e-3
    assert 0.5 < float((variance / norm.running_var)[alive].median()) < 2.0


@needs_package
def test_a_network_that_starts_from_the_package_is_ready_to_train():
    network = initial_network("efficientnet-lite0", "lite0", []).train()
    image = torch.randn(2, 3, 64, 96, generator=torch.Generator().manual_seed(0))
    network(image)[0].log().mean().backward()
    assert all(torch.isfinite(p.grad).all() for p in network.encoder.parameters())
    assert float(network.encoder.stem[1].weight.grad.abs().max()) > 0


def test_another_networks_weights_are_refused(tmp_path):
    file = tmp_path / "other.pth"
    torch.save({"_conv_stem.weight": torch.zeros(32, 3, 3, 3)}, file)
    with pytest.raises(InputError, match=r"other\.pth is not the network"):
        load_efficientnet(EfficientNetLite0(), file)
