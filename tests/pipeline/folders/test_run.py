"""Run folders: nothing of an earlier run stays in them, and no images are deleted from one."""

from pathlib import Path

import pytest

from packetmesh.errors import InputError
from pipeline.folders.inputs import check_inputs_stay
from pipeline.folders.run import check_run_folder, clear_run_folder
from pipeline.sources import Calibrated, Demo, ImagePair, Recorded, RigFolder

OF_EARLIER_RUNS = (
    "surface_poisson.ply",
    "surface_poisson.glb",
    "surface_alpha.ply",
    "surface_alpha.glb",
    "moments.csv",
    "delivery.html",
    "delivery.gif",
    "report.html",
    "picture.jpg",
    "task.json",
    "trajectory.json",
    "config.json",
    "metrics.json",
)


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


def test_baselines_reports_and_moments_of_an_earlier_run_are_deleted(tmp_path):
    touch(*(tmp_path / name for name in (*OF_EARLIER_RUNS, "notes.txt", "imported/node_00/color.png")))
    clear_run_folder(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["imported", "notes.txt"]


def test_a_file_of_the_user_stays_where_no_run_was(tmp_path):
    touch(tmp_path / "picture.jpg", tmp_path / "report.html", tmp_path / "sensor.ply")
    clear_run_folder(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["picture.jpg", "report.html"]


def polycam(folder: Path) -> Path:
    """A folder in the form of Polycam's raw data, whose images are where a run has its keyframes."""
    frames = folder / "keyframes"
    touch(*(frames / name for name in ("images/1.jpg", "cameras/1.json", "depth/1.png")))
    return folder


REFUSED = {
    "the recording": lambda at: (Recorded(str(polycam(at / "scan"))), at / "scan"),
    "the recording as a rig": lambda at: (RigFolder(str(polycam(at / "scan"))), at / "scan"),
    "its images": lambda at: (Recorded(str(polycam(at / "scan"))), at / "scan" / "keyframes"),
    "the recording in its folder": lambda at: (Recorded(str(polycam(at / "scan").parent)), at / "scan"),
    "another recording": lambda at: (Demo("office"), polycam(at / "scan")),
    "a rig": lambda at: (touch(at / "rig/node_00/color.png"), (Demo("office"), at / "rig"))[1],
    "keyframes of the run": lambda at: (RigFolder(str(at / "run/keyframes")), at / "run"),
    "a recording in its import": lambda at: (RigFolder(str(polycam(at / "run/imported/scan"))), at / "run"),
    "a camera of its name": lambda at: (ImagePair("c.png", "d.png", str(at / "config.json")), at),
    "a calibration": lambda at: (Calibrated(Demo("office"), str(at / "keyframes/cameras")), at),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_run_does_not_delete_images(tmp_path, case):
    source, out = REFUSED[case](tmp_path)
    with pytest.raises(InputError, match=r"would replace .*; try another place for --out$"):
        check_run_folder(out, source)


ALLOWED = {
    "a rig that the run imported": lambda at: (
        touch(at / "run/imported/node_00/color.png"),
        (RigFolder(str(at / "run/imported")), at / "run"),
    )[1],
    "a new folder": lambda at: (Recorded(str(polycam(at / "scan"))), at / "run"),
    "a new folder in the recording": lambda at: (Recorded(str(polycam(at / "scan"))), at / "scan" / "run"),
    "the folder of the rig": lambda at: (RigFolder(str(at / "run/rig")), at / "run"),
    "an earlier run": lambda at: (touch(at / "run/keyframes/images/1.jpg"), (Demo("office"), at / "run"))[1],
}


@pytest.mark.parametrize("case", ALLOWED)
def test_a_folder_of_its_own_is_written(tmp_path, case):
    source, out = ALLOWED[case](tmp_path)
    check_run_folder(out, source)


def test_a_file_is_recognised_by_any_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link.ply").symlink_to("cloud.ply")
    check_inputs_stay([Path("mesh.ply")], [Path("cloud.ply")])
    for same in ("cloud.ply", "../" + tmp_path.name + "/cloud.ply", "link.ply"):
        with pytest.raises(InputError, match=r"would replace cloud\.ply, an input"):
            check_inputs_stay([Path(same)], [Path("cloud.ply")])
