"""The cost of a rig's images on the air: bytes, seconds and joules of each coding (SPEC 6.5)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lab.claims.delivery.trials import Values
from network_sim.config import NetworkConfig
from network_sim.metrics.arrivals import until
from network_sim.presets import PRESETS
from network_sim.types import to_s
from pipeline.delivery.sending import DeliverySpec, packet_bytes_of, send
from pipeline.sources import Demo
from pipeline.spec import Spec

NETWORKS = {"thesis-link": "802.15.4", "office": "802.11b"}
"""Presets with the name of their medium access."""
LONGEST_S = 14_400.0


@dataclass(frozen=True, slots=True)
class SendTask:
    """A rig's images, sent until all have arrived."""

    rig: str
    coding: str
    network: str
    """Name of a preset."""


def patient(network: NetworkConfig) -> NetworkConfig:
    """Return the network without a deadline, run for up to four hours."""
    nodes = replace(network.nodes, deadline_s=None)
    return replace(network, nodes=nodes, run=replace(network.run, horizon_s=LONGEST_S))


def send_trial(task: SendTask) -> Values:
    """Return the bytes and packets of a rig's images, and the cost until the sink has them all.

    The cost is missing if they have not all arrived within four hours.
    """
    network = patient(PRESETS[task.network])
    source = Demo(task.rig)
    sending = send(DeliverySpec(Spec(source), network, task.coding, moments=1), source.load())
    image_bytes = sum(len(stream) for stream in sending.streams)
    packet_bytes = packet_bytes_of(network)
    values: Values = {
        "bytes": image_bytes,
        "packets": sum(-(-len(stream) // packet_bytes) for stream in sending.streams),
    }
    if int(sending.arrivals.byte_count.sum()) < image_bytes:
        return values
    end_ns = int(sending.arrivals.t_ns.max())
    spent = until(sending.trace, end_ns)
    return values | {
        "seconds": to_s(end_ns),
        "air_bytes": int(spent.sent_bytes),
        "attempts_lost": int(spent.lost),
        "radio_j": float(spent.radio_j),
        "platform_j": float(spent.platform_j),
    }
