"""Recorded links of other programs: mahimahi traces, output of iperf3, and what cannot be a link."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from network_sim.config import MacConfig, NetworkConfig
from network_sim.radio.link_file import link_notes, read_link_trace
from network_sim.radio.link_trace import Replay
from network_sim.simulate import simulate
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

TCP = """{"start": {"version": "iperf 3.12", "test_start": {
"protocol": "TCP", "num_streams": 1, "blksize": 131072,
"omit": 0, "duration": 3, "bytes": 0, "blocks": 0, "reverse": 0, "tos": 0, "target_bitrate": 20000000}},
"intervals": [{"streams": [{"socket": 5, "start": 0, "end": 1.000129, "seconds": 1.000128984451294,
"bytes": 2621440, "bits_per_second": 20968815.348857943, "retransmits": 0, "snd_cwnd": 1178694,
"snd_wnd": 1907712, "rtt": 100, "rttvar": 21, "pmtu": 65535, "omitted": false, "sender": true}],
"sum": {"start": 0, "end": 1.000129, "seconds": 1.000128984451294, "bytes": 2621440,
"bits_per_second": 20968815.348857943, "retransmits": 0, "omitted": false, "sender": true}},
{"streams": [{"socket": 5, "start": 1.000129, "end": 2.000124, "seconds": 0.999994993209839, "bytes": 2490368,
"bits_per_second": 19923043.75049943, "retransmits": 0, "snd_cwnd": 1178694, "snd_wnd": 1907712, "rtt": 118,
"rttvar": 9, "pmtu": 65535, "omitted": false, "sender": true}], "sum": {"start": 1.000129, "end": 2.000124,
"seconds": 0.999994993209839, "bytes": 2490368, "bits_per_second": 19923043.75049943, "retransmits": 0,
"omitted": false, "sender": true}}], "end": {"sum_sent": {"start": 0, "end": 3.0001, "seconds": 3.0001}}}"""
"""Output of ``iperf3 -c 127.0.0.1 -t 3 -b 20M -J``, iperf 3.12, without its last interval and its sums."""
UDP = """{"start": {"version": "iperf 3.12", "test_start": {
"protocol": "UDP", "num_streams": 1, "blksize": 32768,
"omit": 0, "duration": 3, "reverse": 0, "target_bitrate": 5000000}}, "intervals": [
{"streams": [{"socket": 5, "start": 0, "end": 1.000025, "seconds": 1.0000250339508057, "bytes": 655360,
"bits_per_second": 5242748.753285624, "packets": 20, "omitted": false, "sender": true}],
"sum": {"start": 0, "end": 1.000025, "seconds": 1.0000250339508057, "bytes": 655360,
"bits_per_second": 5242748.753285624, "packets": 20, "omitted": false, "sender": true}}],
"end": {"sum": {"start": 0, "end": 3.000368, "seconds": 3.000368, "bytes": 1900544,
"bits_per_second": 5068048.07000971, "jitter_ms": 0.0765538564266239, "lost_packets": 0, "packets": 58,
"lost_percent": 0, "sender": true}}}"""
"""Output of ``iperf3 -c 127.0.0.1 -u -b 5M -t 3 -J``, iperf 3.12, with its first interval only."""
PING = """PING 127.0.0.1 (127.0.0.1) 56(84) bytes of data.
64 bytes from 127.0.0.1: icmp_seq=1 ttl=64 time=0.076 ms
"""
MAHIMAHI = (0, 7, 7, 10, 14, 18, 22, 100, 100, 101, 250)


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "link.other"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def note_of(path: Path) -> str:
    (note,) = link_notes(NetworkConfig(mac=MacConfig(kind="replay", trace=str(path))))
    return note


def lines_of(times_ms: tuple[int, ...]) -> str:
    return "".join(f"{time_ms}\n" for time_ms in times_ms)


def interval_of(start_s: float, duration_s: float, **more: Any) -> dict[str, Any]:
    return {"sum": {"start": start_s, "seconds": duration_s, "omitted": False, "sender": False, **more}}


def test_a_mahimahi_trace_has_1500_bytes_a_line(tmp_path: Path) -> None:
    link = read_link_trace(written(tmp_path, lines_of(MAHIMAHI)))
    # 250 ms are two steps; the first has the nine lines from 7 to 101, the second 250, and the 0 of the next
    np.testing.assert_allclose(link.t_s, [0.0, 0.125])
    np.testing.assert_allclose(link.rate_bps, [9 * 12_000 / 0.125, 2 * 12_000 / 0.125])
    assert not link.round_trip_s.any()
    assert not link.loss.any()


def test_a_mahimahi_trace_loses_no_byte_and_repeats_after_its_last_line(tmp_path: Path) -> None:
    times_ms = np.sort(np.random.default_rng(5).integers(0, 12_345, 3000))
    link = read_link_trace(written(tmp_path, lines_of(tuple(times_ms.tolist()))))
    edges_s = link.edges_ns / 1e9
    assert edges_s[-1] == pytest.approx(times_ms[-1] / 1e3, abs=1e-6)
    assert (link.rate_bps * np.diff(edges_s)).sum() == pytest.approx(3000 * 1500 * 8, rel=1e-6)
    assert Replay(link).ends_ns(0, 3000 * 1500) == pytest.approx(1e6 * times_ms[-1], rel=1e-6)


def test_a_step_ends_with_its_lines(tmp_path: Path) -> None:
    link = read_link_trace(written(tmp_path, lines_of((100, 100, 101, 200, 300))))
    np.testing.assert_allclose(link.rate_bps, np.array([2, 2, 1]) * 120_000)


def test_a_short_mahimahi_trace_is_a_constant_link(tmp_path: Path) -> None:
    path = written(tmp_path, "1\r\n")  # a file of one line: 12 Mbit/s, the first example of its manual
    link = read_link_trace(path)
    assert (link.t_s.tolist(), link.rate_bps.tolist()) == ([0.0], [pytest.approx(12e6)])
    assert "read as a mahimahi trace" in note_of(path)
    assert "no round trip and no losses, which count as 0" in note_of(path)


def test_columns_of_whole_numbers_stay_columns(tmp_path: Path) -> None:
    link = read_link_trace(written(tmp_path, "0 8 20 0\n1 9 20 1\n"))
    np.testing.assert_allclose(link.rate_bps, [8e6, 9e6])


def test_a_test_over_tcp_gives_rate_and_round_trip(tmp_path: Path) -> None:
    path = written(tmp_path, TCP)
    link = read_link_trace(path)
    np.testing.assert_allclose(link.t_s, [0.0, 1.000129])
    np.testing.assert_allclose(link.rate_bps, [20968815.348857943, 19923043.75049943])
    np.testing.assert_allclose(link.round_trip_s, [100e-6, 118e-6])
    assert not link.loss.any()
    assert "iperf3 over TCP; it has no losses, which count as 0, as TCP sends lost packets again" in note_of(
        path
    )


def test_a_test_over_udp_that_the_sender_wrote_has_the_losses_of_the_whole_test(tmp_path: Path) -> None:
    path = written(tmp_path, UDP.replace('"lost_percent": 0', '"lost_percent": 12.5'))
    link = read_link_trace(path)
    np.testing.assert_allclose(link.rate_bps, 5242748.753285624)
    np.testing.assert_allclose(link.loss, 0.125)
    assert "its losses are those of the whole test, 12.5 %" in note_of(path)
    assert "it has no round trip, which counts as 0" in note_of(path)


def test_a_test_over_udp_that_the_receiver_wrote_has_what_was_sent_and_lost_in_each_interval(
    tmp_path: Path,
) -> None:
    test = json.loads(UDP)
    test["intervals"] = [
        interval_of(0, 1.0, packets=100, lost_percent=25, bytes=75_000),
        interval_of(1.0, 2.0, packets=100, lost_percent=-1, bytes=101_000),  # one came late
        interval_of(3.0, 1.0, packets=40, lost_percent=100, bytes=0),
    ]
    test["start"]["test_start"]["blksize"] = 1000
    path = written(tmp_path, json.dumps(test))
    link = read_link_trace(path)
    np.testing.assert_allclose(link.rate_bps, [800e3, 400e3, 320e3])
    np.testing.assert_allclose(link.loss, [0.25, 0.0, 1.0])
    assert "whole test" not in note_of(path)


def test_omitted_intervals_and_a_short_last_one_are_left_out(tmp_path: Path) -> None:
    test = json.loads(TCP)
    test["intervals"] = [
        interval_of(0, 1.0, bytes=1, omitted=True),
        interval_of(3e-5, 1.0, bytes=1_000_000),
        interval_of(1.0, 1.0, bytes=2_000_000),
        interval_of(2.0, 0.04, bytes=500_000),
    ]
    path = written(tmp_path, json.dumps(test))
    link = read_link_trace(path)
    np.testing.assert_allclose(link.rate_bps, [8e6, 16e6])
    assert link.t_s[0] == 0.0
    assert "no round trip and no losses" in note_of(path)


def test_the_round_trip_is_the_mean_of_the_senders_streams(tmp_path: Path) -> None:
    test = json.loads(TCP)
    (stream,) = test["intervals"][0]["streams"]
    other_way = {**stream, "rtt": 9999, "sender": False}
    test["intervals"][0]["streams"] = [stream, {**stream, "rtt": 300}, other_way]
    link = read_link_trace(written(tmp_path, json.dumps(test)))
    assert link.round_trip_s[0] == pytest.approx(200e-6)


@pytest.mark.parametrize("content", [TCP, lines_of(MAHIMAHI)])
def test_images_cross_such_a_link(content: str, tmp_path: Path) -> None:
    changes = ["nodes.image_bytes=2000", "mac.kind=replay", f"mac.trace={written(tmp_path, content)}"]
    trace = simulate(with_settings(NetworkConfig(), changes))
    assert trace.counters.images.arrived == 3


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("5\n7\n6\n", r"time 3 is 1 ms before the one above; try a mahimahi trace with rising times"),
        ("0\n0\n", "read as a mahimahi trace, lasts 0 ms"),
        ("1\n99999999\n", "lasts more than a day"),
        ("1\n" + "9" * 5000, "lasts more than a day"),
        (PING, "is ping's output, which has no rate; try the output of iperf3 --json"),
        (bytes.fromhex("4d3cb2a1") + bytes(20), "is a packet capture, which shows what was sent"),
        (bytes.fromhex("0a0d0d0a") + bytes(20), "is a packet capture"),
        ("{", "is not valid JSON"),
        ("{}", "has no intervals of iperf3; try"),
        ('{"intervals": [], "error": "unable to connect"}', r"\(iperf3 said: unable to connect\)"),
        (TCP.replace('"bytes": 2621440', '"bytes": -1'), "has '-1' as 'bytes' of an interval"),
        (TCP.replace('"bytes": 2621440', '"bytes": NaN'), "has 'nan' as 'bytes'"),
        (TCP.replace('"bytes": 2621440', '"bites": 1'), "has no number as 'bytes'"),
        (TCP.replace('"rtt": 100', '"rtt": true'), "has 'True' as 'rtt' of a stream"),
        (TCP.replace('"seconds": 1.0', '"seconds": 0.0'), "has an interval of 0.0001"),
        (TCP.replace('"start": 1.000129', '"start": 0'), "intervals that do not follow each other"),
        (TCP.replace('"bytes": 2', '"bytes": 0, "b": 2'), "has a rate of 0 throughout"),
        (UDP.replace('"lost_percent": 0', '"lost": 0'), "has no number as 'lost_percent' of end"),
        (UDP.replace('"blksize": 32768', '"blksize": "32k"'), "has '32k' as 'blksize' of test_start"),
    ],
)
def test_what_cannot_be_a_link_is_one_sentence(content: str | bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as error:
        read_link_trace(written(tmp_path, content))
    assert "link.other" in str(error.value)
    assert "\n" not in str(error.value)
