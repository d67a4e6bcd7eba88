import cv2
import numpy as np
import onnxruntime
import pytest

from packetmesh.errors import InputError
from pipeline.depth import DepthNetwork, align_depth, depth_errors
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.depth.preprocessing import centre_crop, fitted, normalised_input, padded, unpad
from pipeline.io.demos import DEMO_SCENES, load_demo

SIZES = [(480, 640), (240, 320), (641, 361), (256, 256), (48, 64), (33, 700)]


@pytest.fixture(scope="module")
def network() -> DepthNetwork:
    return DepthNetwork()


def _image(height_px: int, width_px: int) -> np.ndarray:
    v, u = np.mgrid[:height_px, :width_px]
    ramp = np.stack([200.0 * v / height_px, 120.0 * u / width_px, 80.0 + 40.0 * np.sin(u / 9.0)], axis=-1)
    return ramp.astype(np.uint8)


def test_the_shipped_network_says_what_runs_it_and_how_it_was_trained(network):
    assert network.provider in onnxruntime.get_available_providers()
    assert {"seed", "images_seen", "abs_rel"} <= network.description.keys()


@pytest.mark.parametrize(("height_px", "width_px"), SIZES)
def test_depth_is_positive_on_every_pixel_of_any_image(network, height_px, width_px):
    depth = network.infer(_image(height_px, width_px))
    assert depth.z_m.shape == (height_px, width_px)
    assert depth.z_m.dtype == np.float32
    assert depth.kind == "relative"
    assert depth.coverage == 1.0
    assert depth.z_m.min() >= 0.099
    assert depth.z_m.max() <= 10.001


@pytest.mark.parametrize(("height_px", "width_px"), [(1, 1), (8, 8), (1, 900), (3000, 4000)])
def test_images_of_a_few_pixels_and_of_millions_get_depth_everywhere(network, height_px, width_px):
    depth = network.infer(_image(height_px, width_px))
    assert depth.z_m.shape == (height_px, width_px)
    assert depth.coverage == 1.0


@pytest.mark.parametrize(("height_px", "width_px"), SIZES)
def test_the_shipped_network_is_fed_and_read_as_it_was_trained_to_the_bit(network, height_px, width_px):
    rgb = _image(height_px, width_px)
    small = fitted(rgb)
    session = onnxruntime.InferenceSession(str(SHIPPED_MODEL), providers=[network.provider])
    image = padded(small, 320, 256).astype(np.float32).transpose(2, 0, 1)[None]
    (answer,) = session.run(None, {"rgb": np.ascontiguousarray(image)})
    logarithm = cv2.resize(np.log(unpad(answer[0, 0], *small.shape[:2])), (width_px, height_px))
    np.testing.assert_array_equal(network.infer(rgb).z_m, np.exp(logarithm))


def test_same_image_same_bits(network):
    first, second = (DepthNetwork().infer(_image(480, 640)).z_m for _ in range(2))
    assert first.tobytes() == second.tobytes() == network.infer(_image(480, 640)).z_m.tobytes()


def test_the_crop_of_the_thesis_knows_exactly_its_own_pixels(network):
    depth = network.infer(_image(480, 640), crop=True)
    inside = np.zeros((480, 640), bool)
    inside[12:468, 16:624] = True
    np.testing.assert_array_equal(depth.valid, inside)


@pytest.mark.parametrize(("height_px", "width_px"), SIZES)
def test_the_crop_keeps_95_percent_of_each_side_of_any_image(height_px, width_px):
    rows, columns = centre_crop(height_px, width_px)
    assert rows.stop - rows.start == round(0.95 * height_px)
    assert columns.stop - columns.start == round(0.95 * width_px)
    assert abs(rows.start - (height_px - rows.stop)) <= 1
    assert abs(columns.start - (width_px - columns.stop)) <= 1


@pytest.mark.parametrize(("height_px", "width_px"), SIZES)
def test_padding_reflects_and_comes_off_again(height_px, width_px):
    small = fitted(_image(height_px, width_px))
    tensor = normalised_input(small)
    assert tensor.shape == (1, 3, 256, 320)
    assert max(small.shape[0] / 240, small.shape[1] / 320) == 1.0
    inner = unpad(tensor[0, 0], *small.shape[:2])
    np.testing.assert_allclose(inner, (small[..., 0] / 255.0 - 0.485) / 0.229, atol=1e-5)


@pytest.mark.parametrize("name", DEMO_SCENES)
def test_the_depth_of_a_mirrored_image_is_the_mirrored_depth(network, name):
    """The graph averages an image's answer with its mirror image's, so this holds but for rounding."""
    rgb = load_demo(name).frames[0].rgb
    straight_m = network.infer(rgb).z_m
    mirrored_m = network.infer(np.ascontiguousarray(rgb[:, ::-1])).z_m
    np.testing.assert_allclose(mirrored_m[:, ::-1], straight_m, rtol=1e-5)
    assert np.abs(np.log(mirrored_m / straight_m)).max() > 0.3  # the place itself is not symmetric


def test_it_knows_the_shape_of_nearly_every_demo_frame_better_than_a_flat_wall_does(network):
    """And its mean relative error is below 13 % and 0.75 times that of a wall at the right distance."""
    errors, flat_errors = [], []
    for name in DEMO_SCENES:
        rig = load_demo(name)
        for frame, truth in zip(rig.frames, rig.truth.depth, strict=True):
            scaled = align_depth(network.infer(frame.rgb), truth, "median").depth.z_m
            flat = np.full_like(truth.z_m, np.nanmedian(truth.z_m))
            errors.append(depth_errors(scaled, truth.z_m))
            flat_errors.append(depth_errors(flat, truth.z_m))
    abs_rel, flat_abs_rel = (np.mean([row.abs_rel for row in rows]) for rows in (errors, flat_errors))
    assert abs_rel < min(0.13, 0.75 * flat_abs_rel)
    better = [row.silog < flat.silog for row, flat in zip(errors, flat_errors, strict=True)]
    assert len(better) - sum(better) <= 2


@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.999])
def test_a_truncated_network_is_refused(tmp_path, share):
    whole = SHIPPED_MODEL.read_bytes()
    file = tmp_path / "cut.onnx"
    file.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=r"cut\.onnx"):
        DepthNetwork(file)


def test_a_file_of_another_kind_is_refused(tmp_path):
    file = tmp_path / "photo.onnx"
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(1000))
    with pytest.raises(InputError, match="not a readable ONNX network"):
        DepthNetwork(file)


def test_a_missing_network_is_refused(tmp_path):
    with pytest.raises(InputError, match="no network file at"):
        DepthNetwork(tmp_path / "nowhere.onnx")


def test_another_network_is_refused(tmp_path):
    file = tmp_path / "other.onnx"
    file.write_bytes(_identity_network())
    with pytest.raises(InputError, match=r"maps x \[1, 4\]"):
        DepthNetwork(file)


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((4, 4, 3)),
        np.zeros((0, 4, 3), np.uint8),
    ],
)
def test_what_is_no_colour_image_is_refused(network, image):
    with pytest.raises(InputError, match="8-bit RGB"):
        network.infer(image)


def _identity_network() -> bytes:
    """The ONNX protobuf of y = Identity(x) for (1, 4) floats, written by hand: onnx is not installed."""

    def field(number: int, value: bytes | int) -> bytes:
        if isinstance(value, int):
            return bytes([number << 3, value])
        return bytes([number << 3 | 2, len(value)]) + value

    def value_info(name: bytes) -> bytes:
        shape = field(1, field(1, 1)) + field(1, field(1, 4))
        return field(1, name) + field(2, field(1, field(1, 1) + field(2, shape)))

    node = field(1, b"x") + field(2, b"y") + field(4, b"Identity")
    graph = field(1, node) + field(2, b"g") + field(11, value_info(b"x")) + field(12, value_info(b"y"))
    return field(1, 8) + field(7, graph) + field(8, field(2, 17))
