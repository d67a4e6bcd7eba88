"""Plain solids of random materials, in heaps and stacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.worlds.furniture import storage
from lab.worlds.furniture.placing import place, solid
from lab.worlds.pieces.stock import Makers, bounds, draw, moved
from lab.worlds.primitives import Mesh, box, cylinder, frustum, lathe, rounded_box, sphere, tube
from lab.worlds.primitives import moved as shifted
from lab.worlds.room_finishes import random_material
from lab.worlds.scene import Part, Rng
from pipeline.kernels.geometry import rigid, rotation_exp


def random_solid(rng: Rng, smallest_m: float, largest_m: float) -> list[Part]:
    """A box, rounded box, cylinder, cone, ball, bowl or bent pipe of any material, standing on z = 0."""
    size = rng.uniform(smallest_m, largest_m, 3)
    radius, height = 0.5 * size[0], size[2]
    wall = min(0.012, 0.2 * radius)
    outside = [(0, 0), (0.6 * radius, 0), (radius, 0.6 * height), (radius, height)]
    within = radius - wall
    inside = [(within, height), (within, 0.6 * height), (0.6 * radius - wall, wall), (0, wall)]
    arc = np.linspace(0.0, np.pi, 12)[:, None]
    hoop = np.concatenate([radius * np.cos(arc), 0.0 * arc, height * np.sin(arc)], axis=1)
    half = 0.5 * height
    sharp = shifted(box(size), z_m=half)
    makers: Makers[Mesh] = [
        (3.0, lambda: sharp),
        (1.5, lambda: shifted(rounded_box(size, rng.uniform(0.1, 0.45) * min(size), 0.0, 2, 1), z_m=half)),
        (2.0, lambda: cylinder(radius, height, 28, 0.004)),
        (0.7, lambda: frustum(radius, radius * rng.uniform(0.0, 0.8), height, 28, 0.004)),
        (1.2, lambda: shifted(sphere(radius, 24), z_m=radius)),
        (1.0, lambda: lathe([*outside, *inside], 28, 0.002)),
        (0.5, lambda: tube(hoop, 0.08 * size[1] + 0.004, 10)),
    ]
    mesh = draw(rng, makers)
    turned = (random_material(rng), place(0.0, 0.0, rng.uniform(0.0, 2.0 * np.pi)))
    piece = [solid(mesh, *turned, smooth=mesh is not sharp)]
    if rng.random() < 0.15:  # fallen over
        piece = moved(piece, rigid(rotation_exp(np.array([np.pi / 2.0, 0.0, 0.0])), np.zeros(3)))
        piece = moved(piece, place(0.0, 0.0, 0.0, -bounds(piece)[0][2]))
    return piece


def stack(rng: Rng) -> list[Part]:
    """A stack of boxes."""
    parts, z = [], 0.0
    for k in range(int(rng.integers(2, 5))):
        size = rng.uniform((0.3, 0.25, 0.12), (0.55, 0.45, 0.4)) * (0.9**k)
        carton = storage.cardboard_box(rng, size_m=size)
        if rng.random() < 0.4:
            carton = [replace(part, material=random_material(rng)) for part in carton]
        parts += moved(carton, place(rng.normal(0.0, 0.03), rng.normal(0.0, 0.03), rng.normal(0.0, 0.15), z))
        z += size[2]
    return parts
