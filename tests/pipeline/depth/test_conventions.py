"""Depth networks of every convention, each a tiny graph with a known answer."""

import itertools
import json
from typing import get_args

import numpy as np
import pytest

pytest.importorskip("onnx")

from onnx import TensorProto, helper

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.settings import with_settings
from pipeline.config import NetworkPreset, PipelineConfig
from pipeline.depth import DepthNetwork, Overrides, align_depth
from pipeline.depth.conventions import PRESETS, metadata_of
from pipeline.depth.preprocessing import IMAGENET_DEVIATION, IMAGENET_MEAN, free_size
from pipeline.types import DepthMap
from tests.pipeline.depth import networks

COLOR = (200, 120, 40)
RELATIVE = {"depth_kind": "relative"}
SPREAD = 10.0
"""Added to every answer so that normalised values stay positive."""


def plain(rows: int = 32, columns: int = 48) -> np.ndarray:
    return np.full((rows, columns, 3), COLOR, np.uint8)


def ramp(rows: int, columns: int) -> np.ndarray:
    """Brightness rises from 40 to 240 to the right; each row is darker than the one above it."""
    v, u = np.mgrid[:rows, :columns]
    gray = 40.0 + 150.0 * u / columns + 50.0 * (1.0 - v / rows)
    return np.repeat(np.rint(gray).astype(np.uint8)[..., None], 3, axis=2)


def normalised(value: float, index: int, how: str) -> float:
    if how == "bytes":
        return value
    unit = value / 255.0
    return unit if how == "unit" else (unit - IMAGENET_MEAN[index]) / IMAGENET_DEVIATION[index]


@pytest.mark.parametrize("how", ["imagenet", "unit", "bytes"])
@pytest.mark.parametrize("channels", ["RGB", "BGR"])
@pytest.mark.parametrize("image", [(1, 3, 32, 48), (1, 32, 48, 3)])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_every_channel_arrives_where_and_as_the_convention_says(tmp_path, how, channels, image, index):
    file = networks.channel(tmp_path / "n.onnx", index, image, plus=SPREAD)
    depth = DepthNetwork(file, None, Overrides("relative", None, how, channels)).infer(plain())
    seen = index if channels == "RGB" else 2 - index
    np.testing.assert_allclose(depth.z_m, normalised(COLOR[seen], seen, how) + SPREAD, rtol=1e-5)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_mean_deviation_and_scale_come_from_the_metadata(tmp_path, index):
    said = RELATIVE | {"input_mean": "90,100,110", "input_deviation": "[2, 3, 4]", "input_scale": "1"}
    file = networks.channel(tmp_path / "n.onnx", index, plus=100.0, metadata=said)
    expected = (COLOR[index] - (90, 100, 110)[index]) / (2, 3, 4)[index] + 100.0
    np.testing.assert_allclose(DepthNetwork(file).infer(plain()).z_m, expected, rtol=1e-5)


def test_a_graph_that_normalises_by_itself_gets_plain_values(tmp_path):
    said = RELATIVE | {"input_normalised": "inside", "input_mean": "0.5,0.5,0.5"}
    file = networks.channel(tmp_path / "n.onnx", metadata=said)
    np.testing.assert_allclose(DepthNetwork(file).infer(plain()).z_m, COLOR[0] / 255.0, rtol=1e-5)


def test_half_precision_is_served(tmp_path):
    file = networks.channel(tmp_path / "n.onnx", metadata=RELATIVE, plus=SPREAD, dtype=TensorProto.FLOAT16)
    expected = normalised(COLOR[0], 0, "imagenet") + SPREAD
    depth = DepthNetwork(file).infer(plain())
    assert depth.z_m.dtype == np.float32
    np.testing.assert_allclose(depth.z_m, expected, rtol=2e-3)


@pytest.mark.parametrize("kind", ["metric", "relative", "inverse"])
def test_the_kind_says_what_the_numbers_mean(tmp_path, kind):
    file = networks.fixed_answer(tmp_path / "n.onnx", [np.full((1, 1, 32, 48), 4.0)])
    depth = DepthNetwork(file, None, Overrides(kind)).infer(plain())
    assert depth.kind == ("metric" if kind == "metric" else "relative")
    np.testing.assert_allclose(depth.z_m, 0.25 if kind == "inverse" else 4.0, rtol=1e-6)


@pytest.mark.parametrize("resize", ["fit", "stretch"])
@pytest.mark.parametrize(("rows", "columns"), [(240, 320), (320, 240), (64, 300), (300, 64), (40, 40)])
def test_what_is_seen_lies_where_it_was_seen(tmp_path, resize, rows, columns):
    said = {"depth_kind": "inverse", "input_resize": resize, "input_normalised": "inside"}
    file = networks.channel(tmp_path / "n.onnx", image=(1, 3, 96, 128), metadata=said)
    image = ramp(rows, columns)
    seen = 255.0 / DepthNetwork(file).infer(image).z_m
    assert seen.shape == (rows, columns)
    np.testing.assert_allclose(seen[4:-4, 4:-4], image[4:-4, 4:-4, 0], atol=4.0)
    np.testing.assert_allclose(seen, image[..., 0], atol=8.0)


def _cells(size: int, inner: int, start: int) -> np.ndarray:
    """Where the centres of ``size`` pixels lie among ``inner`` input pixels from ``start`` on."""
    return start + np.clip((np.arange(size) + 0.5) * inner / size - 0.5, 0, inner - 1)


@pytest.mark.parametrize("slope", [(1.0, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize(
    ("resize", "rows", "columns", "inner"),
    [
        ("stretch", 300, 90, (96, 128)),
        ("fit", 240, 320, (96, 128)),
        ("fit", 64, 256, (32, 128)),
        ("fit", 300, 100, (96, 32)),
        ("fit", 8, 8, (96, 96)),
    ],
)
def test_padding_comes_off_to_the_pixel(tmp_path, slope, resize, rows, columns, inner):
    v, u = np.mgrid[:96, :128]
    answer = 1.0 + slope[0] * v + slope[1] * u
    said = {"depth_kind": "inverse", "input_resize": resize}
    file = networks.fixed_answer(tmp_path / "n.onnx", [answer[None]], (1, 3, 96, 128), said)
    seen = 1.0 / DepthNetwork(file).infer(np.zeros((rows, columns, 3), np.uint8)).z_m
    at_v = _cells(rows, inner[0], (96 - inner[0]) // 2)
    at_u = _cells(columns, inner[1], (128 - inner[1]) // 2)
    expected = 1.0 + slope[0] * at_v[:, None] + slope[1] * at_u[None, :]
    # OpenCV interpolates with 11-bit fixed-point weights.
    np.testing.assert_allclose(seen, expected, rtol=1e-3, atol=2e-3)


@pytest.mark.parametrize("shape", [(1, 1, 96, 128), (1, 96, 128, 1), (1, 96, 128), (96, 128)])
@pytest.mark.parametrize("kind", ["metric", "inverse"])
def test_every_shape_of_a_depth_map_is_read(tmp_path, shape, kind):
    answer = np.random.default_rng(0).uniform(1.0, 5.0, (96, 128))
    file = networks.fixed_answer(tmp_path / "n.onnx", [answer.reshape(shape)], (1, 3, 96, 128))
    depth = DepthNetwork(file, None, Overrides(kind)).infer(np.zeros((96, 128, 3), np.uint8))
    np.testing.assert_allclose(depth.z_m, 1.0 / answer if kind == "inverse" else answer, rtol=1e-5)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_an_output_of_another_size_than_the_input_still_fits_the_image(tmp_path, factor):
    rows, columns = int(96 * factor), int(128 * factor)
    u = np.broadcast_to((np.arange(columns) + 0.5) / columns, (rows, columns))
    file = networks.fixed_answer(tmp_path / "n.onnx", [1.0 + u], (1, 3, 96, 128), {"depth_kind": "inverse"})
    seen = 1.0 / DepthNetwork(file).infer(np.zeros((200, 400, 3), np.uint8)).z_m
    np.testing.assert_allclose(
        seen[:, 20:-20], 1.0 + np.tile((np.arange(400) + 0.5) / 400, (200, 1))[:, 20:-20], atol=1e-3
    )


@pytest.mark.parametrize("order", list(itertools.permutations((1, 2, 4))))
def test_of_several_depth_maps_the_finest_counts(tmp_path, order):
    answers = [np.full((1, 1, 32 // step, 48 // step), float(step)) for step in order]
    depth = DepthNetwork(networks.fixed_answer(tmp_path / "n.onnx", answers, metadata=RELATIVE)).infer(
        plain()
    )
    np.testing.assert_allclose(depth.z_m, 1.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("columns", "rows", "expected"),
    [
        (640, 480, (686, 518)),
        (480, 640, (518, 686)),
        (1920, 1080, (924, 518)),
        (518, 518, (518, 518)),
        (8, 8, (518, 518)),
        (5000, 50, (1554, 518)),
        (50, 5000, (518, 1554)),
    ],
)
def test_free_sizes_are_depth_anythings_up_to_three_to_one(columns, rows, expected):
    assert free_size(columns, rows, 518, 14) == expected


@pytest.mark.parametrize("preset", ["depth-anything-v2-small", "depth-anything-v2-metric"])
def test_an_input_of_free_size_gets_the_presets(tmp_path, preset):
    for axis, expected in ((2, 518.0), (3, 686.0)):
        depth = DepthNetwork(networks.input_side(tmp_path / "n.onnx", axis), preset).infer(plain(480, 640))
        side = depth.z_m if preset.endswith("metric") else 1.0 / depth.z_m
        np.testing.assert_allclose(side, expected, rtol=1e-5)
        assert depth.kind == ("metric" if preset.endswith("metric") else "relative")


def test_a_size_flag_sets_an_input_of_free_size(tmp_path):
    network = DepthNetwork(networks.input_side(tmp_path / "n.onnx", 3), None, Overrides("metric", (96, 64)))
    np.testing.assert_allclose(network.infer(plain()).z_m, 96.0, rtol=1e-5)


def test_settings_feed_the_network_as_flags_do(tmp_path):
    config = with_settings(
        PipelineConfig(),
        [
            "depth.model_kind=metric",
            "depth.input_width_px=96",
            "depth.input_height_px=64",
            "depth.normalisation=bytes",
        ],
    )
    overrides = Overrides.of(config.depth)
    assert overrides == Overrides("metric", (96, 64), "bytes")
    assert Overrides.of(PipelineConfig().depth) == Overrides()
    network = DepthNetwork(networks.input_side(tmp_path / "n.onnx", 2), None, overrides)
    np.testing.assert_allclose(network.infer(plain()).z_m, 64.0, rtol=1e-5)
    assert (network.convention.scale, network.convention.normalised_inside) == (1.0, True)


@pytest.mark.parametrize(
    ("preset", "size_px", "names"),
    [
        ("midas-small", (300, 256), "multiples of 32 pixels, not 300 x 256; try 288 x 256"),
        ("monodepth2", (8, 190), "multiples of 32 pixels, not 8 x 190; try 32 x 192"),
        ("depth-anything-v2-small", (512, 504), "multiples of 14 pixels, not 512 x 504; try 518 x 504"),
    ],
)
def test_a_size_that_the_strides_do_not_divide_is_refused_with_the_nearest(tmp_path, preset, size_px, names):
    file = networks.input_side(tmp_path / "n.onnx", 2)
    with pytest.raises(InputError, match=names) as refused:
        DepthNetwork(file, preset, Overrides(size_px=size_px))
    assert "\n" not in str(refused.value)


def test_midas_small_is_stretched_normalised_and_inverse(tmp_path):
    file = networks.channel(tmp_path / "n.onnx", 1, (1, 3, 256, 256), plus=SPREAD)
    expected = 1.0 / (normalised(COLOR[1], 1, "imagenet") + SPREAD)
    np.testing.assert_allclose(DepthNetwork(file, "midas-small").infer(plain()).z_m, expected, rtol=1e-5)


@pytest.mark.parametrize(("gray", "expected_m"), [(0, 100.0), (255, 0.1), (51, 1.0 / (0.01 + 0.2 * 9.99))])
def test_monodepth2_gives_a_sigmoid_between_two_disparities(tmp_path, gray, expected_m):
    file = networks.channel(tmp_path / "n.onnx", image=(1, 3, 192, 640))
    image = np.full((120, 160, 3), gray, np.uint8)
    np.testing.assert_allclose(DepthNetwork(file, "monodepth2").infer(image).z_m, expected_m, rtol=1e-4)


def test_disparity_of_any_scale_and_shift_becomes_metric_by_the_inverse_line(tmp_path):
    v, u = np.mgrid[:96, :128]
    truth_m = 1.5 + 2.0 * u / 128 + np.sin(v / 20.0) ** 2
    answer = 40.0 / truth_m - 3.0
    said = {"depth_kind": "inverse"}
    network = DepthNetwork(networks.fixed_answer(tmp_path / "n.onnx", [answer], (1, 3, 96, 128), said))
    inferred = network.infer(np.zeros((96, 128, 3), np.uint8))
    aligned = align_depth(inferred, DepthMap(truth_m.astype(np.float32)), "affine_inverse")
    np.testing.assert_allclose(aligned.depth.z_m, truth_m, rtol=1e-4)
    assert aligned.coefficients == pytest.approx({"a": 1.0 / 40.0, "b": 3.0 / 40.0}, rel=1e-3)


@pytest.mark.parametrize("kind", ["metric", "relative", "inverse"])
def test_what_is_not_positive_is_unknown_and_nothing_else(tmp_path, kind):
    answer = np.full((32, 48), 2.0)
    answer[:, :10], answer[:, 10:20], answer[:, 20:24] = 0.0, -1.0, np.nan
    file = networks.fixed_answer(tmp_path / "n.onnx", [answer], metadata={"depth_kind": kind})
    depth = DepthNetwork(file).infer(plain())
    np.testing.assert_array_equal(depth.valid, answer > 0.0)


def test_a_network_that_gives_nothing_positive_is_refused(tmp_path):
    file = networks.fixed_answer(
        tmp_path / "n.onnx", [np.zeros((32, 48))], metadata={"depth_kind": "inverse"}
    )
    with pytest.raises(ReconstructionError, match="another kind"):
        DepthNetwork(file).infer(plain())


@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.parametrize("name", PRESETS)
def test_a_file_can_say_all_that_a_preset_says(tmp_path, name, as_json):
    said = metadata_of(PRESETS[name])
    if as_json:
        said = {key: json.dumps(value) for key, value in said.items()}
    file = networks.input_side(tmp_path / "n.onnx", 2, said)
    assert DepthNetwork(file).convention == PRESETS[name]
    file = networks.input_side(tmp_path / "m.onnx", 2, {"preset": name})
    assert DepthNetwork(file).convention == PRESETS[name]


def test_settings_know_every_preset_and_refuse_others():
    assert set(get_args(NetworkPreset)) == set(PRESETS)
    config = with_settings(PipelineConfig(), ["depth.preset=monodepth2", "depth.model_kind=metric"])
    assert (config.depth.preset, config.depth.model_kind) == ("monodepth2", "metric")
    assert with_settings(config, ["depth.preset=none", "depth.model_kind=none"]) == PipelineConfig()
    with pytest.raises(InputError, match="midas-small"):
        with_settings(config, ["depth.preset=midas"])


def test_metadata_refine_a_preset_and_a_preset_by_name_replaces_metadata(tmp_path):
    said = {"preset": "midas-small", "input_channels": "BGR"}
    file = networks.channel(tmp_path / "n.onnx", image=(1, 3, 256, 256), metadata=said)
    assert DepthNetwork(file).convention.channels == "BGR"
    assert DepthNetwork(file).convention.kind == "inverse"
    assert DepthNetwork(file, "midas-small").convention == PRESETS["midas-small"]
    assert DepthNetwork(file, "midas-small", Overrides("relative")).convention.kind == "relative"


def test_a_graph_of_fixed_size_overrules_the_preset(tmp_path):
    file = networks.channel(tmp_path / "n.onnx", image=(1, 64, 80, 3))
    convention = DepthNetwork(file, "depth-anything-v2-small").convention
    assert (convention.width_px, convention.height_px, convention.layout) == (80, 64, "NHWC")


def _node(kind: str, name: str = "y0") -> list:
    return [helper.make_node(kind, ["x"], [name])]


@pytest.mark.parametrize(
    ("nodes", "image", "depth", "dtype"),
    [
        (_node("Flatten"), [1, 3, 8, 8], [1, 192], TensorProto.FLOAT),
        (_node("Flatten"), ["n", 3, 8, 8], ["n", 192], TensorProto.FLOAT),
        (_node("Relu"), [1, 3, 8, 8], [1, 3, 8, 8], TensorProto.FLOAT),
        (_node("Relu"), [1, 1, 8, 8], [1, 1, 8, 8], TensorProto.FLOAT),
        (_node("Relu"), [2, 3, 8, 8], [2, 3, 8, 8], TensorProto.FLOAT),
        (_node("Identity"), [1, 3, 8, 8], [1, 3, 8, 8], TensorProto.INT64),
        (_node("Relu"), [1, 8], [1, 8], TensorProto.FLOAT),
    ],
)
def test_another_signature_is_refused_with_what_it_maps_and_what_is_accepted(
    tmp_path, nodes, image, depth, dtype
):
    file = networks.save(tmp_path / "other.onnx", nodes, image, [depth], dtype=dtype)
    with pytest.raises(InputError) as refused:
        DepthNetwork(file, "midas-small")
    sentence = str(refused.value)
    assert "other.onnx" in sentence
    assert str(image) in sentence
    assert str(depth) in sentence
    assert "[1, 3, H, W]" in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("preset", "overrides", "metadata", "names"),
    [
        (None, None, {}, "depth-anything-v2-small.*metric, relative, inverse"),
        ("midas", None, {}, "no preset 'midas'.*midas-small"),
        (None, None, {"preset": "midas"}, "no preset 'midas'"),
        (None, None, {"depth_kind": "disparity"}, "depth_kind = 'disparity'.*inverse"),
        (None, None, {"depth_kind": "metric", "input_mean": "0.5"}, "input_mean = '0.5'.*0.485,0.456,0.406"),
        (None, None, {"depth_kind": "metric", "input_size_px": "8x8x8"}, "input_size_px = '8x8x8'.*320x256"),
        (None, None, {"depth_kind": "metric", "input_multiple_px": "0"}, "input_multiple_px = '0'"),
        (None, None, {"depth_kind": "metric", "input_scale": "nan"}, "input_scale"),
        (None, None, {"depth_kind": "metric", "input_fit_px": "48x33"}, "48 x 33 of 48 x 32"),
        (None, None, {"depth_kind": "metric", "depth_range_m": "9,1"}, "from 9 to 1 m"),
        ("midas-small", Overrides(size_px=(64, 64)), {}, "48 x 32 pixels only, not of 64 x 64"),
    ],
)
def test_what_cannot_be_meant_is_one_sentence(tmp_path, preset, overrides, metadata, names):
    file = networks.channel(tmp_path / "n.onnx", metadata=metadata)
    with pytest.raises(InputError, match=names) as refused:
        DepthNetwork(file, preset, overrides)
    assert "\n" not in str(refused.value)


def test_a_free_size_that_nobody_names_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"any size.*width and height"):
        DepthNetwork(networks.input_side(tmp_path / "n.onnx", 2), None, Overrides("metric"))


@pytest.mark.parametrize("size_px", [(0, 64), (64, -1), (100_000, 64)])
def test_a_size_without_sense_is_refused(tmp_path, size_px):
    with pytest.raises(InputError, match=f"{size_px[0]} x {size_px[1]} pixels"):
        DepthNetwork(networks.input_side(tmp_path / "n.onnx", 2), None, Overrides("metric", size_px))


def test_a_size_that_the_graph_cannot_take_is_one_sentence(tmp_path):
    nodes = [
        helper.make_node("Reshape", ["x", "s"], ["r"]),
        helper.make_node("ReduceMean", ["r"], ["y0"], axes=[1], keepdims=0),
    ]
    constants = {"s": np.array([1, 3, 28, 28])}
    file = networks.save(tmp_path / "n.onnx", nodes, [1, 3, "h", "w"], [[1, "h", "w"]], constants)
    with pytest.raises(InputError, match=r"n\.onnx fails on an input of \[1, 3, 20, 30\]") as refused:
        DepthNetwork(file, None, Overrides("metric", (30, 20))).infer(plain())
    assert "\n" not in str(refused.value)


def test_a_preset_of_another_network_needs_its_file():
    with pytest.raises(InputError, match="midas-small"):
        DepthNetwork(preset="midas-small")
