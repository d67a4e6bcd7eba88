"""Tables of results for notebooks: known numbers with their units, pictures, and text that stays text."""

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.settings import with_settings
from pipeline.config import PRESETS, RegistrationConfig
from pipeline.io.demos import load_demo
from pipeline.notebook.pictures import cloud_picture, surface_picture
from pipeline.reconstruct import reconstruct
from pipeline.registration import register
from pipeline.surface.ball_pivoting import reconstruct_surface, roll_ball
from pipeline.types import PointCloud, RegistrationResult, Rig, Surface

SIDE = 11
x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
FLOOR = PointCloud(
    np.stack([0.1 * x, 0.1 * y, 0.0 * x], axis=-1).reshape(-1, 3),
    colors=np.tile(np.array([200, 30, 60], np.uint8), (SIDE**2, 1)),
    normals=np.tile([0.0, 0.0, 1.0], (SIDE**2, 1)),
)
"""1 x 1 m, a point every 10 cm."""


def rows(html):
    """Value by name."""
    pairs = re.findall(r"<tr><td[^>]*>([^<]*)</td><td[^>]*>([^<]*)</td></tr>", html)
    return dict(pairs)


def images(html):
    """(H, W, 3) RGB of each picture."""
    files = re.findall(r"data:image/png;base64,([^\"]+)", html)
    return [
        cv2.imdecode(np.frombuffer(base64.b64decode(file), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        for file in files
    ]


def test_a_cloud_has_its_points_extent_and_spacing():
    table = rows(FLOOR._repr_html_())
    assert table == {
        "Points": "121",
        "Extent along x, y and z": "1.00 × 1.00 × 0.00 m",
        "Spacing, mean and deviation": "100.0 and 0.0 mm",
        "Columns": "points_m, colors, normals",
    }


@pytest.mark.parametrize("count", [0, 1])
def test_a_cloud_of_no_point_or_one_has_a_table(count):
    html = FLOOR.select(np.arange(count))._repr_html_()
    assert rows(html)["Points"] == str(count)
    assert len(images(html)) == count


def test_a_point_in_front_hides_the_one_behind_in_either_order():
    away = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 1.0]])
    corners = np.array([[u, v, 1.5] for u in (-1.0, 1.0) for v in (-1.0, 1.0)])
    pixels = np.concatenate([[[0, 0], [0, 0]], 100 * corners[:, :2]]).astype(int)
    points_m = np.concatenate([away, corners])
    red, green = (250, 0, 0), (0, 250, 0)
    for order in ([0, 1], [1, 0]):
        colors = np.array([red, green, *[(0, 0, 250)] * 4], np.uint8)
        rows_of = [*order, 2, 3, 4, 5]
        cloud = PointCloud(points_m[rows_of], colors[rows_of], pixels=pixels[rows_of])
        assert (cloud_picture(cloud) == green).all(axis=-1).any()


def test_a_surface_has_its_triangles_area_and_rim():
    surface = reconstruct_surface(FLOOR, [0.1])
    html = surface._repr_html_()
    table = rows(html)
    assert table["Triangles"] == "200"
    assert table["Area"] == "1.00 m²"
    assert table["Boundary (holes and outer rims)"] == "4.0 m in 1 loop"
    assert table["Ball radii"] == "100.0 mm"
    assert table["Rays without a surface"] == "–"
    (rgb,) = images(html)
    drawn = (rgb != 255).any(axis=-1)
    assert 0.05 < drawn.mean() < 0.6
    assert np.median(rgb[drawn], axis=0)[0] > 2 * np.median(rgb[drawn], axis=0)[1]


def test_a_bare_surface_has_no_measures_and_an_empty_one_no_picture():
    html = roll_ball(FLOOR, [0.1])._repr_html_()
    assert set(rows(html)) == {"Triangles", "Vertices", "Extent along x, y and z", "Ball radii"}
    empty = Surface(np.empty((0, 3)), np.empty((0, 3), np.int32))._repr_html_()
    assert rows(empty) == {"Triangles": "0", "Vertices": "0"}
    assert not images(empty)


def test_what_a_surfaces_rays_miss_is_white():
    rgb = surface_picture(roll_ball(FLOOR, [0.1]))
    assert (rgb[0, 0] == 255).all()
    assert not (rgb == (255, 0, 255)).all(axis=-1).any()


def test_a_registration_has_its_angle_in_degrees_and_its_length_in_metres():
    T = np.eye(4)
    T[:2, :2] = [[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]]
    T[:3, 3] = (0.03, 0.04, 0.0)
    html = RegistrationResult(T, (), False, "max_iterations")._repr_html_()
    table = rows(html)
    assert table["Rotation"] == "5.730°"
    assert table["Translation"] == "0.0500 m"
    assert table["End"] == "max_iterations after 0 iterations"
    assert "0.99500" in html
    scaled = RegistrationResult(np.diag([2.0, 2.0, 2.0, 1.0]), (), True, "converged")._repr_html_()
    assert rows(scaled)["Scale"] == "2.00000"
    assert rows(scaled)["Rotation"] == "0.000°"


def test_a_registrations_errors_fall():
    cloud = PointCloud(np.random.default_rng(0).uniform(0.0, 1.0, (500, 3)))
    moved = PointCloud(cloud.points_m + np.array([0.02, 0.0, 0.0]))
    table = rows(register(cloud, moved, RegistrationConfig("icp", "point"))._repr_html_())
    first, last = map(float, table["RMSE of the pairs, first to last"].removesuffix(" mm").split(" to "))
    assert last < 0.01 < 15.0 < first
    assert table["Translation"] == "0.0200 m"


def test_a_rig_has_its_photographs_and_its_text_stays_text():
    rig = load_demo("box-on-table")
    named = Rig("<b>mine</b>", (replace(rig.frames[0], name="<script>1</script>", notes=("a & b",)),))
    html = named._repr_html_()
    assert "<b>mine" not in html
    assert "<script" not in html
    assert "a &amp; b" in html
    assert rows(rig._repr_html_())["Nodes"] == str(len(rig.frames))
    assert rows(rig._repr_html_())["Images"] == "640 × 480 px"
    assert len(images(rig._repr_html_())) == min(4, len(rig.frames))


@pytest.fixture(scope="module")
def result():
    """The reconstruction of one node."""
    rig = Rig("one node", load_demo("office").frames[:1])
    return reconstruct(rig, with_settings(PRESETS["packetmesh"], ["surface.max_points=3000"]))


def test_a_reconstruction_shows_its_holes_in_magenta(result):
    html = result._repr_html_()
    before, after = images(html)
    magenta = [float((rgb == (255, 0, 255)).all(axis=-1).mean()) for rgb in (before, after)]
    table = rows(html)
    for share, when in zip(magenta, ("before", "after"), strict=True):
        stated = float(table[f"Rays without a surface {when} fusion"].removesuffix(" %")) / 100.0
        assert share == pytest.approx(stated, abs=0.02)
    assert magenta[1] < magenta[0]


def test_the_picture_is_that_of_a_node_whose_pose_is_used(result):
    """The first one was excluded and keeps its given pose, which is far away."""
    (frame,), (pose,), (verdict,) = (
        result.rig.frames,
        result.placement.T_world_camera,
        result.placement.verdicts,
    )
    far = np.eye(4)
    far[:3, 3] = 300.0
    frames = replace(frame, name="elsewhere", T_world_camera=far), frame
    verdicts = replace(verdict, name="elsewhere", placed=False), verdict
    placement = replace(result.placement, T_world_camera=(far, pose), verdicts=verdicts)
    html = replace(result, rig=Rig("two nodes", frames), placement=placement)._repr_html_()
    assert "elsewhere" not in html
    for own, alone in zip(images(html), images(result._repr_html_()), strict=True):
        assert np.array_equal(own, alone)


def test_what_has_no_table_is_a_type_error():
    from pipeline.notebook import html_of

    with pytest.raises(TypeError, match="dict"):
        html_of({})
