"""Config of the medium access: which radio the nodes have, and its rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from packetmesh.checks import above, at_least, one_of
from packetmesh.errors import InputError

MacKind = Literal[
    "ieee80211b",
    "ieee80211n",
    "ieee80211ax",
    "ieee80211ah",
    "ieee802154",
    "ideal",
    "serial",
    "replay",
    "lora",
    "ble",
    "lte-m",
    "nb-iot",
]
OFDM_KINDS: tuple[MacKind, ...] = ("ieee80211n", "ieee80211ax", "ieee80211ah")
"""Medium accesses that put several packets into one frame (A-MPDU)."""
WLAN_KINDS: tuple[MacKind, ...] = ("ieee80211b", *OFDM_KINDS)
NO_DOWNLINK: tuple[MacKind, ...] = ("lte-m", "nb-iot")
"""Medium accesses whose model carries packets to the sink only."""

MAX_PAYLOAD_BYTES: dict[MacKind, int] = {
    "ieee802154": 116,
    "ieee80211b": 2304,
    "ieee80211n": 2304,
    "ieee80211ax": 2304,
    "ble": 244,
    "lte-m": 120,
    "nb-iot": 121,
}
"""Largest payload of a frame: 127 B less 11 B of header and check sum; the limit of IEEE 802.11; 251 B less
the headers of L2CAP and ATT; a transport block of 1000 bits less the headers of MAC, RLC and PDCP."""
LORA_PAYLOAD_BYTES = {7: 222, 8: 222, 9: 115, 10: 51, 11: 51, 12: 51}
"""Largest payload of LoRaWAN by spreading factor (Regional Parameters 1.0.3, EU863-870, N with repeaters)."""
AH_PAYLOAD_BYTES = {(1e6, 10): 473, (1e6, 0): 722, (1e6, 1): 1489, (1e6, 2): 2255, (2e6, 0): 1617}
"""Largest payload of IEEE 802.11ah by bandwidth and MCS: a frame has at most 511 bytes, or 511 symbols as an
A-MPDU (IEEE 802.11-2020, 23.3.8, the 9 bits of the Length field); for every other MCS it is the 2304 bytes
of IEEE 802.11."""
MOST_SUBFRAMES = {"ieee80211n": 64, "ieee80211ax": 256}
"""Largest number of packets that one block acknowledgement answers (IEEE 802.11-2020, 9.3.1.8; 802.11ax-2021,
9.3.1.8)."""
AH_SUBFRAMES = {1e6: 8, 2e6: 16}
"""The same of IEEE 802.11ah by bandwidth: bits of an NDP block acknowledgement (IEEE 802.11-2020, 9.9.2)."""
GUARDS_US = {"ieee80211n": (0.8, 0.4), "ieee80211ax": (0.8, 1.6, 3.2)}
"""Guard intervals, the usual one first."""


@dataclass(frozen=True, slots=True)
class MacConfig:
    """Medium access: who may send when (SPEC 6.1, 6.3)."""

    kind: MacKind = "ieee802154"
    """Unslotted IEEE 802.15.4, IEEE 802.11b DCF, IEEE 802.11n, 802.11ax or 802.11ah with aggregation, a link
    of its own for every node (ideal), a serial line with ten bits a byte, a recorded link for every node
    (replay), LoRaWAN in the EU's 868 MHz band (lora), Bluetooth LE 2M (ble), or the uplink of a cellular
    module (lte-m, nb-iot)."""
    rts: bool = False
    """Reserve the channel before every data frame (RTS/CTS); only IEEE 802.11 can."""
    ack: bool = True
    """Acknowledge frames and send lost ones again; IEEE 802.11, Bluetooth and cellular modules always do."""
    retries: int | None = None
    """Retransmissions of an unanswered packet; None is 3 times in IEEE 802.15.4, 6 in IEEE 802.11, 7 in
    LoRaWAN, 4 in LTE-M and NB-IoT."""
    rate_bps: float = 11e6
    """Rate of IEEE 802.11b's data frames: 1, 2, 5.5 or 11 Mb/s. A slower one reaches farther."""
    mcs: int = 7
    """Modulation and code rate of IEEE 802.11n (0 to 7), 802.11ax (0 to 11) and 802.11ah (0 to 7; 10 at 1
    MHz sends every bit twice). A lower one is slower and reaches farther."""
    guard_us: float | None = None
    """Pause between two symbols: 0.8 or 0.4 in IEEE 802.11n, 0.8, 1.6 or 3.2 in 802.11ax; None is 0.8."""
    bandwidth_hz: float = 2e6
    """Width of IEEE 802.11ah's channel: 1e6 or 2e6."""
    ampdu_packets: int | None = None
    """Most packets in one frame (A-MPDU) of IEEE 802.11n, 802.11ax or 802.11ah, and in its block
    acknowledgement; None is 64, in 802.11ah 16 at 2 MHz and 8 at 1 MHz. 1 sends every packet in a frame of
    its own."""
    ampdu_bytes: int | None = None
    """Most bytes of such a frame with several packets; None is the standard's limit."""
    link_bps: float = 250e3
    """Rate of the ideal link or the serial line."""
    spreading_factor: int = 7
    """Spreading factor of LoRa, 7 to 12: each step reaches farther and takes about twice as long."""
    connection_interval_s: float = 0.03
    """Time between two connection events of a Bluetooth LE node, which share it equally."""
    full_duplex: bool = False
    """Whether LTE-M modules send and receive at once; others send three eighths of the time."""
    tones: int = 12
    """Subcarriers of 15 kHz that NB-IoT grants to a node: 1, 3, 6 or 12 (all)."""
    trace: str | None = None
    """File of the recorded link: columns of time in s, rate in Mbit/s, round trip in ms, share lost; or a
    mahimahi trace, or the output of iperf3 --json."""

    def __post_init__(self) -> None:
        above("mac.link_bps", self.link_bps, 0.0)
        at_least("mac.retries", self.retries, 0)
        one_of("mac.rate_bps", self.rate_bps, (1e6, 2e6, 5.5e6, 11e6))
        at_least("mac.ampdu_packets", self.ampdu_packets, 1)
        at_least("mac.ampdu_bytes", self.ampdu_bytes, 1)
        one_of("mac.bandwidth_hz", self.bandwidth_hz, (1e6, 2e6))
        self._check_ofdm()
        one_of("mac.spreading_factor", self.spreading_factor, LORA_PAYLOAD_BYTES)
        one_of("mac.tones", self.tones, (1, 3, 6, 12))
        steps = self.connection_interval_s / 0.00125
        if not (6 <= steps <= 3200 and abs(steps - round(steps)) < 1e-6):
            raise InputError(
                f"mac.connection_interval_s is {self.connection_interval_s}; try a multiple of 0.00125 from "
                "0.0075 to 4"
            )
        if self.kind == "replay" and not self.trace:
            raise InputError("mac.kind is replay, but of which recorded link? Try mac.trace=FILE")

    def _check_ofdm(self) -> None:
        """Check the MCS, the guard interval and the aggregation against the standard of the kind."""
        of_ah = (*range(8), 10) if self.bandwidth_hz == 1e6 else range(8)
        possible = {"ieee80211n": range(8), "ieee80211ah": of_ah}.get(self.kind, range(12))
        if self.mcs not in possible:
            width = f" with mac.bandwidth_hz={self.bandwidth_hz:g}" if self.kind == "ieee80211ah" else ""
            raise InputError(
                f"mac.mcs is {self.mcs}, which {self.kind}{width} does not have; try one of "
                f"{', '.join(map(str, possible))}"
            )
        guards_us = GUARDS_US.get(self.kind, (0.4, 0.8, 1.6, 3.2))
        if self.guard_us is not None and self.guard_us not in guards_us:
            raise InputError(f"mac.guard_us is {self.guard_us}; try one of {', '.join(map(str, guards_us))}")
        if self.kind in OFDM_KINDS and (self.ampdu_packets or 1) > self.most_subframes:
            raise InputError(
                f"mac.ampdu_packets is {self.ampdu_packets}, but a block acknowledgement of {self.kind} "
                f"answers {self.most_subframes}; try at most as many"
            )

    @property
    def reaches_nodes(self) -> bool:
        """Whether the sink can send nodes packets of its own in this model."""
        return self.kind not in NO_DOWNLINK and not (self.kind == "lora" and self.ack)

    @property
    def most_subframes(self) -> int:
        """Largest number of packets that a block acknowledgement of IEEE 802.11n, ax or ah answers."""
        return AH_SUBFRAMES[self.bandwidth_hz] if self.kind == "ieee80211ah" else MOST_SUBFRAMES[self.kind]

    @property
    def max_payload_bytes(self) -> int | None:
        """Largest payload of a frame; None if every size is possible."""
        if self.kind == "lora":
            return LORA_PAYLOAD_BYTES[self.spreading_factor]
        if self.kind == "ieee80211ah":
            return AH_PAYLOAD_BYTES.get((self.bandwidth_hz, self.mcs), MAX_PAYLOAD_BYTES["ieee80211b"])
        return MAX_PAYLOAD_BYTES.get(self.kind)
