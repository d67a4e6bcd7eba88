"""Entrants of the benchmark: a method, a variant or another program, with its parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from lab.claims.registration.variants import TUNABLE, VARIANTS
from pipeline.config import Direction, Metric, RegistrationConfig
from pipeline.registration.methods import METHODS, MethodStart
from pipeline.registration.peers import PEERS
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

PIXEL_PAIRS = "pixel-pairs"
"""The baseline without matching: SPEC 4.6."""
GATE_SCALE = "gate_scale"
"""The parameter that multiplies the condition's gate."""
_CONFIG_FIELDS = {part.name for part in fields(RegistrationConfig)}


@dataclass(frozen=True, slots=True)
class Entrant:
    """A way to register: a method with a metric, a variant of one, another program, or pixel pairs."""

    method: str
    """Name in METHODS, VARIANTS or PEERS, or ``PIXEL_PAIRS``."""
    metric: Metric = "point"
    """Metric; other programs have their own."""
    label: str = ""
    """Name in the tables, if not that of method and metric."""
    settings: tuple[tuple[str, float | str], ...] = ()
    """Parameters that differ from the defaults: fields of the config, of the method's first state, or
    ``gate_scale``."""

    @property
    def name(self) -> str:
        """Name, unique in a benchmark."""
        return self.label or (self.method if self.metric == "point" else f"{self.method} plane")

    @property
    def is_peer(self) -> bool:
        """Whether it is another program."""
        return self.method in PEERS

    def scaled_gate_m(self, gate_m: float) -> float:
        """Return the condition's gate times the entrant's own factor."""
        return gate_m * float(dict(self.settings).get(GATE_SCALE, 1.0))

    def config(self, direction: Direction, gate_m: float, max_points: int) -> RegistrationConfig:
        """Return the settings for one case."""
        plain = RegistrationConfig(
            method=VARIANTS[self.method][0] if self.method in VARIANTS else self.method,
            metric=self.metric,
            direction=direction,
            gate_m=self.scaled_gate_m(gate_m),
            max_points=max_points,
        )
        return replace(plain, **{k: v for k, v in self.settings if k in _CONFIG_FIELDS})  # type: ignore[arg-type]

    def start(self) -> MethodStart:
        """Return the function that makes its first state, with the entrant's settings."""
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


Lineup = tuple[tuple[Direction, Entrant], ...]
"""The entrants of a condition, each with its direction of matching."""
