"""C23: a larger ball loses detail, measured on stairs (SPEC 5)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.stats import spearmanr

from lab.claims.claim import Claim, Outcome, bootstrap_ci95, mean_curve
from lab.claims.exhibits import Chart, Table, plain_curve
from lab.claims.surface.stairs import feet_samples, stairs, stairs_cloud
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.radii import spacing
from pipeline.surface.truth import sample_surface
from pipeline.types import FloatArray

SPACINGS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Ball radii over the mean nearest-neighbour distance."""
CLOUDS = 10
SAMPLES = 10_000
CLOSE_M = 0.01
STRONG = -0.8
"""Largest rank correlation at which the accuracy counts as falling."""


@dataclass(frozen=True, slots=True)
class Detail:
    """Measures of one ball's surface of the stairs."""

    radius_m: float
    accuracy_1cm: float
    """Share of the mesh's area within 1 cm of the stairs."""
    coverage_1cm: float
    """Share of the stairs' area with the mesh within 1 cm."""
    foot_gap_m: float
    """Mean distance of the inner edges from the mesh."""


def study(folder: Path, scheduler: str | None) -> Generator[Progress, None, list[list[Detail]]]:
    """Run the same balls over several clouds."""
    found = yield from iterate_trials("C23, stairs", stairs_trial, range(CLOUDS), folder, scheduler)
    return [[Detail(**detail) for detail in run] for run in found]


def stairs_trial(seed: int) -> list[dict[str, Any]]:
    """Return the details of one cloud, as plain values."""
    return [asdict(detail) for detail in details(seed)]


def details(seed: int, spacings: Sequence[float] = SPACINGS) -> tuple[Detail, ...]:
    """Roll balls of growing size, each alone, over one noisy cloud of the stairs."""
    target = stairs()
    cloud = stairs_cloud(target, seed)
    truth, feet_m = triangle_scene(target.vertices_m, target.triangles), feet_samples(target)
    r_F_m, _ = spacing(cloud.points_m)
    rng = np.random.default_rng(seed)
    found = []
    for factor in spacings:
        surface = reconstruct_surface(cloud, [factor * r_F_m])
        mesh = triangle_scene(surface.vertices_m, surface.triangles)
        on_mesh_m = sample_surface(surface.vertices_m, surface.triangles, SAMPLES, rng)
        on_target_m = sample_surface(target.vertices_m, target.triangles, SAMPLES, rng)
        errors_m, missing_m, gaps_m = (
            scene.compute_distance(tensor(points_m, np.float32)).numpy()
            for scene, points_m in ((truth, on_mesh_m), (mesh, on_target_m), (mesh, feet_m))
        )
        accuracy, coverage = (float((far_m <= CLOSE_M).mean()) for far_m in (errors_m, missing_m))
        found.append(Detail(factor * r_F_m, accuracy, coverage, float(gaps_m.mean())))
    return tuple(found)


def judge(runs: Sequence[Sequence[Detail]], spacings: Sequence[float] = SPACINGS) -> Outcome:
    """Return C23's numbers and verdict from the same balls on several clouds."""
    accuracy, coverage, gap_m, radius_m = (
        np.array([[getattr(detail, name) for detail in run] for run in runs])
        for name in ("accuracy_1cm", "coverage_1cm", "foot_gap_m", "radius_m")
    )
    rank = np.array([_rank_correlation(spacings, row) for row in accuracy])
    loss = accuracy[:, 0] - accuracy[:, -1]
    fitted = isotonic_regression(accuracy.mean(axis=0), increasing=False).x
    series = {"rank_correlation": rank, "accuracy_lost": loss}
    series |= {
        f"{name}_{end}": values[:, column]
        for name, values in (("accuracy_1cm", accuracy), ("coverage_1cm", coverage), ("foot_gap_m", gap_m))
        for end, column in (("smallest", 0), ("largest", -1))
    }
    ours = {key: float(values.mean()) for key, values in series.items()}
    ours["off_a_falling_curve"] = float(np.abs(accuracy.mean(axis=0) - fitted).max())
    ci95 = {key: bootstrap_ci95(values) for key, values in series.items()}
    return Outcome(
        ours,
        ci95,
        ci95["rank_correlation"][1] <= STRONG and ci95["accuracy_lost"][0] > 0.0,
        f"from a ball of {spacings[0]:g} to one of {spacings[-1]:g} point spacings the share of the mesh "
        f"within 1 cm of the stairs goes from {ours['accuracy_1cm_smallest']:.1%} to "
        f"{ours['accuracy_1cm_largest']:.1%}, rank correlation {ours['rank_correlation']:.2f}, and the gap "
        f"at the steps' feet from {1000 * ours['foot_gap_m_smallest']:.1f} to "
        f"{1000 * ours['foot_gap_m_largest']:.1f} mm; the smallest ball in turn leaves "
        f"{1 - ours['coverage_1cm_smallest']:.0%} of the stairs without a surface within 1 cm",
        (
            _chart(spacings, accuracy, coverage, fitted),
            _table(spacings, radius_m, accuracy, coverage, gap_m),
        ),
    )


def _rank_correlation(spacings: Sequence[float], accuracy: FloatArray) -> float:
    """Return Spearman's rank correlation; 0 if the accuracy never changes."""
    return 0.0 if np.ptp(accuracy) == 0.0 else float(spearmanr(spacings, accuracy).statistic)


def _chart(
    spacings: Sequence[float], accuracy: FloatArray, coverage: FloatArray, fitted: FloatArray
) -> Chart:
    return Chart(
        "Stairs: accuracy and coverage against the ball's radius",
        "ball radius / point spacing",
        "share within 1 cm",
        (
            mean_curve("accuracy", spacings, accuracy.T),
            mean_curve("coverage", spacings, coverage.T),
            plain_curve("best falling curve", spacings, fitted),
        ),
        f"Steps of 3 to 8 cm, points 1 cm apart with 2 mm of noise, {len(accuracy)} clouds; mean and its "
        "95 % bootstrap interval.",
    )


def _table(
    spacings: Sequence[float],
    radius_m: FloatArray,
    accuracy: FloatArray,
    coverage: FloatArray,
    gap_m: FloatArray,
) -> Table:
    rows = []
    for column, factor in enumerate(spacings):
        mean_mm = 1000.0 * float(radius_m[:, column].mean())
        rows.append(
            (
                f"{factor:g}",
                mean_mm,
                f"{accuracy[:, column].mean():.1%}",
                f"{coverage[:, column].mean():.1%}",
                1000.0 * float(gap_m[:, column].mean()),
                mean_mm / 2.0**0.5,
            )
        )
    return Table(
        "Stairs: what each ball makes of them",
        (
            "radius / spacing",
            "radius (mm)",
            "accuracy at 1 cm",
            "coverage at 1 cm",
            "gap at the steps' feet (mm)",
            "radius / √2 (mm)",
        ),
        tuple(rows),
        "A ball in a right angle touches its two faces one radius from the edge, and the triangle between "
        "them is radius / √2 away; where a step is lower than the ball, it rolls over its head instead.",
    )


C23 = Claim(
    id="C23",
    claim="A larger ball loses detail",
    thesis="stated in 5.2, without a number",
    tolerance=(
        "on stairs, accuracy at 1 cm falls with the radius from 1 to 8 point spacings: mean rank correlation "
        "at most -0.8 with its 95 % interval, and the largest ball less accurate than the smallest"
    ),
    experiment=judge,
    prepare=study,
)
