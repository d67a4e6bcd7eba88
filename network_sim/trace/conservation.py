"""Check of the conservation of packets and images: created = received + dropped + in flight."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from network_sim.trace.counters import Counters, Tally
from network_sim.trace.ledger import Outcomes
from network_sim.trace.log import NetworkTrace
from network_sim.types import Cause, EventKind, to_ns

_BLOCK = 65536


class InternalError(AssertionError):
    """A trace violates an invariant of the simulator: an error in the program, not in its input."""


@dataclass(frozen=True, slots=True)
class Balance:
    """Outcomes of all packets, or all images, of a run, warm-up included."""

    created: int
    received: int
    dropped: dict[Cause, int]
    """Number of packets or images given up, by cause."""
    in_flight: int
    """Held by a node at the end of the run."""

    @property
    def accounted(self) -> int:
        """Sum of all outcomes; equals ``created`` in a correct trace."""
        return self.received + sum(self.dropped.values()) + self.in_flight


def balance(trace: NetworkTrace) -> Balance:
    """Return the balance of packets. Each number is counted from other events, so that an error shows."""
    counters = trace.counters
    held = _count(counters, EventKind.ENQUEUE) - _count(counters, EventKind.DELIVER)
    return Balance(
        created=counters.created,
        received=_count(counters, EventKind.RECEIVE),
        dropped=_by_cause(counters, EventKind.DROP),
        in_flight=held - _count(counters, EventKind.DROP),
    )


def image_balance(trace: NetworkTrace) -> Balance:
    """Return the balance of images: taken = arrived + expired + open."""
    counters = trace.counters
    arrived = _count(counters, EventKind.ARRIVE)
    return Balance(
        created=counters.captured,
        received=arrived,
        dropped=_by_cause(counters, EventKind.EXPIRE),
        in_flight=_count(counters, EventKind.CAPTURE) - arrived - _count(counters, EventKind.EXPIRE),
    )


def check(trace: NetworkTrace) -> None:
    """Check the balances, the history of every packet and image, and, if the log is complete, the counters.

    Raises:
        InternalError: a packet or image appears or vanishes without an event, a node is busy for longer than
            the run, events are recorded too late, or log and counters differ.
    """
    faults = list(trace.counters.faults)
    for noun, sums in (("packets", balance(trace)), ("images", image_balance(trace))):
        if sums.created != sums.accounted:
            faults.append(
                f"{sums.created} {noun} were created, but {sums.received} were received, "
                f"{sum(sums.dropped.values())} given up and {sums.in_flight} are on their way"
            )
    if (states_ns := trace.counters.states_ns.sum(axis=(0, 2))).max(initial=0) > trace.horizon_ns:
        faults.append(f"node {states_ns.argmax()} was busy for longer than the run took")
    if trace.config.run.keep == "all":
        faults += _differences(trace)
    if faults:
        raise InternalError(f"The trace of the run contradicts itself: {'; '.join(faults)}")


def recount(trace: NetworkTrace) -> Counters:
    """Compute the counters again, from a complete log."""
    tally = Tally(trace.counters.states_ns.shape[1], to_ns(trace.config.run.warmup_s))
    for start in range(0, len(trace.events), _BLOCK):
        tally.take(trace.events.rows(start, start + _BLOCK))
    return tally.counters(trace.horizon_ns)


def _differences(trace: NetworkTrace) -> list[str]:
    counted = recount(trace)
    names = [field.name for field in fields(Counters)]
    wrong = [n for n in names if not _same(getattr(counted, n), getattr(trace.counters, n))]
    return [f"the log gives other counters ({', '.join(wrong)})"] if wrong else []


def _same(one: object, other: object) -> bool:
    if isinstance(one, Outcomes) and isinstance(other, Outcomes):
        return (one.created, one.arrived) == (other.created, other.arrived) and np.array_equal(
            one.delays.histogram, other.delays.histogram
        )
    return bool(np.array_equal(one, other))  # type: ignore[arg-type]


def _count(counters: Counters, kind: EventKind) -> int:
    return int(counters.count[:, kind].sum())


def _by_cause(counters: Counters, kind: EventKind) -> dict[Cause, int]:
    sums = counters.count[:, kind].sum(axis=(0, 1))
    return {cause: int(sums[cause]) for cause in Cause if sums[cause]}
