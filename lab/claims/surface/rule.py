"""C21: the radii that the thesis prints follow its rule r_F to r_F + sigma_D (SPEC 5)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from lab.claims.claim import Claim, Outcome
from lab.claims.exhibits import Table
from lab.claims.surface.clouds import CHAINS, chain_clouds
from pipeline.config import PRESETS
from pipeline.io.demos import CALIBRATED_SCENES, load_demo
from pipeline.surface.radii import SIGMAS, radii, spacing

PRINTED_M = (0.0102, 0.0131, 0.0156, 0.0209)
"""Radii in the thesis's figures 4.2 to 4.5: before fusion."""
PRINTED_AFTER_M = (0.0102, 0.0156)
"""Radii in the thesis's figures 4.6 and 4.7: after fusion."""
TOLERANCE = 0.02
READINGS: dict[str, tuple[float, ...]] = {
    "r_F + {0, 1/4, 1/2, 1} sigma_D": SIGMAS["thesis"],
    "r_F + {0, 1/2, 1, 2} sigma_D": (0.0, 0.5, 1.0, 2.0),
    "r_F + {0, 1/3, 2/3, 1} sigma_D": (0.0, 1 / 3, 2 / 3, 1.0),
}
"""Multiples of sigma_D by reading: the rule, an alternative that exceeds r_F + sigma_D, and equal steps."""


def inferred_spacing(sigmas: tuple[float, ...]) -> tuple[float, float]:
    """Return r_F and sigma_D, metres, that make the first and the last of the printed radii exact."""
    return PRINTED_M[0], (PRINTED_M[-1] - PRINTED_M[0]) / (sigmas[-1] - sigmas[0])


def predicted_radii_m(sigmas: tuple[float, ...], r_F_m: float, sigma_D_m: float) -> tuple[float, ...]:
    """Return the radii of a reading."""
    return tuple(r_F_m + factor * sigma_D_m for factor in sigmas)


def deviation(radii_m: tuple[float, ...]) -> float:
    """Return the largest relative difference from the printed radii."""
    return float(np.max(np.abs(np.array(radii_m) / np.array(PRINTED_M) - 1.0)))


def readings_table() -> Table:
    """Return r_F and sigma_D that each reading infers from the first and the last printed radius."""
    first, third = _mm(PRINTED_AFTER_M)
    rows: list[tuple[str | float | None, ...]] = [
        ("printed before fusion", None, None, *_mm(PRINTED_M), None),
        ("printed after fusion", None, None, first, None, third, None, None),
    ]
    for reading, sigmas in READINGS.items():
        spacing_m = inferred_spacing(sigmas)
        radii_m = predicted_radii_m(sigmas, *spacing_m)
        rows.append((reading, *_mm(spacing_m), *_mm(radii_m), f"{deviation(radii_m):.1%}"))
    return Table(
        "The printed radii by three readings, in millimetres if the thesis's unit is the metre",
        ("reading", "r_F", "sigma_D", "1st", "2nd", "3rd", "4th", "largest deviation"),
        tuple(rows),
        "r_F and sigma_D are inferred: they make the first and the last radius exact, so that only the two "
        "between them test a reading. Half the sigma_D with twice the multiples gives the same numbers; it "
        "would make the radii after fusion r_F and r_F + sigma_D, but the largest ball before fusion would "
        "lie beyond the rule's end.",
    )


def scenes_table() -> Table:
    """Return our own r_F, sigma_D and radii, before and after fusion, of the first node of each scene."""
    rows: list[tuple[str | float, ...]] = []
    for scene in CALIBRATED_SCENES:
        rig = load_demo(scene)
        for preset, how in CHAINS.items():
            merged = chain_clouds(rig, 0, PRESETS[preset]).merged
            for when, cloud in (("before", merged.sensor), ("after", merged.fused)):
                spacing_m = spacing(cloud.points_m)
                radii_m = radii(PRESETS["thesis"].surface, *spacing_m)
                rows.append((f"{scene}, {how}, {when} fusion", len(cloud), *_mm((*spacing_m, *radii_m))))
    return Table(
        "The rule on our scenes, in millimetres",
        ("cloud", "points", "r_F", "sigma_D", "1st", "2nd", "3rd", "4th"),
        tuple(rows),
        "First node of each scene, thinned as the chain does. The thesis takes the spacing of the fused "
        "cloud; the rows before fusion say what the sensor's cloud alone would give.",
    )


def _mm(values_m: Iterable[float]) -> tuple[float, ...]:
    return tuple(1000.0 * value for value in values_m)


def _experiment() -> Outcome:
    rule = READINGS["r_F + {0, 1/4, 1/2, 1} sigma_D"]
    r_F_m, sigma_D_m = inferred_spacing(rule)
    radii_m = predicted_radii_m(rule, r_F_m, sigma_D_m)
    worst = deviation(radii_m)
    ours = {"r_F_m": r_F_m, "sigma_D_m": sigma_D_m, "largest_deviation": worst}
    ours |= {f"radius_{place}_m": radius_m for place, radius_m in enumerate(radii_m, 1)}
    even = READINGS["r_F + {0, 1/3, 2/3, 1} sigma_D"]
    ours["largest_deviation_even_steps"] = deviation(predicted_radii_m(even, *inferred_spacing(even)))
    predicted = ", ".join(f"{radius_m:.4f}" for radius_m in radii_m)
    return Outcome(
        ours,
        {},
        worst <= TOLERANCE,
        f"r_F = {r_F_m:.4f} m and sigma_D = {sigma_D_m:.4f} m give {predicted} m, at most {worst:.1%} from "
        f"print, where even steps would be {ours['largest_deviation_even_steps']:.0%} off; two of the four "
        "radii fix r_F and sigma_D, so only the two between them are a test",
        (readings_table(), scenes_table()),
    )


C21 = Claim(
    id="C21",
    claim="Ball radii from r_F to r_F + sigma_D",
    thesis="radii 0.0102, 0.0131, 0.0156 and 0.0209 before fusion, 0.0102 and 0.0156 after",
    tolerance="r_F + {0, 1/4, 1/2, 1} sigma_D gives each printed radius within 2 %",
    experiment=_experiment,
)
