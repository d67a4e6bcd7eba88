"""A room's shell and flat objects on its walls, with photographs of real floors and walls."""

from __future__ import annotations

import cv2
import numpy as np

from lab.training.furniture import SurfaceImage
from lab.worlds.furniture import placing
from lab.worlds.primitives import box
from lab.worlds.room_finishes import muted, random_floor, random_material, random_wall
from lab.worlds.scene import Material, Part, Texture
from lab.worlds.shell import shell, wall_length, wall_pose
from lab.worlds.textures import paint
from pipeline.types import FloatArray

_TEXEL_M = 0.004
_PHOTOGRAPHED = 0.4
"""Share of floors and walls covered by a photograph, if the catalogue has any."""


def photographed_shell(
    rng: np.random.Generator, size_m: FloatArray, images: tuple[SurfaceImage, ...]
) -> list[Part]:
    """Return the shell of a room of ``size_m``, some floors and walls covered with photographs."""
    return shell(
        rng,
        size_m,
        0.5,
        lambda rng: _covered("Wall", rng, images) or random_wall(rng),
        lambda rng: _covered("Floor", rng, images) or random_floor(rng),
    )


def skirting(rng: np.random.Generator, size_m: FloatArray) -> list[Part]:
    """Return boards along the feet of the walls, 12 mm thick."""
    material, height_m = Material(paint(muted(rng, 1, 0.1, 0.8)[0], 2)), rng.uniform(0.05, 0.12)
    boards = []
    for wall in range(4):
        mesh = box((wall_length(size_m, wall), 0.012, height_m))
        boards.append(Part(*mesh, material, wall_pose(size_m, wall, 0.0, 0.006, 0.5 * height_m)))
    return boards


def mirror(rng: np.random.Generator) -> tuple[list[Part], FloatArray]:
    """Return a framed mirror, its foot on z = 0 and its front towards -y, and its (3,) size, metres."""
    size_m = np.array([rng.uniform(0.4, 1.2), 0.03, rng.uniform(0.5, 1.6)])
    glass = Material(paint((0.8, 0.82, 0.8), 3, 0.0), gloss=0.95, infrared=0.02)
    pane = size_m - np.array([0.06, 0.01, 0.06])
    middle = 0.5 * size_m[2]
    frame = Part(*box(size_m), random_material(rng), placing.place(0.0, 0.0, 0.0, middle))
    return [frame, Part(*box(pane), glass, placing.place(0.0, -0.012, 0.0, middle))], size_m


def tiled(image: SurfaceImage, scale: float, gain: FloatArray) -> Texture:
    """Return a photograph repeated over a part's faces.

    Args:
        image: the photograph, of known true size.
        scale: enlargement, 1 for its true size.
        gain: (3,) factors of its linear colours.
    """
    width_m, height_m = scale * image.size_m[0], scale * image.size_m[1]
    shape = (max(2, round(width_m / _TEXEL_M)), max(2, round(height_m / _TEXEL_M)))
    small = image.rgba[..., :3]
    if shape[0] < small.shape[1]:  # coarse, to avoid aliasing on distant floors
        small = cv2.resize(small, shape, interpolation=cv2.INTER_AREA)
    albedo = np.clip((small / 255.0) ** 2.2 * gain, 0.01, 0.9).astype(np.float32)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        axis = np.abs(normals).argmax(axis=1)
        u = np.where(axis == 0, points_m[:, 1], points_m[:, 0]) / width_m
        v = np.where(axis == 2, points_m[:, 1], points_m[:, 2]) / height_m
        rows, columns = ((-v % 1.0) * albedo.shape[0]).astype(int), ((u % 1.0) * albedo.shape[1]).astype(int)
        return albedo[rows % albedo.shape[0], columns % albedo.shape[1]]

    return texture


def _covered(category: str, rng: np.random.Generator, images: tuple[SurfaceImage, ...]) -> Material | None:
    """Return a material with a photograph of the category; None if there is none, or at random."""
    fitting = [image for image in images if image.category == category]
    if not fitting or rng.random() >= _PHOTOGRAPHED:
        return None
    gain = rng.uniform(0.6, 1.2) * rng.uniform(0.85, 1.15, 3)
    texture = tiled(fitting[rng.integers(len(fitting))], rng.uniform(0.8, 2.0), gain)
    return Material(texture, rng.choice([0.0, rng.uniform(0.0, 0.35)]))
