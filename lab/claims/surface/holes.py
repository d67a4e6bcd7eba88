"""C22: far fewer apparent holes after fusion for ball radii from r_F + sigma_D (SPEC 5)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from lab.claims.claim import Claim, Outcome, bootstrap_ci95
from lab.claims.exhibits import Exhibit, Table
from lab.claims.surface.clouds import CHAINS, ChainClouds, chain_clouds
from lab.claims.surface.figures import thesis_figures
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.config import PRESETS
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.io.demos import CALIBRATED_SCENES, SCENES, load_demo
from pipeline.kernels.rays import hit_depth
from pipeline.surface.radii import SIGMAS
from pipeline.types import FloatArray

CLOSE_DEPTH = 0.05
RULES: dict[str, tuple[float, ...]] = {
    "r_F": (0.0,),
    "r_F + sigma_D": (1.0,),
    "r_F to r_F + sigma_D": SIGMAS["thesis"],
    "r_F to r_F + 4 sigma_D": SIGMAS["thesis+"],
}
"""Multiples of sigma_D that are added to r_F, by the rule's name."""
JUDGED = "r_F + sigma_D"
CLOUDS = (
    ("sensor, thesis preset", "thesis", "before"),
    ("union (thesis)", "thesis", "after"),
    ("sensor, packetmesh preset", "packetmesh", "before"),
    ("fill (packetmesh)", "packetmesh", "after"),
)
"""Name, chain and stage of each cloud."""
OWN_RULES = {"thesis": "r_F to r_F + sigma_D", "packetmesh": "r_F to r_F + 4 sigma_D"}
"""Each chain's own rule, by which its median depth error is reported."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Measures of a surface along the rays of its camera."""

    no_hit_share: float
    """Share of all pixel rays without a hit."""
    close_share: float
    """Share of the rays with a true surface that hit within 5 % of the true depth."""
    median_depth_error_m: float
    """Median over the rays that hit both surfaces."""
    loops: int
    """Boundary loops of the mesh."""


Measured = dict[tuple[str, str, str], list[Seen]]
"""By chain, ``before`` or ``after`` fusion, and rule: the measures of each frame, in the same order."""


def seen(clouds: ChainClouds, when: str, sigmas: tuple[float, ...]) -> Seen:
    """Roll over the cloud before or after fusion, and measure the surface from the node's camera."""
    surface, camera = clouds.rolled(when, sigmas), clouds.camera
    depth = hit_depth(surface.vertices_m, surface.triangles, camera.intrinsics, camera.T_world_camera)
    there = clouds.true_depth.valid
    z_m = clouds.true_depth.z_m[there]
    error_m = np.abs(depth.z_m[there] - z_m)
    return Seen(
        1.0 - depth.coverage,
        float((error_m <= CLOSE_DEPTH * z_m).mean()),
        float(np.median(error_m[np.isfinite(error_m)])),
        surface.quality.boundary_loops,
    )


def node_trial(node: tuple[str, int]) -> list[dict[str, Any]]:
    """Measure a node's surfaces by both chains, before and after fusion, by every rule."""
    scene, index = node
    rig = load_demo(scene)
    return [
        {"of": [preset, when, rule], "seen": asdict(seen(clouds, when, sigmas))}
        for preset in CHAINS
        for clouds in [chain_clouds(rig, index, PRESETS[preset])]
        for when in ("before", "after")
        for rule, sigmas in RULES.items()
    ]


def study(folder: Path, scheduler: str | None) -> Generator[Progress, None, Measured]:
    """Run every node of the demo scenes as a rig of its own."""
    nodes = [(scene, index) for scene in CALIBRATED_SCENES for index in range(len(load_demo(scene).frames))]
    found = yield from iterate_trials(
        "C22, holes", node_trial, nodes, folder, scheduler, data=(SHIPPED_MODEL, SHIPPED_COMPLETION, SCENES)
    )
    measured: Measured = {}
    for entry in chain(*found):
        preset, when, rule = entry["of"]
        measured.setdefault((preset, when, rule), []).append(Seen(**entry["seen"]))
    return measured


def figures() -> tuple[Exhibit, ...]:
    """Return the thesis's figures on the first node of the first scene, by both chains."""
    rig = load_demo(CALIBRATED_SCENES[0])
    return tuple(thesis_figures(chain_clouds(rig, 0, PRESETS[preset]), how) for preset, how in CHAINS.items())


def judge(measured: Measured, pictures: tuple[Exhibit, ...] = ()) -> Outcome:
    """Return C22's numbers and verdict."""
    series: dict[str, FloatArray] = {}
    for preset in CHAINS:
        before, after = (_column(measured, preset, when, "no_hit_share") for when in ("before", "after"))
        series[f"no_hit_before_{preset}"] = before
        series[f"no_hit_after_{preset}"] = after
        series[f"no_hit_ratio_{preset}"] = after / before
        for when in ("before", "after"):
            errors_m = _column(measured, preset, when, "median_depth_error_m", OWN_RULES[preset])
            series[f"median_depth_error_{when}_m_{preset}"] = errors_m
            series[f"close_{when}_{preset}"] = _column(measured, preset, when, "close_share")
            series[f"loops_{when}_{preset}"] = _column(measured, preset, when, "loops")
    ours = {key: float(np.mean(values)) for key, values in series.items()}
    ratio = series["no_hit_ratio_thesis"]
    by_chain = "; ".join(_sentence(ours, preset, how) for preset, how in CHAINS.items())
    return Outcome(
        ours=ours,
        ci95={key: bootstrap_ci95(values) for key, values in series.items()},
        reproduced=bootstrap_ci95(ratio)[1] <= 0.5,
        why=f"{by_chain}; halved by the union in {np.sum(ratio <= 0.5)} of {len(ratio)} frames",
        exhibits=(rays_table(measured), loops_table(measured), *pictures),
    )


def _sentence(ours: dict[str, float], preset: str, how: str) -> str:
    missed, close, loops, error_m = (
        tuple(ours[f"{name}_{when}{unit}_{preset}"] for when in ("before", "after"))
        for name, unit in (("no_hit", ""), ("close", ""), ("loops", ""), ("median_depth_error", "_m"))
    )
    return (
        f"by {how} the rays without a surface go from {missed[0]:.1%} to {missed[1]:.1%} at r_F + sigma_D, "
        f"those within 5 % of the true depth from {close[0]:.1%} to {close[1]:.1%} and the boundary loops "
        f"from {loops[0]:.0f} to {loops[1]:.0f}, while the median depth error by the "
        f"chain's own radii goes from {1000 * error_m[0]:.0f} to {1000 * error_m[1]:.0f} mm"
    )


def _column(measured: Measured, preset: str, when: str, name: str, rule: str = JUDGED) -> FloatArray:
    """Return (frames,) one measure."""
    return np.array([float(getattr(seen, name)) for seen in measured[preset, when, rule]])


def rays_table(measured: Measured) -> Table:
    """Return a table of the cameras' rays by cloud and radius rule."""

    def cell(preset: str, when: str, rule: str) -> str:
        missed, close, error_m = (
            np.mean(_column(measured, preset, when, quantity, rule))
            for quantity in ("no_hit_share", "close_share", "median_depth_error_m")
        )
        return f"{missed:.0%} / {close:.0%} / {100.0 * error_m:.1f} cm"

    frames = len(measured["thesis", "before", JUDGED])
    return Table(
        "Rays that find nothing / rays within 5 % of the true depth / median depth error",
        ("cloud", *RULES),
        tuple((name, *(cell(preset, when, rule) for rule in RULES)) for name, preset, when in CLOUDS),
        f"Means over {frames} frames, each node alone at its true pose; r_F and sigma_D are those of the "
        "chain's fused cloud, for the cloud before fusion too. The first share is of all rays, the second "
        "of those that truly hit something. The union closes holes at the price of accuracy, because two "
        "layers lie on each other where the sensor has measured.",
    )


def loops_table(measured: Measured) -> Table:
    """Return a table of boundary loops by cloud and radius rule."""

    def cell(preset: str, when: str, rule: str) -> float:
        return float(np.mean(_column(measured, preset, when, "loops", rule)))

    return Table(
        "Boundary loops",
        ("cloud", *RULES),
        tuple((name, *(cell(preset, when, rule) for rule in RULES)) for name, preset, when in CLOUDS),
        "Mean number. It is no measure of apparent holes: between two layers there are many small loops, "
        "and a large hole is one loop.",
    )


C22 = Claim(
    id="C22",
    claim="Far fewer apparent holes after fusion for ball radii from r_F + sigma_D",
    thesis="“far fewer”, shown in pictures at 0.0102, 0.0131, 0.0156 and 0.0209 m",
    tolerance="rays without a surface at most halved: mean ratio and its 95 % interval at most 0.5",
    experiment=lambda measured: judge(measured, figures()),
    prepare=study,
)
