"""Catalogue models as parts of a room: materials, recolouring, cloth, black objects, lit lamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.training.furniture import Entry
from lab.training.models import Model, Surface
from lab.worlds import textures
from lab.worlds.room_finishes import covered, draw_seed, random_material, recolored
from lab.worlds.scene import Material, Part, Texture
from pipeline.types import FloatArray

_UPHOLSTERED = ("sofa", "couch", "armchair", "bed", "cushion", "pouf", "puff", "ottoman", "curtain")
_OPENING_DEPTH_M = 0.06
"""Largest depth of a door or window in a room."""


def dressed(
    entry: Entry, model: Model, T: FloatArray, rng: np.random.Generator, daylight: float
) -> list[Part]:
    """Return the parts of a model at ``T``, in its own or other colours, black, or of one random material.

    Args:
        entry: the model's catalogue entry.
        model: its surfaces.
        T: (4, 4) pose of its foot in the world.
        rng: draws colours and cloth.
        daylight: brightness of window panes; 0 at night, when they are dark and shiny.
    """
    share = placed_size_m(entry)[1] / entry.size_m[1]
    parts = [_part(surface, entry, T, rng, daylight, share) for surface in model.surfaces]
    kind = rng.random()
    if kind < 0.4 or entry.category == "Characters":
        return parts
    if kind < 0.75:
        return recolored(parts, rng)
    if kind < 0.87:
        return [_darkened(part) for part in parts]
    soft = any(word in entry.name.lower() for word in _UPHOLSTERED)
    return covered(parts, _cloth(rng) if soft else random_material(rng))


def placed_size_m(entry: Entry) -> FloatArray:
    """Return (3,) width, depth and height in the room; doors and windows are at most 6 cm deep."""
    if entry.role != "opening":
        return entry.size_m
    return np.array([entry.size_m[0], min(entry.size_m[1], _OPENING_DEPTH_M), entry.size_m[2]])


def _part(
    surface: Surface, entry: Entry, T: FloatArray, rng: np.random.Generator, daylight: float, share: float
) -> Part:
    """Return one surface with the material of its kind, its size along y scaled by ``share``."""
    texture: Texture = surface.colors if share == 1.0 else _stretched(surface.colors, share)
    gloss = float(rng.uniform(0.15, 0.45))
    material = {
        "matt": Material(texture),
        "glossy": Material(texture, gloss),
        "glass": Material(texture, 0.5, infrared=0.1),
        "mirror": Material(textures.paint((0.8, 0.82, 0.8), 3, 0.0), 0.95, infrared=0.02),
        "glowing": Material(texture, emission=float(rng.uniform(0.5, 3.0))),
    }[surface.kind]
    if surface.kind == "glass" and entry.role == "opening":
        if daylight > 0.0:
            material = Material(textures.paint((0.75, 0.85, 0.95), 5, 0.2), infrared=0.1, emission=daylight)
        else:
            material = Material(textures.paint((0.02, 0.02, 0.03), 5, 0.2), 0.7, infrared=0.02)
    vertices = surface.vertices_m * np.array([1.0, share, 1.0])
    return Part(vertices, surface.triangles, material, T, smooth=True)


def _stretched(texture: Texture, share: float) -> Texture:
    scale = np.array([1.0, 1.0 / share, 1.0], np.float32)
    return lambda points_m, normals: texture(points_m * scale, normals)


def _darkened(part: Part) -> Part:
    """Return the part in black, in infrared too, so that a depth sensor loses it."""
    texture = part.material.texture
    black = replace(part.material, texture=lambda p, n: 0.01 + 0.05 * texture(p, n), infrared=0.05)
    return part if part.material.emission > 0.0 else replace(part, material=black)


def _cloth(rng: np.random.Generator) -> Material:
    """Return a cloth: plain weave, stripes, a print or checks."""
    color, second = textures.random_palette(rng, 2)
    seed = draw_seed(rng)
    makers = (
        lambda: textures.fabric(color, second, seed, rng.uniform(0.004, 0.02)),
        lambda: textures.stripes(color, second, seed, rng.uniform(0.02, 0.1), bool(rng.integers(2))),
        lambda: textures.motif(color, second, seed, rng.uniform(0.05, 0.25)),
        lambda: textures.checker(color, second, rng.uniform(0.02, 0.15), seed),
    )
    return Material(makers[rng.integers(len(makers))]())
