"""A folder holds the files of its last calibration only."""

import json

import pytest

from packetmesh.errors import InputError
from pipeline.calibration import report as reports
from pipeline.calibration.estimate import calibrate
from pipeline.calibration.from_images import CameraReport
from pipeline.calibration.report import write_camera_folder
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views

OLD = {"metrics.json", "depth_correction.json", "camera.yaml", "matlab.txt"}


@pytest.fixture
def report():
    given = views(0.2, 0)
    return CameraReport(BOARD, {}, tuple(given), calibrate(given, SIZE, "rational"), ())


@pytest.fixture
def folder(tmp_path):
    for name in (*OLD, "color.png"):
        (tmp_path / name).write_text("{}")
    return tmp_path


def test_what_this_calibration_does_not_write_is_no_file_of_an_earlier_one(report, folder):
    missing = write_camera_folder(report, folder)
    assert any(sentence.startswith("matlab.txt is not written") for sentence in missing)
    assert not (folder / "depth_correction.json").exists()
    assert not (folder / "matlab.txt").exists()
    assert json.loads((folder / "metrics.json").read_text())["board"] == report.board.title
    assert (folder / "color.png").exists()


def test_a_run_that_stops_half_way_leaves_no_metrics(report, folder, monkeypatch):
    def full(*_):
        raise InputError("The disk is full")

    monkeypatch.setattr(reports, "write_intrinsics", full)
    with pytest.raises(InputError):
        write_camera_folder(report, folder)
    assert not OLD & {path.name for path in folder.iterdir()}
