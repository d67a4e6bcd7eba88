"""Clouds of other programs: names of fields, headers, units of LAS files, widths of sweeps, degrees."""

import logging
import tracemalloc

import laspy
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.cloud_ply import parse_ply
from pipeline.io.clouds import read_cloud

RNG = np.random.default_rng(3)
POINTS = RNG.uniform(0.0, 4.0, (600, 3)).astype(np.float32).astype(np.float64)
COLORS = RNG.integers(0, 256, (600, 3)).astype(np.uint8)
NORMALS = np.tile([0.0, 0.6, 0.8], (600, 1))
US_FOOT_M = 1200.0 / 3937.0


def ply(fields, newline=b"\n", before="", rows_before=b""):
    """A binary PLY of (name, NumPy type, column), with an element before the vertices."""
    words = {"f4": "float", "u1": "uchar"}
    table = np.empty(600, [(name, kind) for name, kind, _ in fields])
    for name, _, column in fields:
        table[name] = column
    header = f"ply\nformat binary_little_endian 1.0\n{before}element vertex 600\n"
    header += "".join(f"property {words[kind]} {name}\n" for name, kind, _ in fields) + "end_header\n"
    return header.encode().replace(b"\n", newline) + rows_before + table.tobytes()


def columns(names, kind, rows):
    return [(name, kind, rows[:, k]) for k, name in enumerate(names)]


@pytest.mark.parametrize("position", [("x", "y", "z"), ("X", "Y", "Z")])
@pytest.mark.parametrize("normal", [("n_x", "n_y", "n_z"), ("normal_x", "normal_y", "normal_z")])
@pytest.mark.parametrize("color", [("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b")])
def test_fields_have_many_names(tmp_path, position, normal, color):
    fields = columns(position, "f4", POINTS) + columns(normal, "f4", NORMALS) + columns(color, "u1", COLORS)
    (tmp_path / "a.ply").write_bytes(ply(fields))
    cloud = read_cloud(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.points_m, POINTS)
    np.testing.assert_array_equal(cloud.colors, COLORS)
    np.testing.assert_allclose(cloud.normals, NORMALS, atol=1e-7)


def test_splats_have_their_mean_colours(tmp_path, caplog):
    """A splat's colour is 0.5 + C0 f_dc, where C0 = 0.28209479 is the constant spherical harmonic."""
    coefficients = (COLORS / 255.0 - 0.5) / 0.28209479
    names = ("f_dc_0", "f_dc_1", "f_dc_2")
    (tmp_path / "a.ply").write_bytes(ply(columns("xyz", "f4", POINTS) + columns(names, "f4", coefficients)))
    caplog.set_level(logging.WARNING)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ply").colors, COLORS)
    assert "mean colours of Gaussian splats" in caplog.text


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("comment", [0, 20_000])
def test_headers_end_their_lines_as_they_like_and_may_be_long(tmp_path, newline, comment):
    before = f"comment {'a' * comment}\nelement camera 2\nproperty float f\nproperty uchar k\n"
    data = ply(columns("xyz", "f4", POINTS), newline, before, b"\n" * 10)
    (tmp_path / "a.ply").write_bytes(data)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ply").points_m, POINTS)


def with_a_camera(rows, count=2, cameras=1):
    """A text PLY with one row of a camera before its vertices."""
    header = f"ply\nformat ascii 1.0\nelement camera {cameras}\nproperty float f\nelement vertex {count}\n"
    header += "property float x\nproperty float y\nproperty float z\nend_header\n"
    return header + "".join(f"{row}\n" for row in ("9", *rows))


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_rows_before_the_vertices_of_a_text_are_skipped(tmp_path, newline):
    text = with_a_camera(("1 2 3", "4 5 6")).replace("\n", newline)
    (tmp_path / "a.ply").write_bytes(text.encode())
    assert read_cloud(tmp_path / "a.ply").points_m.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]


def test_rows_before_the_vertices_of_a_text_are_not_collected():
    """A list of the lines would have 20 times the text's size."""
    text = with_a_camera((*["9"] * 20_000, "1 2 3"), count=1, cameras=20_001).encode()
    tracemalloc.start()
    try:
        assert parse_ply("a.ply", text).tolist() == [(1.0, 2.0, 3.0)]
        assert tracemalloc.get_traced_memory()[1] < 10 * len(text)
    finally:
        tracemalloc.stop()


def test_more_rows_before_the_vertices_than_the_text_has_leave_no_vertex(tmp_path):
    (tmp_path / "a.ply").write_text(with_a_camera(("1 2 3",), count=1, cameras=10**30).rstrip())
    with pytest.raises(InputError, match="ends after 0 of its 1 points"):
        read_cloud(tmp_path / "a.ply")


@pytest.mark.parametrize(("rows", "there"), [((), 0), (("1 2 3",), 1)])
def test_a_text_that_ends_early_counts_its_vertices_only(tmp_path, rows, there):
    (tmp_path / "a.ply").write_text(with_a_camera(rows, count=100))
    with pytest.raises(InputError, match=f"ends after {there} of its 100 points"):
        read_cloud(tmp_path / "a.ply")


def test_a_negative_number_of_rows_before_the_vertices_is_refused(tmp_path):
    (tmp_path / "a.ply").write_text(with_a_camera(("1 2 3", "4 5 6"), cameras=-1))
    with pytest.raises(InputError, match="unusual PLY header"):
        read_cloud(tmp_path / "a.ply")


def test_a_list_among_the_vertices_is_named(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
    header += "property list uchar int near\nend_header\n"
    (tmp_path / "a.ply").write_text(header + "1 1 2\n")
    with pytest.raises(InputError, match=r"element vertex of .* has the list near"):
        read_cloud(tmp_path / "a.ply")


SYSTEMS = {
    "feet": (
        'PROJCS["p",GEOGCS["g",DATUM["d",SPHEROID["s",6378137,298.257]],UNIT["degree",0.0174532925]],'
        'PARAMETER["false_easting",6561666.667],UNIT["US survey foot",0.304800609601219],AXIS["X",EAST]]',
        (US_FOOT_M, US_FOOT_M, US_FOOT_M),
    ),
    "feet_and_metres": (
        'COMPD_CS["c",PROJCS["p",GEOGCS["g",UNIT["degree",0.0174532925]],UNIT["foot",0.3048]],'
        'VERT_CS["v",VERT_DATUM["d",2005],UNIT["metre",1],AXIS["Up",UP]]]',
        (0.3048, 0.3048, 1.0),
    ),
    "second_edition": (
        'PROJCRS["p",BASEGEOGCRS["g",DATUM["d",ELLIPSOID["e",6378137,298.2,LENGTHUNIT["metre",1]]]],'
        'CS[Cartesian,2],AXIS["x",east,LENGTHUNIT["foot",0.3048]],AXIS["y",north,LENGTHUNIT["foot",0.3048]]]',
        (0.3048, 0.3048, 0.3048),
    ),
    "metres": ('PROJCS["p",GEOGCS["g",UNIT["degree",0.0174532925]],UNIT["metre",1]]', (1.0, 1.0, 1.0)),
}


def las(path, points, record):
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales = np.full(3, 1e-4)
    header.vlrs.append(record)
    file = laspy.LasData(header)
    file.x, file.y, file.z = points.T
    file.write(str(path))


def wkt(text):
    record = laspy.vlrs.known.WktCoordinateSystemVlr()
    record.string = text
    return record


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_las_file_is_converted_from_the_unit_of_its_coordinate_system(tmp_path, caplog, name):
    text, metres = SYSTEMS[name]
    las(tmp_path / "a.las", POINTS / metres, wkt(text))
    caplog.set_level(logging.WARNING)
    cloud = read_cloud(tmp_path / "a.las")
    np.testing.assert_allclose(cloud.points_m, POINTS, atol=1e-4)
    assert cloud.colors is None  # format 7 has places for colours, and nobody filled them
    assert ("converted to metres" in caplog.text) == (metres != (1.0, 1.0, 1.0))
    given = read_cloud(tmp_path / "a.las", header_unit=False)
    np.testing.assert_allclose(given.points_m, POINTS / metres, atol=1e-4)


def test_degrees_of_a_las_file_are_refused_until_a_unit_is_given(tmp_path):
    las(
        tmp_path / "a.las",
        POINTS,
        wkt('GEOGCS["g",DATUM["d",SPHEROID["s",6378137,298]],UNIT["degree",0.01745]]'),
    )
    with pytest.raises(InputError, match=r"latitude and longitude in degrees.* --metres-per-unit if"):
        read_cloud(tmp_path / "a.las")
    assert len(read_cloud(tmp_path / "a.las", header_unit=False)) == 600


def test_degrees_in_a_ply_are_refused(tmp_path):
    degrees = POINTS * (1e-5, 1e-5, 10.0) + (1.5, 1.5, 0.0)
    (tmp_path / "a.ply").write_bytes(ply(columns("xyz", "f4", degrees)))
    with pytest.raises(InputError, match=r"look like latitude and longitude.* --metres-per-unit if"):
        read_cloud(tmp_path / "a.ply")
    assert len(read_cloud(tmp_path / "a.ply", header_unit=False)) == 600


@pytest.mark.parametrize("width", [3, 6])
def test_rows_of_another_width_are_no_sweep_and_columns_settle_it(tmp_path, width):
    rows = np.zeros((600, width), "<f4")
    rows[:, :3] = POINTS
    rows[:, 2] += 10.0
    rows[:, 3:] = RNG.random((600, width - 3))
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    with pytest.raises(InputError, match=r"no rows of x, y, z, reflectance.*--columns"):
        read_cloud(tmp_path / "a.bin")
    given = read_cloud(tmp_path / "a.bin", ",".join(["x", "y", "z", *"_" * (width - 3)]))
    np.testing.assert_array_equal(given.points_m, rows[:, :3])


def test_labels_are_no_positions(tmp_path):
    (tmp_path / "a.bin").write_bytes(RNG.integers(0, 260, 1000).astype("<u4").tobytes())
    with pytest.raises(InputError, match="are no positions"):
        read_cloud(tmp_path / "a.bin")


def test_an_array_may_name_its_fields_and_may_not_lie_on_its_side(tmp_path):
    named = np.zeros(600, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4")])
    for axis, name in enumerate("xyz"):
        named[name] = POINTS[:, axis]
    np.save(tmp_path / "a.npy", named)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.npy").points_m, POINTS)
    np.save(tmp_path / "b.npy", POINTS.T)
    with pytest.raises(InputError, match=r"3 rows of 600 numbers.*points\.T"):
        read_cloud(tmp_path / "b.npy")


LINES = {
    "fortran": "\n".join(" ".join(f"{v:.8e}".replace("e", "D") for v in row) for row in POINTS),
    "numpy": "[" + "\n".join(f"[{x:.8f}  {y:.8f}  {z:.8f}]" for x, y, z in POINTS) + "]",
    "python": "\n".join(f"({x:.8f}, {y:.8f}, {z:.8f})," for x, y, z in POINTS),
    "colmap": "# 3D point list\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
    + "\n".join(
        f"{k} {x:.8f} {y:.8f} {z:.8f} 1 2 3 0.5" + " 4 7" * (1 + k % 3) for k, (x, y, z) in enumerate(POINTS)
    ),
}


@pytest.mark.parametrize("name", LINES)
def test_texts_of_other_programs_are_read(tmp_path, name):
    (tmp_path / "a.txt").write_text(LINES[name])
    cloud = read_cloud(tmp_path / "a.txt")
    np.testing.assert_allclose(cloud.points_m, POINTS, atol=1e-7)
    if name == "colmap":
        assert (cloud.colors == [1, 2, 3]).all()


def test_doubt_about_columns_after_a_word_names_places_in_the_file(tmp_path):
    lines = [f"tree {k} {x:.6f} {y:.6f} {z:.6f}" for k, (x, y, z) in enumerate(POINTS)]
    (tmp_path / "a.txt").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"column 2 rises.*--columns _,_,x,y,z or --columns _,x,y,z,_,"):
        read_cloud(tmp_path / "a.txt")
    np.testing.assert_allclose(read_cloud(tmp_path / "a.txt", "_,_,x,y,z").points_m, POINTS, atol=1e-6)
