"""Captures: every frame of a run, at its time and with its size, as other readers see it."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from struct import unpack, unpack_from
from zlib import crc32

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.export.capture import check_capture, write_capture
from network_sim.mac import ieee80211b
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.log import Events, NetworkTrace, Recorder
from network_sim.types import Cause, EventKind, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.by_hand import trace_of

WPAN = ("thesis-link", "nodes.image_bytes=20000")
RELAYS = ("greenhouse", "nodes.images=1", "nodes.header_bytes=10", "run.horizon_s=200")
WLAN = ("office", "run.horizon_s=4", "nodes.count=8", "nodes.interval_s=2", "nodes.depth_bytes=0")
RTS = (*WLAN, "mac.rts=true")
STREET = ("street-grid", "run.keep=all", "run.horizon_s=30", "run.warmup_s=0")
MANY = ("run.horizon_s=3", "nodes.count=3", "nodes.interval_s=2", "nodes.depth_bytes=0", "loss.share=0.2")
CASES = {
    "wpan": WPAN,
    "wpan without acknowledgements": (*WPAN, "mac.ack=false"),
    "relays": RELAYS,
    "requests": (
        *RELAYS,
        f"nodes.first_bytes_by_node={','.join(12 * ['1000'])}",
        f"nodes.request_bytes_by_node={','.join(12 * ['38'])}",
    ),
    "sleeping relays": (*RELAYS, "nodes.duty_cycle=0.3", "nodes.duty_period_s=0.3"),
    "wlan": WLAN,
    "rts": RTS,
    "slow": (*WLAN, "mac.rate_bps=1e6", "nodes.header_bytes=0"),
    "street": STREET,
    "n": ("wifi-n", *MANY),
    "n, rts": ("wifi-n", *MANY, "mac.rts=true", "mac.guard_us=0.4", "nodes.header_bytes=0"),
    "ax": ("wifi-ax", *MANY, "mac.guard_us=1.6", "nodes.count=6", "run.horizon_s=6"),
    "ax, wide": ("wifi-ax", *MANY, "mac.ampdu_packets=256", "mac.mcs=0", "nodes.payload_bytes=100"),
    "ah": ("wifi-ah", *MANY),
    "ah, rts": ("wifi-ah", *MANY, "mac.rts=true"),
    "ideal": ("thesis-link", "mac.kind=ideal", "nodes.header_bytes=30", "nodes.image_bytes=3000"),
}


def run(case: str) -> NetworkTrace:
    preset, *changes = CASES[case]
    return simulate(with_settings(PRESETS[preset], changes))


def records(path: Path) -> Iterator[tuple[int, bytes]]:
    """Time in ns and bytes of each record, read as the format's description says."""
    data = path.read_bytes()
    assert unpack_from("<IHHiII", data) == (0xA1B23C4D, 2, 4, 0, 0, 262144)
    at = 24
    while at < len(data):
        seconds, rest_ns, kept, size = unpack_from("<IIII", data, at)
        assert kept == size
        assert rest_ns < 10**9
        yield seconds * 10**9 + rest_ns, data[at + 16 : at + 16 + size]
        at += 16 + size
    assert at == len(data)


def written(case: str, folder: Path) -> tuple[NetworkTrace, list[bytes]]:
    """The run of a case and its frames, whose times are those of the log."""
    trace, path = run(case), folder / "trace.pcap"
    write_capture(trace, path)
    found = list(records(path))
    on_air = trace.events.of(EventKind.AIR, EventKind.ACK)
    on_air = on_air.where(on_air.size_bytes > 0)  # without the answers that are preambles only
    assert [t_ns for t_ns, _ in found] == on_air.t_ns.tolist()
    assert len(found) > 50
    return trace, [frame for _, frame in found]


def crc16(data: bytes) -> int:
    """The check sum of IEEE 802.15.4, bit by bit."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


def resent(trace: NetworkTrace) -> list[bool]:
    """For each data frame, whether its sender sent the same packet last, without sleep in between."""
    last, found = {}, []
    for kind, node, packet in zip(
        *(getattr(trace.events, name).tolist() for name in ("kind", "node", "packet")), strict=True
    ):
        if kind == EventKind.DOWN:
            last.pop(node, None)
        if kind == EventKind.AIR:
            found.append(last.get(node) == packet)
            last[node] = packet
    return found


@pytest.mark.parametrize("case", ["wpan", "wpan without acknowledgements", "relays", "sleeping relays"])
def test_ieee802154_frames_have_the_sizes_and_numbers_of_the_run(case: str, tmp_path: Path) -> None:
    trace, frames = written(case, tmp_path)
    events = trace.events.of(EventKind.AIR, EventKind.ACK)
    numbers: dict[int, int] = {}
    repeats = iter(resent(trace))
    for index, frame in enumerate(frames):
        node, peer = int(events.node[index]), int(events.peer[index])
        assert len(frame) == events.size_bytes[index] - 6  # preamble, start of frame and length
        assert int.from_bytes(frame[-2:], "little") == crc16(frame[:-2])
        if events.kind[index] == EventKind.ACK:
            assert frame[:3] == bytes([2, 0, numbers[peer]])
            continue
        control, number, network, receiver, sender = unpack("<HBHHH", frame[:9])
        assert control == (0x8861 if trace.config.mac.ack else 0x8841)
        assert (network, receiver - 1, sender - 1) == (0x504D, peer, node)
        if next(repeats):
            assert number == numbers[node]
        else:
            assert number == (numbers.get(node, -1) + 1) % 256
        numbers[node] = number


@pytest.mark.parametrize("case", ["wlan", "rts", "slow", "street"])
def test_ieee80211_frames_have_the_sizes_rates_and_numbers_of_the_run(case: str, tmp_path: Path) -> None:
    trace, frames = written(case, tmp_path)
    events = trace.events.of(EventKind.AIR, EventKind.ACK)
    rate_bps = trace.config.mac.rate_bps
    numbers: dict[int, int] = {}
    repeats = iter(resent(trace))
    kinds = {0x08: 0, 0xB4: 0, 0xC4: 0, 0xD4: 0}
    for index, frame in enumerate(frames):
        assert frame[:9] == bytes.fromhex("00000a000600000010")
        body, node, peer = frame[10:], int(events.node[index]), int(events.peer[index])
        assert len(body) == events.size_bytes[index]
        assert ieee80211b.waveform(frame[9] * 500e3).air_ns(len(body)) == events.duration_ns[index]
        assert crc32(body[:-4]) == int.from_bytes(body[-4:], "little")
        assert body[4:10] == b"\x02PM\0" + (peer + 1).to_bytes(2, "big")
        kinds[body[0]] += 1
        if events.kind[index] == EventKind.ACK:
            continue
        assert frame[9] == rate_bps / 500e3
        assert body[10:16] == b"\x02PM\0" + (node + 1).to_bytes(2, "big")
        retry, number = body[1] == 8, int.from_bytes(body[22:24], "little") >> 4
        assert retry == next(repeats)
        assert number == (numbers[node] if retry else (numbers.get(node, -1) + 1) % 4096)
        numbers[node] = number
    failed = int((trace.events.of(EventKind.LOSS).cause == Cause.COLLISION).sum())
    assert kinds[0x08] == (trace.events.kind == EventKind.AIR).sum()
    if case == "rts":
        assert failed > 0
        assert kinds[0xB4] - kinds[0xC4] + kinds[0x08] - kinds[0xD4] == failed
    if case == "wlan":
        assert sum(resent(trace)) > 0
        assert kinds[0x08] - kinds[0xD4] == failed


@pytest.mark.parametrize("case", ["n", "n, rts", "ax", "ax, wide", "ah", "ah, rts"])
def test_block_acknowledgements_say_what_arrived(case: str, tmp_path: Path) -> None:
    trace, frames = written(case, tmp_path)
    events = trace.events.of(EventKind.AIR, EventKind.ACK)
    events = events.where(events.size_bytes > 0)
    lost = {
        (node, packet, t_ns)
        for node, packet, t_ns, cause in _columns(trace.events.of(EventKind.LOSS), "node packet t_ns cause")
        if cause != Cause.ACK_LOST
    }
    sent: dict[int, list[tuple[int, int, int]]] = {}
    """Number, packet and end of each packet of the latest data frame of each node."""
    numbers: dict[tuple[int, int], int] = {}
    answers = 0
    columns = _columns(events, "kind node peer packet t_ns duration_ns size_bytes")
    for frame, (kind, node, peer, packet, t_ns, duration_ns, size) in zip(frames, columns, strict=True):
        body = frame[int.from_bytes(frame[2:4], "little") :]
        assert crc32(body[:-4]) == int.from_bytes(body[-4:], "little")
        assert body[4:10] == b"\x02PM\0" + (peer + 1).to_bytes(2, "big")
        if kind == EventKind.AIR:
            assert body[0] == 0x88
            assert 0 <= size - len(body) <= 4 + 3  # delimiter and padding
            number = int.from_bytes(body[22:24], "little") >> 4
            assert (body[1] == 8) == ((node, packet) in numbers)
            assert numbers.setdefault((node, packet), number) == number
            parts = sent.setdefault(node, [])
            if parts and parts[-1][2] != t_ns:
                parts.clear()
            parts.append((number, packet, t_ns + duration_ns))
        elif body[0] == 0x94:
            answers += 1
            assert len(body) == size
            first, wide = int.from_bytes(body[18:20], "little"), size == 56
            assert first & 15 == (4 if wide else 0)
            bitmap = int.from_bytes(body[20:-4], "little")
            end_ns = sent[peer][-1][2]
            arrived = [number for number, one, _ in sent[peer] if (peer, one, end_ns) not in lost]
            assert first >> 4 == sent[peer][0][0]
            assert bitmap == sum(1 << (number - (first >> 4)) for number in arrived)
    assert (answers > 5) == (not case.startswith("ah"))


def _columns(events: Events, names: str) -> list[tuple[int, ...]]:
    return list(zip(*(getattr(events, name).tolist() for name in names.split()), strict=True))


@pytest.mark.parametrize("kind", ["ieee802154", "ieee80211b"])
def test_a_packet_that_its_node_sends_after_sleep_has_a_new_number(kind: str, tmp_path: Path) -> None:
    """Packet 0, again, and after sleep; then packet 1."""

    def story(recorder: Recorder) -> None:
        for packet in (0, 1):
            recorder.add(0, EventKind.ENQUEUE, 0, packet=packet, image=0, size_bytes=50)
        for t_ns, packet in ((10, 0), (20, 0), (50, 0), (60, 1)):
            recorder.add(t_ns, EventKind.AIR, 0, 2, packet, 0, size_bytes=67, duration_ns=5)
        recorder.add(30, EventKind.DOWN, 0)
        recorder.add(40, EventKind.UP, 0)

    trace = trace_of(story, warmup_s=0.0)
    config = with_settings(trace.config, [f"mac.kind={kind}"])
    write_capture(replace(trace, config=config), tmp_path / "trace.pcap")
    frames = [frame for _, frame in records(tmp_path / "trace.pcap")]
    if kind == "ieee802154":
        assert [frame[2] for frame in frames] == [0, 0, 1, 2]
    else:
        assert [(frame[32] >> 4, frame[11]) for frame in frames] == [(0, 0), (0, 8), (1, 0), (2, 0)]


def test_reservations_end_with_the_exchange(tmp_path: Path) -> None:
    """A frame's reservation ends within 1 us after the last frame of its exchange."""
    trace, frames = written("rts", tmp_path)
    events = trace.events.of(EventKind.AIR, EventKind.ACK)
    ends_ns = events.t_ns + events.duration_ns
    exchanges = 0
    for first in range(len(frames) - 3):
        kinds = [frame[10] for frame in frames[first : first + 4]]
        packets = set(events.packet[first : first + 4].tolist())
        if kinds != [0xB4, 0xC4, 0x08, 0xD4] or len(packets) > 1:
            continue
        exchanges += 1
        for index in range(first, first + 4):
            reserved_ns = 1000 * int.from_bytes(frames[index][12:14], "little")
            assert 0 <= ends_ns[index] + reserved_ns - ends_ns[first + 3] < 1000 * 2
    assert exchanges > 50


def test_payloads_say_what_they_carry(tmp_path: Path) -> None:
    _, frames = written("wpan", tmp_path)
    first = next(frame for frame in frames if frame[9:].startswith(b"#node 2 image"))
    assert first[9:-2].rstrip(b"\0").endswith(b"fragment 0 bytes 0-115")
    third = b"fragment 2 bytes 232-347"  # 116 bytes each
    assert any(frame[9:-2].rstrip(b"\0").endswith(third) for frame in frames)
    trace, frames = written("requests", tmp_path)
    events = trace.events.of(EventKind.AIR, EventKind.ACK)
    assert PacketKind.REQUEST in events.packet_kind
    taken = trace.events.of(EventKind.CAPTURE)
    cameras = dict(zip(taken.image.tolist(), taken.node.tolist(), strict=True))
    forwarded = 0
    for index, frame in enumerate(frames):
        if events.kind[index] == EventKind.ACK:
            continue
        camera = cameras[int(events.image[index])]
        ends = unpack(">HH", frame[11:15])
        if events.packet_kind[index] in (PacketKind.STATUS, PacketKind.REQUEST):
            assert ends == (len(trace.names), camera + 1)
        else:
            assert ends == (camera + 1, len(trace.names))
            forwarded += int(events.node[index]) != camera
        name = f"#{trace.names[ends[0] - 1]} ".encode()
        assert frame[19:-2].startswith(name[: len(frame) - 21])  # a STATUS has little room
    assert forwarded > 0


def test_links_without_frames_give_ip_packets(tmp_path: Path) -> None:
    trace, packets = written("ideal", tmp_path)
    sizes = trace.events.of(EventKind.AIR).size_bytes.tolist()
    assert [len(packet) for packet in packets] == sizes
    assert unpack_from("<I", (tmp_path / "trace.pcap").read_bytes(), 20) == (101,)
    for packet in packets:
        assert packet[0] == 0x45
        assert int.from_bytes(packet[2:4], "big") == len(packet)
        assert sum(np.frombuffer(packet[:20], ">u2").tolist()) % 0xFFFF == 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["run.keep=images"], r"run.keep is images.*try run.keep=all"),
        (["mac.kind=serial"], r"mac.kind is serial.*nodes.header_bytes is 0.*try nodes.header_bytes=28"),
        (["scenario=street-grid", "mac.kind=ideal", "scheme.headers_bytes=8"], "try scheme.headers_bytes=28"),
    ],
)
def test_runs_without_frames_are_one_sentence(changes: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_capture(with_settings(NetworkConfig(), changes))


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
@pytest.mark.parametrize("case", CASES)
def test_tshark_finds_nothing_wrong(case: str, tmp_path: Path) -> None:
    trace, frames = written(case, tmp_path)
    checks = [f"{name}.check_checksum:TRUE" for name in ("wlan", "ip", "udp")]
    words = ["tshark", "-r", str(tmp_path / "trace.pcap")]
    words += [word for check in checks for word in ("-o", check)]
    fields = ("_ws.malformed", "_ws.expert.severity", "wpan.fcs_ok", "wlan.fcs.status", "udp.checksum.status")
    words += ["-T", "fields", *(word for field in fields for word in ("-e", field))]
    lines = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
    rows = [line.split("\t") for line in lines]
    assert len(rows) == len(frames)
    warning = 0x00600000
    for malformed, severity, wpan, wlan, udp in rows:
        assert not malformed
        assert all(int(one, 0) < warning for one in severity.split(",") if one)
        assert wpan in ("", "1", "True")
        assert wlan in ("", "1", "Good")
        assert udp in ("", "1", "2", "Good", "Unverified")
    if trace.config.mac.kind != "ideal":
        assert all(wpan or wlan for _, _, wpan, wlan, _ in rows)


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
@pytest.mark.parametrize(
    ("preset", "field", "of_data", "of_answer"),
    [
        # wlan_radio.duration, us: as the simulated frames, without the signal extension of 6 us
        ("wifi-n", "wlan_radio.duration", "228", "28"),
        ("wifi-n", "radiotap.mcs.index", "7", ""),
        ("wifi-ax", "radiotap.he.data_3.data_mcs", "0x0009", ""),
        ("wifi-ah", "radiotap.s1g.mcs", "7", None),
    ],
)
def test_tshark_reads_how_frames_were_sent(
    preset: str, field: str, of_data: str, of_answer: str | None, tmp_path: Path
) -> None:
    changes = ["run.horizon_s=3", "nodes.interval_s=2", "nodes.payload_bytes=1498", "mac.ampdu_packets=1"]
    trace, path = simulate(with_settings(PRESETS[preset], changes)), tmp_path / "trace.pcap"
    write_capture(trace, path)
    words = ["tshark", "-r", str(path), "-c", "2", "-T", "fields", "-e", field]
    lines = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split("\n")
    assert lines[0] == of_data
    if of_answer is not None:
        assert lines[1] == of_answer
    if preset == "wifi-n":
        assert trace.events.of(EventKind.AIR).duration_ns[0] == (228 + 6) * 1000
        assert trace.events.of(EventKind.ACK).duration_ns[0] == (28 + 6) * 1000
