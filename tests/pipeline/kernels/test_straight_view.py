"""A straight view of a bent image, and depth on its way back."""

import numpy as np
import pytest

from pipeline.kernels.geometry import pixel_rays, project
from pipeline.kernels.straight_view import (
    WIDEST,
    bends_strongly,
    bent_depth,
    straight_image,
    straight_view,
)
from pipeline.types import DepthMap
from tests.pipeline.lenses import KIND, camera

BENT = ["rational", "prism", "tilt", "fisheye"]


def test_only_lenses_with_more_than_five_coefficients_are_straightened():
    assert [kind for kind in KIND if bends_strongly(camera(kind))] == BENT


def painting(rays):
    """(..., 3) colours by direction; they change slowly."""
    x, y = rays[..., 0], rays[..., 1]
    return np.stack([127 + 60 * np.sin(x), 127 + 60 * np.sin(y), 127 + 60 * np.cos(x + y)], axis=-1)


@pytest.mark.parametrize("kind", BENT)
def test_a_direction_has_its_colour_in_both_images(kind):
    lens, view = camera(kind), straight_view(camera(kind))
    rgb = painting(pixel_rays(lens)).astype(np.uint8)
    seen = straight_image(rgb, lens, view).astype(float)
    rays = pixel_rays(view)
    pixels = project(lens, rays.reshape(-1, 3)).reshape(*rays.shape[:2], 2)
    inside = np.all((pixels >= 0) & (pixels <= (319, 239)), axis=-1)
    assert inside.mean() > 0.5
    np.testing.assert_allclose(seen[inside], painting(rays)[inside], atol=3.0)
    assert (seen[np.any((pixels < -1) | (pixels > (320, 240)), axis=-1)] == 0).all()


@pytest.mark.parametrize("kind", BENT)
def test_a_straight_view_shows_all_directions_up_to_60_degrees(kind):
    lens, view = camera(kind), straight_view(camera(kind))
    pixels = project(view, pixel_rays(lens).reshape(-1, 3))
    steep = np.abs(pixel_rays(lens).reshape(-1, 3)[:, :2]).max(axis=1)
    assert np.all((pixels >= -0.5) & (pixels <= (319.5, 239.5)), axis=1)[steep < WIDEST].all()
    assert (view.fx_px, view.distortion.any()) == (view.fy_px, False)


@pytest.mark.parametrize("kind", BENT)
def test_depth_comes_back_to_the_pixels_of_its_directions(kind):
    lens, view = camera(kind), straight_view(camera(kind))
    own = pixel_rays(view)
    z_m = (2.0 + 0.3 * own[..., 0] - 0.2 * own[..., 1]).astype(np.float32)
    found = bent_depth(DepthMap(z_m, "relative"), lens, view)
    rays = pixel_rays(lens)
    assert found.kind == "relative"
    assert found.coverage > 0.6
    expected = 2.0 + 0.3 * rays[..., 0] - 0.2 * rays[..., 1]
    np.testing.assert_allclose(found.z_m[found.valid], expected[found.valid], atol=0.003)
    assert not found.valid[np.abs(rays[..., :2]).max(axis=-1) > 4.0 / 3.0 * WIDEST + 0.05].any()
