"""``packetmesh infer-depth`` as a user meets it."""

import json

import cv2
import numpy as np
import pytest

from app.drawing.colors import HOLE
from pipeline.depth import DepthNetwork
from pipeline.io.images import read_color, read_depth
from tests.app import commands
from tests.paths import ASSETS

PAIR = ASSETS / "scenes" / "box-on-table" / "node_00"


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "infer-depth", *argv)


def values(file) -> np.ndarray:
    image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert image.dtype == np.uint16
    return image


def answer(tmp_path, depth: np.ndarray, kind: str):
    """A network that gives this depth for any image."""
    pytest.importorskip("onnx")
    from tests.pipeline.depth import networks

    file = tmp_path / f"{kind}.onnx"
    return networks.fixed_answer(file, [depth], (1, 3, *depth.shape), {"depth_kind": kind})


def photo(tmp_path, name: str = "photo.png", rows: int = 20, columns: int = 30):
    file = tmp_path / name
    cv2.imwrite(str(file), np.full((rows, columns, 3), 90, np.uint8))
    return file


def test_a_photograph_becomes_shares_of_its_largest_depth(capsys, tmp_path):
    code, out, err = run(capsys, PAIR / "color.png", "--out", tmp_path / "out", "--json")
    report = json.loads(out)
    (record,) = report["photos"].values()
    z = DepthNetwork().infer(read_color(PAIR / "color.png")).z_m
    assert code == 0
    assert report["kind"] == "relative"
    assert report["provider"].endswith("ExecutionProvider")
    assert (record["height_px"], record["width_px"]) == z.shape
    assert 0.0 < record["inference_ms"] < 60_000.0
    np.testing.assert_allclose(values(record["depth"]), 65534.0 * z / z.max(), atol=1.0)
    assert read_color(record["preview"]).shape == (*z.shape, 3)
    assert report["provider"] in err
    assert " ms" in err


def test_metres_are_written_in_millimetres_and_what_16_bits_cannot_hold_is_left_out(capsys, tmp_path):
    metres = np.full((20, 30), 2.5)
    metres[:, :6], metres[:, 6:12] = 80.0, -1.0
    network = answer(tmp_path, metres, "metric")
    code, out, err = run(capsys, photo(tmp_path), "--out", tmp_path, "--model", network, "--json")
    (record,) = json.loads(out)["photos"].values()
    assert code == 0
    np.testing.assert_array_equal(values(record["depth"]), np.where(metres == 2.5, 2500, 0))
    assert record["known"] == pytest.approx(0.8)
    assert record["too_far"] == pytest.approx(0.25)
    assert (record["nearest_m"], record["farthest_m"]) == pytest.approx((2.5, 80.0))
    assert "65.534" in err
    unknown = (read_color(record["preview"]) == HOLE).all(axis=-1)
    np.testing.assert_array_equal(unknown, metres < 0.0)


def test_disparity_is_written_as_shares_of_the_largest(capsys, tmp_path):
    disparity = np.linspace(0.0, 8.0, 30)[None].repeat(20, axis=0)
    network = answer(tmp_path, disparity, "inverse")
    code, out, _ = run(capsys, photo(tmp_path), "--out", tmp_path, "--model", network, "--json")
    (record,) = json.loads(out)["photos"].values()
    assert code == 0
    np.testing.assert_allclose(values(record["depth"]), 65534.0 * disparity / 8.0, atol=1.0)
    assert values(record["depth"])[0, 0] == 0
    shades = read_color(record["preview"])[0, 1:].astype(int).sum(axis=-1)
    assert (np.diff(shades) >= 0).all(), "the nearer, the lighter"


@pytest.mark.parametrize("kind", ["relative", "inverse"])
def test_a_sensor_makes_the_depth_metric(capsys, tmp_path, kind):
    v, u = np.mgrid[:20, :30]
    truth_m = 1.0 + 0.05 * u + 0.02 * v
    network = answer(tmp_path, 3.0 * truth_m if kind == "relative" else 5.0 / truth_m - 1.0, kind)
    sensor_mm = np.rint(1000.0 * truth_m).astype(np.uint16)
    sensor_mm[5:12, 8:20] = 0
    cv2.imwrite(str(tmp_path / "sensor.png"), sensor_mm)
    given = ("--model", network, "--sensor", tmp_path / "sensor.png")
    code, out, _ = run(capsys, photo(tmp_path), "--out", tmp_path, *given, "--json")
    (record,) = json.loads(out)["photos"].values()
    assert code == 0
    assert record["alignment"]["mode"] == "local"
    assert record["alignment"]["residual_rms_m"] < 0.002
    np.testing.assert_allclose(values(record["depth"]), 1000.0 * truth_m, atol=4.0)


def test_a_sensors_holes_are_filled_and_what_it_measured_stays(capsys, tmp_path):
    words = (PAIR / "color.png", "--out", tmp_path, "--sensor", PAIR / "depth.png", "--fill", "--json")
    code, out, err = run(capsys, *words)
    assert code == 0
    (record,) = json.loads(out)["photos"].values()
    filled, sensor = read_depth(record["depth"]), read_depth(PAIR / "depth.png")
    measured = sensor.valid
    np.testing.assert_array_equal(filled.z_m[measured], sensor.z_m[measured])
    assert filled.valid.mean() > 0.98
    assert record["filled"]["share"] == pytest.approx((filled.valid & ~measured).mean())
    assert 0.3 < record["filled"]["mean_confidence"] < 1.0
    assert "of the pixels filled in" in err


def test_holes_are_filled_by_a_network_that_takes_image_and_depth(capsys, tmp_path):
    """It gives 3 m wherever it gets no depth, and says so with little confidence."""
    pytest.importorskip("onnx")
    from onnx import helper

    from tests.pipeline.depth import networks

    nodes = [
        helper.make_node("ReduceMean", ["image"], ["m"], keepdims=0),
        helper.make_node("Sub", ["m", "m"], ["zero"]),
        helper.make_node("Add", ["depth", "zero"], ["seen"]),
        helper.make_node("Greater", ["seen", "zero"], ["known"]),
        helper.make_node("Where", ["known", "seen", "three"], ["y"]),
    ]
    shapes = {"image": (1, 3, "h", "w"), "depth": (1, 1, "h", "w")}
    constants = {"three": np.float32(3.0)}
    file = networks.completion(tmp_path / "n.onnx", nodes, shapes, shapes["depth"], constants, name="y")
    words = (PAIR / "color.png", "--out", tmp_path, "--sensor", PAIR / "depth.png", "--fill", "--json")
    code, out, _ = run(capsys, *words, "--completion", file)
    assert code == 0
    (record,) = json.loads(out)["photos"].values()
    filled, sensor = read_depth(record["depth"]), read_depth(PAIR / "depth.png")
    np.testing.assert_array_equal(filled.z_m[sensor.valid], sensor.z_m[sensor.valid])
    far = cv2.erode((~sensor.valid).astype(np.uint8), np.ones((3, 3))) > 0
    assert far.any()
    np.testing.assert_allclose(filled.z_m[far], 3.0, rtol=1e-3)
    assert record["filled"]["mean_confidence"] < 0.3
    code, _, err = run(capsys, *words, "--model", file)
    assert code == 1
    assert "infer-depth: --completion" in err


@pytest.mark.parametrize(
    "name", ["grey.png", "alpha.png", "grey_alpha.png", "grey16.png", "palette.png", "cmyk.jpg"]
)
def test_images_of_every_sort_are_read_as_the_colours_they_show(capsys, tmp_path, name):
    Image = pytest.importorskip("PIL.Image")
    color = np.full((20, 30, 3), (204, 102, 51), np.uint8)
    gray = np.full((20, 30), 160, np.uint8)
    half = np.full((20, 30), 128, np.uint8)
    images = {
        "grey.png": Image.fromarray(gray),
        "alpha.png": Image.fromarray(np.dstack([color, half])),
        "grey_alpha.png": Image.fromarray(np.dstack([gray, half]), "LA"),
        "grey16.png": Image.fromarray(gray.astype(np.uint16) * 257),
        "palette.png": Image.fromarray(color).convert("P"),
        "cmyk.jpg": Image.fromarray(color).convert("CMYK"),
    }
    images[name].save(tmp_path / name)
    expected = gray[..., None].repeat(3, axis=2) if "grey" in name else color
    np.testing.assert_allclose(read_color(tmp_path / name), expected, atol=3)
    code, out, _ = run(capsys, tmp_path / name, "--out", tmp_path / "out", "--json")
    (record,) = json.loads(out)["photos"].values()
    assert code == 0
    assert values(record["depth"]).shape == (20, 30)
    assert record["known"] == 1.0


@pytest.mark.parametrize(("rows", "columns"), [(8, 8), (1, 1)])
def test_a_tiny_image_is_inferred(capsys, tmp_path, rows, columns):
    file = photo(tmp_path, "tiny.png", rows, columns)
    code, _, _ = run(capsys, file, "--out", tmp_path / "out")
    assert code == 0
    assert values(tmp_path / "out" / "tiny_depth.png").shape == (rows, columns)


def test_several_photographs_share_one_network(capsys, tmp_path):
    files = [photo(tmp_path, f"{name}.png") for name in "abc"]
    code, out, err = run(capsys, *files, "--out", tmp_path / "out", "--json")
    assert code == 0
    assert list(json.loads(out)["photos"]) == list(map(str, files))
    assert len(list((tmp_path / "out").iterdir())) == 6
    assert err.count("\n") == 4


def test_what_cannot_be_done_is_one_sentence_and_leaves_nothing_behind(capsys, tmp_path):
    good = photo(tmp_path)
    (tmp_path / "other").mkdir()
    same_name = photo(tmp_path / "other")
    (tmp_path / "cut.onnx").write_bytes(DepthNetwork().model_path.read_bytes()[:100_000])
    (tmp_path / "cut.png").write_bytes(good.read_bytes()[:-20])
    (tmp_path / "text.jpg").write_text("no photograph")
    cv2.imwrite(str(tmp_path / "huge.png"), np.zeros((5001, 5000), np.uint8))
    depth = tmp_path / "depth.png"
    cv2.imwrite(str(depth), np.full((20, 30), 1500, np.uint16))
    cases = [
        ([], 2, "photograph"),
        ([good, good, "--sensor", good], 2, "--sensor"),
        ([good, "--fill"], 2, "--fill needs the depth image"),
        ([good, "--completion", good], 2, "add --fill and --sensor"),
        ([good, "--completion", tmp_path / "none.onnx", "--sensor", depth, "--fill"], 1, "none.onnx"),
        ([good, same_name], 1, "photo"),
        ([good, "--model", tmp_path / "cut.onnx"], 1, "cut.onnx"),
        ([good, "--model", tmp_path / "none.onnx"], 1, "none.onnx"),
        ([good, "--preset", "midas-small"], 1, "midas-small"),
        ([good, "--size-px", 64, 64], 1, "320 x 256"),
        ([good, "--sensor", good], 1, "16"),
        ([tmp_path / "cut.png"], 1, "cut.png"),
        ([tmp_path / "text.jpg"], 1, "text.jpg"),
        ([tmp_path / "huge.png"], 1, "5000 x 5001"),
        ([tmp_path / "none.png"], 1, "none.png"),
    ]
    for argv, expected, names in cases:
        code, out, err = run(capsys, *argv, "--out", tmp_path / "out")
        assert (code, out) == (expected, ""), argv
        (sentence,) = [line for line in err.splitlines() if line.startswith("packetmesh: ")]
        assert names in sentence
        assert "Traceback" not in err
        assert not list((tmp_path / "out").glob("*"))
