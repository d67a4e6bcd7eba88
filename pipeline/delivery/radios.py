"""One rig's images by every radio: how long, how many joules and bytes until the sink's surface is as
good."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType

from network_sim.config import NetworkConfig, UplinkConfig
from network_sim.presets import PRESETS
from packetmesh.progress import drain
from pipeline.delivery.moments import Moment, Rebuilder
from pipeline.delivery.sending import DeliverySpec, send
from pipeline.types import Rig

RADIOS: Mapping[str, str] = MappingProxyType(
    {
        "wifi-ax": "802.11ax, MCS 9",
        "wifi-n": "802.11n, MCS 7",
        "office": "802.11b, 11 Mbit/s",
        "wifi-ah": "802.11ah, 2 MHz, MCS 7",
        "ble": "Bluetooth LE 2M",
        "lte-m": "LTE-M, half-duplex",
        "nb-iot": "NB-IoT, 12 subcarriers",
        "thesis-link": "802.15.4, 250 kbit/s",
        "lora": "LoRa, spreading factor 7",
    }
)
"""Presets with a radio each, and what it is."""
SPACING_M = 8.0
"""Distance of the sink behind the cameras' centre."""
LONGEST_S = 172_800.0
"""Longest simulated time: two days."""
ALMOST, WHOLE = 0.9, 0.99
"""Shares of the lossless surface's quality that are waited for."""


@dataclass(frozen=True, slots=True)
class RadioReach:
    """What a radio needs until the sink's surface is as good as without losses; times are infinite if
    never."""

    preset: str
    seconds_to_90_s: float
    """Until 90 % of the lossless quality, s since the images were taken, or since a recording began."""
    seconds_to_99_s: float
    radio_j: float
    """Energy of all nodes' radios until 99 %, or until the last byte that arrived; the sink's is not in
    it."""
    energy_j: float
    """The same with computers and cameras."""
    sent_bytes: int
    """Bytes on the air until then, headers and repetitions included."""
    delivered_bytes: int
    """Bytes of the images at the sink by then."""
    image_bytes: int
    """Bytes of all images as encoded for this radio's packets."""
    share: float
    """Quality then, as a share of the lossless one."""


def radio_network(preset: str) -> NetworkConfig:
    """Return a preset's radio in the network that all radios have here.

    The sink is ``SPACING_M`` behind the cameras, nodes never sleep, no image is too late, there is no uplink
    behind the sink, and the run ends when all has arrived or after ``LONGEST_S``.
    """
    network = PRESETS[preset]
    nodes = replace(network.nodes, spacing_m=SPACING_M, deadline_s=None, duty_cycle=1.0)
    run = replace(network.run, horizon_s=LONGEST_S)
    return replace(network, nodes=nodes, uplink=UplinkConfig(), run=run)


def reach(preset: str, spec: DeliverySpec, rig: Rig, lossless_f_score: float | None) -> RadioReach:
    """Send a rig's images by a radio, and rebuild the scene at each moment until it is as good as it can be.

    Args:
        preset: name of the radio.
        spec: as for ``send``, with the radio's network.
        rig: the spec's rig.
        lossless_f_score: F-score at 5 cm of the surface from the images before coding; None without a truth:
            then the quality is the share of the bytes that have arrived.

    Raises:
        InputError: as for ``iterate_delivery``.
    """
    sending = send(spec, rig)
    rebuilder, image_bytes = Rebuilder(sending), sum(len(stream) for stream in sending.streams)
    almost_s = whole_s = inf
    for index in range(len(sending.times_ns)):
        moment = drain(rebuilder.moment(index))
        share = _share(moment, lossless_f_score, image_bytes)
        if share >= ALMOST:
            almost_s = min(almost_s, moment.t_s)
        if share >= WHOLE:
            whole_s = moment.t_s
            break
    return RadioReach(
        preset,
        seconds_to_90_s=almost_s,
        seconds_to_99_s=whole_s,
        radio_j=moment.radio_j,
        energy_j=moment.energy_j,
        sent_bytes=moment.sent_bytes,
        delivered_bytes=moment.delivered_bytes,
        image_bytes=image_bytes,
        share=share,
    )


def _share(moment: Moment, lossless_f_score: float | None, image_bytes: int) -> float:
    """Return the quality of a moment as a share of the lossless one."""
    if lossless_f_score is None:
        return moment.delivered_bytes / image_bytes
    return 0.0 if moment.truth is None else moment.truth["f_score_5cm"] / lossless_f_score
