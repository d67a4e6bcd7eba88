"""Frames of an IEEE 802.11 run as bytes: data, RTS, CTS, acknowledgements, and block acknowledgements."""

from __future__ import annotations

from dataclasses import dataclass, field

from network_sim.export import ieee80211_frames as wlan
from network_sim.export.contents import Contents
from network_sim.export.numbers import LastNumbers, WindowNumbers
from network_sim.export.on_air import Frames, rows
from network_sim.export.radiotap import control_header, data_header
from network_sim.mac import physical_layer
from network_sim.mac.phy import RTS_BYTES
from network_sim.trace.frames import fates
from network_sim.trace.log import NetworkTrace
from network_sim.types import Cause, EventKind


@dataclass(slots=True)
class _DataFrame:
    """A data frame on the air: an A-MPDU, or a frame of one packet."""

    serial: int
    """Its number among the data frames of the run."""
    start_ns: int
    end_ns: int
    packets: int = 0
    received: dict[int, bool] = field(default_factory=dict)
    """Whether each packet arrived, by sequence number; filled while the capture is written."""


def wlan_frames(trace: NetworkTrace, contents: Contents) -> Frames:
    """Yield time and bytes of each frame of IEEE 802.11, with a radiotap header before it.

    A reply to an RTS is a CTS, any other an acknowledgement. What an RTS reserves is known from the frame
    that follows; without one, it is the time for a frame of one packet.
    """
    layer, stations = (
        physical_layer(trace.config.mac),
        [wlan.address(node + 1) for node in range(len(trace.names))],
    )
    aggregates, gap_ns, cts_ns = layer.aggregation is not None, layer.gap_ns, layer.cts.duration_ns
    numbers = (WindowNumbers if aggregates else LastNumbers)(wlan.SEQUENCES)
    data_frame = wlan.qos_data_frame if aggregates else wlan.data_frame
    radiotap, control = data_header(trace.config.mac), control_header(trace.config.mac)
    ether_type = wlan.IPV4 if contents.are_ip else wlan.EXPERIMENTAL
    frames, arrived = _data_frames(trace)
    by_start = {(node, frame.start_ns): frame for node, frame in frames}
    part = iter(zip(frames, arrived, strict=True))
    latest: dict[int, _DataFrame] = {}
    asked_ns: dict[int, int] = {}
    """Duration of the exchange after the CTS, of stations whose last request was an RTS."""
    for row in rows(trace):
        if row.kind == EventKind.DOWN:
            numbers.forget(row.node)
            continue
        sender, receiver = stations[row.node], stations[row.peer]
        if row.kind == EventKind.AIR:
            asked_ns.pop(row.node, None)
            (_, frame), well = next(part)
            latest[row.node] = frame
            order = numbers.of(row)
            frame.received[order[0]] = well
            reserved_us = _us(gap_ns + layer.answer(frame.packets).duration_ns)
            body = data_frame(sender, receiver, *order, reserved_us, ether_type, contents.payload(row))
            yield row.t_ns, radiotap(frame.serial, frame.packets) + body
        elif row.size_bytes == RTS_BYTES:
            data = by_start.get((row.node, row.t_ns + row.duration_ns + gap_ns + cts_ns + gap_ns))
            data_ns = data.end_ns - data.start_ns if data else layer.data_ns(contents.size_bytes(row.packet))
            answer = layer.answer(data.packets if data else 1)
            asked_ns[row.node] = gap_ns + data_ns + gap_ns + answer.duration_ns
            yield row.t_ns, control + wlan.rts(sender, receiver, _us(gap_ns + cts_ns + asked_ns[row.node]))
        elif not row.size_bytes:
            continue
        elif row.peer in asked_ns:
            yield row.t_ns, control + wlan.cts(receiver, _us(asked_ns[row.peer]))
        elif aggregates and latest[row.peer].packets > 1:
            yield (
                row.t_ns,
                control + wlan.block_ack(sender, receiver, latest[row.peer].received, row.size_bytes),
            )
        else:
            yield row.t_ns, control + wlan.acknowledgement(receiver)


def _data_frames(trace: NetworkTrace) -> tuple[list[tuple[int, _DataFrame]], list[bool]]:
    """Return sender and data frame of each packet on the air, in the order of time, and whether it arrived.

    The packets of an A-MPDU follow one another without a pause; before its next frame a station waits.
    """
    events = trace.events.of(EventKind.AIR)
    arrived = (fates(events, trace.events.of(EventKind.LOSS)) == Cause.NONE).tolist()
    latest: dict[int, _DataFrame] = {}
    found: list[tuple[int, _DataFrame]] = []
    serial = 0
    columns = (events.node, events.t_ns, events.duration_ns)
    for node, t_ns, duration_ns in zip(*(column.tolist() for column in columns), strict=True):
        frame = latest.get(node)
        if frame is None or frame.end_ns != t_ns:
            frame = latest[node] = _DataFrame(serial, t_ns, t_ns)
            serial += 1
        frame.end_ns = t_ns + duration_ns
        frame.packets += 1
        found.append((node, frame))
    return found, arrived


def _us(duration_ns: int) -> int:
    """Return the whole microseconds of a reservation, rounded up as in IEEE 802.11-2007, 7.1.4."""
    return -(-duration_ns // 1000)
