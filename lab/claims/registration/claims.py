"""C16 to C20: the thesis's claims about CEICP, tested on one common benchmark (SPEC 8)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from lab.claims.claim import Claim, Outcome, bootstrap_ci95
from lab.claims.registration.capture import map_capture
from lab.claims.registration.cases import CONDITIONS
from lab.claims.registration.curves import capture_maps, captured_rooms, convergence_charts
from lab.claims.registration.entrants import PIXEL_PAIRS
from lab.claims.registration.results import Results
from lab.claims.registration.setup import FIXED_GATE, capture_tasks, case_tasks
from lab.claims.registration.statistics import Comparison, compare, holm
from lab.claims.registration.tables import (
    NODES,
    ablation_table,
    compared,
    comparison_table,
    conditions_table,
    lost,
    table_4_4,
    tuning_table,
)
from lab.claims.registration.trials import run_case
from lab.places.judging import wilson
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.types import FloatArray

ONE_NODE = tuple(name for name, condition in CONDITIONS.items() if condition.clouds == "inferred")
BEATEN = ("icp", "picp", "ricp", "mricp")
"""Rivals that CEICP beats according to C16; others are only reported."""
REPORTED = (
    *("ficp", "hicp", "icp-gated", PIXEL_PAIRS, "ceicp-a plane"),
    *("open3d-gicp", "small-gicp", "small-gicp-staged", "fast-robust-icp"),
)
OTHERS = (
    *("trimmed-icp", "ceicp-literal", "ceicp-r", "ceicp-ml", "open3d-plane"),
    *("icp plane", "icp-gated plane", "ficp plane", "ceicp-n plane", "fast-robust-icp plane"),
)
STRICT_P = 0.01
"""Corrected p below which CEICP beats a rival."""
MEASURES = ("ratio", "p")


def registration_results(folder: Path, scheduler: str | None) -> Generator[Progress, None, Results]:
    """Run the whole benchmark."""
    trials = yield from iterate_trials("C16 to C20, registration", run_case, case_tasks(), folder, scheduler)
    cells = yield from iterate_trials("C20, capture range", map_capture, capture_tasks(), folder, scheduler)
    return Results(chain(*trials), chain(*cells))


def _c16(results: Results) -> Outcome:
    rivals = (*BEATEN, *REPORTED, *OTHERS)
    by_method = {
        ours: compared(results, ours, tuple(rival for rival in rivals if rival != ours), ONE_NODE)
        for ours in ("ceicp-a", "ceicp-n", "ceicp-a plane")
    }
    back = compared(results, "ceicp-a", rivals, ONE_NODE, direction="p2q")
    judged = [c for c in by_method["ceicp-a"] if c.rival in BEATEN]
    beaten = [c for c in judged if c.ratio < 1.0 and c.p < STRICT_P]
    ahd = compared(results, "ceicp-a", BEATEN, ONE_NODE, "ahd_cm")
    ours = {f"ahd_ratio_ceicp-a_{c.rival}": c.ratio for c in ahd}
    for name, comparisons in by_method.items():
        ours |= _numbers(name, [c for c in comparisons if c.rival not in OTHERS])
    ours |= _numbers("ceicp-a_p2q", back)
    ratios = ", ".join(f"{c.rival} {c.ratio:.2f} (p {c.p:.1g})" for c in judged)
    reported = ", ".join(
        f"{c.rival} {c.ratio:.2f} ({c.outcome})" for c in by_method["ceicp-a"] if c.rival in REPORTED
    )
    plane_rivals = tuple(e for e in results.entrants(NODES) if not e.startswith("ceicp-a plane"))
    exhibits = (
        table_4_4(results),
        conditions_table(results, "q2p"),
        conditions_table(results, "p2q"),
        *(
            comparison_table(f"One node, all six conditions: {name} against the rest", name, comparisons)
            for name, comparisons in by_method.items()
        ),
        comparison_table(
            "One node, all six conditions, target matched to source (p2q): ceicp-a against the rest",
            "ceicp-a",
            back,
        ),
        comparison_table(
            "Two nodes, sensor and fused: ceicp-a plane against the rest",
            "ceicp-a plane",
            compared(results, "ceicp-a plane", plane_rivals, NODES),
        ),
        tuning_table(),
    )
    return Outcome(
        ours,
        {},
        len(beaten) == len(BEATEN),
        f"median ratio of the point errors of CEICP-A and its rivals over {judged[0].cases} trials: "
        f"{ratios}; not part of the claim: {reported}; target matched to source {_backward(back)}. "
        f"{_losses(results)}. By average Hausdorff distance on the overlap the ratio to ICP is "
        f"{ahd[0].ratio:.2f}",
        exhibits,
    )


def _backward(comparisons: Sequence[Comparison]) -> str:
    """Return the claim's rivals, and gated ICP, matched in the reverse direction, as text."""
    shown = (*BEATEN, "icp-gated")
    return ", ".join(f"{c.rival} {c.ratio:.2f} ({c.outcome})" for c in comparisons if c.rival in shown)


def _losses(results: Results) -> str:
    """Return where CEICP-A's median error is above that of ICP, gated ICP and pixel pairs, by metric."""
    parts = []
    for ours in ("ceicp-a", "ceicp-a plane"):
        by_rival = {
            rival: lost(results, ours, rival, ONE_NODE) for rival in ("icp", "icp-gated", PIXEL_PAIRS)
        }
        parts += [
            f"{ours} loses to {rival} in {len(labels)} of {len(ONE_NODE)} conditions"
            + (f" ({'; '.join(labels)})" if labels else "")
            for rival, labels in by_rival.items()
        ]
    return ", ".join(parts)


def _c17(results: Results) -> Outcome:
    icp_cm = results.values("icp", ("easy",))
    ours: dict[str, float] = {"point_error_m_icp": float(np.median(icp_cm)) / 100.0}
    ci95 = {"point_error_m_icp": _in_metres(bootstrap_ci95(icp_cm, statistic=np.median))}
    for name in ("ceicp-n", "ceicp-a", "ceicp-literal"):
        errors_cm = results.values(name, ("easy",))
        ours[f"point_error_m_{name}"] = float(np.median(errors_cm)) / 100.0
        ci95[f"point_error_m_{name}"] = _in_metres(bootstrap_ci95(errors_cm, statistic=np.median))
        ours[f"point_error_ratio_{name}"] = float(np.median(errors_cm) / np.median(icp_cm))
        ci95[f"point_error_ratio_{name}"] = ratio_of_medians_ci95(errors_cm, icp_cm)
        ahd = [np.median(results.values(who, ("easy",), "ahd_cm")) for who in (name, "icp")]
        ours[f"ahd_ratio_{name}"] = float(ahd[0] / ahd[1])
    back_cm = {who: results.values(who, ("easy",), direction="p2q") for who in ("ceicp-n", "icp")}
    ours["point_error_m_icp_p2q"] = float(np.median(back_cm["icp"])) / 100.0
    ours["point_error_ratio_ceicp-n_p2q"] = float(np.median(back_cm["ceicp-n"]) / np.median(back_cm["icp"]))
    ratio, (_, high) = ours["point_error_ratio_ceicp-n"], ci95["point_error_ratio_ceicp-n"]
    return Outcome(
        ours,
        ci95,
        high <= 0.6,
        f"CEICP-N over ICP is {ratio:.2f} in point error and {ours['ahd_ratio_ceicp-n']:.2f} in average "
        "Hausdorff distance when each point of the complete cloud is matched to the holed one; matched the "
        f"other way round it is {ours['point_error_ratio_ceicp-n_p2q']:.2f}, and ICP's own error goes from "
        f"{1000.0 * ours['point_error_m_icp']:.1f} to {1000.0 * ours['point_error_m_icp_p2q']:.1f} mm",
        (ablation_table(results),),
    )


def ratio_of_medians_ci95(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of median(a) / median(b) over paired cases."""
    pairs = np.stack([a, b], axis=1)
    return bootstrap_ci95(pairs, statistic=lambda pairs, axis: np.divide(*np.median(pairs, axis=axis).T))


def _c18(results: Results) -> Outcome:
    comparisons = tuple(
        compare(name, results.values(name, ONE_NODE), results.values("mricp", ONE_NODE))
        for name in ("ceicp-literal", "ceicp-n", "ceicp-a")
    )
    comparisons = holm(comparisons)
    ours = {f"{name}_{c.rival}_mricp": getattr(c, name) for c in comparisons for name in MEASURES}
    annealed = comparisons[-1]
    ratios = ", ".join(f"{c.rival} {c.ratio:.2f} ({c.outcome}, p {c.p:.1g})" for c in comparisons)
    return Outcome(
        ours,
        {},
        annealed.outcome != "worse",
        f"point error over MRICP's, all conditions of one node: {ratios}; the thesis's own numbers are 11 to "
        "39 % below MRICP's, so “comparable” understates them",
    )


def _c19(results: Results) -> Outcome:
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for entrant in ("icp", "ceicp-n", "ceicp-a", "icp plane", "ceicp-n plane", "ceicp-a plane"):
        for quantity in ("k90", "iterations"):
            values = results.values(entrant, ("easy",), quantity)
            values = values[np.isfinite(values)]
            if len(values):
                ours[f"{quantity}_{entrant}"] = float(np.median(values))
                ci95[f"{quantity}_{entrant}"] = bootstrap_ci95(values, statistic=np.median)
    faster = all(_faster(results, name, q) for name in ("ceicp-n", "ceicp-a") for q in ("k90", "iterations"))
    point, plane = (
        ", ".join(f"{who} {ours[f'k90_{who}']:g} and {ours[f'iterations_{who}']:g}" for who in group)
        for group in (("icp", "ceicp-n", "ceicp-a"), ("icp plane", "ceicp-n plane", "ceicp-a plane"))
    )
    return Outcome(
        ours,
        ci95,
        faster,
        f"median iterations to 90 % of the drop and in all: point to point {point}; point to plane {plane}",
        (*convergence_charts(results, "easy"), *convergence_charts(results, "nodes-sensor")),
    )


def _faster(results: Results, entrant: str, quantity: str) -> bool:
    """Whether an entrant needs significantly fewer iterations than ICP, point to point."""
    mine, icp = (results.values(who, ("easy",), quantity) for who in (entrant, "icp"))
    both = np.isfinite(mine) & np.isfinite(icp)
    return compare("icp", np.maximum(mine[both], 1.0), np.maximum(icp[both], 1.0)).outcome == "better"


def _c20(results: Results) -> Outcome:
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    why = []
    for entrant in dict.fromkeys(cell["entrant"] for cell in results.cells):
        captured = captured_rooms(results, entrant)
        ends = {"nearest": captured[min(captured)], "farthest": captured[max(captured)]}
        for end, rooms in ends.items():
            ours[f"captured_{end}_{entrant}"] = float(np.mean(rooms))
            ci95[f"captured_{end}_{entrant}"] = wilson(sum(rooms), len(rooms))
        mean = ours[f"captured_mean_{entrant}"] = float(np.mean(list(captured.values())))
        near, far = (f"{sum(rooms)} of {len(rooms)}" for rooms in ends.values())
        why.append(f"{entrant} {near} and {far}, {mean:.0%} from all starts")
    return Outcome(
        ours,
        ci95,
        ours[f"captured_farthest_{FIXED_GATE}"] <= 0.5 * ours[f"captured_nearest_{FIXED_GATE}"],
        "rooms that end within 1.5 degrees and 5 cm from the nearest and the farthest start: "
        + "; ".join(why),
        capture_maps(results),
    )


def _numbers(name: str, comparisons: Sequence[Comparison]) -> dict[str, float]:
    """Return ratios and p values by name."""
    return {f"{measure}_{name}_{c.rival}": getattr(c, measure) for c in comparisons for measure in MEASURES}


def _in_metres(interval_cm: tuple[float, float]) -> tuple[float, float]:
    return interval_cm[0] / 100.0, interval_cm[1] / 100.0


CLAIMS = (
    Claim(
        id="C16",
        claim="CEICP is the most accurate of seven methods",
        thesis="Table 4.4: 4.361, 5.5484 and 7.6874, lowest of seven in each of three scenes",
        tolerance=(
            "order only: CEICP-A's point error below that of ICP, PICP, RICP and MRICP over the six "
            "conditions of one node, Holm-corrected p < 0.01 each; FICP, HICP and GICP are reported"
        ),
        experiment=_c16,
        prepare=registration_results,
    ),
    Claim(
        id="C17",
        claim="CEICP's error is a third to a half of ICP's",
        thesis="Table 4.4: CEICP over ICP 0.53, 0.55 and 0.32",
        tolerance=(
            "median point error of CEICP-N at most 0.6 times ICP's, with its 95 % interval (easy, the "
            "complete cloud is matched to the sensor's); the ratio of average Hausdorff distances on the "
            "overlap is reported"
        ),
        experiment=_c17,
        prepare=registration_results,
    ),
    Claim(
        id="C18",
        claim="CEICP is comparable to MRICP",
        thesis="“comparable”; CEICP over MRICP 0.89, 0.84 and 0.61 in Table 4.4",
        tolerance="CEICP-A not significantly worse than MRICP in point error; being better is reported",
        experiment=_c18,
        prepare=registration_results,
    ),
    Claim(
        id="C19",
        claim="CEICP converges faster than ICP, point to point",
        thesis="Fig. 4.9: curves of CEICP, PICP and MRICP; “faster” in 5.2",
        tolerance=(
            "CEICP-N and CEICP-A need significantly fewer iterations than ICP, in all and to 90 % of the "
            "error's drop (easy); the plane metric is reported, too"
        ),
        experiment=_c19,
        prepare=registration_results,
    ),
    Claim(
        id="C20",
        claim="CEICP needs a nearly aligned start",
        thesis="stated in 5.2, without a number",
        tolerance=(
            "CEICP-N with a fixed T_d of 0.3 m is captured from the farthest start (45 degrees, 0.6 m) in at "
            "most half as many rooms as from the nearest (5 degrees, 0.1 m); other gates are reported"
        ),
        experiment=_c20,
        prepare=registration_results,
    ),
)
