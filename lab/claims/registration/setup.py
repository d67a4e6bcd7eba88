"""What a benchmark consists of, and the key that says which stored results belong to it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path

import pipeline
from lab.claims.registration.cases import CONDITIONS, Condition
from lab.claims.registration.entrants import Entrant, ablations, methods, peers, tuned
from pipeline.config import Direction

Lineup = tuple[tuple[Direction, Entrant], ...]

ROOMS = 30
FIRST_ROOM = 100
"""Rooms before it were looked at while the benchmark was made."""
CAPTURE_ROOMS = 6
CURVE_CONDITIONS = ("easy", "nodes-sensor")
"""Where convergence curves are recorded (Fig. 4.9)."""
CURVED = ("icp", "picp", "ricp", "mricp", "ficp", "hicp", "ceicp-n", "ceicp-a", "icp plane", "ceicp-a plane")
"""Whose: the methods of Table 4.4, and the plane metric."""
ABLATED = ("easy", "bias-3", "holes-x3", "outliers-20", "nodes-sensor", "nodes-fused")
"""Where the ablations run."""
BOTH_DIRECTIONS = ("easy", "bias-3", "holes-x3", "outliers-20")
"""Conditions in which the sensor cloud asks the complete one as well."""
ASKED_BACK = ("icp", "icp-gated", "ficp", "hicp", "ceicp-n", "ceicp-a")
"""Methods that take part in that."""
OVERLAPPING = ("ficp", "ceicp-a")
"""Methods that run point to point on the overlap series as well; those without a gate are lost there."""
SLOW = {
    "kernel-correlation": ("easy", "nodes-sensor"),
    "ceicp-ml": ("easy", "holes-x3", "nodes-sensor"),
}
"""Methods that take several times as long as the rest, and the conditions that they take part in."""
FIXED_GATE = "ceicp-n, T_d 0.3 m"
CAPTURED = (
    (Entrant("icp"), True),
    (Entrant("ficp"), True),
    (Entrant("ceicp-n", label=FIXED_GATE), False),
    (Entrant("ceicp-n"), True),
    (Entrant("ceicp-a", "plane"), True),
)
"""Whose capture range is mapped, and whether its gate is told how far off the start is."""
_CODE = (
    "registration",
    "scenes",
    "acquisition",
    "config.py",
    "geometry.py",
    *(
        f"experiments/registration/{name}.py"
        for name in ("capture", "cases", "entrants", "trials", "variants")
    ),
)
"""Parts of the pipeline that a result depends on, beside the lineups."""


@dataclass(frozen=True, slots=True)
class Setup:
    """One benchmark."""

    rooms: tuple[int, ...]
    """Seeds of ``box_room``."""
    lineups: dict[str, Lineup]
    """By condition, who takes part and in which direction."""
    max_points: int = 4000
    curves: tuple[str, ...] = CURVE_CONDITIONS
    """Conditions with convergence curves."""
    captured: tuple[tuple[Entrant, bool], ...] = ()
    """Whose capture range is mapped, on the clouds of ``easy``; False keeps the gate at 0.3 m."""
    capture_rooms: tuple[int, ...] = field(default=())

    def key(self) -> str:
        """Twelve digits that change with everything a result depends on, the code too, but not with the
        rooms: results of more rooms can be added to those of fewer."""
        contents = {
            "conditions": {name: asdict(CONDITIONS[name]) for name in self.lineups},
            "lineups": {name: [(d, asdict(e)) for d, e in lineup] for name, lineup in self.lineups.items()},
            "max_points": self.max_points,
            "curves": [self.curves, CURVED],
            "captured": [(asdict(entrant), told) for entrant, told in self.captured],
            "code": _code_digest(),
        }
        return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()[:12]


def standard_setup(rooms: int = ROOMS) -> Setup:
    """The benchmark behind the claims: all conditions, every entrant tuned."""
    return Setup(
        rooms=tuple(range(FIRST_ROOM, FIRST_ROOM + rooms)),
        lineups={condition.name: standard_lineup(condition) for condition in CONDITIONS.values()},
        captured=CAPTURED,
        capture_rooms=tuple(range(FIRST_ROOM, FIRST_ROOM + min(rooms, CAPTURE_ROOMS))),
    )


def standard_lineup(condition: Condition) -> Lineup:
    """Who takes part in a condition.

    A node's own two clouds: point to point as in Table 4.4, and the plane metric where there is no bias
    for it to follow. Two nodes: both metrics.
    """
    name, single = condition.name, condition.clouds == "inferred"
    everyone = [e for e in methods() if name in SLOW.get(e.method, CONDITIONS)]
    asked = [e for e in everyone if condition.overlap is None or e.method in OVERLAPPING]
    asked += methods("plane") if not single or name == "easy" else ()
    asked += ablations("point" if single else "plane") if name in ABLATED else ()
    asked += peers()
    back = [e for e in everyone if e.method in ASKED_BACK] if name in BOTH_DIRECTIONS else []
    if name in ABLATED and not single:
        back = [Entrant("ceicp-a", "plane")]
    return (
        *(("q2p", tuned(entrant)) for entrant in asked),
        *(("p2q", tuned(entrant)) for entrant in back),
    )


@cache
def _code_digest() -> str:
    """Digest of the source files that results depend on."""
    root = Path(pipeline.__file__).parent
    files = sorted(
        path
        for part in _CODE
        for path in ([root / part] if part.endswith(".py") else (root / part).rglob("*.py"))
    )
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
