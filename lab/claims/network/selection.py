"""C36: the choice of M of N cameras that together see the most surface (SPEC 6.3).

Each scene has spheres on the ground, like plants on a bench, with voxels on their surfaces, and cameras
around them that look at the middle. Visibility is geometric: a camera sees a voxel that is in its picture and
faces it if no sphere is in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.claims.claim import Claim, Outcome
from lab.claims.exhibits import Chart, Table
from lab.claims.network.intervals import curve, interval
from network_sim.fixed.selection import (
    FloatArray,
    all_cameras,
    at_random,
    greedy,
    greedy_by_cost,
    nearest,
    view_quality,
)
from pipeline.types import BoolArray

SEEDS = 20
CAMERAS = 12
SPHERES = 8
VOXELS_EACH = 80
COS_HALF_VIEW = np.cos(np.radians(30.0))
REFERENCE_M = 1.5
SIZES_BYTES = (200_000.0, 921_615.0)
"""Smallest and largest size of a camera's image: coded, and as PPM."""
PROGRAMS = ("greedy", "greedy by cost", "nearest", "random")


@dataclass(frozen=True, slots=True)
class View:
    """The cameras' views of one scene."""

    q: FloatArray
    """(N, V) visibility x resolution x incidence."""
    distances_m: FloatArray
    """(N,) distance from each camera to the sink, which is in the middle."""
    costs: FloatArray
    """(N,) bytes of an image of each camera."""


def make_view(seed: int) -> View:
    """Return spheres at random places with cameras at random places of a ring around them."""
    rng = np.random.default_rng(seed)
    radii_m = rng.uniform(0.15, 0.4, SPHERES)
    centers_m = np.column_stack([rng.uniform(-1.2, 1.2, (SPHERES, 2)), radii_m])
    normals = rng.normal(size=(SPHERES, VOXELS_EACH, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    voxels_m = (centers_m[:, None] + radii_m[:, None, None] * normals).reshape(-1, 3)
    angle, distance_m = rng.uniform(0, 2 * np.pi, CAMERAS), rng.uniform(1.8, 4.0, CAMERAS)
    height_m = rng.uniform(0.5, 2.0, CAMERAS)
    cameras_m = np.column_stack([distance_m * np.cos(angle), distance_m * np.sin(angle), height_m])
    rays_m = voxels_m[None] - cameras_m[:, None]
    lengths_m = np.linalg.norm(rays_m, axis=2)
    directions = rays_m / lengths_m[..., None]
    incidence = -np.einsum("nvc,vc->nv", directions, normals.reshape(-1, 3))
    axes = -cameras_m / np.linalg.norm(cameras_m, axis=1, keepdims=True)
    in_picture = np.einsum("nvc,nc->nv", directions, axes) > COS_HALF_VIEW
    visible = (
        in_picture
        & (incidence > 0.0)
        & ~behind_a_sphere(cameras_m, directions, lengths_m, centers_m, radii_m)
    )
    q = view_quality(visible, lengths_m, incidence, REFERENCE_M)
    return View(q, np.linalg.norm(cameras_m, axis=1), rng.uniform(*SIZES_BYTES, CAMERAS))


def behind_a_sphere(
    cameras_m: FloatArray,
    directions: FloatArray,
    lengths_m: FloatArray,
    centers_m: FloatArray,
    radii_m: FloatArray,
) -> BoolArray:
    """Return (N, V) whether the line of sight meets a sphere before the voxel."""
    hidden = np.zeros(lengths_m.shape, bool)
    for center_m, radius_m in zip(centers_m, radii_m, strict=True):
        to_center_m = center_m - cameras_m
        along_m = np.einsum("nvc,nc->nv", directions, to_center_m)
        miss_m2 = np.sum(to_center_m**2, axis=1)[:, None] - along_m**2
        entry_m = along_m - np.sqrt(np.maximum(radius_m**2 - miss_m2, 0.0))
        hidden |= (miss_m2 < radius_m**2) & (entry_m > 0.0) & (entry_m < lengths_m - 1e-6)
    return hidden


def shares(view: View, seed: int) -> FloatArray:
    """Return (programs, N) value of the M cameras of each program, M from 1 to N, over that of all.

    The program with costs does not fix M: it may spend M times the mean cost of a camera.
    """
    whole = all_cameras(view.q).value
    rng = np.random.default_rng((seed, 1))
    rows = np.zeros((len(PROGRAMS), len(view.q)))
    for m in range(1, len(view.q) + 1):
        chosen = (
            greedy(view.q, m),
            greedy_by_cost(view.q, view.costs, m * float(view.costs.mean())),
            nearest(view.q, m, view.distances_m),
            at_random(view.q, m, rng),
        )
        rows[:, m - 1] = [selection.value / whole for selection in chosen]
    return rows


def _c36(seeds: int = SEEDS) -> Outcome:
    found = np.stack([shares(make_view(seed), seed) for seed in range(seeds)])
    few = range(CAMERAS - 1)
    leads = found[:, 0] - found[:, PROGRAMS.index("random")]
    better = sum(interval(leads[:, m])[1] > 0.0 for m in few)
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for m in (2, 4, 6):
        for row, program in enumerate(PROGRAMS):
            name = f"share_of_all_{program.replace(' ', '_')}_{m}"
            mean, low, high = interval(found[:, row, m - 1])
            ours[name], ci95[name] = mean, (low, high)
    return Outcome(
        ours,
        ci95,
        better == len(few),
        f"over {seeds} scenes with {CAMERAS} cameras, 4 chosen greedily are worth "
        f"{ours['share_of_all_greedy_4']:.0%} of all, 4 at random {ours['share_of_all_random_4']:.0%}, the 4 "
        f"nearest {ours['share_of_all_nearest_4']:.0%}; greedy's mean lead over random is above zero with "
        f"its 95 % interval for {better} of {len(few)} M below N; its least lead in a single scene is "
        f"{leads.min():.3f}",
        (_chart(found), _table(found)),
    )


def _chart(found: FloatArray) -> Chart:
    """Return a chart of the shares over M with their intervals."""
    m = range(1, found.shape[2] + 1)
    curves = tuple(
        curve(program, m, [found[:, row, column - 1] for column in m]) for row, program in enumerate(PROGRAMS)
    )
    return Chart(
        "What M of 12 cameras see",
        "cameras that send",
        "F(S) / F(all)",
        curves,
        note="Greedy by cost may spend the bytes of M mean images, on however many cameras.",
    )


def _table(found: FloatArray) -> Table:
    means: list[list[float]] = found.mean(axis=0).tolist()
    rows: list[tuple[str | float, ...]] = [
        (program, *row) for program, row in zip(PROGRAMS, means, strict=True)
    ]
    header = ("cameras that send", *(str(m + 1) for m in range(found.shape[2])))
    return Table("F(S) / F(all), mean over the scenes", header, tuple(rows))


CLAIMS = (
    Claim(
        id="C36",
        claim="Fewer cameras than there are, chosen well, keep most of the view",
        thesis="3.6.2: M of N cameras send; no number",
        tolerance=(
            "greedy choice worth more than a random one of equal size, in the mean over 20 scenes with its "
            "95 % interval, for every M below N"
        ),
        experiment=_c36,
    ),
)
