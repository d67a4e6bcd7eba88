"""Lengths, angles, areas and boxes whose values and variances are known."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.measuring import measures
from pipeline.measuring.lookup import lookup_of
from pipeline.measuring.marks import mark, mark_on_ray
from pipeline.measuring.planes import plane_at
from pipeline.measuring.propagation import Z95
from pipeline.measuring.surface import measured_cloud
from pipeline.types import PointCloud
from tests.pipeline.measuring.scenes import BOX_M, box_on_table, joined, measured, sheet

SIGMA_M = 0.002


def facing_walls(**other):
    """Two walls, x = 0 and x = 2, that face each other; the second is of node 1."""
    left = sheet(20, 20, 0.05, (0, 0, 0), (0, 1, 0), (0, 0, 1))
    right = sheet(20, 20, 0.05, (2, 0, 0), (0, 0, 1), (0, 1, 0))
    nodes = np.repeat([0, 1], len(left[0]))
    return measured(
        joined(left, right), SIGMA_M, nodes=nodes, **({"pose_covariances": np.zeros((2, 6, 6))} | other)
    )


def half(value):
    low, high = value.ci95
    assert value.value - low == pytest.approx(high - value.value)
    return high - value.value


def length(surface, a=(0.0, 0.5, 0.5), b=(2.0, 0.5, 0.5)):
    (value,) = measures.distance(surface, mark(surface, np.array(a)), mark(surface, np.array(b))).values
    return value


def test_a_length_along_the_noise_has_both_ends_variances():
    value = length(facing_walls())
    assert (value.name, value.unit, value.guessed) == ("length", "m", False)
    assert value.value == pytest.approx(2.0)
    assert half(value) == pytest.approx(Z95 * np.sqrt(2.0) * SIGMA_M, rel=1e-3)


def test_a_length_across_the_noise_has_none_of_it():
    assert half(length(facing_walls(), b=(0.0, 0.8, 0.5))) < 1e-6


def test_the_scale_makes_long_lengths_less_sure():
    surface = facing_walls(scale_sd=0.01)
    assert half(length(surface, b=(0.0, 0.8, 0.5))) == pytest.approx(Z95 * 0.3 * 0.01, rel=1e-3)
    both = np.hypot(np.sqrt(2.0) * SIGMA_M, 0.02)
    assert half(length(surface)) == pytest.approx(Z95 * both, rel=1e-3)


def test_the_pose_between_two_nodes_counts_once_and_within_a_node_not_at_all():
    motions = np.zeros((2, 6, 6))
    motions[1] = np.diag([0.0, 0.0, 0.01, 0.005, 0.0, 0.0]) ** 2
    surface = facing_walls(pose_covariances=motions)
    turned_m = 0.01 * 0.5  # a turn about the world's z moves the far end by y times the angle
    expected = np.sqrt(2.0 * SIGMA_M**2 + 0.005**2 + turned_m**2)
    assert half(length(surface)) == pytest.approx(Z95 * expected, rel=1e-3)
    assert half(length(surface, (2.0, 0.2, 0.5), (2.0, 0.8, 0.5))) < 1e-6


def test_95_of_100_intervals_hold_the_true_length():
    surface, rng, covered = facing_walls(), np.random.default_rng(7), 0
    rows = [
        np.argmin(np.linalg.norm(surface.vertices_m - end, axis=1)) for end in ([0, 0.5, 0.5], [2, 0.3, 0.2])
    ]
    ends = [mark(surface, surface.vertices_m[row], "vertex") for row in rows]
    true_m = float(np.linalg.norm(ends[0].point_m - ends[1].point_m))
    for _ in range(2000):
        noisy = [replace(end, point_m=end.point_m + rng.normal(0.0, SIGMA_M) * end.ray) for end in ends]
        low, high = measures.distance(surface, *noisy).values[0].ci95
        covered += low <= true_m <= high
    assert 0.935 <= covered / 2000 <= 0.965


def test_a_click_meets_the_first_surface_on_its_ray():
    surface = facing_walls()
    clicked = mark_on_ray(surface, np.array([1.0, 0.52, 0.47]), np.array([3.0, 0.0, 0.0]))
    assert clicked.point_m == pytest.approx([2.0, 0.52, 0.47], abs=1e-6)
    assert clicked.normal == pytest.approx([-1.0, 0.0, 0.0])
    assert clicked.node == 1
    with pytest.raises(InputError, match="no surface under the pointer"):
        mark_on_ray(surface, np.array([1.0, 0.5, 0.5]), np.array([0.0, 0.0, 1.0]))


def test_marks_snap_to_vertices_edges_and_planes():
    surface = measured(box_on_table())
    near_edge = np.array([0.104, 0.003, 0.148])
    assert mark(surface, near_edge, "vertex").point_m == pytest.approx([0.1, 0.0, 0.15], abs=1e-6)
    edge = mark(surface, near_edge, "edge")
    assert edge.point_m == pytest.approx([0.104, 0.0, 0.15], abs=1e-6)
    assert edge.covariance_m2 @ [1.0, 0.0, 0.0] == pytest.approx(0.0, abs=1e-12)
    assert mark(surface, np.array([0.1, 0.1, 0.16]), "plane").point_m == pytest.approx([0.1, 0.1, 0.15])
    with pytest.raises(InputError, match="No edge is near"):
        mark(surface, np.array([0.15, 0.1, 0.15]), "edge")


def worn_box():
    """The box whose vertices within 12 mm of two faces are rounded off by as much as 5 mm."""
    vertices_m, triangles, normals = box_on_table()
    center_m, half_m = 0.5 * np.array(BOX_M), 0.5 * np.array(BOX_M)
    off_m = vertices_m - center_m
    near = np.clip(1.0 - (half_m - np.abs(off_m)) / 0.012, 0.0, 1.0)
    near[:, 2] *= off_m[:, 2] > 0.0
    two = (np.sort(near, axis=1)[:, 1:2] > 0.0) & (vertices_m[:, 2:] > 0.0)
    return vertices_m - 0.005 * near * np.sign(off_m) * two, triangles, normals


def test_a_corner_is_where_three_planes_meet_however_worn_it_is():
    surface = measured(worn_box(), SIGMA_M)
    ends = [mark(surface, np.array([0.005, y_m, 0.148]), "vertex") for y_m in (0.006, BOX_M[1] - 0.006)]
    for end, y_m in zip(ends, (0.0, BOX_M[1]), strict=True):
        assert end.point_m == pytest.approx([0.0, y_m, BOX_M[2]], abs=1e-3)
        assert end.snapped == "vertex"
    (value,) = measures.distance(surface, *ends).values
    assert value.ci95[0] < BOX_M[1] < value.ci95[1]
    assert half(value) < 0.005


def test_a_corner_whose_third_face_was_not_seen_ends_its_edge():
    vertices_m, triangles, normals = box_on_table()
    hidden = (normals[:, 1] < -0.5) | ((normals[:, 2] > 0.5) & (vertices_m[:, 2] == 0.0))
    seen = ~hidden[triangles].any(axis=1)
    surface = measured((vertices_m, triangles[seen], normals), SIGMA_M)
    end = mark(surface, np.array([0.005, 0.006, 0.149]), "vertex")
    assert end.point_m[[0, 2]] == pytest.approx([0.0, BOX_M[2]], abs=1e-3)
    along_sd_m = np.sqrt(end.covariance_m2[1, 1])
    assert along_sd_m == pytest.approx(2.0 * lookup_of(surface).spacing_m / np.sqrt(12.0), rel=0.02)
    assert abs(end.point_m[1]) < 2.0 * along_sd_m
    far = mark(surface, np.array([0.15, 0.1, 0.15]), "vertex")
    assert far.point_m == pytest.approx([0.15, 0.1, 0.15])


@pytest.mark.parametrize("gap_m", [0.03, 0.04])
def test_a_wall_behind_a_box_makes_no_corner_of_it(gap_m):
    """The box's back was not seen; its top would meet the wall behind it in the air."""
    w, d, h = BOX_M
    x, y, z = np.eye(3)
    box = (
        sheet(30, 20, 0.01, (0, 0, h), x, y),
        sheet(20, 15, 0.01, (0, d, 0), -y, z),
        sheet(20, 15, 0.01, (w, 0, 0), y, z),
    )
    surface = measured(joined(*box, sheet(60, 40, 0.01, (-0.1, d + gap_m, 0.0), x, z)), SIGMA_M)
    end = mark(surface, np.array([0.003, d - 0.004, h]), "vertex")
    assert end.point_m[[0, 2]] == pytest.approx([0.0, h], abs=1e-3)
    assert abs(end.point_m[1] - d) < 2.0 * np.sqrt(end.covariance_m2[1, 1])
    with pytest.raises(InputError, match="No edge is near"):
        mark(surface, np.array([0.1, d - 0.004, h]), "edge")


def test_faces_of_a_thin_board_meet_nowhere():
    sheets = sheet(20, 20, 0.01), sheet(20, 20, 0.01, (0.2, 0.0, -0.01), (-1, 0, 0))
    board = measured(joined(*sheets), SIGMA_M)
    place_m = np.array([0.1, 0.1, 0.0])
    assert mark(board, place_m, "vertex").point_m == pytest.approx(place_m)
    with pytest.raises(InputError, match="No edge is near"):
        mark(board, place_m, "edge")


def test_points_of_unknown_noise_are_as_noisy_as_their_neighbours_show():
    """A merged cloud has no noise for inferred points."""
    vertices_m, _, normals = sheet(20, 20, 0.01)
    rough_m = 0.001
    vertices_m[:, 2] += np.random.default_rng(5).normal(0.0, rough_m, len(vertices_m))
    inferred = vertices_m[:, 0] > 0.105
    sigma_m = np.where(inferred, np.nan, SIGMA_M)
    cloud = PointCloud(vertices_m, normals=normals, sigma_m=sigma_m, source=inferred.astype(np.uint8))
    surface = measured_cloud(cloud)
    assert np.all(surface.sigma_m[~inferred] == SIGMA_M)
    assert np.median(surface.sigma_m[inferred]) == pytest.approx(rough_m, rel=0.25)
    assert plane_at(surface, np.array([0.1, 0.1, 0.0])).normal == pytest.approx([0.0, 0.0, 1.0], abs=0.02)


def test_what_several_nodes_saw_is_where_one_of_them_saw_it():
    """The second node may be shifted; along the surface, a mark of both is where either shows it."""
    shift_sd_m = 0.01
    motion = np.zeros((2, 6, 6))
    motion[1, 3:, 3:] = shift_sd_m**2 * np.eye(3)
    flat = sheet(20, 20, 0.05)
    surface = measured(flat, 0.0, nodes=np.full(len(flat[0]), -1), pose_covariances=motion)
    along = length(surface, (0.2, 0.5, 0.0), (0.7, 0.5, 0.0))
    assert half(along) == pytest.approx(Z95 * np.sqrt(2.0 * 0.25) * shift_sd_m, rel=1e-3)
    rng = np.random.default_rng(0)
    of_second = rng.integers(0, 2, (2, 100_000))
    moves_m = rng.normal(0.0, shift_sd_m, 100_000) * (of_second[0] - of_second[1])
    assert half(along) / Z95 == pytest.approx(np.std(moves_m), rel=0.02)


def test_heights_and_gaps_of_planes():
    surface = measured(box_on_table())
    table, top = (plane_at(surface, np.array(place)) for place in ([-0.2, -0.2, 0.0], [0.1, 0.1, 0.15]))
    (height,) = measures.point_to_plane(surface, mark(surface, np.array([0.1, 0.1, 0.15])), table).values
    assert height.value == pytest.approx(0.15)
    assert half(height) == pytest.approx(Z95 * 0.001, rel=0.01)
    (nothing,) = measures.point_to_plane(surface, mark(surface, np.array([0.4, 0.4, 0.0])), table).values
    assert (nothing.value, nothing.ci95[0]) == (pytest.approx(0.0, abs=1e-9), 0.0)
    assert nothing.ci95[1] == pytest.approx(Z95 * 0.001, rel=0.02)
    gap = measures.plane_to_plane(surface, table, top)
    assert gap.values[0].value == pytest.approx(0.15)
    assert np.ptp(gap.ends_m, axis=0) == pytest.approx([0.0, 0.0, 0.15])
    side = plane_at(surface, np.array([0.0, 0.1, 0.07]))
    with pytest.raises(InputError, match="not parallel: 90 degrees apart"):
        measures.plane_to_plane(surface, table, side)
    with pytest.raises(InputError, match="on one plane"):
        measures.plane_to_plane(surface, table, plane_at(surface, np.array([0.5, 0.4, 0.0])))


@pytest.mark.parametrize("inner_deg", [60.0, 90.0, 135.0])
def test_the_angle_of_two_planes_is_the_one_between_their_visible_sides(inner_deg):
    turn = np.radians(inner_deg)
    floor = sheet(20, 20, 0.05)
    wall = sheet(20, 20, 0.05, (0, 0, 0), (0, 1, 0), (np.cos(turn), 0.0, np.sin(turn)))
    surface = measured(joined(floor, wall))
    planes = [plane_at(surface, 0.5 * (mesh[0].min(axis=0) + mesh[0].max(axis=0))) for mesh in (floor, wall)]
    found = measures.angle_of_planes(surface, *planes)
    assert found.values[0].value == pytest.approx(inner_deg)
    assert found.ends_m[1] == pytest.approx([0.0, 0.5, 0.0], abs=1e-6)


def test_an_angle_of_three_points():
    surface = measured(sheet(20, 20, 0.05), rays=np.tile([1.0, 0.0, 0.0], (441, 1)))
    a, corner, b = (mark(surface, np.array(place)) for place in ([0.5, 0, 0], [0, 0, 0], [0.5, 0.5, 0]))
    (value,) = measures.angle(surface, a, corner, b).values
    assert value.value == pytest.approx(45.0, abs=1e-4)
    ends = [replace(end, covariance_m2=1e-6 * np.eye(3)) for end in (a, corner, b)]
    (value,) = measures.angle(surface, *ends).values
    by_paper = 0.001 * np.sqrt(
        1 / 0.5**2 + 1 / 0.5 + (1 / 0.5**2 + 1 / 0.5 - 2 / (0.5 * np.sqrt(0.5)) * np.cos(np.pi / 4))
    )
    assert half(value) == pytest.approx(Z95 * np.degrees(by_paper), rel=0.01)
    with pytest.raises(InputError, match="at its corner"):
        measures.angle(surface, a, a, b)


def test_three_faces_of_a_box_and_the_box_as_a_part():
    surface = measured(box_on_table(), scale_sd=0.001)
    places = ([0.1, 0.1, 0.15], [0.0, 0.1, 0.07], [0.1, 0.0, 0.07])
    faces = tuple(plane_at(surface, np.array(place)) for place in places)
    for found in (
        measures.box_of_planes(surface, faces),
        measures.box_of_part(surface, np.array([0.1, 0.1, 0.15])),
    ):
        assert [one.name for one in found.values] == ["width", "depth", "height"]
        for one, true_m in zip(found.values, BOX_M, strict=True):
            assert one.ci95[0] <= true_m <= one.ci95[1]
            assert one.value == pytest.approx(true_m, abs=0.012)
        assert found.ends_m.shape == (8, 3)
        assert np.ptp(found.ends_m, axis=0) == pytest.approx(BOX_M, abs=0.015)
    with pytest.raises(InputError, match="degrees apart, and faces of a box are square"):
        measures.box_of_planes(surface, (faces[0], faces[0], faces[1]))
    with pytest.raises(InputError, match="No level plane continues around"):
        measures.box_of_part(surface, np.array([-0.2, -0.2, 0.0]))


def corner(*inward):
    """Three 2 m planes at x = 0, y = 0 and z = 0, on a grid of 5 cm; normals point into the box or out."""
    x, y, z = np.eye(3)
    sides = zip(((y, z), (z, x), (x, y)), inward, strict=True)
    surface = measured(
        joined(
            *(sheet(40, 40, 0.05, x=a, y=b) if to else sheet(40, 40, 0.05, x=b, y=a) for (a, b), to in sides)
        )
    )
    return surface, tuple(plane_at(surface, 1.0 - axis) for axis in (x, y, z))


@pytest.mark.parametrize("inward", [True, False])
def test_a_corner_of_a_room_is_a_box_as_one_of_a_thing(inward):
    found = measures.box_of_planes(*corner(inward, inward, inward))
    for value in found.values:
        assert value.value == pytest.approx(2.0, abs=0.025)
        assert value.ci95[0] < 2.0 < value.ci95[1]
    assert found.ends_m.min(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    assert found.ends_m.max(axis=0) == pytest.approx(np.full(3, 2.0), abs=0.025)


@pytest.mark.parametrize("inward", [(True, True, False), (False, False, True)])
def test_planes_seen_from_both_sides_of_a_box_are_none(inward):
    with pytest.raises(InputError, match="some are seen from outside it, others from inside"):
        measures.box_of_planes(*corner(*inward))


def test_the_floor_in_front_of_a_small_box_is_no_face_of_it():
    """It has many more points than the two faces, which are seen from outside, and it is seen from inside."""
    x, y, z = np.eye(3)
    floor = sheet(40, 40, 0.05, (0.05, -2.05, 0.0), x, y)
    surface = measured(joined(floor, sheet(8, 8, 0.05, x=z, y=y), sheet(8, 8, 0.05, x=x, y=z)))
    places = ([1.0, -1.0, 0.0], [0.0, 0.2, 0.2], [0.2, 0.0, 0.2])
    planes = tuple(plane_at(surface, np.array(place)) for place in places)
    with pytest.raises(InputError, match="some are seen from outside it, others from inside"):
        measures.box_of_planes(surface, planes)


def test_the_area_of_a_hole():
    vertices_m, triangles, normals = sheet(20, 20, 0.05)
    middle_m = vertices_m[triangles].mean(axis=1)
    inside = np.all(np.abs(middle_m[:, :2] - 0.5) < 0.1, axis=1)
    surface = measured((vertices_m, triangles[~inside], normals))
    found = measures.hole_area(surface, np.array([0.5, 0.5, 0.0]))
    (area,) = found.values
    assert (area.value, area.unit) == (pytest.approx(0.04), "m2")
    assert area.ci95[0] < 0.04 < area.ci95[1]
    assert len(found.ends_m) == 16
    assert measures.hole_area(surface, np.array([0.41, 0.4, 0.0])).values[0].value == pytest.approx(0.04)
    with pytest.raises(InputError, match="No hole"):
        measures.hole_area(surface, np.array([0.1, 0.1, 0.0]))


def test_a_true_length_checks_and_sets_the_scale():
    surface = facing_walls(scale_sd=0.02)
    ends = [np.array([0.0, 0.5, 0.5]), np.array([2.0, 0.5, 0.5])]
    found = measures.distance(surface, *(mark(surface, end) for end in ends))
    scaled, check = measures.with_scale(surface, 2.05, found)
    own = np.sqrt(2.0) * SIGMA_M / 2.0
    weight = 0.02**2 / (0.02**2 + own**2)
    assert check.ratio == pytest.approx(1.025)
    assert check.factor == pytest.approx(1.025**weight)
    assert check.agrees
    assert not check.advice
    assert scaled.scale_sd == pytest.approx(own * np.sqrt(weight), rel=0.01)
    again = measures.distance(scaled, *(mark(scaled, check.factor * end) for end in ends))
    assert again.values[0].value == pytest.approx(2.0 * check.factor)
    assert measures.declared(again, 2.05).values[0].ci95 == (2.05, 2.05)
    with pytest.raises(InputError, match="try a positive one"):
        measures.with_scale(surface, 0.0, found)
    floor = plane_at(surface, np.array([0.0, 0.5, 0.5]))
    nothing = measures.point_to_plane(surface, mark(surface, np.array([0.0, 0.2, 0.2])), floor)
    with pytest.raises(InputError, match="mark a longer length"):
        measures.with_scale(surface, 0.1, nothing)


def test_a_true_length_outside_the_interval_counts_alone():
    surface = facing_walls(scale_sd=0.02)
    found = measures.Measure("distance", (length(surface),), np.zeros((2, 3)))
    scaled, check = measures.with_scale(surface, 2.5, found)
    assert not check.agrees
    assert "does not agree" in check.sentence
    assert check.factor == pytest.approx(1.25)
    assert scaled.scale_sd == pytest.approx(np.sqrt(2.0) * SIGMA_M / 2.0, rel=0.01)


def test_a_length_that_is_less_well_known_than_the_scale_hardly_changes_it_and_says_so():
    surface = facing_walls(scale_sd=0.0001)
    found = measures.Measure("distance", (length(surface),), np.zeros((2, 3)))
    scaled, check = measures.with_scale(surface, 2.004, found)
    assert scaled.scale_sd < surface.scale_sd
    assert check.factor == pytest.approx(1.0, abs=1e-4)
    assert check.advice == "This length is known to 0.14 % only; measure a longer one"


@pytest.mark.parametrize("own_sd", [0.002, 0.01, 0.031])
def test_setting_the_scale_never_widens_an_interval_and_95_of_100_hold(own_sd):
    rng, before, true_m, held, widths = np.random.default_rng(4), 0.01, 0.3, [], []
    surface = facing_walls(scale_sd=before)
    for _ in range(600):
        scale = np.exp(before * rng.standard_normal())  # true over drawn size
        measured_m = true_m / scale * np.exp(own_sd * rng.standard_normal())
        half_m = Z95 * np.hypot(before, own_sd) * measured_m
        one = measures.Value("length", measured_m, "m", (measured_m - half_m, measured_m + half_m), False)
        scaled, check = measures.with_scale(
            surface, true_m, measures.Measure("distance", (one,), np.zeros((2, 3)))
        )
        held.append(abs(np.log(scale / check.factor)) < Z95 * scaled.scale_sd)
        widths.append(scaled.scale_sd if check.agrees else 0.0)
    assert max(widths) <= before
    assert 0.90 < np.mean(held) < 0.98


def test_a_true_length_does_not_straighten_what_the_lens_has_bent():
    surface = facing_walls(scale_sd=0.02)
    found = measures.Measure("distance", (length(surface),), np.zeros((2, 3)))
    scaled, check = measures.with_scale(surface, 2.01, found)
    places = ([0.0, 0.5, 0.5], [2.0, 0.5, 0.5])
    before, after = (
        measures.angle_of_planes(one, *(plane_at(one, factor * np.array(place)) for place in places))
        for one, factor in ((surface, 1.0), (scaled, check.factor))
    )
    assert after.values[0].ci95 == pytest.approx(before.values[0].ci95, rel=0.01)


def test_two_equal_points_have_no_length():
    surface = facing_walls()
    end = mark(surface, np.array([0.0, 0.5, 0.5]))
    with pytest.raises(InputError, match="the same point"):
        measures.distance(surface, end, end)


def test_a_guessed_end_has_the_odds_of_its_confidence():
    count = 2 * 441
    guessed = np.repeat([False, True], 441)
    widths = []
    for confidence in (0.55, 0.95):
        surface = facing_walls(
            guessed=guessed,
            rays=np.tile([1.0, 0.0, 0.0], (count, 1)),
            ranges_m=np.full(count, 3.0),
            confidence=np.where(guessed, confidence, np.nan),
        )
        value = length(surface)
        assert value.guessed
        assert value.ci95 == length(surface).ci95
        assert value.ci95[0] <= 2.0 <= value.ci95[1]
        assert abs((value.ci95[1] - 2.0) - (2.0 - value.ci95[0])) > 0.01
        widths.append(np.ptp(value.ci95))
        assert not length(surface, b=(0.0, 0.8, 0.5)).guessed
    assert widths[0] > widths[1] > 0.02


def test_a_guessed_hole_and_a_guessed_box_have_the_odds_of_their_confidence():
    vertices_m, triangles, normals = sheet(20, 20, 0.05)
    inside = np.all(np.abs(vertices_m[triangles].mean(axis=1)[:, :2] - 0.5) < 0.1, axis=1)
    holed, box = (vertices_m, triangles[~inside], normals), box_on_table()

    def widths(guessed, confidence):
        def surface(mesh):
            count = len(mesh[0])
            return measured(
                mesh,
                guessed=np.full(count, guessed),
                ranges_m=np.full(count, 2.0),
                confidence=np.full(count, confidence),
            )

        area = measures.hole_area(surface(holed), np.array([0.5, 0.5, 0.0])).values
        top, side, front = [0.1, 0.1, 0.15], [0.0, 0.1, 0.07], [0.1, 0.0, 0.07]
        boxes = surface(box)
        part = measures.box_of_part(boxes, np.array(top)).values
        faces = measures.box_of_planes(
            boxes, tuple(plane_at(boxes, np.array(face)) for face in (top, side, front))
        ).values
        values = (*area, *part, *faces)
        assert all(value.guessed == guessed for value in values)
        return np.array([value.ci95[1] - value.value for value in values])

    known, sure, unsure = widths(False, np.nan), widths(True, 0.95), widths(True, 0.55)
    assert np.all(known < sure)
    assert np.all(sure < unsure)
    assert unsure[0] > 0.5 * 0.04
    assert np.all(unsure[1:] > 1.0)
