"""Images as TIFF, PFM and NumPy files: other programs' come back, bad ones get a sentence."""

import io

import cv2
import numpy as np
import OpenEXR
import pytest
from PIL import Image, ImageCms

from packetmesh.errors import InputError
from pipeline.io.images import read_color, read_depth
from pipeline.io.rigs import load_rig

RNG = np.random.default_rng(2)
MM = RNG.integers(500, 6000, (12, 17), dtype=np.uint16)
MM[3:5, 4:9] = 0
METRES = np.where(MM > 0, MM / 1000.0, np.nan).astype(np.float32)
RGB = RNG.integers(0, 256, (12, 17, 3), dtype=np.uint8)


def npy(values):
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=True)
    return stream.getvalue()


def tiff(values):
    stream = io.BytesIO()
    Image.fromarray(values).save(stream, format="TIFF")
    return stream.getvalue()


def exr(**channels):
    """Of OpenEXR's own writer."""
    stream = io.BytesIO()
    with OpenEXR.File(
        {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}, channels
    ) as file:
        file.write(stream)
    return stream.getvalue()


def opencv(values, suffix):
    return cv2.imencode(suffix, values)[1].tobytes()


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("mm.npy", npy(MM)),
        ("mm.tif", opencv(MM, ".tiff")),
        ("pillow.tif", tiff(MM)),
        ("metres.npy", npy(METRES)),
        ("doubles.npy", npy(METRES.astype(float))),
        ("metres.tiff", opencv(METRES, ".tiff")),
        ("metres.pfm", opencv(METRES, ".pfm")),
        ("big.pfm", b"Pf\n17 12\n1.0\n" + METRES[::-1].astype(">f4").tobytes()),
        ("z.exr", exr(Z=METRES)),
        ("y_and_alpha.exr", exr(Y=METRES, A=np.ones_like(METRES))),
        ("zeros.npy", npy(np.nan_to_num(METRES))),
    ],
)
def test_depth_comes_back(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    np.testing.assert_allclose(read_depth(tmp_path / name).z_m, METRES, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "data", "expected"),
    [
        ("rgb.npy", npy(RGB), RGB),
        ("rgb.tif", opencv(RGB[..., ::-1], ".tiff"), RGB),
        ("pillow.tif", tiff(RGB), RGB),
        ("grey.tif", tiff(RGB[..., 0]), np.stack([RGB[..., 0]] * 3, axis=-1)),
        ("alpha.npy", npy(np.dstack([RGB, RGB[..., 0]])), RGB),
    ],
)
def test_colours_come_back(tmp_path, name, data, expected):
    (tmp_path / name).write_bytes(data)
    np.testing.assert_array_equal(read_color(tmp_path / name), expected)


@pytest.mark.parametrize("type_", [np.uint16, np.int32, np.int64, np.float32])
def test_a_scale_that_is_given_holds_for_every_type(tmp_path, type_):
    values = MM.astype(type_)
    (tmp_path / "a.npy").write_bytes(npy(values))
    np.testing.assert_allclose(read_depth(tmp_path / "a.npy", 5000.0).z_m, METRES / 5.0, rtol=1e-6)
    if type_ != np.float32:
        np.testing.assert_allclose(read_depth(tmp_path / "a.npy").z_m, METRES, rtol=1e-6)
    else:
        (tmp_path / "mm.tif").write_bytes(tiff(values))
        np.testing.assert_allclose(read_depth(tmp_path / "mm.tif", 1000.0).z_m, METRES, rtol=1e-6)


def test_a_rig_takes_the_only_image_of_a_name(tmp_path):
    node = tmp_path / "rig" / "node_00"
    node.mkdir(parents=True)
    (node / "color.ppm").write_bytes(opencv(RGB[..., ::-1], ".ppm"))
    (node / "depth.npy").write_bytes(npy(METRES))
    (node / "intrinsics.json").write_text('{"width":17,"height":12,"fx":20,"fy":20,"cx":8,"cy":6}')
    (frame,) = load_rig(tmp_path / "rig").frames
    np.testing.assert_array_equal(frame.rgb, RGB)
    np.testing.assert_array_equal(frame.depth.z_m, METRES)
    (node / "color.tif").write_bytes(tiff(RGB))
    with pytest.raises(
        InputError, match=r"has several images, color\.ppm, color\.tif; try to keep one"
    ):  # which of the two is meant
        load_rig(tmp_path / "rig")


def header_only(shape):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return stream.getvalue()


BAD = {
    "cut.npy": (npy(METRES)[:-9], "truncated"),
    "cut.tif": (tiff(MM)[:200], "truncated"),
    "cut.pfm": (opencv(METRES, ".pfm")[:-9], "truncated"),
    "cut.exr": (exr(Z=METRES)[:-90], "truncated or damaged"),
    "nameless.exr": (exr(a=METRES, b=METRES), "has the channels a, b; try one channel"),
    "colours.exr": (exr(R=METRES, G=METRES, B=METRES), r"3 channel\(s\)"),
    "bomb.npy": (header_only((200_000, 200_000)), "truncated or damaged"),
    "bomb.pfm": (b"Pf\n200000 200000\n-1.0\n", "200000 x 200000 pixels"),
    "pickle.npy": (npy(np.array([{}], object)), "truncated or damaged"),
    "text.npy": (npy(np.array([["a"]])), "no image"),
    "line.npy": (npy(METRES[0]), "no image"),
    "three.npy": (npy(np.dstack([METRES] * 3)), r"3 channel\(s\)"),
    "bytes.npy": (npy(RGB[..., 0]), "one of 16 or more is needed"),
    "millimetres.npy": (npy(1000.0 * METRES), "try --depth-scale 1000, which"),
    "nothing.npy": (npy(np.zeros((4, 4))), "no depth anywhere"),
    "words.pfm": (b"Pf\nwide high\n-1.0\n", "truncated or damaged"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_image_gets_its_sentence(tmp_path, name):
    data, says = BAD[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=says) as caught:
        read_depth(tmp_path / name)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_colours_of_sixteen_bits_are_refused(tmp_path):
    (tmp_path / "deep.npy").write_bytes(npy(RGB.astype(np.uint16)))
    with pytest.raises(InputError, match="try 8 bits"):
        read_color(tmp_path / "deep.npy")


@pytest.mark.parametrize(("mode", "within"), [("CMYK", 0), ("P", 0), ("YCbCr", 2), ("LAB", 3), ("LA", 0)])
def test_colours_of_a_tiff_in_another_mode_are_those_that_pillow_shows(tmp_path, mode, within):
    smooth = np.add.outer(8 * np.arange(12), 4 * np.arange(17))[..., None] + np.arange(3) * 20
    picture = Image.fromarray(smooth.astype(np.uint8))
    if mode == "LAB":  # Pillow converts to it by colour profiles only
        profiles = [ImageCms.createProfile(name) for name in ("sRGB", "LAB")]
        other = ImageCms.profileToProfile(picture, *profiles, outputMode="LAB")
    else:
        other = picture.convert(mode)
    other.save(tmp_path / "color.tif")
    expected = picture if mode == "LAB" else other.convert("RGB")
    difference = read_color(tmp_path / "color.tif").astype(int) - np.asarray(expected)
    assert np.abs(difference).max() <= within


def test_of_two_images_in_a_tiff_none_is_chosen(tmp_path):
    pages = [Image.fromarray(MM), Image.fromarray(MM + 1)]
    pages[0].save(tmp_path / "depth.tif", save_all=True, append_images=pages[1:])
    with pytest.raises(InputError, match=r"depth.tif holds 2 images; try a file with one of them"):
        read_depth(tmp_path / "depth.tif")


@pytest.mark.parametrize("values", [METRES[..., None], METRES[None]])
def test_an_axis_of_one_channel_is_dropped(tmp_path, values):
    np.save(tmp_path / "depth.npy", values)
    np.testing.assert_array_equal(read_depth(tmp_path / "depth.npy").z_m, METRES)


def test_half_precision_is_converted_before_any_arithmetic(tmp_path):
    millimetres = np.full((4, 4), 2050.0, np.float16)
    np.save(tmp_path / "depth.npy", millimetres)
    np.testing.assert_array_equal(read_depth(tmp_path / "depth.npy", 1000.0).z_m, np.float32(2.05))
