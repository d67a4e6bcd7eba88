"""``packetmesh deliver --every-radio`` as a user meets it."""

import json

import pytest

from pipeline.delivery import radios
from pipeline.io.rigs import save_rig
from tests.app.commands import check_one_sentence, run
from tests.pipeline.delivery.small import small_rig

WORDS = ("--every-radio", "--coding", "raw", "--moments", 3, "--set", "surface.max_points=2500")


@pytest.fixture(scope="module")
def rig_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    save_rig(folder, small_rig())
    return folder


def test_the_table_has_a_line_for_each_radio_and_the_record_its_numbers(
    capsys, monkeypatch, rig_folder, tmp_path
):
    monkeypatch.setattr(radios, "RADIOS", {"wifi-n": "802.11n, MCS 7"})
    words = ("deliver", "--rig", rig_folder, "--out", tmp_path, *WORDS, "nodes.payload_bytes=1400")
    code, table, said = run(capsys, *words)
    assert code == 0
    heading, line = table.splitlines()
    assert heading.split()[:2] == ["preset", "radio"]
    assert line.startswith("wifi-n")
    record = json.loads((tmp_path / "every_radio.json").read_text())
    (row,) = record["radios"]
    assert row["reaches"] is True
    assert row["preset"] == "wifi-n"
    assert 0.0 < row["seconds_to_90_s"] <= row["seconds_to_99_s"]
    assert row["sent_bytes"] > row["delivered_bytes"]
    assert "without the sink, which stands 8 m behind them" in said
    code, text, _ = run(capsys, *words, "--json")
    assert code == 0
    assert json.loads(text) == record


def test_what_no_radio_reaches_is_said(capsys, monkeypatch, rig_folder, tmp_path):
    monkeypatch.setattr(radios, "RADIOS", {"wifi-ax": "802.11ax, MCS 9"})
    code, table, said = run(
        capsys, "deliver", "--rig", rig_folder, "--out", tmp_path, *WORDS, "nodes.spacing_m=500"
    )
    assert code == 0
    assert "does not reach" in table
    assert "which stands 500 m behind" in said
    assert "wifi-ax comes to 0.0%: 0 of" in said
    (row,) = json.loads((tmp_path / "every_radio.json").read_text())["radios"]
    assert (row["reaches"], row["seconds_to_99_s"]) == (False, None)


def test_a_setting_that_does_not_exist_is_one_sentence(capsys, rig_folder, tmp_path):
    words = ("deliver", "--rig", rig_folder, "--out", tmp_path / "out", *WORDS, "nodes.wrong=1")
    check_one_sentence(run(capsys, *words), 1, "nodes.wrong")
    assert not (tmp_path / "out").exists()
