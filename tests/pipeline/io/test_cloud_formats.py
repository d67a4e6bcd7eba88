"""PCD, text and NumPy clouds: other people's come back as they were meant, bad ones get a sentence."""

import io
import zipfile

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.clouds import read_cloud
from pipeline.kernels.open3d_runtime import o3d

RNG = np.random.default_rng(11)
POINTS = RNG.normal(size=(40, 3)).astype(np.float32).astype(np.float64)
NORMALS = RNG.normal(size=(40, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLORS = RNG.integers(0, 256, (40, 3), dtype=np.uint8)


@pytest.mark.parametrize("ascii_text", [True, False])
def test_a_pcd_of_open3d_is_read(tmp_path, ascii_text):
    other = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    other.normals = o3d.utility.Vector3dVector(NORMALS)
    other.colors = o3d.utility.Vector3dVector(COLORS / 255.0)
    o3d.io.write_point_cloud(str(tmp_path / "cloud.pcd"), other, write_ascii=ascii_text)
    again = read_cloud(tmp_path / "cloud.pcd")
    np.testing.assert_allclose(again.points_m, POINTS, atol=1e-6)
    np.testing.assert_allclose(again.normals, NORMALS, atol=1e-6)
    if not ascii_text:  # a packed colour printed as a decimal float loses its last bits
        np.testing.assert_array_equal(again.colors, COLORS)


def test_a_pcd_with_padding_whole_number_colours_and_no_points_line_is_read(tmp_path):
    header = "# .PCD v0.5\nVERSION 0.5\nFIELDS x y z _ rgba _\nSIZE 4 4 4 1 4 2\nTYPE F F F U U I\n"
    header += "COUNT 1 1 1 4 1 1\nWIDTH 20\nHEIGHT 2\nDATA binary\n"
    layout = [("p", "<f4", 3), ("pad", "u1", 4), ("bgra", "u1", 4), ("pad2", "<i2")]
    table = np.zeros(40, layout)
    table["p"], table["bgra"][:, :3] = POINTS, COLORS[:, ::-1]
    (tmp_path / "cloud.pcd").write_bytes(header.encode() + table.tobytes())
    again = read_cloud(tmp_path / "cloud.pcd")
    np.testing.assert_array_equal(again.points_m, POINTS)
    np.testing.assert_array_equal(again.colors, COLORS)
    assert again.normals is None


def lines(*columns: np.ndarray, separator: str = " ") -> str:
    rows = np.concatenate(columns, axis=1)
    return "\n".join(separator.join(format(value, ".17g") for value in row) for row in rows) + "\n"


@pytest.mark.parametrize("separator", [" ", ",", ", ", ";", "\t"])
@pytest.mark.parametrize("columns", ["p", "pn", "pc", "pnc", "pcn"])
def test_text_is_read_whatever_separates_it(tmp_path, separator, columns):
    arrays = {"p": POINTS, "n": NORMALS, "c": COLORS}
    (tmp_path / "a.xyz").write_text("# by hand\n\n" + lines(*map(arrays.get, columns), separator=separator))
    again = read_cloud(tmp_path / "a.xyz")
    np.testing.assert_array_equal(again.points_m, POINTS)
    for name, expected, letter in (("normals", NORMALS, "n"), ("colors", COLORS, "c")):
        if letter in columns:
            np.testing.assert_array_equal(getattr(again, name), expected)
        else:
            assert getattr(again, name) is None


def test_a_first_line_of_words_names_the_columns(tmp_path):
    text = "R,G,B,Intensity,Z,Y,X\n" + lines(COLORS, POINTS[:, :1], POINTS[:, ::-1], separator=",")
    (tmp_path / "a.csv").write_text(text)
    again = read_cloud(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.points_m, POINTS)
    np.testing.assert_array_equal(again.colors, COLORS)


def test_a_fourth_column_is_no_colour(tmp_path):
    (tmp_path / "a.xyz").write_text(lines(POINTS, COLORS[:, :1]))
    again = read_cloud(tmp_path / "a.xyz")
    assert again.colors is None
    np.testing.assert_array_equal(again.points_m, POINTS)


@pytest.mark.parametrize("scale", [1, 1 / 255])
def test_arrays_are_read_with_their_colours(tmp_path, scale):
    np.savez(
        tmp_path / "a.npz", points=POINTS, colors=COLORS * scale if scale < 1 else COLORS, normals=NORMALS
    )
    again = read_cloud(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.points_m, POINTS)
    np.testing.assert_array_equal(again.colors, COLORS)
    np.testing.assert_array_equal(again.normals, NORMALS)


def npz(**arrays) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def pcd(data: str, body: bytes, points: object = 9, fields: str = "x y z") -> bytes:
    width = len(fields.split())
    sizes, types = " ".join(["4"] * width), " ".join(["F"] * width)
    header = f"VERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nPOINTS {points}\nDATA {data}\n"
    return header.encode() + body


BAD = {
    "truncated.pcd": (pcd("binary", bytes(60)), "after 5 of its 9 points"),
    "missing_lines.pcd": (pcd("ascii", b"1 2 3\n"), "after 1 of its 9 points"),
    "short_lines.pcd": (pcd("ascii", b"1 2 3\n4 5\n", 2), "not 3 numbers"),
    "huge.pcd": (pcd("binary", b"", 10**9), "more than the 20 million"),
    "negative.pcd": (pcd("binary", b"", -3), "unusual PCD header"),
    "words.pcd": (pcd("binary", b"", "many"), "unusual PCD header"),
    "flat.pcd": (pcd("binary", bytes(99), 2, "x y"), "no x, y, z"),
    "no_data.pcd": (b"VERSION 0.7\nFIELDS x y z\n", "not a PCD file"),
    "hello.xyz": (b"hello world\n", "no lines of three numbers"),
    "two.xyz": (b"1 2\n3 4\n", "no lines of three numbers"),
    "ragged.xyz": (b"1 2 3\n4 5 6\n7 8\n", "not 3 numbers"),
    "binary.xyz": (b"\xff\xfe\x80\x00" * 9, "not a text file"),
    "all_nan.xyz": (b"nan nan nan\n" * 4, "no point with finite"),
    "names_only.csv": (b"x,y,z\n", "no lines of three numbers"),
    "no_position.csv": (b"a,b,c\n1,2,3\n", "no x, y, z"),
    "text.npz": (b"hello", "truncated or damaged archive"),
    "truncated.npz": (npz(points=POINTS)[:300], "truncated or damaged archive"),
    "objects.npz": (npz(points=np.array([{}, None, print])), "holds more than numbers"),
    "other.npz": (npz(xyz=POINTS), "no array 'points'"),
    "flat.npz": (npz(points=POINTS[:, :2]), "try 40 x 3 numbers"),
    "words.npz": (npz(points=np.full((4, 3), "a")), "try 4 x 3 numbers"),
    "short_colors.npz": (npz(points=POINTS, colors=COLORS[:5]), "array 'colors'"),
    "cloud.dxf": (b"SECTION", "of a kind that is not read"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_cloud_gets_its_sentence(tmp_path, name):
    content, says = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says) as error:
        read_cloud(tmp_path / name)
    text = str(error.value)
    assert name in text
    assert "\n" not in text
    assert "; try " in text


def test_an_archive_that_unpacks_to_too_much_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.io.cloud_npz.MAX_UNPACKED_BYTES", 100_000)
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", bytes(1_000_000))
    assert (tmp_path / "bomb.npz").stat().st_size < 10_000
    with pytest.raises(InputError, match=r"unpacks to more than 0\.1 MB"):
        read_cloud(tmp_path / "bomb.npz")
