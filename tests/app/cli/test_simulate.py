"""``packetmesh simulate`` as a user meets it."""

import json
import subprocess
import sys

import pytest

from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS
from network_sim.replicate import measured
from packetmesh.settings import settings, with_settings
from tests.app import commands

TINY = ("nodes.image_bytes=2000", "run.horizon_s=10")
CONFIG = with_settings(PRESETS["thesis-link"], TINY)


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "simulate", *argv)


def test_json_holds_every_metric_with_its_unit_and_definition(capsys):
    code, out, err = run(capsys, "--json", "--set", *TINY)
    record = json.loads(out)
    expected = measured(CONFIG)
    assert code == 0
    assert {name: one["mean"] for name, one in record.items()} == {n: m.value for n, m in expected.items()}
    assert all(one["ci95"] is None and one["unit"] and one["definition"] for one in record.values())
    assert record["image_delivery_ratio"]["mean"] == 1.0
    assert "collection" in err


def test_the_table_has_a_line_for_every_metric(capsys):
    code, out, _ = run(capsys, "--set", *TINY)
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(measured(CONFIG))


def test_describe_lists_every_setting_with_unit_and_meaning(capsys):
    code, out, _ = run(capsys, "--preset", "greenhouse", "--describe", "--json")
    rows = json.loads(out)
    assert code == 0
    assert {key: row["value"] for key, row in rows.items()} == settings(PRESETS["greenhouse"])
    assert all(row["meaning"] for key, row in rows.items())
    assert (rows["radio.range_m"]["unit"], rows["radio.nakagami_m"]["unit"]) == ("m", "")
    code, out, _ = run(capsys, "--describe")
    assert code == 0
    assert out.count("\n") == 2 * len(rows)


def test_the_same_seed_writes_the_same_trace_and_its_config_repeats_the_run(capsys, tmp_path):
    folders = [tmp_path / "one", tmp_path / "two", tmp_path / "other"]
    run(capsys, "--out", folders[0], "--set", *TINY)
    code, _, _ = run(capsys, "--out", folders[1], "--preset", folders[0] / "config.json")
    run(capsys, "--out", folders[2], "--set", *TINY, "run.seed=1")
    assert code == 0
    for name in ("trace.ndjson", "trace.csv", "trace.json", "metrics.json"):
        first, again, other = ((folder / name).read_bytes() for folder in folders)
        assert first == again != other
    written = json.loads((folders[0] / "trace.json").read_text())["settings"]
    assert with_settings(NetworkConfig(), [f"{key}={value}" for key, value in written.items()]) == CONFIG
    assert not list(folders[0].glob(".*"))


def test_replications_give_intervals(capsys):
    code, out, _ = run(capsys, "--replications", 3, "--json", "--set", *TINY)
    record = json.loads(out)
    assert code == 0
    assert record["image_delay_mean"]["ci95"] > 0.0
    assert record["image_delivery_ratio"]["ci95"] == 0.0


def test_a_sweep_has_one_record_for_each_value(capsys, tmp_path):
    sweep = ("--sweep", "uplink.rate_bps=100000,none", "--out", tmp_path, "--set", *TINY)
    code, out, _ = run(capsys, *sweep, "--json")
    record = json.loads(out)
    assert code == 0
    assert list(record) == ["uplink.rate_bps=100000", "uplink.rate_bps=none"]
    slow, fast = (record[key]["image_delay_mean"]["mean"] for key in record)
    assert slow > fast
    assert json.loads((tmp_path / "metrics.json").read_text()) == record
    assert json.loads((tmp_path / "config.json").read_text())["sweep"] == "uplink.rate_bps=100000,none"


def test_files_for_other_programs_are_written_when_asked_for(capsys, tmp_path):
    code, _, _ = run(capsys, "--out", tmp_path / "plain", "--set", *TINY)
    assert code == 0
    code, _, _ = run(capsys, "--out", tmp_path / "more", "--pcap", "--netem", "--set", *TINY)
    assert code == 0
    plain, more = ({path.name for path in (tmp_path / name).iterdir()} for name in ("plain", "more"))
    assert more - plain == {"trace.pcap", "link.sh"}
    assert (tmp_path / "more" / "trace.pcap").read_bytes()[:4] == b"\x4d\x3c\xb2\xa1"
    assert (tmp_path / "more" / "link.sh").read_text().startswith("#!/bin/sh\n")


def test_a_network_without_links_gets_no_script_and_no_trace(capsys, tmp_path):
    far = ("nodes.spacing_m=900", "run.horizon_s=1")
    code, _, err = run(capsys, "--netem", "--out", tmp_path, "--set", *far)
    assert (code, list(tmp_path.iterdir())) == (1, [])
    assert err.splitlines()[-1].startswith("packetmesh: No node delivered a packet")


def test_files_for_other_programs_need_a_folder(capsys):
    got = run(capsys, "--pcap", "--set", *TINY)
    commands.check_one_sentence(got, 2, "--pcap writes a file, but there is no folder")


def test_a_node_without_a_way_to_the_sink_is_named_and_the_run_ends(capsys):
    far = ("nodes.layout=line", "nodes.spacing_m=150", "nodes.images=0", "nodes.interval_s=1")
    code, out, err = run(capsys, "--json", "--set", *TINY, *far)
    assert code == 0
    assert "node 1, node 2, node 3" in err
    record = json.loads(out)
    assert record["images_expired_no_route"]["mean"] == record["images_expired"]["mean"] == 30.0


@pytest.mark.parametrize(
    ("argv", "code", "names"),
    [
        (["--preset", "thesis-lnk"], 1, "try thesis-link or"),
        (["--preset", "/no/such.json"], 1, "/no/such.json"),
        (["--set", "nodes.cuont=2"], 1, "nodes.count"),
        (["--set", "count=2"], 1, "nodes.count"),
        (["--set", "run.horizon_s=0"], 1, "run.horizon_s is 0.0"),
        (["--set", "mac.link_bps=-5"], 1, "mac.link_bps is -5.0"),
        (["--set", "street.access_points=0"], 1, "street.access_points is 0"),
        (["--set", "mac.kind=aloha"], 1, "ieee802154"),
        (["--replications", "0"], 1, "replications is 0"),
        (["--sweep", "scheme.k"], 2, "--sweep scheme.k"),
        (["--netem", "--sweep", "scheme.k=1,2"], 2, "--netem writes a file, but --sweep keeps no trace"),
        (["--pcap", "--set", "run.keep=images"], 1, "try run.keep=all"),
        (["--sweep", "scheme.kk=1,2"], 1, "scheme.k"),
        (["--sweep", "scheme.k=1,many"], 1, "many"),
    ],
)
def test_wrong_use_is_one_sentence_and_leaves_nothing_behind(capsys, tmp_path, argv, code, names):
    out_folder = tmp_path / "out"
    got = run(capsys, *argv, "--out", out_folder)
    commands.check_one_sentence(got, code, names)
    assert got[2].count("\n") == 1
    assert not out_folder.exists() or not list(out_folder.iterdir())


def test_a_folder_that_cannot_be_written_is_named_before_anything_runs(capsys, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    code, out, err = run(capsys, "--out", blocked / "out", "--set", *TINY)
    assert code == 1
    assert out == ""
    assert str(blocked) in err
    assert err.count("\n") == 1


def test_a_full_disk_is_one_sentence(capsys, tmp_path, monkeypatch):
    from network_sim.trace import files as trace_files

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(trace_files, "_write", full)
    code, out, err = run(capsys, "--out", tmp_path, "--json", "--set", *TINY)
    assert code == 1
    assert out == ""
    assert "No space left" in err.splitlines()[-1]
    assert not list(tmp_path.iterdir())


def test_a_reader_who_goes_away_is_no_error():
    command = f"{sys.executable} -m app.cli simulate --describe | head -1"
    answer = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert answer.stdout.count("\n") == 1
    assert answer.stderr == ""


def idle(err):
    """The settings that change nothing, as the command says."""
    return [
        line.partition(" changes nothing here: ")[0] for line in err.splitlines() if "changes nothing" in line
    ]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["radio.capture_db=6"], []),
        (["radio.capture_db=6", "mac.kind=serial"], ["radio.capture_db"]),
        (["mac.kind=ideal", "mac.rts=true", "radio.noise_dbm=-90"], ["mac.rts", "radio.noise_dbm"]),
        (["radio.tx_power_dbm=3"], ["radio.tx_power_dbm"]),
        (["radio.tx_power_dbm=3", "radio.noise_dbm=-90"], []),
        (["radio.range_m=120"], ["radio.range_m"]),
        (["radio.range_m=10"], []),
        (["scheme.k=4", "loss.burst_packets=5"], ["scheme.k", "loss.burst_packets"]),
    ],
)
def test_a_given_setting_that_changes_nothing_is_said(capsys, given, said):
    code, _, err = run(capsys, "--set", *TINY, *given)
    assert code == 0
    assert idle(err) == said


def test_settings_given_twice_or_set_by_the_sweep_are_said(capsys):
    code, _, err = run(capsys, "--set", *TINY, "--set", "nodes.count=2", "nodes.count=3")
    assert code == 0
    assert "nodes.count is given 2 times; the last value counts: 3\n" in err
    code, out, _ = run(capsys, "--set", *TINY, "--set", "nodes.count=2", "--json")
    assert (
        json.loads(out)["goodput"]["mean"]
        == measured(with_settings(CONFIG, ["nodes.count=2"]))["goodput"].value
    )
    code, _, err = run(capsys, "--set", *TINY, "mac.retries=1", "--sweep", "mac.retries=0,3")
    assert code == 0
    assert "mac.retries=1 changes nothing here: --sweep sets mac.retries\n" in err


def test_more_memory_than_there_is_is_one_sentence(capsys, monkeypatch):
    def fail(config):
        raise MemoryError("Unable to allocate 185 GiB")

    monkeypatch.setattr("network_sim.simulate.iterate_simulation", fail)
    code, out, err = run(capsys, "--set", *TINY)
    assert (code, out) == (1, "")
    assert "not enough memory (Unable to allocate 185 GiB); try" in err


def test_a_config_file_s_settings_count_as_given_and_a_preset_s_do_not(capsys, tmp_path):
    serial = ["--preset", "greenhouse", "--set", *TINY, "mac.kind=serial"]
    code, _, err = run(capsys, *serial, "--out", tmp_path)
    assert (code, idle(err)) == (0, [])
    code, _, err = run(capsys, "--preset", tmp_path / "config.json")
    assert code == 0
    assert {"radio.nakagami_m", "radio.noise_dbm", "nodes.spacing_m"} < set(idle(err))
    assert "nodes.image_bytes" not in idle(err)


def test_a_sweep_that_changes_nothing_is_said(capsys):
    for sweep, said in (("scheme.k=3,5,none", ["scheme.k"]), ("mac.retries=0,3", [])):
        code, _, err = run(capsys, "--set", *TINY, "--sweep", sweep)
        assert code == 0
        assert idle(err) == said


def test_how_a_recorded_link_was_read_is_said_once(capsys, tmp_path):
    link = tmp_path / "link.csv"
    link.write_text("time_ms;rate_kbps;rtt_ms;loss_%\r\n0;2500,5;35;0,5\r\n15;2500;29;0\r\n")
    code, _, err = run(capsys, "--set", *TINY, "mac.kind=replay", f"mac.trace={link}", "--replications", "2")
    assert code == 0
    note = "was read with time in ms, rate in kbit/s, loss in per cent, decimal commas"
    assert err.count(f"The recorded link {link} {note}\n") == err.count("was read with") == 1
