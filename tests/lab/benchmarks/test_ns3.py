"""Saturated nodes beside ns-3's: the same question to both, and what is told when there is no ns-3."""

import json
import sys
from functools import partial

import pytest

from lab.benchmarks import ns3 as peer
from lab.benchmarks.network import SATURATED, benchmark
from network_sim.config import NetworkConfig
from network_sim.mac.saturation import saturation
from packetmesh.errors import PacketMeshError

SCENARIOS = [(mac, nodes) for mac, counts in SATURATED.items() for nodes in counts]
SMALL_STUDY = partial(
    benchmark, objects=4, horizon_s=1860.0, runs=1, saturated_s=dict.fromkeys(SATURATED, 1.0)
)
STAND_IN = f"""#!{sys.executable}
import json, sys
if sys.argv[1] == "-c":
    sys.exit()
counted = dict(arrived=100, packets=125, frames=150, counted_s=2.0, events=5000, wall_s=0.5)
print("a line of ns-3's own")
print(json.dumps(dict(runs=[counted for _ in json.loads(sys.argv[2])], constants=dict())))
"""
"""Answers like an interpreter that has ns-3."""
FAILS = f"""#!{sys.executable}
import sys
sys.exit(sys.argv[1] != "-c" and "no such channel")
"""


@pytest.fixture
def interpreter(tmp_path, monkeypatch):
    """Make a program the interpreter that the environment names."""

    def make(program):
        path = tmp_path / "python"
        path.write_text(program)
        path.chmod(0o755)
        monkeypatch.setenv(peer.PYTHON_VARIABLE, str(path))
        return str(path)

    return make


def saturated_runs(result):
    return [run for run in result.runs if "mac" in run]


def test_ours_alone_is_told_with_the_way_to_get_ns3(monkeypatch):
    monkeypatch.setenv(peer.PYTHON_VARIABLE, "/no/such/python")
    result = SMALL_STUDY()
    runs = saturated_runs(result)
    assert [(run["mac"], run["nodes"]) for run in runs] == SCENARIOS
    for run in runs:
        assert set(run["network_sim"]) == {"simulated_s_per_s", "kernel_events_per_s"}
        assert min(run["network_sim"].values()) > 0.0
        assert (run["ns3"], run["time_ratio"], run["throughput_ratio"]) == (None, None, None)
    missing = result.notes[-1]
    assert "/no/such/python" in missing
    assert "pip install ns3" in missing
    assert peer.PYTHON_VARIABLE in missing
    json.dumps(result.record(), allow_nan=False)


def test_both_programs_stand_side_by_side(interpreter):
    interpreter(STAND_IN)
    result = SMALL_STUDY()
    for run, (mac, _), note in zip(saturated_runs(result), SCENARIOS, result.notes[1:], strict=True):
        assert run["ns3"] == {"simulated_s_per_s": 2.0, "kernel_events_per_s": 10_000.0}
        assert run["time_ratio"] == pytest.approx(2.0 / run["network_sim"]["simulated_s_per_s"])
        assert run["throughput_ratio"] > 0.0
        assert note.startswith(mac)
        assert "ns-3: 2.0 simulated s and 10,000 kernel events" in note
    assert result.peers == {}


def test_ns3_is_counted_by_payload_and_by_packets(interpreter):
    runs, _ = peer.run_ns3(interpreter(STAND_IN), {"ieee80211b": (3,)}, 4.0)
    expected = peer.Run(100 * 8000 / 2.0, 0.8, 1.5, 0.125, 10_000.0)
    assert runs == {("ieee80211b", 3, strict): expected for strict in (False, True)}


def test_a_module_beside_the_script_does_not_hide_ns3(tmp_path, monkeypatch):
    """As ``lab/benchmarks/ns3.py`` did, so that ``from ns import ns`` found no ns-3."""
    (tmp_path / "ns3.py").touch()
    (tmp_path / "runs.py").write_text(
        "import importlib.util, json, os\n"
        "found = importlib.util.find_spec('ns3')\n"
        "beside = found is not None and os.path.dirname(found.origin) == os.path.dirname(__file__)\n"
        "print(json.dumps(dict(runs=[], constants=dict(beside=beside))))\n"
    )
    monkeypatch.setattr(peer, "RUNS", tmp_path / "runs.py")
    assert peer.run_ns3(sys.executable, {}, 1.0) == ({}, {"beside": False})


def test_what_went_wrong_in_ns3_is_told(interpreter):
    with pytest.raises(PacketMeshError, match="no such channel"):
        peer.run_ns3(interpreter(FAILS), SATURATED, 1.0)


@pytest.mark.parametrize(
    ("ratio", "strict", "verdict"),
    [
        (1.04, None, "agrees"),
        (0.94, 0.96, "agrees if strict"),
        (0.94, None, "differs"),
        (0.94, 0.94, "differs"),
        (None, None, "ns-3 did not run"),
    ],
)
def test_five_per_cent_decide(ratio, strict, verdict):
    run = peer.Run(1.0, 1.0, 1.0, 1.0, 1.0)
    assert peer.Row("ieee80211b", 1, run, ratio and run, strict and run, ratio, strict).verdict == verdict


def test_the_kernel_has_twice_the_events_in_twice_the_time():
    short, long = (saturation(NetworkConfig(), 1, seconds, seed=0).kernel_events for seconds in (2.0, 4.0))
    assert long == pytest.approx(2 * short, rel=0.02)
    assert short > 500


def test_the_real_ns3_carries_about_as_much():
    try:
        python = peer.find_python()
    except PacketMeshError as error:
        pytest.skip(str(error))
    counts = {"ieee802154": (1,), "ieee80211b": (2,)}
    theirs, constants = peer.run_ns3(python, counts, 3.0)
    assert {mac: set(found) for mac, found in constants.items()} == {
        mac: set(found) for mac, found in peer.CONSTANTS.items()
    }
    for row in peer.compare(counts, theirs, 3.0):
        assert row.verdict == "agrees"
