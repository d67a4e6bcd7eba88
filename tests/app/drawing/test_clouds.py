"""Point clouds of cameras in the scene: as large as their pixels, and as many as a browser can take."""

import numpy as np
import pytest

from app.compute.records import SENSOR_POINTS, Sample, grid_step, on_grid
from app.drawing.clouds import BAND, COVER, POINT_SIZE_M, add_sensor_cloud, clear
from pipeline.kernels.geometry import rigid

SPACING = 0.004
POSE = rigid(np.eye(3), np.array([1.0, 2.0, 3.0]))


def cloud(depths_m, spacing=SPACING):
    depths_m = np.asarray(depths_m, np.float32)
    points_m = np.column_stack([0.1 * depths_m, 0.2 * depths_m, depths_m])
    colors = np.column_stack([np.arange(len(depths_m))] * 3).astype(np.uint8)
    return Sample(points_m, colors, len(depths_m), spacing=spacing)


def drawn(server, sample, **options):
    """The point clouds by which a sample is drawn."""
    clear(server.scene, "/cloud")
    add_sensor_cloud(server.scene, "/cloud", sample, POSE, **options)
    handles = server.scene._handle_from_node_name
    np.testing.assert_allclose(handles["/cloud"].position, POSE[:3, 3])
    return [handle for name, handle in list(handles.items()) if name.startswith("/cloud/")]


def test_each_point_is_as_large_as_its_pixel_at_its_depth(server):
    depths_m = np.geomspace(0.3, 9.0, 60)
    found = drawn(server, cloud(depths_m))
    assert sum(len(one.points) for one in found) == 60
    for one in found:
        sizes = one.point_size / (COVER * SPACING * one.points[:, 2].astype(float))
        assert np.all((sizes > BAND**-0.51) & (sizes < BAND**0.51))
    rows = np.concatenate([one.colors[:, 0] for one in found])
    places_m = np.concatenate([one.points for one in found])
    np.testing.assert_allclose(places_m[np.argsort(rows), 2], depths_m, rtol=2**-11)


def test_points_to_be_seen_over_others_are_larger(server):
    (usual,), (larger,) = drawn(server, cloud([2.0])), drawn(server, cloud([2.0]), larger=1.7)
    assert larger.point_size == pytest.approx(1.7 * usual.point_size)


def test_points_of_no_grid_have_one_size(server):
    clear(server.scene, "/cloud")
    add_sensor_cloud(server.scene, "/cloud", cloud([1.0, 4.0], spacing=None), POSE)
    assert server.scene._handle_from_node_name["/cloud"].point_size == POINT_SIZE_M


@pytest.mark.parametrize(
    ("total", "step"),
    [(0, 1), (SENSOR_POINTS, 1), (SENSOR_POINTS + 1, 2), (741_239, 2), (9 * SENSOR_POINTS, 3)],
)
def test_the_step_is_the_least_that_leaves_few_enough(total, step):
    assert grid_step(total) == step


def test_a_grid_has_every_so_many_columns_and_rows():
    v, u = np.mgrid[:6, :9]
    pixels = np.column_stack([u.ravel(), v.ravel()])
    assert on_grid(pixels, 1).all()
    kept = pixels[on_grid(pixels, 3)]
    assert sorted(map(tuple, kept)) == [(u, v) for u in (0, 3, 6) for v in (0, 3)]
