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
"""Seeds of ``box_room``; rooms before them were looked at while the benchmark was made."""
MAX_POINTS = 4000
CAPTURE_ROOMS = 6
CURVE_CONDITIONS = ("easy", "nodes-sensor")
"""Where convergence curves are recorded (Fig. 4.9)."""
CURVED = ("icp", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-n", "ceicp-a", "icp plane", "ceicp-a plane")
"""The entrants with curves: the methods of Table 4.4, and the plane metric."""
ABLATED = ("easy", "bias-3", "holes-x3", "outliers-20", "nodes-sensor", "nodes-fused")
"""Where the ablations run."""
REVERSED = (
    *("icp", "icp-gated", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-literal", "ceicp-n", "ceicp-a"),
    *("icp plane", "icp-gated plane", "ceicp-n plane", "ceicp-a plane"),
)
"""The entrants that match target to source as well: Table 4.4, and the plane metric beside it. The overlap
series has one direction."""
OVERLAPPING = ("ficp", "ceicp-a")
"""Methods that run point to point on the overlap series as well; those without a gate are lost there."""
SLOW = {
    "kernel-correlation": ("easy", "nodes-sensor"),
    "ceicp-ml": ("easy", "holes-x3", "nodes-sensor"),
}
"""Methods that take several times as long as the rest, and the conditions that they take part in."""
PLANE = ("icp", "icp-gated", "picp", "ficp", "fast-robust-icp", "ceicp-n", "ceicp-a", "ceicp-r")
"""Methods that run with the point-to-plane metric as well."""
FAST_PEERS = ("open3d-plane", "open3d-gicp", "small-gicp", "small-gicp-staged", "small-vgicp-staged")
"""Other programs that take well under a second; CPD takes minutes for a condition."""
FIXED_GATE = "ceicp-n, T_d 0.3 m"
CAPTURED = (
    (Entrant("icp"), True),
    (Entrant("ficp"), True),
    (Entrant("ceicp-n", label=FIXED_GATE), False),
    (Entrant("ceicp-n"), True),
    (Entrant("ceicp-a", "plane"), True),
)
"""The entrants whose capture range is mapped, and whether the gate grows with the start's distance."""


def case_tasks() -> list[CaseTask]:
    """A trial of each condition in each room, every entrant tuned."""
    lineups = {name: standard_lineup(condition) for name, condition in CONDITIONS.items()}
    return [
        CaseTask(CONDITIONS[name], room, lineup, MAX_POINTS, CURVED if name in CURVE_CONDITIONS else ())
        for room in ROOMS
        for name, lineup in lineups.items()
    ]


def capture_tasks() -> list[CaptureTask]:
    """The capture ranges in each of the first few rooms."""
    return [
        CaptureTask(CONDITIONS["easy"], room, entrant, by_start, MAX_POINTS)
        for room in ROOMS[:CAPTURE_ROOMS]
        for entrant, by_start in CAPTURED
    ]


def standard_lineup(condition: Condition) -> Lineup:
    """The entrants of a condition.

    Both metrics everywhere, but on the overlap series, where few run point to point. A node's own two clouds
    share their pixels, so that pixel pairs take part.
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
    """The entrant with the value that tuning chose for it, if it was tuned."""
    if entrant.name not in TUNED:
        return entrant
    parameter, value, _ = TUNED[entrant.name]
    return replace(entrant, settings=((parameter, value), *entrant.settings))


def methods(metric: Metric = "point") -> tuple[Entrant, ...]:
    """Every method, and ICP with a gate, with one metric."""
    names = ("icp", "icp-gated", *(name for name in METHODS if name != "icp"))
    return tuple(Entrant(name, metric) for name in names if metric == "point" or name in PLANE)


def peers() -> tuple[Entrant, ...]:
    """The installed other programs that are fast enough."""
    return tuple(Entrant(name) for name in available_peers() if name in FAST_PEERS)


def ablations(metric: Metric) -> tuple[Entrant, ...]:
    """CEICP with a part taken out; the thesis's own formula only exists point to point."""
    name = "ceicp-a" if metric == "point" else "ceicp-a plane"
    shared = tuple(
        Entrant(f"ceicp-a-{part}", metric, f"{name}, {label}", _like(name))
        for part, label in (("gaussian", "w = p"), ("hard-gate", "hard gate"), ("fixed-sigma", "fixed sigma"))
    )
    if metric == "plane":
        both = (*_like(name), ("direction", "both"))
        return (*shared, Entrant("ceicp-a", metric, f"{name}, both directions", both))
    return (
        *shared,
        Entrant("ceicp-n-gaussian", label="ceicp-n, w = p", settings=_like("ceicp-n")),
        Entrant("ceicp-literal", label="ceicp-literal, metres", settings=(("unit", "m"),)),
        Entrant(
            "ceicp-literal-centroids",
            label="ceicp-literal, weighted centroids",
            settings=_like("ceicp-literal"),
        ),
    )


def _like(name: str) -> tuple[tuple[str, float | str], ...]:
    """The tuned setting of another entrant."""
    return ((TUNED[name][0], TUNED[name][1]),) if name in TUNED else ()
