"""The benchmark behind the claims: its rooms, the entrants of each condition, and the trials."""

from __future__ import annotations

from dataclasses import replace

from lab.claims.registration.capture import CaptureTask
from lab.claims.registration.cases import CONDITIONS, Condition
from lab.claims.registration.entrants import PIXEL_PAIRS, Entrant, Lineup
from lab.claims.registration.trials import CaseTask
from lab.claims.registration.tuned import TUNED
from pipeline.config import Metric
from pipeline.registration.methods import METHODS
from pipeline.registration.peers import available_peers

ROOMS = range(100, 130)
"""Seeds of ``box_room``; lower seeds were used while the benchmark was developed."""
MAX_POINTS = 4000
CAPTURE_ROOMS = 6
CURVE_CONDITIONS = ("easy", "nodes-sensor")
"""Conditions with recorded convergence curves (Fig. 4.9)."""
CURVED = ("icp", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-n", "ceicp-a", "icp plane", "ceicp-a plane")
"""Entrants with recorded curves: the methods of Table 4.4 (CEICP as N and A), and ICP and CEICP-A with the
plane metric."""
ABLATED = ("easy", "bias-3", "holes-x3", "outliers-20", "nodes-sensor", "nodes-fused")
"""Conditions of the ablations."""
REVERSED = (
    *("icp", "icp-gated", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-literal", "ceicp-n", "ceicp-a"),
    *("icp plane", "icp-gated plane", "ceicp-n plane", "ceicp-a plane"),
)
"""Entrants that also run with the target matched to the source (p2q), except on the overlap series."""
OVERLAPPING = ("ficp", "ceicp-a")
"""The only methods that run point to point on the overlap series."""
SLOW = {
    "kernel-correlation": ("easy", "nodes-sensor"),
    "ceicp-ml": ("easy", "holes-x3", "nodes-sensor"),
}
"""Methods that take several times as long as others, and the only conditions in which they run."""
PLANE = ("icp", "icp-gated", "picp", "ficp", "fast-robust-icp", "ceicp-n", "ceicp-a", "ceicp-r")
"""Methods that also run with the point-to-plane metric."""
FAST_PEERS = ("open3d-plane", "open3d-gicp", "small-gicp", "small-gicp-staged", "small-vgicp-staged")
"""Other programs that take well under a second; CPD is left out: it takes minutes per condition."""
FIXED_GATE = "ceicp-n, T_d 0.3 m"
CAPTURED = (
    (Entrant("icp"), True),
    (Entrant("ficp"), True),
    (Entrant("ceicp-n", label=FIXED_GATE), False),
    (Entrant("ceicp-n"), True),
    (Entrant("ceicp-a", "plane"), True),
)
"""Entrants with a capture map, and whether the gate grows with the start's translation."""


def case_tasks() -> list[CaseTask]:
    """Return one task for each condition in each room, with tuned entrants."""
    lineups = {name: standard_lineup(condition) for name, condition in CONDITIONS.items()}
    return [
        CaseTask(CONDITIONS[name], room, lineup, MAX_POINTS, CURVED if name in CURVE_CONDITIONS else ())
        for room in ROOMS
        for name, lineup in lineups.items()
    ]


def capture_tasks() -> list[CaptureTask]:
    """Return one task for each entrant with a capture map in each of the first ``CAPTURE_ROOMS`` rooms."""
    return [
        CaptureTask(CONDITIONS["easy"], room, entrant, by_start, MAX_POINTS)
        for room in ROOMS[:CAPTURE_ROOMS]
        for entrant, by_start in CAPTURED
    ]


def standard_lineup(condition: Condition) -> Lineup:
    """Return the entrants of a condition, each with its direction of matching.

    Methods run point to point, on the overlap series only those in ``OVERLAPPING``; those in ``PLANE`` also
    run with the plane metric. Pixel pairs take part where both clouds are one node's and share their pixels.
    """
    name, single = condition.name, condition.clouds == "inferred"
    everyone = [e for e in methods() if name in SLOW.get(e.method, CONDITIONS)]
    forward = [e for e in everyone if condition.overlap is None or e.method in OVERLAPPING]
    forward += methods("plane")
    forward += (Entrant(PIXEL_PAIRS),) if single else ()
    forward += ablations("point" if single else "plane") if name in ABLATED else ()
    forward += peers()
    back = [e for e in forward if e.name in REVERSED and condition.overlap is None]
    return (
        *(("q2p", tuned(entrant)) for entrant in forward),
        *(("p2q", tuned(entrant)) for entrant in back),
    )


def tuned(entrant: Entrant) -> Entrant:
    """Return the entrant with its tuned value, if it was tuned."""
    if entrant.name not in TUNED:
        return entrant
    parameter, value, _ = TUNED[entrant.name]
    return replace(entrant, settings=((parameter, value), *entrant.settings))


def methods(metric: Metric = "point") -> tuple[Entrant, ...]:
    """Return all methods and gated ICP with one metric; with the plane metric only those in ``PLANE``."""
    names = ("icp", "icp-gated", *(name for name in METHODS if name != "icp"))
    return tuple(Entrant(name, metric) for name in names if metric == "point" or name in PLANE)


def peers() -> tuple[Entrant, ...]:
    """Return the installed other programs that are fast enough."""
    return tuple(Entrant(name) for name in available_peers() if name in FAST_PEERS)


def ablations(metric: Metric) -> tuple[Entrant, ...]:
    """Return CEICP variants with one part removed or changed; the thesis's formula is point to point only."""
    name = "ceicp-a" if metric == "point" else "ceicp-a plane"
    shared = tuple(
        Entrant(f"ceicp-a-{part}", metric, f"{name}, {label}", _tuned_settings(name))
        for part, label in (("gaussian", "w = p"), ("hard-gate", "hard gate"), ("fixed-sigma", "fixed sigma"))
    )
    if metric == "plane":
        both = (*_tuned_settings(name), ("direction", "both"))
        return (*shared, Entrant("ceicp-a", metric, f"{name}, both directions", both))
    return (
        *shared,
        Entrant("ceicp-n-gaussian", label="ceicp-n, w = p", settings=_tuned_settings("ceicp-n")),
        Entrant("ceicp-literal", label="ceicp-literal, metres", settings=(("unit", "m"),)),
        Entrant(
            "ceicp-literal-centroids",
            label="ceicp-literal, weighted centroids",
            settings=_tuned_settings("ceicp-literal"),
        ),
    )


def _tuned_settings(name: str) -> tuple[tuple[str, float | str], ...]:
    """Return the tuned setting of the entrant ``name``; empty if it was not tuned."""
    return ((TUNED[name][0], TUNED[name][1]),) if name in TUNED else ()
