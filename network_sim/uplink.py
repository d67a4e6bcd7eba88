"""The cellular hop from the sink to the cloud: one sender with a queue, a latency and random loss."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import UplinkConfig
from network_sim.types import NS_PER_S, Cause, EventKind, Packet, to_ns
from packetmesh.errors import InputError

if TYPE_CHECKING:
    from network_sim.trace import Recorder


class Uplink:
    """Sends packets in order; a lost one is not sent again.

    It records ENQUEUE and DELIVER, and LOSS and DROP with ``UPLINK``. It uses none of the nodes' radio, so
    there is no AIR: the duration of DELIVER or LOSS is the time it took to send.
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
        """``receive(packet, cloud)`` gets each packet that arrives, ``lost(packet)`` each other one.

        Raises:
            InputError: ``config`` has no rate.
        """
        if config.rate_bps is None:
            raise InputError("uplink.rate_bps is not set, so there is no way to the cloud; try 10e6")
        self._env = env
        self._byte_ns = 8 * NS_PER_S / config.rate_bps
        self._latency_ns = to_ns(config.latency_s)
        self._loss = config.loss
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
            duration_ns = round(packet.size_bytes * self._byte_ns)
            yield self._env.timeout(duration_ns)
            if self._rng.random() < self._loss:
                self._record(EventKind.LOSS, packet, Cause.UPLINK, duration_ns)
                self._record(EventKind.DROP, packet, Cause.UPLINK)
                self._env.process(self._report_loss(packet))
            else:
                self._env.process(self._travel(packet, duration_ns))
        self._sending = False

    def _travel(self, packet: Packet, duration_ns: int) -> Generator[simpy.Event, Any, None]:
        yield self._env.timeout(self._latency_ns)
        self._record(EventKind.DELIVER, packet, duration_ns=duration_ns)
        self._receive(packet, self._cloud)

    def _report_loss(self, packet: Packet) -> Generator[simpy.Event, Any, None]:
        """The sink finds out right after the packet should have arrived."""
        yield self._env.timeout(self._latency_ns + 1)
        self._lost(packet)

    def _record(
        self, kind: EventKind, packet: Packet, cause: Cause = Cause.NONE, duration_ns: int = 0
    ) -> None:
        now_ns, size_bytes = int(self._env.now), packet.size_bytes
        self._recorder.add_packet(
            now_ns, kind, packet, self._sink, self._cloud, size_bytes, cause, duration_ns
        )
