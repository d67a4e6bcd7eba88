"""``packetmesh deliver`` as a user meets it."""

import csv
import json

import pytest

from pipeline.folders.run import FILES, OTHER_FILES
from pipeline.io.rigs import save_rig
from tests.app.commands import check_one_sentence, run
from tests.pipeline.delivery.small import small_rig
from tests.pipeline.importing.bags import write_bag

pytestmark = pytest.mark.xdist_group("cli_deliver")  # one worker makes the shared run once
FEW = ("--set", "surface.max_points=2500")


@pytest.fixture(scope="module")
def rig_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    save_rig(folder, small_rig())
    return folder


@pytest.fixture(scope="module")
def delivered(rig_folder, tmp_path_factory):
    """Everything arrives, in a lossless coding: the folder and the JSON."""
    import contextlib
    import io

    from app.cli import main

    out, text = tmp_path_factory.mktemp("delivered"), io.StringIO()
    words = ["deliver", "--rig", rig_folder, "--coding", "raw", "--moments", 3, "--out", out, "--json", *FEW]
    with contextlib.redirect_stdout(text):
        main([*map(str, words)])
    return out, json.loads(text.getvalue())


def test_the_last_moment_is_the_reconstruction_to_the_byte(capsys, rig_folder, delivered, tmp_path):
    assert run(capsys, "reconstruct", "--rig", rig_folder, "--out", tmp_path, *FEW)[0] == 0
    names = [
        "sensor.ply",
        "inferred.ply",
        "fused.ply",
        "surface_before.ply",
        "surface_after.ply",
        "surface.glb",
    ]
    for name in names:
        assert (tmp_path / name).read_bytes() == (delivered[0] / name).read_bytes(), name


def test_json_says_what_was_delivered_when_and_what_it_is_good_for(delivered):
    out, answer = delivered
    last = answer["moments"][-1]
    assert last["surface"]["no_hit_ray_share"] == answer["lossless"]["no_hit_ray_share"]
    assert last["f_score_5cm"] == answer["lossless"]["f_score_5cm"] > 0.5
    assert last["delivered_bytes"] == answer["bytes"] == sum(node["total_bytes"] for node in last["nodes"])
    assert json.loads((out / "metrics.json").read_text())["delivery"] == answer


def test_the_table_has_a_row_for_every_moment(delivered):
    out, answer = delivered
    with (out / "moments.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["t_s"]) for row in rows] == [moment["t_s"] for moment in answer["moments"]]
    assert float(rows[-1]["no_hit_ray_share"]) == answer["moments"][-1]["surface"]["no_hit_ray_share"]


def test_the_hand_out_stands_alone(delivered):
    page = (delivered[0] / "delivery.html").read_text()
    assert len(page) < 15_000_000
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert (delivered[0] / "delivery.gif").read_bytes()[:4] == b"GIF8"


def test_a_later_run_deletes_each_of_its_files(delivered):
    assert {path.name for path in delivered[0].iterdir()} <= {*FILES, *OTHER_FILES}


def test_the_settings_are_kept_so_that_the_network_can_run_again(capsys, delivered):
    config = json.loads((delivered[0] / "config.json").read_text())
    assert (config["coding"], config["network"]) == ("raw", "office")
    assert config["network_settings"]["nodes.count"] == "2"


def test_nothing_arrives_and_that_is_said(capsys, rig_folder, tmp_path):
    words = ("--set", "nodes.retransmit=false", "loss.share=1", "surface.max_points=2500")
    code, out, err = run(capsys, "deliver", "--rig", rig_folder, "--out", tmp_path / "d", "--json", *words)
    assert code == 0
    assert "none arrived" in err
    assert json.loads(out)["moments"][-1]["surface"] is None
    assert not (tmp_path / "d" / "surface.glb").exists()


def test_what_was_left_out_and_by_whose_decision_is_printed_and_written(
    capsys, rig_folder, delivered, tmp_path
):
    words = ("--preset", "thesis-link", "--leave-out-seen", "--moments", 1, "--json", *FEW)
    code, text, err = run(capsys, "deliver", "--rig", rig_folder, "--out", tmp_path / "d", *words)
    assert code == 0
    answer = json.loads(text)
    found = answer["left_out"]
    assert found["bytes"] + answer["bytes"] == found["whole_bytes"]
    assert found["bytes"] == sum(node["bytes"] for node in found["nodes"])
    assert found["tiles"] == sum(node["tiles"] for node in found["nodes"]) > 0
    assert f"{found['tiles']} tiles with {found['bytes']:,} bytes" in err
    (giver,) = (node for node in found["nodes"] if node["name"] == "node_01")
    assert f"node_01: left out {giver['tiles']} tiles" in err
    assert f"{giver['shown_by']['node_00']} shown by node_00" in err
    assert json.loads((tmp_path / "d" / "config.json").read_text())["leave_out_seen"]
    assert f"{found['tiles']} tiles" in (tmp_path / "d" / "delivery.html").read_text()
    assert "left_out" not in delivered[1]


def test_the_order_that_the_sink_requests_is_printed_and_written(capsys, rig_folder, delivered, tmp_path):
    words = ("--order", "worth", "--moments", 1, "--json", *FEW)
    code, text, err = run(capsys, "deliver", "--rig", rig_folder, "--out", tmp_path / "d", *words)
    assert code == 0
    ordered = json.loads(text)["ordered"]
    for node in ordered["nodes"]:
        assert sorted(node["tiles"]) == list(range(len(node["added_m2"])))
        assert f"{node['name']}: " in err
    assert f"{sum(node['request_bytes'] for node in ordered['nodes'])} bytes after" in err
    assert json.loads((tmp_path / "d" / "config.json").read_text())["order"] == "worth"
    assert "add most surface first" in (tmp_path / "d" / "delivery.html").read_text()
    assert "ordered" not in delivered[1]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--leave-out-seen", "--coding", "jpeg"), "coding exact only"),
        (("--leave-out-seen", "--down", "node_01"), "Only one camera"),
        (("--leave-out-seen", "--preset", "nb-iot"), "Over nb-iot"),
        (("--order", "worth", "--coding", "layered"), "coding exact only"),
        (("--preset", "street-grid"), "cameras that stand still"),
        (("--coding", "zip"), "layered"),
        (("--moments", "0"), "moments"),
        (("--link-trace", "{folder}/none.txt"), "none.txt"),
        (("--link-trace", "{folder}/back.txt"), "back.txt"),
    ],
)
def test_bad_input_gets_a_sentence_and_leaves_no_folder(capsys, rig_folder, tmp_path, words, says):
    (tmp_path / "back.txt").write_text("0.0 10 5 0\n-1.0 10 5 0\n")
    words = [word.format(folder=tmp_path) for word in words]
    got = run(capsys, "deliver", "--rig", rig_folder, "--out", tmp_path / "out", *words)
    check_one_sentence(got, 1, says)
    assert not (tmp_path / "out").exists()


def test_a_recorded_link_carries_the_images(capsys, rig_folder, tmp_path):
    trace = tmp_path / "link.txt"
    trace.write_text("".join(f"{0.01 * row:.2f} 8.0 20 0.0\n" for row in range(200)))
    words = ("--link-trace", trace, "--moments", 1, "--coding", "jpeg", "--json", *FEW)
    code, out, _ = run(capsys, "deliver", "--rig", rig_folder, "--out", tmp_path / "out", *words)
    assert code == 0
    (moment,) = json.loads(out)["moments"]
    sending_s = max(node["total_bytes"] for node in moment["nodes"]) / 1e6
    assert (
        sending_s + 0.01 <= moment["t_s"] <= 1.03 * sending_s + 0.021
    )  # half a round trip; begun within 10 ms


def test_a_recording_is_imported_and_sent(capsys, tmp_path):
    write_bag(tmp_path / "recording", small_rig(), "mcap", moments=1)
    (bag,) = (tmp_path / "recording").glob("*.mcap")
    words = ("--rig", bag, "--out", tmp_path / "out", "--moments", 1, "--coding", "jpeg", "--json", *FEW)
    code, out, err = run(capsys, "deliver", *words)
    assert code == 0
    assert f"{bag} is a recording (bag), imported as" in err
    (moment,) = json.loads(out)["moments"]
    assert moment["surface"]["triangles"] > 100
    assert json.loads(out)["import"]["kind"] == "bag"


def test_network_settings_that_change_nothing_and_the_form_of_a_recorded_link_are_said(
    capsys, rig_folder, tmp_path
):
    link = tmp_path / "link.txt"
    link.write_text("0 2.5 35 3\n0.5 3 29 0\n")
    words = ("--rig", rig_folder, "--moments", 1, "--link-trace", link, "--out", tmp_path / "out", *FEW)
    given = (
        "nodes.images=3",
        "radio.capture_db=6",
        "nodes.retransmit=true",
        "nodes.count=9",
        "mac.ack=false",
        "mac.kind=ideal",
        "nodes.layout=line",
    )
    code, _, err = run(capsys, "deliver", *words, *given)
    assert code == 0
    said = [
        line.partition(" changes nothing here: ")[0] for line in err.splitlines() if "changes nothing" in line
    ]
    assert sorted(said) == [
        "mac.kind=ideal",
        "nodes.count",
        "nodes.images",
        "nodes.layout",
        "radio.capture_db",
    ]
    assert f"The recorded link {link} was read with loss in per cent\n" in err


def test_a_layout_counts_only_for_a_rig_without_poses_and_that_is_said(capsys):
    from app.cli.deliver import say_network
    from network_sim.presets import PRESETS
    from packetmesh.settings import with_settings

    office = PRESETS["office"]
    for changes, said in ((["nodes.layout=line"], 1), (["nodes.layout=line", "mac.kind=serial"], 1), ([], 0)):
        say_network(with_settings(office, changes), office, "office", changes, {})
        assert capsys.readouterr().err.count("nodes.layout changes nothing here") == said
