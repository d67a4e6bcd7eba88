"""Hand-written traces: one small enough to work out on paper, and random ones of any length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from network_sim.config import EnergyConfig, Keep, NetworkConfig, RunConfig
from network_sim.trace.log import NetworkTrace, Recorder
from network_sim.types import Cause, EventKind, PacketKind, to_ns

E, C = EventKind, Cause
HORIZON_S = 180.0
WARMUP_S = 60.0
NAMES, ROLES = ("camera 0", "camera 1", "sink"), ("node", "node", "sink")
Story = Callable[[Recorder], None]


def config_of(keep: Keep, warmup_s: float = WARMUP_S, horizon_s: float = HORIZON_S) -> NetworkConfig:
    run = RunConfig(horizon_s=horizon_s, warmup_s=warmup_s, keep=keep)
    return replace(NetworkConfig(), run=run, energy=EnergyConfig(1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 1000.0))


def trace_of(story: Story, keep: Keep = "all", warmup_s: float = WARMUP_S) -> NetworkTrace:
    recorder = Recorder(keep, 3, to_ns(warmup_s))
    story(recorder)
    positions_m = np.array([[0.0, 0.1], [20.0, 0.0], [40.0, 1 / 3]])
    return recorder.trace(config_of(keep, warmup_s), NAMES, positions_m, to_ns(HORIZON_S), ROLES)


def hop(
    recorder: Recorder,
    start_s: float,
    node: int,
    peer: int,
    packet: int,
    image: int = -1,
    size_bytes: int = 500,
    duration_s: float = 2.0,
    kind: PacketKind = PacketKind.IMAGE,
) -> float:
    """One frame that arrives; when it does, in seconds."""
    end_s = start_s + duration_s
    air_ns, duration_ns = to_ns(start_s), to_ns(duration_s)
    recorder.add(
        air_ns, E.AIR, node, peer, packet, image, 0, size_bytes, C.NONE, duration_ns, packet_kind=kind
    )
    recorder.add(to_ns(end_s), E.DELIVER, node, peer, packet, image, 0, size_bytes, packet_kind=kind)
    return end_s


def small_run(recorder: Recorder) -> None:
    """Two cameras and a sink, 60 s of warm-up, 120 s that count."""

    def record(
        t_s: float, kind: EventKind, node: int, peer: int, packet: int, image: int, **more: Any
    ) -> None:
        recorder.add(to_ns(t_s), kind, node, peer, packet, image, **{"size_bytes": 500, **more})

    record(10, E.CAPTURE, 0, 3, -1, 0)  # all of it within the warm-up
    record(10, E.ENQUEUE, 0, 2, 0, 0)
    record(hop(recorder, 10, 0, 2, 0), E.RECEIVE, 0, 2, 0, 0)
    record(12, E.ARRIVE, 0, 2, -1, 0)

    record(70, E.CAPTURE, 0, 3, -1, 1)  # two packets, the first collides once
    record(70, E.ENQUEUE, 0, 2, 1, 1)
    record(70, E.ENQUEUE, 0, 2, 2, 1)
    record(70, E.AIR, 0, 2, 1, 1, duration_ns=to_ns(2))
    record(72, E.LOSS, 0, 2, 1, 1, cause=C.COLLISION)
    record(hop(recorder, 72, 0, 2, 1), E.RECEIVE, 0, 2, 1, 1)
    record(hop(recorder, 74, 0, 2, 2), E.RECEIVE, 0, 2, 2, 1)
    record(76, E.ACK, 2, 0, 2, 1, duration_ns=to_ns(0.1))
    record(76, E.ARRIVE, 0, 2, -1, 1, size_bytes=900)

    record(85, E.ENQUEUE, 0, 2, 6, -1, size_bytes=40, packet_kind=PacketKind.SUMMARY)
    end_s = hop(recorder, 85, 0, 2, 6, size_bytes=40, duration_s=0.5, kind=PacketKind.SUMMARY)
    record(end_s, E.RECEIVE, 0, 2, 6, -1, size_bytes=40, packet_kind=PacketKind.SUMMARY)

    record(100, E.CAPTURE, 1, 3, -1, 2)  # over a relay
    record(100, E.ENQUEUE, 1, 0, 3, 2)
    record(hop(recorder, 100, 1, 0, 3), E.ENQUEUE, 0, 2, 3, 2)
    record(hop(recorder, 102, 0, 2, 3), E.RECEIVE, 1, 2, 3, 2)
    record(104, E.ARRIVE, 1, 2, -1, 2, size_bytes=450)

    record(120, E.CAPTURE, 1, 4, -1, 3)  # given up
    record(120, E.ENQUEUE, 1, 0, 4, 3)
    record(120, E.AIR, 1, 0, 4, 3, duration_ns=to_ns(2))
    record(122, E.LOSS, 1, 0, 4, 3, cause=C.RANGE)
    record(122, E.DROP, 1, 0, 4, 3, cause=C.RETRIES)
    record(130, E.EXPIRE, 1, -1, -1, 3, cause=C.DEADLINE)

    record(140, E.DOWN, 1, -1, -1, -1)  # sleeps, and hears nothing of what is sent to it
    record(150, E.UP, 1, -1, -1, -1)
    record(160, E.DOWN, 0, -1, -1, -1, cause=C.NODE_DOWN)
    record(170, E.UP, 0, -1, -1, -1)
    record(175, E.CAPTURE, 0, 3, -1, 4)  # on its way when the run ends
    record(175, E.ENQUEUE, 0, 2, 5, 4)
    record(179, E.AIR, 0, 2, 5, 4, duration_ns=to_ns(2))


def random_run(seed: int, images: int = 400) -> Story:
    """Images of three packets each that are lost, delivered or still waiting, over several minutes."""

    def story(recorder: Recorder) -> None:
        rng, packet = np.random.default_rng(seed), 0
        starts_s = np.sort(rng.uniform(0.0, HORIZON_S - 1.0, images))
        for image, start_s in enumerate(starts_s):
            node, fates = int(rng.integers(2)), rng.random(3)
            recorder.add(to_ns(start_s), E.CAPTURE, node, image % 5, image=image, size_bytes=300)
            ends_s = []
            for fate in fates:
                where: dict[str, Any] = {
                    "node": node,
                    "peer": 2,
                    "packet": packet,
                    "image": image,
                    "size_bytes": 100,
                }
                recorder.add(to_ns(start_s), E.ENQUEUE, **where)
                end_s = start_s + float(rng.exponential(0.3))
                if end_s >= HORIZON_S or fate < 0.05:
                    pass  # it waits
                elif fate < 0.2:
                    recorder.add(to_ns(end_s), E.DROP, **where, cause=C.RETRIES)
                else:
                    recorder.add(to_ns(end_s), E.DELIVER, **where)
                    recorder.add(to_ns(end_s), E.RECEIVE, **where)
                    ends_s.append(end_s)
                packet += 1
            if len(ends_s) == 3:
                recorder.add(to_ns(max(ends_s)), E.ARRIVE, node, 2, image=image, size_bytes=300)

    return story
