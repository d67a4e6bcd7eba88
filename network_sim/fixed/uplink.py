"""Cellular uplink from the sink to the cloud: one sender with a queue, a latency and random loss.

Rate, latency and loss are configured, or come from a recorded link that is replayed from the run's start.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import UplinkConfig
from network_sim.radio.link_file import read_link_trace
from network_sim.radio.link_trace import LinkTrace, Replay, constant_link
from network_sim.types import Cause, EventKind, Packet
from packetmesh.errors import InputError

if TYPE_CHECKING:
    from network_sim.trace.log import Recorder


class Uplink:
    """Sends packets in order; it does not retransmit lost packets.

    It records ENQUEUE and DELIVER, and LOSS and DROP with ``UPLINK``. It does not use the nodes' radio, so
    there is no AIR: the duration of DELIVER or LOSS is the transmission time.
    """

    def __init__(
        self,
        env: simpy.Environment,
        config: UplinkConfig,
        recorder: Recorder,
        rng: np.random.Generator,
        sink: int,
        cloud: int,
        receive: Callable[[Packet, int], None],
        lost: Callable[[Packet], None],
    ) -> None:
        """Create the uplink; it calls ``receive(packet, cloud)`` on arrival, ``lost(packet)`` on loss.

        Raises:
            InputError: ``config`` has neither a rate nor a recorded link that can be read.
        """
        self._env = env
        self._link = Replay(_link_trace(config))
        self._arrives_ns = 0
        self._recorder = recorder
        self._rng = rng
        self._sink = sink
        self._cloud = cloud
        self._receive = receive
        self._lost = lost
        self._waiting: deque[Packet] = deque()
        self._sending = False

    def put(self, packet: Packet) -> None:
        """Queue a packet."""
        self._record(EventKind.ENQUEUE, packet)
        self._waiting.append(packet)
        if not self._sending:
            self._sending = True
            self._env.process(self._serve())

    def _serve(self) -> Generator[simpy.Event, Any, None]:
        while self._waiting:
            packet = self._waiting.popleft()
            begins_ns = int(self._env.now)
            ends_ns = self._link.ends_ns(begins_ns, packet.size_bytes)
            duration_ns = ends_ns - begins_ns
            yield self._env.timeout(duration_ns)
            self._arrives_ns = max(self._arrives_ns, ends_ns + self._link.latency_ns(ends_ns))
            travels_ns = self._arrives_ns - ends_ns
            if self._rng.random() < self._link.loss(ends_ns):
                self._record(EventKind.LOSS, packet, Cause.UPLINK, duration_ns)
                self._record(EventKind.DROP, packet, Cause.UPLINK)
                self._env.process(self._report_loss(packet, travels_ns))
            else:
                self._env.process(self._travel(packet, travels_ns, duration_ns))
        self._sending = False

    def _travel(self, packet: Packet, travels_ns: int, duration_ns: int) -> Generator[simpy.Event, Any, None]:
        yield self._env.timeout(travels_ns)
        self._record(EventKind.DELIVER, packet, duration_ns=duration_ns)
        self._receive(packet, self._cloud)

    def _report_loss(self, packet: Packet, travels_ns: int) -> Generator[simpy.Event, Any, None]:
        """Report a loss to the sink, right after the packet should have arrived."""
        yield self._env.timeout(travels_ns + 1)
        self._lost(packet)

    def _record(
        self, kind: EventKind, packet: Packet, cause: Cause = Cause.NONE, duration_ns: int = 0
    ) -> None:
        now_ns, size_bytes = int(self._env.now), packet.size_bytes
        self._recorder.add_packet(
            now_ns, kind, packet, self._sink, self._cloud, size_bytes, cause, duration_ns
        )


def _link_trace(config: UplinkConfig) -> LinkTrace:
    if config.trace is not None:
        return read_link_trace(config.trace)
    if config.rate_bps is None:
        raise InputError("uplink.rate_bps is not set, so there is no way to the cloud; try 10e6")
    return constant_link(config.rate_bps, 2.0 * config.latency_s, config.loss)
