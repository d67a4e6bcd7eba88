"""Tables of points as other programs write them: separators, decimal commas, titles, orders of columns."""

import csv
import logging

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.clouds import read_cloud

RNG = np.random.default_rng(5)
COUNT = 200
POINTS = np.round(RNG.uniform(-4.0, 4.0, (COUNT, 3)), 3)
COLORS = RNG.integers(0, 256, (COUNT, 3))
NORMALS = RNG.normal(size=(COUNT, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
INTENSITY = RNG.integers(0, 256, (COUNT, 1))
PHOTO = np.clip(INTENSITY + RNG.integers(-9, 10, (COUNT, 3)), 0, 255)
"""Colours as in a photograph, whose channels are alike."""
LIGHT = RNG.integers(0, 256, (COUNT, 1))
TIME = 1000.0 + 0.0025 * np.arange(COUNT)[:, None]


def comma(value: float) -> str:
    return f"{value:.4f}".replace(".", ",")


def rows_of(*columns: np.ndarray) -> np.ndarray:
    return np.hstack(columns)


def write_csv(path, rows, titles=None, word=str, **dialect):
    with path.open("w", newline="", encoding=dialect.pop("encoding", "utf-8")) as file:
        writer = csv.writer(file, **dialect)
        if titles:
            writer.writerow(titles)
        writer.writerows([[word(value) for value in row] for row in rows])


def notes(caplog) -> str:
    return "\n".join(record.getMessage() for record in caplog.records)


@pytest.fixture
def said(caplog):
    caplog.set_level(logging.WARNING)
    return caplog


@pytest.mark.parametrize("delimiter", [";", "\t", " ", "|"])
@pytest.mark.parametrize("titles", [None, ["X", "Y", "Z"]])
def test_decimal_commas_are_read_and_said(tmp_path, said, delimiter, titles):
    write_csv(tmp_path / "a.csv", POINTS, titles, comma, delimiter=delimiter)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, POINTS)
    assert "commas are decimal marks" in notes(said)


def test_quoted_decimal_commas_may_have_commas_between_them(tmp_path):
    write_csv(tmp_path / "a.csv", POINTS, ["X", "Y", "Z"], comma, quoting=csv.QUOTE_ALL)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, POINTS)


def test_unquoted_commas_that_are_both_are_in_doubt(tmp_path):
    (tmp_path / "a.csv").write_text("".join(",".join(map(comma, row)) + "\n" for row in POINTS))
    with pytest.raises(InputError, match="decimal marks as well as separators; try to export"):
        read_cloud(tmp_path / "a.csv")


def test_marks_of_thousands_are_no_decimal_marks(tmp_path):
    far = POINTS + np.array([5e5, 4.65e6, 1200.0])
    write_csv(tmp_path / "a.csv", far, word=lambda value: f"{value:,.3f}", delimiter=";")
    np.testing.assert_allclose(read_cloud(tmp_path / "a.csv").points_m, far, atol=1e-9)

    def german(value):
        return f"{value:,.3f}".translate(str.maketrans(",.", ".,"))

    write_csv(tmp_path / "b.csv", far, word=german, delimiter=";")
    np.testing.assert_allclose(read_cloud(tmp_path / "b.csv").points_m, far, atol=1e-9)
    for mark in ("'", "\u2019", "\u00a0", "\u202f"):
        write_csv(tmp_path / "c.csv", far, word=lambda v, m=mark: f"{v:,.3f}".replace(",", m), delimiter=";")
        np.testing.assert_allclose(read_cloud(tmp_path / "c.csv").points_m, far, atol=1e-9)


def test_commas_before_three_digits_beside_whole_numbers_are_in_doubt(tmp_path):
    (tmp_path / "a.csv").write_text("1,234;12;3,456\n7,891;13;2,345\n")
    with pytest.raises(InputError, match="may be decimal marks or mark thousands, as in 1,234; try"):
        read_cloud(tmp_path / "a.csv")


TITLES = {
    "time first": (["GPS Time [s]", "X [m]", "Y [m]", "Z [m]"], (TIME, POINTS)),
    "quotes": (['"Time"', '"X"', '"Y"', '"Z"'], (TIME, POINTS)),
    "survey": (["id", "Easting", "Northing", "Elevation"], (np.arange(COUNT)[:, None], POINTS)),
    "velodyne": (["intensity", "Points:0", "Points:1", "Points:2"], (INTENSITY, POINTS)),
    "units by slash": (["t", "x/m", "y/m", "z/m"], (TIME, POINTS)),
    "units by underscore": (["t", "x_m", "y_m", "z_m"], (TIME, POINTS)),
}


@pytest.mark.parametrize("case", TITLES)
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_titles_name_the_columns_and_it_is_said(tmp_path, said, case, delimiter):
    titles, columns = TITLES[case]
    write_csv(tmp_path / "a.csv", rows_of(*columns), titles, delimiter=delimiter)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, POINTS)
    assert "x, y, z are columns 2 to 4" in notes(said)
    assert "column 1 (" in notes(said)


def test_the_note_names_every_column(tmp_path, said):
    titles = ["GPS Time [s]", "X [m]", "Y [m]", "Z [m]"]
    write_csv(tmp_path / "a.csv", rows_of(TIME, POINTS), titles)
    read_cloud(tmp_path / "a.csv")
    sentence = "x, y, z are columns 2 to 4 (X [m], Y [m], Z [m]); column 1 (GPS Time [s]) is not used"
    assert f"{tmp_path / 'a.csv'}: {sentence}" in notes(said)


@pytest.mark.parametrize("titles", ["X [m] Y [m] Z [m]", "x, y, z", "X;Y;Z", "//X Y Z", "# x y z"])
def test_titles_may_be_separated_otherwise_than_numbers(tmp_path, titles):
    np.savetxt(tmp_path / "a.txt", POINTS[:, [2, 0, 1]], "%.3f", header="z x y", comments="# ")
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.txt").points_m, POINTS)
    np.savetxt(tmp_path / "b.txt", POINTS, "%.3f", header=titles, comments="")
    np.testing.assert_array_equal(read_cloud(tmp_path / "b.txt").points_m, POINTS)


def test_the_titles_of_cloudcompare_are_a_comment_before_the_count(tmp_path):
    table = rows_of(POINTS, COLORS, LIGHT, NORMALS)
    head = f"//X Y Z R G B Intensity Nx Ny Nz\n{COUNT}\n"
    body = "".join(" ".join(f"{value:.8f}" for value in row) + "\n" for row in table)
    (tmp_path / "a.asc").write_text(head + body)
    cloud = read_cloud(tmp_path / "a.asc")
    np.testing.assert_array_equal(cloud.points_m, POINTS)
    np.testing.assert_array_equal(cloud.colors, COLORS)
    np.testing.assert_allclose(cloud.normals, NORMALS, atol=1e-8)


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("ft", 0.3048), ("in", 0.0254)])
@pytest.mark.parametrize("form", ["X [{}]", "x_{}", "X ({})"])
def test_a_unit_in_the_titles_is_heeded_and_said(tmp_path, said, unit, metres, form):
    titles = [form.format(unit).replace("X", axis.upper()).replace("x_", f"{axis}_") for axis in "xyz"]
    write_csv(tmp_path / "a.csv", POINTS / metres, titles)
    np.testing.assert_allclose(read_cloud(tmp_path / "a.csv").points_m, POINTS, rtol=1e-12)
    assert f"a unit is {metres:g} m; x, y, z are converted to metres" in notes(said)
    raw = read_cloud(tmp_path / "a.csv", header_unit=False).points_m
    np.testing.assert_allclose(raw, POINTS / metres, rtol=1e-12)


def test_an_intensity_is_told_from_colours_that_are_alike(tmp_path, said):
    for name, columns in (("i", (POINTS, LIGHT, PHOTO)), ("j", (POINTS, PHOTO, LIGHT))):
        np.savetxt(tmp_path / f"{name}.txt", rows_of(*columns), "%g")
        np.testing.assert_array_equal(read_cloud(tmp_path / f"{name}.txt").colors, PHOTO)
    assert "the colours are columns 5 to 7; column 4 is not used" in notes(said)
    assert "the colours are columns 4 to 6; column 7 is not used" in notes(said)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ((TIME, POINTS), "column 1 rises.*--columns _,x,y,z or --columns x,y,z,_"),
        ((RNG.permutation(1.7e9 + TIME), POINTS), "too large for a position"),
        ((RNG.integers(0, 32, (COUNT, 1)), POINTS), "whole numbers like a row or ring"),
        ((RNG.integers(0, 32, (COUNT, 2)), POINTS, COLORS), "--columns _,_,x,y,z,_,_,_"),
        ((POINTS, LIGHT, COLORS), "may be colours; try --columns x,y,z,r,g,b,_ or --columns x,y,z,_,r,g,b"),
    ],
)
def test_columns_in_doubt_are_one_sentence_and_the_option_settles_it(tmp_path, columns, says):
    table = rows_of(*columns)
    np.savetxt(tmp_path / "a.txt", table, "%.17g")
    np.save(tmp_path / "a.npy", table)
    for name in ("a.txt", "a.npy"):
        with pytest.raises(InputError, match=says) as caught:
            read_cloud(tmp_path / name)
        right = next(k for k in range(3) if np.array_equal(table[:, k : k + 3], POINTS))
        named = ",".join([*"_" * right, "x", "y", "z", *"_" * (table.shape[1] - right - 3)])
        if "colours" not in says:
            assert f"--columns {named} " in f"{caught.value} "
        np.testing.assert_array_equal(read_cloud(tmp_path / name, named).points_m, POINTS)


def test_given_columns_come_before_titles_and_guesses(tmp_path, said):
    write_csv(tmp_path / "a.csv", rows_of(POINTS, COLORS, NORMALS), list("abcdefghi"))
    with pytest.raises(InputError, match=r"no x, y, z among the titles .*a, b, c, d.*; try --columns"):
        read_cloud(tmp_path / "a.csv")
    cloud = read_cloud(tmp_path / "a.csv", "z,x,y,_,r,g,nx,ny,nz".replace("_,r,g", "r,g,b"))
    np.testing.assert_array_equal(cloud.points_m, POINTS[:, [1, 2, 0]])
    np.testing.assert_array_equal(cloud.colors, COLORS)
    np.testing.assert_allclose(cloud.normals, NORMALS)
    assert not notes(said)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ("x,y,q", "name 'q', which is none of x, y, z"),
        ("x,y,x", "name x twice"),
        ("x,y,_", "do not name all of x, y, z"),
        ("x,y,z,r,g,_", "do not name all of red, green, blue"),
        ("x,y,z,_,_,_,_", "has 6 columns, and --columns names 7"),
    ],
)
def test_given_columns_that_cannot_be_are_one_sentence(tmp_path, columns, says):
    np.savetxt(tmp_path / "a.txt", rows_of(POINTS, NORMALS))
    with pytest.raises(InputError, match=f"{says}.*; try"):
        read_cloud(tmp_path / "a.txt", columns)


def test_columns_of_a_file_that_names_them_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", points=POINTS)
    with pytest.raises(InputError, match="names its columns itself; try it without --columns"):
        read_cloud(tmp_path / "a.npz", "x,y,z")


REFUSED = {
    "latitude": (["lat", "lon", "alt"], "latitude and longitude .*; try to export it in metres"),
    "angles": (["X [deg]", "Y [deg]", "Z [m]"], "latitude and longitude"),
    "two x": (["x", "x", "y"], "two columns x, x and x; try --columns"),
    "two units": (["x_mm", "y_m", "z_m"], "different units"),
    "a title too few": (["x", "y"], "2 titles .* above 3 columns; try --columns"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_titles_in_doubt_are_one_sentence(tmp_path, case):
    titles, says = REFUSED[case]
    write_csv(tmp_path / "a.csv", POINTS, titles)
    with pytest.raises(InputError, match=says):
        read_cloud(tmp_path / "a.csv")


def test_degrees_without_titles_are_refused_until_the_option_says_metres(tmp_path):
    degrees = POINTS * [1e-5, 1e-5, 1.0] + [48.137, 11.575, 519.0]
    np.savetxt(tmp_path / "a.xyz", degrees, "%.9f")
    with pytest.raises(InputError, match=r"look like latitude and longitude.* --columns x,y,z if"):
        read_cloud(tmp_path / "a.xyz")
    assert len(read_cloud(tmp_path / "a.xyz", "x,y,z")) == COUNT


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_other_encodings_are_read(tmp_path, encoding):
    titles = ["X", "Y", "Z", "Größe"]
    write_csv(tmp_path / "a.csv", rows_of(POINTS, LIGHT), titles, delimiter=";", encoding=encoding)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, POINTS)


def test_words_and_empty_cells_do_not_shift_columns(tmp_path):
    table = [[f"p{k}", *row, ""] for k, row in enumerate(POINTS)]
    table[7][2] = ""
    write_csv(tmp_path / "a.csv", table, ["name", "x", "y", "z", "remark"])
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, np.delete(POINTS, 7, axis=0))


def test_pts_may_have_several_scans_with_a_count_each(tmp_path, said):
    scan = "".join(" ".join(f"{v:g}" for v in row) + "\n" for row in rows_of(POINTS, LIGHT, COLORS))
    (tmp_path / "a.pts").write_text(f"{COUNT}\n{scan}{COUNT}\n{scan}")
    cloud = read_cloud(tmp_path / "a.pts")
    np.testing.assert_array_equal(cloud.points_m, np.vstack([POINTS, POINTS]))
    np.testing.assert_array_equal(cloud.colors[COUNT:], COLORS)
    assert not notes(said)
    (tmp_path / "b.pts").write_text(f"{COUNT - 1}\n{scan}")
    with pytest.raises(InputError, match="more lines of numbers than its first line counts"):
        read_cloud(tmp_path / "b.pts")
    (tmp_path / "c.txt").write_text(f"{COUNT + 1}\n{scan}")
    with pytest.raises(InputError, match="ends after 200 of its 201 points"):
        read_cloud(tmp_path / "c.txt")


@pytest.mark.parametrize(
    "columns", [(POINTS,), (POINTS, NORMALS), (POINTS, COLORS), (POINTS, COLORS, NORMALS)]
)
def test_what_is_plain_is_not_said(tmp_path, said, columns):
    np.savetxt(tmp_path / "a.xyz", rows_of(*columns), "%.9f")
    np.save(tmp_path / "a.npy", rows_of(*columns))
    for name in ("a.xyz", "a.npy"):
        np.testing.assert_allclose(read_cloud(tmp_path / name).points_m, POINTS, atol=1e-9)
    assert not notes(said)


def test_colours_of_sixteen_bits_and_of_shares_are_colours(tmp_path):
    np.savetxt(tmp_path / "a.csv", rows_of(POINTS, 256 * COLORS), delimiter=",", header="x,y,z,r,g,b")
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").colors, COLORS)
    np.savetxt(tmp_path / "b.txt", rows_of(POINTS, COLORS / 255.0), header="X Y Z Rf Gf Bf", comments="//")
    np.testing.assert_array_equal(read_cloud(tmp_path / "b.txt").colors, COLORS)


SWEEP = rows_of(POINTS, INTENSITY, RNG.integers(0, 32, (COUNT, 1))).astype("<f4")


def test_sweeps_of_nuscenes_are_told_from_those_of_kitti_by_their_ring(tmp_path, said):
    kitti = rows_of(POINTS, RNG.uniform(0, 1, (COUNT, 1))).astype("<f4")
    for name, sweep in (("a.bin", SWEEP), ("LIDAR_TOP__1.pcd.bin", SWEEP), ("000001.bin", kitti)):
        sweep.tofile(tmp_path / name)  # 200 rows of 16 or 20 bytes are divisible by both
        np.testing.assert_allclose(read_cloud(tmp_path / name).points_m, POINTS, atol=1e-6)
    assert notes(said).count("columns 4 and 5 (intensity, ring index) are not used") == 2


def test_a_sweep_in_doubt_needs_its_columns(tmp_path):
    odd = rows_of(POINTS, 1000.0 * LIGHT, POINTS[:, :1]).astype("<f4")
    odd.tofile(tmp_path / "a.bin")
    with pytest.raises(InputError, match=r"four numbers a point, as in KITTI, or five.*--columns x,y,z,i,_"):
        read_cloud(tmp_path / "a.bin")
    np.testing.assert_allclose(read_cloud(tmp_path / "a.bin", "x,y,z,i,_").points_m, POINTS, atol=1e-6)
    with pytest.raises(InputError, match="no rows of 3 4-byte numbers"):
        read_cloud(tmp_path / "a.bin", "x,y,z")


@pytest.mark.parametrize("titles", [None, ["x", "y", "z"], ["x", "y", "z", ""]])
def test_a_separator_at_the_end_of_each_line_is_no_column(tmp_path, said, titles):
    write_csv(tmp_path / "a.csv", [[*row, ""] for row in POINTS], titles, delimiter=";")
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.csv").points_m, POINTS)


def test_lines_of_different_lengths_are_read_by_given_columns(tmp_path):
    """As COLMAP's points3D.txt, with a track of any length after each point."""
    lines = [
        " ".join(map(str, [k, *point, *color, 0.5, *range(2 * (k % 5))]))
        for k, (point, color) in enumerate(zip(POINTS, COLORS, strict=True))
    ]
    (tmp_path / "points3D.txt").write_text("# 3D point list\n" + "\n".join(lines) + "\n")
    with pytest.raises(InputError, match="has a line that is not 8 numbers; try to export it again"):
        read_cloud(tmp_path / "points3D.txt")
    cloud = read_cloud(tmp_path / "points3D.txt", "_,x,y,z,r,g,b")
    np.testing.assert_array_equal(cloud.points_m, POINTS)
    np.testing.assert_array_equal(cloud.colors, COLORS)


def test_a_grid_of_heights_is_no_list_of_points(tmp_path):
    head = "ncols 4\nnrows 50\nxllcorner 0.0\nyllcorner 0.0\ncellsize 1.0\n"
    np.savetxt(tmp_path / "a.asc", POINTS[:, :1].reshape(50, 4), header=head.strip(), comments="")
    with pytest.raises(InputError, match="grid of heights and no list of points; try"):
        read_cloud(tmp_path / "a.asc")


def test_an_alpha_after_the_colours_is_no_colour(tmp_path):
    np.savetxt(tmp_path / "a.txt", rows_of(POINTS, COLORS, np.full((COUNT, 1), 255)), "%g")
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.txt").colors, COLORS)
