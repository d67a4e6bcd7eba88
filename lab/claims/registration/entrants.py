"""Who takes part in the benchmark, and with what parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from lab.claims.registration.tuned import TUNED
from lab.claims.registration.variants import TUNABLE, VARIANTS
from pipeline.config import Direction, Metric, RegistrationConfig
from pipeline.registration.methods import METHODS, MethodStart
from pipeline.registration.peers import PEERS, available_peers
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

GATE_SCALE = "gate_scale"
"""The parameter that multiplies the condition's gate."""
PLANE = ("icp", "icp-gated", "picp", "ficp", "fast-robust-icp", "ceicp-n", "ceicp-a", "ceicp-r")
"""Methods that run with the point-to-plane metric as well."""
FAST_PEERS = ("open3d-plane", "open3d-gicp", "small-gicp", "small-gicp-staged", "small-vgicp-staged")
"""Other programs that take well under a second; CPD takes minutes for a condition."""
_CONFIG_FIELDS = {part.name for part in fields(RegistrationConfig)}


@dataclass(frozen=True, slots=True)
class Entrant:
    """One way to register: a method with a metric, a variant of one, or another program."""

    method: str
    """Name in METHODS, VARIANTS or PEERS."""
    metric: Metric = "point"
    """Other programs have their own."""
    label: str = ""
    """What the tables call it, if not by method and metric."""
    settings: tuple[tuple[str, float | str], ...] = ()
    """Parameters that differ from the defaults: fields of the config, of the method's first state, or
    ``gate_scale``."""

    @property
    def name(self) -> str:
        """Unique in a benchmark."""
        return self.label or (self.method if self.metric == "point" else f"{self.method} plane")

    @property
    def is_peer(self) -> bool:
        """Whether it is another program."""
        return self.method in PEERS

    def scaled_gate_m(self, gate_m: float) -> float:
        """The condition's gate times the entrant's own factor."""
        return gate_m * float(dict(self.settings).get(GATE_SCALE, 1.0))

    def config(self, direction: Direction, gate_m: float, max_points: int) -> RegistrationConfig:
        """The settings for one case."""
        plain = RegistrationConfig(
            method=VARIANTS[self.method][0] if self.method in VARIANTS else self.method,
            metric=self.metric,
            direction=direction,
            gate_m=self.scaled_gate_m(gate_m),
            max_points=max_points,
        )
        return replace(plain, **{k: v for k, v in self.settings if k in _CONFIG_FIELDS})  # type: ignore[arg-type]

    def start(self) -> MethodStart:
        """What makes its first state, with the settings that belong to it."""
        tuned_here = self.method in TUNABLE and bool(self.settings)
        begin = (
            TUNABLE[self.method]
            if tuned_here
            else VARIANTS[self.method][1]
            if self.method in VARIANTS
            else METHODS[self.method]
        )
        own = {k: v for k, v in self.settings if k not in _CONFIG_FIELDS and k != GATE_SCALE}

        def start(config: RegistrationConfig, source: PointCloud, target: PointCloud) -> PairWeighting:
            return replace(begin(config, source, target), **own)

        return start if own else begin


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
    parts: tuple[tuple[str, str, tuple[tuple[str, float | str], ...]], ...] = (
        ("ceicp-a-gaussian", f"{name}, w = p", ()),
        ("ceicp-a-hard-gate", f"{name}, hard gate", ()),
        ("ceicp-a-fixed-sigma", f"{name}, fixed sigma", ()),
    )
    shared = tuple(
        Entrant(method, metric, label, _like(name) + settings) for method, label, settings in parts
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
