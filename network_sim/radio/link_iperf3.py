"""Recorded links from the intervals of a test by iperf3 (``iperf3 --json``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from network_sim.radio.link_trace import FloatArray, LinkTrace
from packetmesh.errors import InputError

Record = Mapping[str, Any]

SHORTEST_S = 1e-3
"""Shortest interval that is read."""
MOST = 1e15
"""Largest number that is read: bit/s, bytes, us or s."""
SHORT_END = 0.5
"""The last interval is left out if it is shorter than this share of the usual one: it holds the end only."""
_AGAIN = "try a test with iperf3 --json again"


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval of a test by iperf3, all its streams together."""

    start_s: float
    duration_s: float
    rate_bps: float
    """Rate at which TCP delivered, or at which UDP sent datagrams."""
    round_trip_s: float | None
    """Mean of the streams; only the sender of TCP measures it."""
    loss: float | None
    """Share of the datagrams that got lost; only the receiver of UDP counts them."""


def iperf3_link(test: Record, path: str) -> tuple[LinkTrace, str]:
    """Read the intervals of a test, without those that its option -O omits.

    Args:
        test: the object that iperf3 prints.
        path: its file, for messages.

    Returns:
        The link, and a sentence about what the test did not measure. Intervals of UDP that count no losses
        have the share lost in the whole test.

    Raises:
        InputError: there are no intervals, or a number is missing or out of range.
    """
    records = [
        one for one in _records(test.get("intervals")) if _record(one.get("sum")).get("omitted") is not True
    ]
    if not records:
        reason = test.get("error")
        error = f" (iperf3 said: {reason})" if isinstance(reason, str) else ""
        raise InputError(f"The recorded link {path} has no intervals of iperf3{error}; {_AGAIN}")
    settings = _record(_record(test.get("start")).get("test_start"))
    udp = settings.get("protocol") == "UDP"
    datagram_bytes = _number(settings, "blksize", "test_start", path) if udp else None
    found = [_interval(one, datagram_bytes, path) for one in records]
    usual_s = float(np.median([one.duration_s for one in found]))
    if len(found) > 1 and found[-1].duration_s < SHORT_END * usual_s:
        found.pop()
    starts_s = np.array([one.start_s for one in found])
    if (np.diff(starts_s) < SHORTEST_S).any():
        raise InputError(f"The recorded link {path} has intervals that do not follow each other; {_AGAIN}")
    losses = [one.loss for one in found]
    whole = None
    if udp and None in losses:
        whole = _number(_record(_record(test.get("end")).get("sum")), "lost_percent", "end", path) / 100.0
    link = LinkTrace(
        starts_s - starts_s[0],
        np.array([one.rate_bps for one in found]),
        _filled([one.round_trip_s for one in found], 0.0),
        np.clip(_filled(losses, whole or 0.0), 0.0, 1.0),
    )
    if not link.rate_bps.any():
        raise InputError(f"The recorded link {path} has a rate of 0 throughout; try another recording")
    return link, _note(path, udp, whole, any(one.round_trip_s is None for one in found))


def _interval(interval: Record, datagram_bytes: float | None, path: str) -> Interval:
    total = _record(interval.get("sum"))
    start_s, duration_s = (_number(total, key, "an interval", path) for key in ("start", "seconds"))
    if duration_s < SHORTEST_S:
        raise InputError(f"The recorded link {path} has an interval of {duration_s:g} s; {_AGAIN}")
    if datagram_bytes is not None:
        packets = _number(total, "packets", "an interval", path)
        loss = (
            _number(total, "lost_percent", "an interval", path, -MOST) / 100.0
            if "lost_percent" in total
            else None
        )
        return Interval(start_s, duration_s, 8.0 * datagram_bytes * packets / duration_s, None, loss)
    rate_bps = 8.0 * _number(total, "bytes", "an interval", path) / duration_s
    streams = [one for one in _records(interval.get("streams")) if one.get("sender") == total.get("sender")]
    round_trips_s = [1e-6 * _number(one, "rtt", "a stream", path) for one in streams if "rtt" in one]
    mean_s = float(np.mean(round_trips_s)) if round_trips_s else None
    return Interval(start_s, duration_s, rate_bps, mean_s, None)


def _note(path: str, udp: bool, whole: float | None, no_round_trip: bool) -> str:
    lacks = ["no round trip"] if no_round_trip else []
    if udp:
        more = "" if whole is None else f"; its losses are those of the whole test, {100.0 * whole:.3g} %"
        more += "; a test that sends less than the link carries shows too low a rate"
    else:
        lacks.append("no losses")
        more = ", as TCP sends lost packets again (loss.share adds losses)"
    zero = f"; it has {' and '.join(lacks)}, which count{'s' * (len(lacks) == 1 and no_round_trip)} as 0"
    return f"The recorded link {path} was read as a test by iperf3 over {'UDP' if udp else 'TCP'}{zero}{more}"


def _filled(values: list[float | None], value: float) -> FloatArray:
    return np.array([value if one is None else one for one in values])


def _records(value: object) -> list[Record]:
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list) else []


def _record(value: object) -> Record:
    return value if isinstance(value, dict) else {}


def _number(record: Record, key: str, where: str, path: str, least: float = 0.0) -> float:
    """Return a number of iperf3's output, from ``least`` to ``MOST``."""
    value = record.get(key)
    if isinstance(value, int | float) and not isinstance(value, bool) and least <= value <= MOST:
        return float(value)
    found = "no number" if value is None else f"{str(value)[:40]!r}"
    raise InputError(f"The recorded link {path} has {found} as '{key}' of {where} by iperf3; {_AGAIN}")
