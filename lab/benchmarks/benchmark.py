"""What one case of the benchmarks gives."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Benchmark:
    """One case measured, beside its peers in the same run."""

    ours_s: float
    """Median of the rounds, seconds."""
    peers: dict[str, float]
    """Median seconds of other programs on the same input."""
    peak_memory_bytes: int
    """Most memory of the measuring process, its libraries included."""
    peer_memory_bytes: dict[str, int] = field(default_factory=dict)
    """The same of the peers, where each has a process of its own."""
    errors_m: dict[str, float] = field(default_factory=dict)
    """How wrong the answers are, ours and the peers', where the truth is known."""
    runs: tuple[dict[str, Any], ...] = ()
    """Every single measurement, with what the case alone measures."""
    notes: tuple[str, ...] = ()
    """What to tell people below the times."""

    def record(self) -> dict[str, Any]:
        """Plain values; ``ratio`` is our time over the fastest peer's, ``ratios`` over every one's."""
        ratios = {name: self.ours_s / peer_s for name, peer_s in self.peers.items()}
        return asdict(self) | {"ratio": max(ratios.values(), default=None), "ratios": ratios}
