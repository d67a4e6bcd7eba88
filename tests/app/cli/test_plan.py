"""``packetmesh plan`` as a user meets it."""

import json
import re
import shutil

import numpy as np
import pytest

from pipeline.folders.plan import FILES
from pipeline.io.rigs import save_rig
from tests.app.commands import check_one_sentence, run
from tests.pipeline.delivery.small import small_rig

pytestmark = pytest.mark.xdist_group("cli_plan")  # one worker makes the shared plan once
FEW = ("--set", "surface.max_points=2500")
CAMERA = {
    *("T_world_camera", "height_m", "pan_deg", "tilt_deg", "where", "gain_rays", "ci95"),
    *("dark_rays", "overlap"),
    *("seconds_to_90", "seconds_to_99", "joules", "battery_days"),
}


@pytest.fixture(scope="module")
def rig_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    save_rig(folder, small_rig())
    return folder


@pytest.fixture(scope="module")
def planned(rig_folder, tmp_path_factory):
    """Folder and JSON of a plan of two cameras."""
    import contextlib
    import io

    from app.cli import main

    out, text = tmp_path_factory.mktemp("plan"), io.StringIO()
    words = [
        "plan",
        "--rig",
        rig_folder,
        "--cameras",
        2,
        "--where",
        "walls,tripods",
        "--out",
        out,
        "--json",
        *FEW,
    ]
    with contextlib.redirect_stdout(text):
        main([*map(str, words)])
    return out, json.loads(text.getvalue())


def test_json_has_every_camera_with_its_promise_and_its_delivery(planned):
    _, record = planned
    assert len(record["cameras"]) == 2
    for camera in record["cameras"]:
        assert set(camera) == CAMERA
        assert 0.0 <= camera["dark_rays"] <= camera["gain_rays"]
        assert camera["ci95"][0] <= camera["gain_rays"] <= camera["ci95"][1]
        assert camera["where"] in ("walls", "tripods")
        assert camera["overlap"] >= 0.25
        assert 0.0 < camera["seconds_to_90"] <= camera["seconds_to_99"]
        T = np.array(camera["T_world_camera"])
        assert T[2, 3] - record["floor_m"] == pytest.approx(camera["height_m"])
        assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))
    gains = sum(camera["gain_rays"] for camera in record["cameras"])
    assert record["total"]["gain_rays"] == pytest.approx(gains)
    assert record["total"]["joules"] == pytest.approx(sum(one["joules"] for one in record["cameras"]))
    assert record["measured_rays"] + record["total"]["gain_rays"] < 1.0


def test_the_folder_holds_the_files_and_the_record_its_settings(planned):
    out, record = planned
    assert {path.name for path in out.iterdir()} == set(FILES)
    written = json.loads((out / "plan.json").read_text())
    assert {name: written[name] for name in record} == record
    assert written["chain"]["settings"]["surface.max_points"] == "2500"
    assert "radio.frequency_hz" in written["network_settings"]


def test_the_report_stands_alone_and_shows_each_camera(planned):
    page = (planned[0] / "plan.html").read_text()
    assert page.count("data:image/jpeg") == 2
    assert page.count("<svg ") == 1
    assert not re.search("https?:", page.replace("http://www.w3.org/2000/svg", ""))
    for words in ("together promise", "of what the best choice", "its content is not known", "95 %"):
        assert words in page


def test_the_table_is_for_people_and_the_plan_is_the_same_again(capsys, rig_folder, planned, tmp_path):
    (tmp_path / "report.html").write_text("of a run")
    (tmp_path / "plan.json").write_text("of an earlier plan")
    words = ("--cameras", 2, "--where", "walls,tripods", "--out", tmp_path, *FEW)
    code, out, err = run(capsys, "plan", "--rig", rig_folder, *words)
    assert code == 0
    heading, *rows = out.splitlines()
    assert heading.startswith("camera")
    assert [row.split()[0] for row in rows] == ["1", "2"]
    for sentence in ("The 2 cameras together promise", "It promises at least", "its content is not known"):
        assert sentence in err
    for name in FILES:
        assert (tmp_path / name).read_bytes() == (planned[0] / name).read_bytes(), name
    assert (tmp_path / "report.html").read_text() == "of a run"


def test_without_a_folder_the_same_plan_is_printed(capsys, monkeypatch, rig_folder, planned, tmp_path):
    monkeypatch.chdir(tmp_path)
    words = ("--cameras", 2, "--where", "walls,tripods", "--json", *FEW)
    code, out, err = run(capsys, "plan", "--rig", rig_folder, *words)
    assert code == 0
    assert json.loads(out) == planned[1]
    assert "See " not in err
    assert list(tmp_path.iterdir()) == []


def test_a_budget_that_fewer_cameras_keep_says_so(capsys, rig_folder, planned, tmp_path):
    first, second = (camera["joules"] for camera in planned[1]["cameras"])
    words = ("--cameras", 2, "--where", "walls,tripods", "--budget-j", 0.9 * (first + second))
    code, out, err = run(capsys, "plan", "--rig", rig_folder, *words, "--out", tmp_path, "--json", *FEW)
    assert code == 0
    assert len(json.loads(out)["cameras"]) == 1
    assert re.search(r"The budget of [\d.]+ J allows 1 of the 2 cameras", err)


def test_dark_surface_may_be_left_out(capsys, rig_folder, planned):
    words = ("--cameras", 2, "--where", "walls,tripods", "--no-dark-surface", "--json", *FEW)
    _, text, err = run(capsys, "plan", "--rig", rig_folder, *words)
    record = json.loads(text)
    assert (planned[1]["dark_surface"], record["dark_surface"]) == (True, False)
    assert record["total"]["dark_rays"] == 0.0
    assert (
        planned[1]["total"]["gain_rays"] - planned[1]["total"]["dark_rays"]
        <= record["total"]["gain_rays"] + 1e-9
    )
    assert "is left out of this plan" in err


def test_the_plan_may_place_the_sink(capsys, rig_folder):
    code, _, err = run(capsys, "plan", "--rig", rig_folder, "--where", "tripods", "--sink", "best", *FEW)
    assert code == 0
    assert "where its weakest link to a camera is strongest" in err


def test_a_place_of_the_sink_may_be_negative_and_replaced_settings_are_named(capsys, rig_folder, tmp_path):
    words = ("--where", "tripods", "--sink", "-1.5,0.5", "--out", tmp_path, "--json")
    settings = (*FEW, "radio.wall_db=3", "nodes.images=2")
    code, out, err = run(capsys, "plan", "--rig", rig_folder, *words, *settings)
    assert code == 0
    assert json.loads(out)["network"]["sink_m"] == [-1.5, 0.5]
    assert "radio.wall_db changes nothing here: --walls names their material" in err
    assert "nodes.images changes nothing here" in err


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("--cameras", "0"), 1, "cameras is 0; try at least 1"),
        (("--cameras", "21"), 1, "plan at most 20"),
        (("--sensor", "lidar"), 1, "no sensor 'lidar'; try one of as-present"),
        (("--where", "roof"), 1, "No camera can stand on 'roof'"),
        (("--where", ","), 1, "No camera may stand anywhere"),
        (("--coding", "zip"), 1, "layered"),
        (("--walls", "glass"), 1, "no wall of 'glass'"),
        (("--preset", "street-grid"), 1, "cameras that stand still"),
        (("--preset", "moon"), 1, "no preset 'moon'"),
        (("--every-s", "0"), 1, "every_s"),
        (("--budget-j", "-1"), 1, "budget_j"),
        (("--sink", "here"), 2, "--sink takes best or a place such as 1.5,-0.4"),
        (("--sink", "1,2,3"), 2, "--sink takes best or a place"),
        (("--scene", "office"), 2, "--scene"),
    ],
)
def test_wrong_use_is_one_sentence_and_leaves_no_folder(capsys, rig_folder, tmp_path, words, code, says):
    got = run(capsys, "plan", "--rig", rig_folder, "--out", tmp_path / "out", *words)
    check_one_sentence(got, code, says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--where", "ceiling"), "no free place for a camera on ceiling; allow another kind"),
        (("--where", "tripods", "--sink", "900,900"), "does not carry a new camera's image to the sink"),
        (("--where", "tripods", "--budget-j", "0.0001"), "No camera meets budget and deadline"),
    ],
)
def test_a_plan_that_cannot_be_is_one_sentence_and_writes_nothing(capsys, rig_folder, tmp_path, words, says):
    got = run(capsys, "plan", "--rig", rig_folder, "--out", tmp_path / "runs" / "out", *words, *FEW)
    check_one_sentence(got, 1, says)
    assert not (tmp_path / "runs").exists()


def test_a_node_without_depth_is_one_sentence(capsys, rig_folder, tmp_path):
    shutil.copytree(rig_folder / "node_00", tmp_path / "rig" / "node_00")
    (tmp_path / "rig" / "node_00" / "depth.png").unlink()
    got = run(capsys, "plan", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *FEW)
    check_one_sentence(got, 1, "depth")


def test_a_plan_does_not_replace_the_images(capsys, rig_folder):
    got = run(capsys, "plan", "--rig", rig_folder, "--out", rig_folder, *FEW)
    check_one_sentence(got, 1, "is a rig or a recording")
