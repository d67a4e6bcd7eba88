"""Figures 4.2 to 4.7 of the thesis on a scene of our own: one ball before and after fusion."""

from __future__ import annotations

from lab.claims.exhibits import Picture
from lab.claims.surface.clouds import ChainClouds
from pipeline.kernels.geometry import scaled
from pipeline.kernels.rays import Camera, hit_depth
from pipeline.surface.pictures import mesh_picture

FIGURES: tuple[tuple[str, str, str, float], ...] = (
    ("4.2", "before", "r_F", 0.0),
    ("4.3", "before", "r_F + sigma_D/4", 0.25),
    ("4.4", "before", "r_F + sigma_D/2", 0.5),
    ("4.5", "before", "r_F + sigma_D", 1.0),
    ("4.6", "after", "r_F", 0.0),
    ("4.7", "after", "r_F + sigma_D/2", 0.5),
)
"""Number of the figure, before or after fusion, name of the radius, and its multiple of sigma_D."""
PICTURE_SIZE = 0.5
"""Picture size over the camera's own."""


def thesis_figures(clouds: ChainClouds, how: str) -> Picture:
    """Return the six surfaces, each of a single radius, from the node's camera.

    Args:
        how: the chain's treatment of the inferred points, for the title.
    """
    camera = Camera(scaled(clouds.camera.intrinsics, PICTURE_SIZE), clouds.camera.T_world_camera)
    images = []
    for number, when, name, factor in FIGURES:
        surface = clouds.rolled(when, (factor,))
        depth = hit_depth(surface.vertices_m, surface.triangles, camera.intrinsics, camera.T_world_camera)
        caption = (
            f"{number}: {when} fusion, {name} = {1000.0 * surface.radii_m[0]:.1f} mm; "
            f"{1.0 - depth.coverage:.0%} of the rays find nothing"
        )
        images.append((caption, mesh_picture(surface, camera)))
    return Picture(
        f"Figures 4.2 to 4.7 on {clouds.name}, by {how}",
        tuple(images),
        "A single ball radius each, seen from the node's camera; magenta: rays that find nothing. The "
        "thesis's radii are 0.0102, 0.0131, 0.0156 and 0.0209 before and 0.0102 and 0.0156 after fusion: "
        "those of r_F + {0, 1/4, 1/2, 1} sigma_D and of r_F + {0, 1/2} sigma_D.",
    )
