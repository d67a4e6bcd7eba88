"""Sofas, chairs, stools and cushions."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import FABRICS, WOODS, black_plastic, chrome, fabric, pick, steel, wood
from lab.worlds.furniture.placing import ORIGIN, board, corners, solid
from lab.worlds.primitives import cylinder, frustum, lathe, merged, moved, rounded_box, tube
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def sofa(
    rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 1.95, color: str | None = None, seats: int = 2
) -> list[Part]:
    """A sofa with loose seat and back cushions, 0.9 m deep; one seat makes an armchair."""
    cloth = pick(rng, FABRICS, color)
    base, pads = fabric(rng, cloth), fabric(rng, cloth * 1.06)
    arm_m, depth_m = 0.19, 0.9
    inside_m = width_m - 2.0 * arm_m
    behind = rounded_box((inside_m + 0.1, 0.2, 0.56), 0.07)
    parts = [
        solid(rounded_box((width_m - 0.06, depth_m - 0.08, 0.22), 0.04), base, T_world, (0.0, 0.0, 0.23)),
        solid(behind, base, T_world, (0.0, depth_m / 2 - 0.11, 0.54), (-0.12, 0.0, 0.0)),
    ]
    arm = rounded_box((arm_m, depth_m, 0.46), 0.075)
    parts += [solid(arm, base, T_world, (s * (width_m - arm_m) / 2.0, 0.0, 0.37)) for s in (-1, 1)]
    pitch_m = inside_m / seats
    for k in range(seats):
        x = (k - (seats - 1) / 2.0) * pitch_m
        seat = rounded_box((pitch_m - 0.008, 0.64, 0.19), 0.05, 0.02)
        parts.append(solid(seat, pads, T_world, (x, -0.115, 0.415), (0.02, rng.normal(0.0, 0.01), 0.0)))
        back = rounded_box((pitch_m - 0.02, 0.44, 0.21), 0.06, 0.04)
        parts.append(solid(back, pads, T_world, (x, 0.235, 0.66), (np.pi / 2.0 - 0.22, 0.0, 0.0)))
    legs = wood(rng, WOODS[3], along=2)
    foot, spots = frustum(0.016, 0.024, 0.13), corners(width_m / 2 - 0.12, depth_m / 2 - 0.12)
    return parts + [solid(foot, legs, T_world, (x, y, 0.0)) for x, y in spots]


def armchair(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A wide upholstered chair."""
    return sofa(rng, T_world, width_m=0.92, color=color, seats=1)


def cushion(
    rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None, size_m: float = 0.44
) -> list[Part]:
    """A plump square cushion that lies flat on the origin; turn it with ``T_world``."""
    cloth = fabric(rng, pick(rng, FABRICS, color))
    vertices, triangles = rounded_box((size_m, size_m, 0.15), 0.02, 0.055, cells=10)
    # Pull the sides in between the tips, as a filled cover does.
    along = vertices[:, :2] / (size_m / 2.0)
    vertices[:, :2] *= 1.0 - 0.07 * (1.0 - along[:, ::-1] ** 2)
    return [solid((vertices, triangles), cloth, T_world, (0.0, 0.0, 0.075))]


def dining_chair(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A wooden chair with a slatted back, seat at 0.45 m."""
    grain = pick(rng, WOODS, color)
    timber, upright = wood(rng, grain), wood(rng, grain, along=2)
    seat = solid(rounded_box((0.44, 0.43, 0.035), 0.012), timber, T_world, (0.0, 0.0, 0.45))
    leg = frustum(0.014, 0.019, 0.435, 16)
    front = [solid(leg, upright, T_world, (x, -0.18, 0.0)) for x in (-0.18, 0.18)]
    post = tube([(0.0, 0.2, 0.0), (0.0, 0.19, 0.43), (0.0, 0.21, 0.65), (0.0, 0.27, 0.9)], 0.017)
    back = [solid(post, upright, T_world, (x, 0.0, 0.0)) for x in (-0.19, 0.19)]
    slats = [
        board((0.38, 0.016, 0.06), timber, T_world, (0.0, y, z), (-lean, 0.0, 0.0), 0.004)
        for y, z, lean in ((0.2, 0.6, 0.1), (0.226, 0.71, 0.22), (0.255, 0.84, 0.25))
    ]
    rail = [board((0.36, 0.014, 0.05), timber, T_world, (0.0, -0.18, 0.4), edge_m=0.003)]
    return [seat, *front, *back, *slats, *rail]


def stool(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A round workshop stool on four splayed legs, 0.6 m high."""
    grain = pick(rng, WOODS, color)
    seat = lathe([(0.15, 0.0), (0.165, 0.012), (0.165, 0.03), (0.14, 0.04)], bevel_m=0.004)
    parts = [solid(seat, wood(rng, grain), T_world, (0.0, 0.0, 0.57))]
    timber = wood(rng, grain, along=2)
    for x, y in corners(1.0, 1.0):
        leg = tube([(0.17 * x, 0.17 * y, 0.002), (0.1 * x, 0.1 * y, 0.58)], [0.015, 0.019])
        parts.append(solid(leg, timber, T_world))
    rungs = [tube([(0.14 * x, -0.14, 0.2), (0.14 * x, 0.14, 0.2)], 0.009) for x in (-1, 1)]
    rungs += [tube([(-0.145, 0.145 * y, 0.26), (0.145, 0.145 * y, 0.26)], 0.009) for y in (-1, 1)]
    return [*parts, solid(merged(rungs), timber, T_world)]


def office_chair(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A swivel chair on a five-armed star with castors."""
    cloth = fabric(rng, pick(rng, ("#26282b", "#3a4a58", "#5a5f66"), color))
    black = black_plastic()
    seat = rounded_box((0.5, 0.48, 0.1), 0.04, 0.012)
    back = rounded_box((0.46, 0.58, 0.085), 0.038, 0.012)
    parts = [
        solid(seat, cloth, T_world, (0.0, 0.0, 0.47)),
        solid(back, cloth, T_world, (0.0, 0.25, 0.83), (np.pi / 2.0 - 0.16, 0.0, 0.0)),
        solid(cylinder(0.025, 0.25), chrome(), T_world, (0.0, 0.0, 0.16)),
        solid(cylinder(0.04, 0.1, bevel_m=0.004), black, T_world, (0.0, 0.0, 0.1)),
        solid(tube([(0, 0.06, 0.42), (0, 0.26, 0.42), (0, 0.3, 0.5), (0, 0.3, 0.75)], 0.022), black, T_world),
    ]
    star, castors = [], []
    for angle in np.arange(5) * 2.0 * np.pi / 5.0 + 0.3:
        tip = np.array([np.cos(angle), np.sin(angle)]) * 0.31
        star.append(tube([(0.0, 0.0, 0.13), (*(tip * 0.5), 0.115), (*tip, 0.075)], [0.03, 0.022, 0.015]))
        wheel = rounded_box((0.045, 0.052, 0.055), 0.02)
        castors.append(moved(wheel, tip[0], tip[1], 0.028))
    parts += [solid(merged(star), steel(rng), T_world), solid(merged(castors), black, T_world)]
    for s in (-1, 1):
        arm = tube([(s * 0.22, 0.05, 0.45), (s * 0.29, 0.05, 0.47), (s * 0.3, 0.05, 0.66)], 0.016)
        pad = rounded_box((0.07, 0.26, 0.03), 0.013)
        parts += [solid(arm, black, T_world), solid(pad, black, T_world, (s * 0.3, 0.0, 0.675))]
    return parts
