"""Scripts for tc netem: their options, and what they call when they run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.export.link_statistics import Bursts, LinkStatistics
from network_sim.export.netem import (
    check_netem_script,
    netem_options,
    recorded_script,
    write_netem_script,
)
from network_sim.radio.link_trace import LinkTrace, constant_link
from network_sim.simulate import simulate
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

LINK = LinkStatistics(100, 54321.9, 0.02, 0.0, 0.0, 0.0, None)
RECORDED = LinkTrace(
    np.array([0.0, 0.2, 0.4, 0.6]),
    np.array([0.0, 12.5e6, 12.5e6, 0.0]),
    np.array([0.01, 0.02, 0.02, 0.03]),
    np.array([0.0, 0.125, 0.125, 1.0]),
)
ROWS = [
    "at 0 rate 12500kbit delay 205000us",
    "at 200000 rate 12500kbit delay 10000us loss random 12.5%",
    "at 600000 rate 12500kbit delay 415000us loss random 100%",
]
FAKE_TC = '#!/bin/sh\necho "$(date +%s%N) $*" >> "$TC_LOG"\n'


def written(folder: Path, *changes: str) -> Path:
    path = folder / "link.sh"
    write_netem_script(simulate(with_settings(NetworkConfig(), changes)), path)
    return path


def fake_tc(folder: Path) -> dict[str, str]:
    """An environment in which ``tc`` only notes the time and what it was called with."""
    (folder / "bin").mkdir()
    (folder / "bin" / "tc").write_text(FAKE_TC)
    (folder / "bin" / "tc").chmod(0o755)
    return {"PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "TC_LOG": str(folder / "log")}


def calls(folder: Path) -> list[tuple[int, str]]:
    """Time in ns and arguments of each call of the fake ``tc``."""
    lines = (folder / "log").read_text().splitlines()
    return [(int(t_ns), words) for t_ns, _, words in (line.partition(" ") for line in lines)]


@pytest.mark.parametrize(
    ("changes", "options"),
    [
        ({}, "rate 54.322kbit delay 0us"),
        ({"delay_s": 0.0123456}, "rate 54.322kbit delay 12346us"),
        ({"jitter_s": 2e-3}, "rate 54.322kbit delay 1us 2000us distribution normal"),
        ({"loss": 0.125}, "rate 54.322kbit delay 0us loss random 12.5%"),
        (
            {"loss": 0.1, "bursts": Bursts(1 / 72, 1 / 8)},
            "rate 54.322kbit delay 0us loss gemodel 1.38889% 12.5% 100% 0%",
        ),
        ({"rate_bps": 11e6}, "rate 11000kbit delay 0us"),
        ({"rate_bps": 0.5}, "rate 0.008kbit delay 0us"),  # a byte per second: 0 would be no limit
    ],
)
def test_options_have_the_units_of_netem(changes: dict[str, object], options: str) -> None:
    link = LinkStatistics(**{name: getattr(LINK, name) for name in LINK.__slots__} | changes)
    assert netem_options(link) == options


def test_rows_of_a_recording_have_its_times_and_wait_while_it_cannot_send() -> None:
    text = recorded_script(RECORDED, "wifi.txt")
    assert [line.strip() for line in text.splitlines() if line.startswith("    at ")] == ROWS
    assert "start_us=$((start_us + 800000))" in text
    assert "# The recorded link wifi.txt," in text


def test_a_recording_is_played_at_its_times_and_undone(tmp_path: Path) -> None:
    path = tmp_path / "link.sh"
    path.write_text(recorded_script(RECORDED, "wifi.txt"))
    process = subprocess.Popen(["sh", str(path), "eth7"], env=fake_tc(tmp_path))
    deadline_s = time.monotonic() + 20.0
    while time.monotonic() < deadline_s and (not (tmp_path / "log").exists() or len(calls(tmp_path)) < 5):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGTERM)  # a shell that runs in the background ignores the first
    assert process.wait(timeout=10) == 130
    start, first, second, third, again, *_, last = calls(tmp_path)
    assert start[1] == f"qdisc replace dev eth7 root netem {ROWS[0].removeprefix('at 0 ')}"
    for (_, words), row in zip((first, second, third, again), (*ROWS, ROWS[0]), strict=True):
        assert words == f"qdisc change dev eth7 root netem {row.split(' ', 2)[2]}"
    waits_s = np.array([one[0] - first[0] for one in (second, third, again)]) / 1e9
    assert ((waits_s > [0.15, 0.55, 0.75]) & (waits_s < [0.6, 1.0, 1.2])).all()
    assert last[1] == "qdisc del dev eth7 root"


def test_each_node_has_its_link(tmp_path: Path) -> None:
    changes = ("mac.kind=ideal", "mac.link_bps=2e5", "nodes.bytes_by_node=300,400,500")
    path = written(tmp_path, *changes)
    env = fake_tc(tmp_path)
    subprocess.run(["sh", str(path), "eth7", "2"], env=env, check=True)
    assert calls(tmp_path)[0][1] == "qdisc replace dev eth7 root netem rate 200kbit delay 0us"
    for words in ((), ("eth7",), ("eth7", "4")):
        wrong = subprocess.run(["sh", str(path), *words], env=env, capture_output=True, text=True)
        assert wrong.returncode == 2
        assert "NODE of 1, 2, 3" in wrong.stderr
    assert len(calls(tmp_path)) == 1


def test_a_recorded_link_comes_from_its_file(tmp_path: Path) -> None:
    link = tmp_path / "constant.txt"
    link.write_text("0 8 30 0.01\n")
    text = written(tmp_path, "mac.kind=replay", f"mac.trace={link}", "nodes.image_bytes=500").read_text()
    assert "    at 0 rate 8000kbit delay 15000us loss random 1%\n" in text
    assert f"# The recorded link {link}," in text


@pytest.mark.parametrize("changes", [("nodes.image_bytes=30000",), ("mac.kind=ideal", "loss.share=0.2")])
def test_tc_understands_the_options(changes: tuple[str, ...], tmp_path: Path) -> None:
    """The options are read before the device is looked for, which does not exist."""
    if shutil.which("tc") is None:
        pytest.skip("iproute2 is not installed")
    path = written(tmp_path, *changes, "run.horizon_s=10")
    for words in (["sh", str(path), "none-such", "1"], ["sh", "-n", str(path)]):
        answer = subprocess.run(words, capture_output=True, text=True).stderr.strip()
        assert answer in ("", 'Cannot find device "none-such"')


def test_tc_understands_the_rows_of_a_recording(tmp_path: Path) -> None:
    if shutil.which("tc") is None:
        pytest.skip("iproute2 is not installed")
    for row in ROWS:
        words = ["tc", "qdisc", "change", "dev", "none-such", "root", "netem", *row.split()[2:]]
        answer = subprocess.run(words, capture_output=True, text=True)
        assert answer.stderr.strip() == 'Cannot find device "none-such"'


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="shellcheck is not installed")
def test_shellcheck_finds_nothing(tmp_path: Path) -> None:
    path = written(tmp_path, "nodes.image_bytes=3000")
    (tmp_path / "recorded.sh").write_text(recorded_script(constant_link(1e6, 0.1, 0.0), "a `b` $(c)"))
    subprocess.run(["shellcheck", str(path), str(tmp_path / "recorded.sh")], check=True)


def test_a_path_cannot_end_the_comment(tmp_path: Path) -> None:
    text = recorded_script(RECORDED, "a\nrm b")
    assert text.splitlines()[1].startswith("# The recorded link a?rm b,")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["run.keep=counters"], "run.keep is counters.*try run.keep=all"),
        (["scenario=street-grid", "mac.kind=ieee80211b"], "scenario is street-grid.*try scenario=collection"),
    ],
)
def test_runs_without_links_are_one_sentence(changes: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_netem_script(with_settings(NetworkConfig(), changes))


def test_nodes_that_deliver_nothing_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"No node delivered a packet.*try a longer run.horizon_s"):
        written(tmp_path, "nodes.spacing_m=500", "run.horizon_s=5")
    assert not list(tmp_path.iterdir())
