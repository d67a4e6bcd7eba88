"""Recorded links as other programs write them: other units, separators, decimals; doubt is an error."""

import codecs
import re

import numpy as np
import pytest

from network_sim.config import MacConfig, NetworkConfig, UplinkConfig
from network_sim.radio.link_columns import column_named
from network_sim.radio.link_file import link_notes, read_link_trace
from packetmesh.errors import InputError

PLAIN = "0 2.5 35 0.03\n0.5 0 29.5 0\n1.0 12.25 26 0.97\n"
"""The recording that all the others below hold, too."""
EQUAL = {
    "tabs": ("0\t2.5\t35\t0.03\n0.5\t0\t29.5\t0\n1.0\t12.25\t26\t0.97\n", ""),
    "commas": ("0, 2.5, 35, 0.03\n0.5, 0, 29.5, 0\n1.0, 12.25, 26, 0.97\n", ""),
    "a comma at the end": ("0,2.5,35,0.03,\n0.5,0,29.5,0,\n1.0,12.25,26,0.97,\n", ""),
    "semicolons": ("0;2.5;35;0.03\n0.5;0;29.5;0\n1.0;12.25;26;0.97\n", ""),
    "decimal commas": ("0;2,5;35;0,03\n0,5;0;29,5;0\n1,0;12,25;26;0,97\n", "decimal commas"),
    "decimal commas, whole numbers first": (
        "zeit_s;rate;rtt;loss\n".replace("zeit", "time") + "0;2,5;35;0,03\n0,5;0;29,5;0\n1,0;12,25;26;0,97\n",
        "decimal commas",
    ),
    "decimal commas and blanks": ("0,0 2,5 35 0,03\n0,5 0 29,5 0\n1,0 12,25 26 0,97\n", "decimal commas"),
    "per cent": ("0 2.5 35 3\n0.5 0 29.5 0\n1.0 12.25 26 97\n", "loss in per cent"),
    "epoch seconds": (
        "1700000000 2.5 35 0.03\n1700000000.5 0 29.5 0\n1700000001 12.25 26 0.97\n",
        "time in s since 1970",
    ),
    "epoch milliseconds": (
        "1700000000000 2.5 35 0.03\n1700000000500 0 29.5 0\n1700000001000 12.25 26 0.97\n",
        "time in ms since 1970",
    ),
    "epoch nanoseconds": (
        "1700000000000000000 2.5 35 0.03\n1700000000500000000 0 29.5 0\n1700000001000000000 12.25 26 0.97\n",
        "time in ns since 1970",
    ),
    "a header of kbit/s, ms and %": (
        "time_ms,rate_kbps,rtt_ms,loss_%\n0,2500,35,3\n500,0,29.5,0\n1000,12250,26,97\n",
        "time in ms, rate in kbit/s, loss in per cent",
    ),
    "a header with brackets": (
        "t [s]  throughput (bit/s)  RTT [us]  packet loss (%)\n".replace("packet loss", "packet_loss")
        + "0 2.5e6 35000 3\n0.5 0 29500 0\n1 12.25e6 26000 97\n",
        "rate in bit/s, round trip in us, loss in per cent",
    ),
    "a header in another order": (
        "loss_rate;rtt;timestamp;bandwidth/(kB/s)\n0.03;35;0;312.5\n0;29.5;0.5;0\n0.97;26;1;1531.25\n",
        "rate in kB/s",
    ),
    "a header in a comment": (
        "# made by us\n# time_ms rate_Mbit/s rtt_s loss_percent\n"
        "0 2.5 .035 3\n500 0 .0295 0\n1000 12.25 .026 97\n",
        "time in ms, round trip in s, loss in per cent",
    ),
    "one more column": (
        "t,rate,rtt,loss,cell\n0,2.5,35,0.03,7\n0.5,0,29.5,0,7\n1.0,12.25,26,0.97,8\n",
        "other columns left out",
    ),
    "other columns whose unit or kind is in doubt": (
        "time_s,rate_mbps,rtt_ms,rtt_jitter_ms,latency_ms,loss,note\n"
        '0,2.5,35,1,17,0.03,"a, b"\n0.5,0,29.5,1,15,0,"c"\n1.0,12.25,26,1,13,0.97,""\n',
        "other columns left out",
    ),
    "a header of the usual units": ("time_s rate_mbps rtt_ms loss\n" + PLAIN, ""),
    "quotes": (
        '"time_s","rate_mbps","rtt_ms","loss"\n"0","2.5","35","0.03"\n"0.5","0","29.5","0"\n'
        '"1.0","12.25","26","0.97"\n',
        "",
    ),
}


def written(tmp_path, text):
    path = tmp_path / "link.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def note_of(path):
    notes = link_notes(NetworkConfig(mac=MacConfig(kind="replay", trace=str(path))))
    return notes[0] if notes else ""


def same(one, other):
    for name in ("t_s", "rate_bps", "round_trip_s", "loss"):
        np.testing.assert_allclose(
            getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-7, err_msg=name
        )


@pytest.fixture
def plain(tmp_path):
    return read_link_trace(written(tmp_path, PLAIN))


@pytest.mark.parametrize("form", EQUAL)
def test_every_form_gives_the_same_recording_and_is_said(tmp_path, plain, form):
    text, said = EQUAL[form]
    path = written(tmp_path, text)
    same(read_link_trace(path), plain)
    assert note_of(path) == (f"The recorded link {path} was read with {said}" if said else "")


def test_the_usual_form_is_in_seconds_megabits_milliseconds_and_shares(plain):
    np.testing.assert_array_equal(plain.t_s, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(plain.rate_bps, [2.5e6, 0.0, 12.25e6])
    np.testing.assert_allclose(plain.round_trip_s, [0.035, 0.0295, 0.026])
    np.testing.assert_array_equal(plain.loss, [0.03, 0.0, 0.97])


@pytest.mark.parametrize(
    "content",
    [
        codecs.BOM_UTF8 + PLAIN.encode(),
        PLAIN.replace("\n", "\r\n").encode(),
        codecs.BOM_UTF8 + PLAIN.replace("\n", "\r\n").encode(),
        codecs.BOM_UTF16_LE + PLAIN.replace("\n", "\r\n").encode("utf-16-le"),
        PLAIN.replace(" ", "   ").encode().rstrip(),
    ],
)
def test_marks_and_line_ends_of_windows_make_no_difference(tmp_path, plain, content):
    path = written(tmp_path, content)
    same(read_link_trace(path), plain)
    assert note_of(path) == ""


DOUBTS = {
    "steps": (
        "0 2 30 0\n15 2 30 0\n30 3 30 0\n",
        "15 apart: in seconds or milliseconds?",
        "time_ms",
        ("time_s", "time_ms"),
    ),
    "rates": (
        "0 2500 30 0\n1 2 30 0\n",
        "up to 2500: in Mbit/s, kbit/s",
        "rate_kbit/s",
        ("rate_mbit/s", "rate_kbit/s"),
    ),
    "short round trips": ("0 2 0.03 0\n1 2 0.04 0\n", "at most 0.04: in milli", "rtt_s", ("rtt_ms", "rtt_s")),
    "long round trips": ("0 2 30000 0\n1 2 30000 0\n", "of 30000: in milli", "rtt_us", ("rtt_ms", "rtt_us")),
    "losses": ("0 2 30 0.5\n1 2 30 1.5\n", "up to 1.5: in per cent", "loss_percent", ("loss_percent",)),
}


@pytest.mark.parametrize("kind", DOUBTS)
def test_a_doubt_is_an_error_whose_remedy_works(tmp_path, kind):
    text, asked, offered, units = DOUBTS[kind]
    with pytest.raises(InputError) as error:
        read_link_trace(written(tmp_path, text))
    message = str(error.value)
    assert asked in message
    assert "\n" not in message
    header = re.search(r"for example: (.*)$", message)[1]
    assert offered in header
    found = []
    for unit in units:
        settled = " ".join(unit if word == offered else word for word in header.split())
        found.append(read_link_trace(written(tmp_path, f"{settled}\n{text}")))
    assert len({repr(trace) for trace in found}) == len(units)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("time,rate_KBPS,rtt,loss\n0,1,2,0\n1,1,2,0\n", "'rate_KBPS': bits or bytes? Try kbit/s or kB/s"),
        (
            "time,rate_furlongs,rtt,loss\n0,1,2,0\n1,1,2,0\n",
            "whose unit is unknown; try one of bit/s, kbit/s",
        ),
        ("time,rate,latency_ms,loss\n0,1,2,0\n1,1,2,0\n", "'latency_ms': one way or both? Try rtt_ms"),
        ("time,rate,rtt,loss,time_ms\n0,1,2,0,0\n1,1,2,0,0\n", "names time twice"),
        ("time,rate,rtt\n0,1,2\n", "does not name the four columns; try a header such as: time_s"),
        ("time,rate,rtt,loss\n0,1,2\n", "line 1 does not name the four columns"),
        ("0,015,2,50,35,0,0,67\n0,030,2,50,29,0,0,67\n", "line 2 has 8 columns; try 4, or semicolons"),
        ("0,015;2.50,1;35;0\n0,030;2.5;29;0\n", "as"),
        ("1 2 3 4 5\n", "line 1 has 5 columns; try 4"),
    ],
)
def test_what_is_unclear_is_one_sentence(tmp_path, text, names):
    with pytest.raises(InputError) as error:
        read_link_trace(written(tmp_path, text))
    assert names in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("title", "quantity", "unit"),
    [
        *[(title, 1, "Mbit/s") for title in ("rate_mbps", "Rate (Mbit/s)", "throughput [Mbps]", "bw/Mb/s")],
        *[
            (title, 1, "kbit/s")
            for title in ("kbit_rate_kbps".removeprefix("kbit_"), "bandwidth kbit/s", "goodput_kbits/s")
        ],
        *[(title, 1, "MB/s") for title in ("rate_MBps", "rate [MB/s]", "rate in MByte/s")],
        *[
            (title, 0, "ms")
            for title in ("time_ms", "timestamp [ms]", "t/ms", "epoch_ms", "elapsed time (msec)")
        ],
        *[(title, 0, None) for title in ("t", "time", "timestamp", "ts")],
        *[(title, 2, "ms") for title in ("rtt_ms", "round_trip_time_ms", "Round trip (ms)", "ping ms")],
        *[
            (title, 3, "per cent")
            for title in ("loss%", "loss_pct", "packet loss [%]", "lost percent", "loss rate (%)")
        ],
        *[(title, 3, None) for title in ("loss", "loss_rate", "plr")],
        ("seconds", 0, "s"),
        ("loss_share", 3, "share"),
    ],
)
def test_titles_as_people_write_them(title, quantity, unit):
    column = column_named(title, "here")
    assert (column.quantity, column.unit) == (quantity, unit)


@pytest.mark.parametrize("title", ["cell", "note", "x", "total", "state", "host"])
def test_other_titles_are_none(title):
    assert column_named(title, "here") is None


def test_only_links_that_a_run_reads_are_spoken_of(tmp_path):
    path = str(written(tmp_path, EQUAL["per cent"][0]))
    assert link_notes(NetworkConfig(mac=MacConfig(trace=path))) == []
    assert len(link_notes(NetworkConfig(uplink=UplinkConfig(trace=path)))) == 1
    both = NetworkConfig(mac=MacConfig(kind="replay", trace=path), uplink=UplinkConfig(trace=path))
    assert len(link_notes(both)) == 1


@pytest.mark.parametrize("name", ["cell_3", "cell_4", "eth_3", "wifi_10", "wifi_13", "wifi_14"])
def test_real_recordings_are_in_the_usual_form(shared_data, name):
    path = shared_data / "link_traces" / f"{name}.txt"
    assert note_of(path) == ""
    np.testing.assert_array_equal(read_link_trace(path).rate_bps, 1e6 * np.loadtxt(path)[:, 1])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0 1_0 20 0\n", "has '1_0' as rate"),
        ("time,DL_bitrate,UL_bitrate\n0,1,2\n", "(not found: rate, round trip, loss)"),
        ("time,rate,rtt,loss\n0,1,2\n", "(the rows have 3 columns)"),
        ("0.5\n1\n3\n", "line 1 has 1 column; try 4"),
        ("1700000001 1 2 0\n1700000000 1 2 0\n", "line 2 is 1 s before the row above; try rows in order"),
        ("0 1 2 0\n1e-12 1 2 0\n", "line 2 comes 1e-12 s after the row above; try to check the unit of time"),
        ("t_s rate_bps rtt_ms loss\n0 1e300 2 0\n", "line 2 has a rate of 1e+294 Mbit/s, read in bit/s"),
        ("t_s rate_bps rtt_ms loss\n0 0.01 2 0\n", "line 2 has a rate of 1e-08 Mbit/s, read in bit/s"),
        ("t_s rate_bps rtt_s loss\n0 1e6 1e99 0\n", "line 2 has a round trip of 1e+102 ms, read in s"),
        ("t_s rate_bps rtt_s loss\n0 1e6 1 0\n1e10 1e6 1 0\n", "line 3 has a time of 1e+10 s, read in s"),
    ],
)
def test_values_and_rows_that_no_link_has_are_named(tmp_path, text, says):
    with pytest.raises(InputError) as error:
        read_link_trace(written(tmp_path, text))
    assert says in str(error.value)


def test_a_rate_that_may_be_in_kbit_s_is_said_and_a_header_settles_it(tmp_path):
    assert note_of(written(tmp_path, "0 800 20 0\n1 400 20 0\n")).endswith(
        "was read with rate in Mbit/s (up to 800); if that is wrong, name the unit in a header"
    )
    assert note_of(written(tmp_path, "time_s rate_mbps rtt_ms loss\n0 800 20 0\n1 400 20 0\n")) == ""
    assert note_of(written(tmp_path, "0 300 20 0\n1 40 20 0\n")) == ""
