import numpy as np
import pytest

from lab.benchmarks.hidden_depth import blob, depth_edges, hide, hole_shapes
from packetmesh.errors import InputError
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 240, 320


def wall(step_m: float = 1.0, holes: bool = True) -> DepthMap:
    """A wall at 2 m, nearer by ``step_m`` on the right, with five holes of 6 x 11 pixels and a margin."""
    z_m = np.full((HEIGHT_PX, WIDTH_PX), 2.0, np.float32)
    z_m[:, WIDTH_PX // 2 :] -= step_m
    if holes:
        for k in range(5):
            z_m[30 * k + 20 : 30 * k + 26, 40:51] = np.nan
        z_m[:8] = z_m[:, :5] = np.nan
    return DepthMap(z_m)


@pytest.mark.parametrize("share", [0.02, 0.15, 0.5])
@pytest.mark.parametrize("step_m", [0.0, 1.0])
@pytest.mark.parametrize("holes", [False, True])
def test_only_pixels_with_depth_are_hidden_and_about_the_share_asked_for(share, step_m, holes):
    sensor = wall(step_m, holes)
    hidden = hide(sensor, np.random.default_rng(1), share)
    largest_blob = np.pi * (0.05 * np.hypot(HEIGHT_PX, WIDTH_PX)) ** 2 / sensor.valid.sum()
    assert not (hidden & ~sensor.valid).any()
    assert share <= hidden.sum() / sensor.valid.sum() + 1e-5
    assert hidden.sum() / sensor.valid.sum() <= share + largest_blob


def test_shapes_are_those_of_the_frames_own_holes():
    shapes = hole_shapes(wall().valid)
    assert [shape.shape for shape in shapes] == [(6, 11)] * 5
    assert all(shape.all() for shape in shapes)


def test_a_frame_without_edges_is_hidden_in_the_shapes_of_its_holes_alone():
    hidden = hide(wall(step_m=0.0), np.random.default_rng(2), 0.004)
    inside = hidden[1:-1, 1:-1]
    count = np.lib.stride_tricks.sliding_window_view(hidden, (6, 11)).sum(axis=(2, 3))
    assert (count == 66).any()
    assert inside.any()


def test_blobs_sit_on_depth_edges():
    sensor = wall(holes=False)
    edges = np.argwhere(depth_edges(sensor))
    assert set(edges[:, 1]) == {WIDTH_PX // 2 + k for k in (-2, -1, 0, 1)}
    hidden = hide(sensor, np.random.default_rng(3), 0.1)
    columns = np.argwhere(hidden)[:, 1]
    assert np.abs(columns - WIDTH_PX // 2).max() <= 3 + 0.05 * np.hypot(HEIGHT_PX, WIDTH_PX)


def test_a_blob_is_an_ellipse_within_its_radii():
    diagonal_px = np.hypot(HEIGHT_PX, WIDTH_PX)
    for seed in range(20):
        area_px = blob((HEIGHT_PX, WIDTH_PX), np.random.default_rng(seed)).sum()
        assert 0.9 * np.pi * (0.015 * diagonal_px) ** 2 <= area_px <= 1.05 * np.pi * (0.05 * diagonal_px) ** 2


def test_the_same_seed_hides_the_same_pixels():
    first, again, other = (hide(wall(), np.random.default_rng(seed), 0.15) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("share", [0.0, -0.1, 0.95, float("nan")])
def test_a_share_out_of_range_is_refused(share):
    with pytest.raises(InputError, match=r"try 0\.15"):
        hide(wall(), np.random.default_rng(0), share)


def test_a_frame_without_depth_is_refused():
    with pytest.raises(InputError, match="no valid pixel"):
        hide(DepthMap(np.full((20, 20), np.nan, np.float32)), np.random.default_rng(0), 0.1)
