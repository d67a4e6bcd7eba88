"""Physical layers of IEEE 802.11 as its medium access sees them: airtimes, interframe spaces, windows,
answers."""

from __future__ import annotations

from dataclasses import dataclass

from network_sim.radio.propagation import Modulation


@dataclass(frozen=True, slots=True)
class Waveform:
    """One way to send a frame, from which its time on the air follows."""

    modulation: Modulation
    preamble_ns: int
    """Preamble and headers of the physical layer."""
    symbol_ns: float
    bits_per_symbol: int
    extra_bits: int = 0
    """Service and tail bits."""
    step_ns: int = 1
    """The symbols take a multiple of this."""
    extension_ns: int = 0
    """Silence that counts as part of the frame (signal extension, packet extension)."""

    def symbols(self, frame_bytes: int) -> int:
        """Return the number of symbols of a frame."""
        return -(-(8 * frame_bytes + self.extra_bits) // self.bits_per_symbol)

    def air_ns(self, frame_bytes: int) -> int:
        """Return the time on the air of a frame, preamble included."""
        symbols_ns = -(-round(self.symbols(frame_bytes) * self.symbol_ns) // self.step_ns) * self.step_ns
        return self.preamble_ns + symbols_ns + self.extension_ns

    def most_bytes(self, duration_ns: int) -> int:
        """Return the bytes of the largest frame that takes no longer than this."""
        symbols_ns = (duration_ns - self.preamble_ns - self.extension_ns) // self.step_ns * self.step_ns
        return (int(symbols_ns // self.symbol_ns) * self.bits_per_symbol - self.extra_bits) // 8


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to a frame: CTS, acknowledgement or block acknowledgement."""

    size_bytes: int
    """0 if it is a preamble only (NDP)."""
    duration_ns: int


@dataclass(frozen=True, slots=True)
class Aggregation:
    """Limits of a frame with several packets (A-MPDU)."""

    most_packets: int
    most_bytes: int
    most_ns: int
    """Longest time on the air."""
    always: bool
    """Whether a single packet has a delimiter, too: a frame of IEEE 802.11ax is always an A-MPDU."""
    most_plain_bytes: int = 65_535
    """Largest frame without a delimiter, if ``always`` is False."""


@dataclass(frozen=True, slots=True)
class PhysicalLayer:
    """What the distributed coordination function needs to know of a physical layer."""

    slot_ns: int
    sifs_ns: int
    difs_ns: int
    """Interframe space before the backoff: DIFS, or the AIFS of best effort where frames have a priority."""
    propagation_ns: int
    """Propagation delay between two stations."""
    min_window: int
    """Contention window of the first attempt, slots: CWmin + 1."""
    max_window: int
    attempts: int
    """Attempts (data frames, or RTS) per packet before it is dropped, if ``mac.retries`` is None."""
    header_bytes: int
    """MAC header with check sum, and LLC/SNAP, of each packet."""
    data: Waveform
    control: Waveform
    """Of RTS."""
    cts: Answer
    ack: Answer
    block_ack: Answer | None
    """None if frames carry one packet each."""
    aggregation: Aggregation | None
    eifs_ns: int
    """Silence after a damaged frame: its acknowledgement may be on the air, at the slowest rate."""
    answer_begins_ns: int
    """Time from the start of an answer until a station knows that there is one."""

    @property
    def gap_ns(self) -> int:
        """Time between a frame and its answer."""
        return self.sifs_ns + 2 * self.propagation_ns

    @property
    def reply_wait_ns(self) -> int:
        """Time from the end of a frame until its sender counts it as lost; a DIFS and a countdown follow."""
        return self.gap_ns + self.slot_ns + self.answer_begins_ns

    @property
    def rts_ns(self) -> int:
        """Time on the air of an RTS."""
        return self.control.air_ns(RTS_BYTES)

    def answer(self, packets: int) -> Answer:
        """Return the answer to a frame of so many packets."""
        return self.ack if packets == 1 or self.block_ack is None else self.block_ack

    def data_ns(self, payload_bytes: int) -> int:
        """Return the time on the air of a frame that carries one packet.

        Args:
            payload_bytes: payload of the medium access: application bytes with UDP and IP headers.
        """
        return self.frame_ns([payload_bytes])

    def frame_ns(self, payloads_bytes: list[int]) -> int:
        """Return the time on the air of a frame that carries these packets."""
        return self.data.air_ns(sum(self.subframes_bytes(payloads_bytes)))

    def subframes_bytes(self, payloads_bytes: list[int]) -> list[int]:
        """Return the bytes of each packet in a frame: headers and, in an A-MPDU, delimiter and padding.

        A delimiter has four bytes, and every subframe but the last is padded to a multiple of four
        (IEEE 802.11-2020, 9.7.1).
        """
        packets_bytes = [size + self.header_bytes for size in payloads_bytes]
        limits = self.aggregation
        if limits is None:
            return packets_bytes
        if len(packets_bytes) == 1 and not limits.always and packets_bytes[0] <= limits.most_plain_bytes:
            return packets_bytes
        padded = [DELIMITER_BYTES + -(-size // 4) * 4 for size in packets_bytes[:-1]]
        return [*padded, DELIMITER_BYTES + packets_bytes[-1]]


RTS_BYTES = 20
ACK_BYTES = 14
"""Acknowledgement or CTS."""
BLOCK_ACK_BYTES = 32
"""Compressed, for 64 packets; 24 bytes more for 256."""
QOS_HEADER_BYTES = 26 + 4 + 8
"""MAC header with QoS field, check sum, and LLC/SNAP."""
DELIMITER_BYTES = 4
LEGACY_BPS = (6e6, 12e6, 24e6)
"""Basic rates for answers and RTS: the mandatory rates of OFDM without aggregation."""
_LEGACY_BITS = {6e6: 24, 12e6: 48, 24e6: 96}
LEGACY_PREAMBLE_NS = 20_000
SIGNAL_EXTENSION_NS = 6_000
"""Silence after every OFDM frame at 2.4 GHz (IEEE 802.11-2020, 18.3.2.4)."""
OFDM_SLOT_NS, OFDM_SIFS_NS = 9_000, 10_000
"""Short slot and SIFS at 2.4 GHz, without stations of 802.11b."""
AIFS_SLOTS = 3
"""AIFSN of best effort (IEEE 802.11-2020, Table 9-155)."""
BEST_EFFORT_WINDOWS = 16, 1024
ATTEMPTS = 7


def legacy(rate_bps: float) -> Waveform:
    """Return OFDM at 6, 12 or 24 Mb/s at 2.4 GHz: 4 us symbols, 16 service and 6 tail bits (IEEE 802.11-2020,
    17.4.3)."""
    name: dict[float, Modulation] = {6e6: "bpsk 1/2", 12e6: "qpsk 1/2", 24e6: "16-qam 1/2"}
    bits = _LEGACY_BITS[rate_bps]
    return Waveform(name[rate_bps], LEGACY_PREAMBLE_NS, 4_000, bits, 22, extension_ns=SIGNAL_EXTENSION_NS)


def answer_rate_bps(mcs: int) -> float:
    """Return the fastest basic rate that is no faster than the MCS's reference rate (10.6.6.5.2, 10.6.11):
    that of its constellation and code rate."""
    return (6e6, 12e6, 12e6, 24e6)[min(mcs, 3)]


def wlan_2_4_ghz(data: Waveform, mcs: int, aggregation: Aggregation) -> PhysicalLayer:
    """Return the physical layer of 802.11n or 802.11ax at 2.4 GHz, which differ in their data frames only."""
    control = legacy(answer_rate_bps(mcs))
    ack = Answer(ACK_BYTES, control.air_ns(ACK_BYTES))
    block_bytes = BLOCK_ACK_BYTES + (24 if aggregation.most_packets > 64 else 0)
    aifs_ns = OFDM_SIFS_NS + AIFS_SLOTS * OFDM_SLOT_NS
    return PhysicalLayer(
        slot_ns=OFDM_SLOT_NS,
        sifs_ns=OFDM_SIFS_NS,
        difs_ns=aifs_ns,
        propagation_ns=0,
        min_window=BEST_EFFORT_WINDOWS[0],
        max_window=BEST_EFFORT_WINDOWS[1],
        attempts=ATTEMPTS,
        header_bytes=QOS_HEADER_BYTES,
        data=data,
        control=control,
        cts=ack,
        ack=ack,
        block_ack=Answer(block_bytes, control.air_ns(block_bytes)),
        aggregation=aggregation,
        eifs_ns=OFDM_SIFS_NS + legacy(6e6).air_ns(ACK_BYTES) + aifs_ns,
        answer_begins_ns=LEGACY_PREAMBLE_NS,
    )
