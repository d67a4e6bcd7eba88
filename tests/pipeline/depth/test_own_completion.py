"""Completion by a user's own network: tiny graphs of image and depth with known answers."""

import numpy as np
import pytest

pytest.importorskip("onnx")

from onnx import TensorProto, helper

from packetmesh.errors import InputError, ReconstructionError
from packetmesh.settings import with_settings
from pipeline.config import DepthConfig, PipelineConfig
from pipeline.depth import DepthNetwork, OwnCompletion, align_depth, complete, completed_by, judge
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.own_completion import hidden_squares, on_grid
from pipeline.depth.slopes import LOG_SCALES
from pipeline.types import DepthMap
from tests.pipeline.depth import networks

ROWS, COLUMNS = 48, 64
IMAGE, DEPTH = (1, 3, ROWS, COLUMNS), (1, 1, ROWS, COLUMNS)
RGB = np.dstack(np.broadcast_arrays(*np.ogrid[0:ROWS, 0:COLUMNS], 90)).astype(np.uint8) * np.uint8(3)
HOLE = np.zeros((ROWS, COLUMNS), bool)
HOLE[15:35, 20:44] = True
WALL_M = np.broadcast_to(np.linspace(1.0, 2.0, COLUMNS, dtype=np.float32), (ROWS, COLUMNS)).copy()


def with_hole(z_m=WALL_M):
    return DepthMap(np.where(HOLE, np.float32(np.nan), z_m))


def node(kind, inputs, output, **attributes):
    return helper.make_node(kind, inputs, [output], **attributes)


def touched(*names):
    """Nodes that use the image without changing the sum ``zero``."""
    return [
        node("ReduceMean", ["image"], "mean", keepdims=0),
        node("Sub", ["mean", "mean"], "zero"),
    ]


def constant(path, depth, **more):
    """Answers this depth where depth goes in as 0, else the depth that went in."""
    nodes = [
        *touched(),
        node("Add", ["depth", "zero"], "seen"),
        node("Greater", ["seen", "zero"], "known"),
        node("Where", ["known", "seen", "answer"], "depth_out"),
    ]
    constants = {"answer": depth.astype(np.float32)[None, None]}
    return networks.completion(path, nodes, {"image": IMAGE, "depth": DEPTH}, DEPTH, constants, **more)


def test_a_network_that_returns_its_depth_fills_nothing(tmp_path):
    nodes = [*touched(), node("Add", ["depth", "zero"], "depth_out")]
    file = networks.completion(tmp_path / "n.onnx", nodes, {"image": IMAGE, "depth": DEPTH}, DEPTH)
    completed = OwnCompletion(file).complete(with_hole(), RGB)
    np.testing.assert_array_equal(completed.depth.z_m, with_hole().z_m)
    np.testing.assert_array_equal(completed.log_scale, np.float32(LOG_SCALES[1]))


def test_a_network_that_knows_the_truth_fills_it_and_is_certain(tmp_path):
    completed = OwnCompletion(constant(tmp_path / "n.onnx", WALL_M)).complete(with_hole(), RGB)
    np.testing.assert_allclose(completed.depth.z_m, WALL_M, rtol=1e-4)
    np.testing.assert_array_equal(completed.log_scale, np.float32(LOG_SCALES[0]))


def test_a_network_that_is_20_percent_off_in_holes_knows_it(tmp_path):
    completed = OwnCompletion(constant(tmp_path / "n.onnx", 1.2 * WALL_M)).complete(with_hole(), RGB)
    np.testing.assert_allclose(completed.log_scale, np.log(np.log(1.2)), atol=1e-3)
    np.testing.assert_allclose(completed.depth.z_m[HOLE], 1.2 * WALL_M[HOLE], rtol=1e-3)
    np.testing.assert_array_equal(completed.depth.z_m[~HOLE], WALL_M[~HOLE])


@pytest.mark.parametrize("times", [0.001, 0.1, 40.0])
def test_an_output_in_another_unit_is_scaled_to_the_sensor(tmp_path, times):
    nodes = [*touched(), node("Add", ["answer", "zero"], "depth_out")]
    constants = {"answer": (times * WALL_M)[None, None].astype(np.float32)}
    inputs = {"image": IMAGE, "depth": DEPTH}
    file = networks.completion(tmp_path / "n.onnx", nodes, inputs, DEPTH, constants)
    np.testing.assert_allclose(OwnCompletion(file).complete(with_hole(), RGB).depth.z_m, WALL_M, rtol=1e-4)


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("how", [None, "unit", "bytes", "imagenet"])
def test_every_channel_arrives_where_and_as_said(tmp_path, index, how):
    """The answer is depth + 10 + one channel of the image, which only its hole shows."""
    nodes = [
        node("Gather", ["image", "k"], "c", axis=1),
        node("Add", ["c", "ten"], "shifted"),
        node("Greater", ["depth", "none"], "known"),
        node("Where", ["known", "depth", "shifted"], "depth_out"),
    ]
    constants = {"k": np.array([index]), "ten": np.float32(10.0), "none": np.float32(0.0)}
    file = networks.completion(tmp_path / "n.onnx", nodes, {"image": IMAGE, "depth": DEPTH}, DEPTH, constants)
    plane = np.full((ROWS, COLUMNS), 9.0, np.float32)
    completed = OwnCompletion(file, how).complete(with_hole(plane), RGB)
    mean, deviation = (0.485, 0.456, 0.406)[index], (0.229, 0.224, 0.225)[index]
    value = RGB[..., index] / 255.0
    value = {"bytes": 255.0 * value, "imagenet": (value - mean) / deviation}.get(how, value)
    np.testing.assert_allclose(completed.depth.z_m[HOLE], 10.0 + value[HOLE], rtol=1e-4)


SHAPES = {
    "NCHW": (IMAGE, DEPTH),
    "NHWC": ((1, ROWS, COLUMNS, 3), (1, ROWS, COLUMNS, 1)),
    "rank 3": (IMAGE, (1, ROWS, COLUMNS)),
    "rank 2": (IMAGE, (ROWS, COLUMNS)),
    "image last, depth first": ((1, ROWS, COLUMNS, 3), DEPTH),
    "open": (("n", 3, "h", "w"), ("n", 1, "h", "w")),
    "open batch and channel": (("n", 3, "h", "w"), ("n", "c", "h", "w")),
}


@pytest.mark.parametrize("shapes", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("names", [("image", "depth"), ("rgb", "sparse"), ("input.1", "input.2")])
def test_depth_arrives_at_its_pixels_in_every_shape(tmp_path, shapes, names):
    """Twice the depth comes out, which scaling undoes; the truth stands in the hole by its column."""
    image, depth = names
    nodes = [
        node("ReduceMean", [image], "mean", keepdims=0),
        node("Sub", ["mean", "mean"], "zero"),
        node("Add", [depth, depth], "twice"),
        node("Add", ["twice", "zero"], "y"),
    ]
    file = networks.completion(
        tmp_path / "n.onnx", nodes, dict(zip(names, shapes, strict=True)), shapes[1], name="y"
    )
    sensor = with_hole()
    completed = OwnCompletion(file).complete(sensor, RGB)
    known = completed.depth.valid
    assert known[~HOLE].all()
    assert not known[19:31, 24:40].any()


def test_depth_as_the_fourth_channel_is_taken_in_metres(tmp_path):
    nodes = [
        node("Gather", ["rgbd", "k"], "d", axis=1),
        node("Greater", ["d", "none"], "known"),
        node("Where", ["known", "d", "three"], "y"),
    ]
    constants = {"k": np.array([3]), "none": np.float32(0.0), "three": np.float32(3.0)}
    inputs = {"rgbd": (1, 4, ROWS, COLUMNS)}
    file = networks.completion(tmp_path / "n.onnx", nodes, inputs, DEPTH, constants, name="y")
    completed = OwnCompletion(file).complete(with_hole(np.full_like(WALL_M, 2.0)), RGB)
    np.testing.assert_allclose(completed.depth.z_m, np.where(HOLE, 3.0, 2.0), rtol=1e-4)


@pytest.mark.parametrize("kind", [TensorProto.FLOAT, TensorProto.BOOL, TensorProto.UINT8])
def test_a_mask_says_where_depth_is_measured(tmp_path, kind):
    """The answer is 2 where the mask holds, and 3 elsewhere."""
    nodes = [
        *touched(),
        node("ReduceMean", ["depth"], "m", keepdims=0),
        node("Sub", ["m", "m"], "none"),
        node("Cast", ["valid_mask"], "as_float", to=TensorProto.FLOAT),
        node("Sub", ["three", "as_float"], "left"),
        node("Add", ["left", "none"], "some"),
        node("Add", ["some", "zero"], "depth_out"),
    ]
    file = networks.completion(
        tmp_path / "n.onnx",
        nodes,
        {"image": IMAGE, "depth": DEPTH, "valid_mask": DEPTH},
        DEPTH,
        {"three": np.float32(3.0)},
        types={"valid_mask": kind},
    )
    completed = OwnCompletion(file).complete(with_hole(np.full_like(WALL_M, 2.0)), RGB)
    np.testing.assert_allclose(completed.depth.z_m, np.where(HOLE, 3.0, 2.0), rtol=1e-4)


def test_the_unit_of_the_metadata_goes_in_and_comes_out(tmp_path):
    """A network of millimetres that knows nothing above 1.5 m."""
    nodes = [
        *touched(),
        node("Greater", ["depth", "zero"], "known"),
        node("Where", ["known", "depth", "far"], "all"),
        node("Min", ["all", "most"], "depth_out"),
    ]
    constants = {"far": np.float32(1200.0), "most": np.float32(1500.0)}
    inputs = {"image": IMAGE, "depth": DEPTH}
    file = networks.completion(
        tmp_path / "n.onnx", nodes, inputs, DEPTH, constants, {"depth_unit_m": "0.001"}
    )
    completed = OwnCompletion(file).complete(with_hole(np.full_like(WALL_M, 1.0)), RGB)
    np.testing.assert_allclose(completed.depth.z_m, np.where(HOLE, 1.2, 1.0), rtol=1e-4)


def test_large_images_are_reduced_and_small_ones_enlarged_in_place(tmp_path):
    nodes = [*touched(), node("Add", ["depth", "zero"], "depth_out")]
    file = networks.completion(tmp_path / "n.onnx", nodes, {"image": IMAGE, "depth": DEPTH}, DEPTH)
    for rows, columns in ((480, 640), (24, 32)):
        x = np.linspace(1.0, 2.0, columns, dtype=np.float32)
        sensor = DepthMap(np.broadcast_to(x, (rows, columns)).copy())
        sensor.z_m[:, columns // 2 - 1] = np.nan  # one column, which the grid's neighbours know
        rgb = np.full((rows, columns, 3), 90, np.uint8)
        z_m = OwnCompletion(file).complete(sensor, rgb).depth.z_m
        known = np.isfinite(z_m)
        np.testing.assert_allclose(z_m[known], np.broadcast_to(x, z_m.shape)[known], rtol=0.02)
        assert known.mean() > 0.8


def test_half_precision_is_served(tmp_path):
    half = TensorProto.FLOAT16
    nodes = [*touched(), node("Add", ["depth", "zero"], "depth_out")]
    inputs = {"image": IMAGE, "depth": DEPTH}
    types = dict.fromkeys(inputs, half)
    file = networks.completion(tmp_path / "n.onnx", nodes, inputs, DEPTH, types=types)
    completed = OwnCompletion(file).complete(with_hole(), RGB)
    assert completed.depth.z_m.dtype == np.float32
    np.testing.assert_array_equal(completed.depth.z_m, with_hole().z_m)


def test_it_replaces_the_aligned_depth_up_to_the_rims(tmp_path):
    completed = OwnCompletion(constant(tmp_path / "n.onnx", 1.3 * WALL_M)).complete(with_hole(), RGB)
    network = align_depth(DepthMap(0.5 * WALL_M, "relative"), with_hole(), "median")
    judged = judge(network, with_hole(), RGB, 1.0, 0.0, completed)
    np.testing.assert_allclose(
        judged.depth.z_m[HOLE & judged.depth.valid], 1.3 * WALL_M[HOLE & judged.depth.valid], rtol=1e-3
    )
    assert judged.depth.valid[HOLE].mean() > 0.8
    np.testing.assert_allclose(judged.depth.z_m[~HOLE], WALL_M[~HOLE], rtol=1e-3)


def test_nan_and_infinity_are_unknown(tmp_path):
    answer = np.where(np.arange(COLUMNS) % 2, np.nan, np.inf) * np.ones((ROWS, 1))
    answer[20:30, 25:35] = 1.7
    completed = OwnCompletion(constant(tmp_path / "n.onnx", answer)).complete(with_hole(), RGB)
    assert completed.depth.valid[22:28, 27:33].all()
    assert not completed.depth.valid[16:19, 22:42].any()
    network = align_depth(DepthMap(WALL_M, "relative"), with_hole(), "median")
    judged = judge(network, with_hole(), RGB, 1.0, 0.0, completed)
    assert not judged.depth.valid[16:19, 22:42].any()


@pytest.mark.parametrize("answer", [np.nan, -1.0, 0.0])
def test_an_answer_without_depth_is_one_sentence(tmp_path, answer):
    nodes = [*touched(), node("Mul", ["depth", "none"], "d"), node("Add", ["d", "zero"], "depth_out")]
    inputs = {"image": IMAGE, "depth": DEPTH}
    file = networks.completion(tmp_path / "n.onnx", nodes, inputs, DEPTH, {"none": np.float32(answer)})
    with pytest.raises(ReconstructionError, match=r"n\.onnx gives no positive depth"):
        OwnCompletion(file).complete(with_hole(), RGB)


def test_disparity_is_no_depth(tmp_path):
    nodes = [*touched(), node("Add", ["answer", "zero"], "depth_out")]
    constants = {"answer": (1.0 / (8.0 * WALL_M - 7.5))[None, None].astype(np.float32)}
    file = networks.completion(tmp_path / "n.onnx", nodes, {"image": IMAGE, "depth": DEPTH}, DEPTH, constants)
    with pytest.raises(ReconstructionError, match="does not follow the measured depth"):
        OwnCompletion(file).complete(with_hole(), RGB)


BAD = {
    "two depths": ({"image": IMAGE, "depth": DEPTH, "depth2": DEPTH}, DEPTH),
    "two images": ({"image": IMAGE, "depth": IMAGE}, DEPTH),
    "intrinsics": ({"image": IMAGE, "depth": DEPTH, "K": (1, 3, 3)}, DEPTH),
    "five channels": ({"image": (1, 5, ROWS, COLUMNS), "depth": DEPTH}, DEPTH),
    "a batch of two": ({"image": (2, 3, ROWS, COLUMNS), "depth": DEPTH}, DEPTH),
    "points come out": ({"image": IMAGE, "depth": DEPTH}, (1, 3, ROWS, COLUMNS)),
    "only a mask": ({"image": IMAGE, "mask": DEPTH}, DEPTH),
    "four channels and depth": ({"image": (1, 4, ROWS, COLUMNS), "depth": DEPTH}, DEPTH),
}


def sum_of(path, inputs, output):
    """A network that uses all its inputs."""
    nodes = [node("ReduceMean", [name], f"m{name}", keepdims=0) for name in inputs]
    nodes.append(node("Sum", [f"m{name}" for name in inputs], "s"))
    nodes.append(node("Expand", ["s", "shape"], "depth_out"))
    return networks.completion(path, nodes, inputs, output, {"shape": np.array(output)})


@pytest.mark.parametrize("shapes", BAD.values(), ids=BAD)
def test_a_signature_that_does_not_fit_is_one_sentence_with_what_there_is(tmp_path, shapes):
    file = sum_of(tmp_path / "n.onnx", *shapes)
    with pytest.raises(InputError, match=r"n\.onnx maps .*, but a completion network maps") as caught:
        OwnCompletion(file)
    for name in shapes[0]:
        assert name in str(caught.value)


def test_image_and_depth_of_different_sizes_are_refused(tmp_path):
    file = sum_of(tmp_path / "n.onnx", {"image": IMAGE, "depth": (1, 1, ROWS, 32)}, DEPTH)
    with pytest.raises(InputError, match="different heights or widths"):
        OwnCompletion(file)


@pytest.mark.parametrize(
    ("metadata", "sentence"),
    [
        ({"depth_unit_m": "mm"}, "depth_unit_m = 'mm'"),
        ({"depth_unit_m": "0"}, "depth_unit_m = '0'"),
        ({"depth_kind": "inverse"}, "disparity"),
        ({"input_layout": "CHW"}, "input_layout"),
    ],
)
def test_metadata_that_do_not_fit_are_one_sentence(tmp_path, metadata, sentence):
    file = constant(tmp_path / "n.onnx", WALL_M, metadata=metadata)
    with pytest.raises(InputError, match=sentence):
        OwnCompletion(file)


def test_each_network_is_told_where_it_belongs(tmp_path):
    with pytest.raises(InputError, match=r"depth\.completion"):
        DepthNetwork(constant(tmp_path / "both.onnx", WALL_M))
    with pytest.raises(InputError, match=r"as depth\.model, not"):
        OwnCompletion(networks.channel(tmp_path / "one.onnx"))
    with pytest.raises(InputError, match="but a completion network maps"):
        OwnCompletion(SHIPPED_COMPLETION)
    with pytest.raises(InputError, match="There is no"):
        OwnCompletion(tmp_path / "none.onnx")


def test_nothing_measured_and_other_sizes_are_one_sentence(tmp_path):
    network = OwnCompletion(constant(tmp_path / "n.onnx", WALL_M))
    with pytest.raises(InputError, match="no valid pixel"):
        network.complete(DepthMap(np.full_like(WALL_M, np.nan)), RGB)
    with pytest.raises(InputError, match="one pixel grid"):
        network.complete(with_hole(), RGB[:-1])


def test_a_single_measured_pixel_is_enough(tmp_path):
    lone = np.full_like(WALL_M, np.nan)
    lone[0, 0] = 1.0
    completed = OwnCompletion(constant(tmp_path / "n.onnx", 1.3 * np.ones_like(WALL_M))).complete(
        DepthMap(lone), RGB
    )
    np.testing.assert_allclose(np.delete(completed.depth.z_m.ravel(), 0), 1.3, rtol=1e-4)
    np.testing.assert_array_equal(completed.log_scale, np.float32(LOG_SCALES[1]))


def test_the_settings_choose_the_network(tmp_path):
    file = constant(tmp_path / "n.onnx", 1.2 * WALL_M)
    config = with_settings(PipelineConfig(), [f"depth.completion={file}"]).depth
    assert config.completion == str(file)
    own = completed_by(config, with_hole(), RGB).depth.z_m
    np.testing.assert_allclose(own[HOLE], 1.2 * WALL_M[HOLE], rtol=1e-3)
    shipped = completed_by(DepthConfig(), with_hole(), RGB).depth.z_m
    np.testing.assert_array_equal(shipped, complete(with_hole(), RGB).depth.z_m)


@pytest.mark.parametrize(
    ("config", "completes"),
    [
        (DepthConfig(), True),
        (DepthConfig(model="m"), False),
        (DepthConfig(model="m", completion="c"), True),
        (DepthConfig(completion="c"), True),
        (DepthConfig(completion="c", fill="network"), False),
    ],
)
def test_a_named_completion_completes(config, completes):
    assert config.completes == completes
    assert config.of_network() == DepthConfig(model=config.model)


def test_a_fifth_is_hidden_in_squares_apart():
    hidden = hidden_squares(np.ones((480, 640), bool))
    assert hidden.mean() == pytest.approx(0.2, abs=0.02)
    side = round(640 / 24)
    blocks = hidden[::side, ::side]
    assert not (blocks[1:] & blocks[:-1]).any()
    assert not (blocks[:, 1:] & blocks[:, :-1]).any()
    assert not hidden_squares(np.zeros((48, 64), bool)).any()


@pytest.mark.parametrize("height", [240, 480, 700])
def test_the_squares_are_a_twenty_fourth_of_the_width(height):
    side, rows = round(640 / 24), height // round(640 / 24)
    hidden = hidden_squares(np.ones((height, 640), bool))
    squares = hidden[: rows * side, : 23 * side].reshape(rows, side, 23, side)
    assert (squares == squares[:, :1, :, :1]).all()


def test_depth_is_placed_in_the_middle_of_the_grid():
    plane = np.arange(12.0, dtype=np.float32).reshape(3, 4)
    whole = on_grid(plane, (4, 3), (5, 8))
    np.testing.assert_array_equal(whole[1:4, 2:6], plane)
    assert whole.sum() == plane.sum()
