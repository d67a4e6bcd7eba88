"""Boards that others photographed: found in every image, and the published camera within its errors."""

import cv2
import pytest

from packetmesh.progress import drain
from pipeline.calibration.board import Board
from pipeline.calibration.from_images import image_files, iterate_calibration

PUBLISHED = {"fx": 701.012, "fy": 698.654, "cx": 308.455, "cy": 246.843, "k1": -0.2556, "k2": 0.1}


def test_the_published_chessboard_camera_is_found_within_its_errors(shared_data):
    files = image_files([str(shared_data / "calibration_chessboard")])
    report = drain(iterate_calibration(files, Board("chessboard", 6, 4, 0.03), "thesis", 2))
    found = report.calibration
    assert len(found.views) == 13
    for name, value in PUBLISHED.items():
        assert abs(found.parameters[name] - value) < 3.0 * found.standard_errors[name]
        if name in ("fx", "fy", "cx", "cy"):
            assert found.parameters[name] == pytest.approx(value, rel=0.005)
    assert report.held_out_rms_px < 0.25


def test_the_circle_grid_is_found_in_six_of_six(shared_data):
    files = image_files([str(shared_data / "calibration_circles_8x10" / "*.jpg")])
    report = drain(iterate_calibration(files, Board("circles", 8, 10, 0.025)))
    assert [one.found for one in report.detections.values()] == [True] * 6
    assert report.calibration.parameters["fx"] == pytest.approx(455.0, rel=0.01)
    assert report.calibration.rms_px < 0.55
    height, width = cv2.imread(str(files[0])).shape[:2]
    assert report.calibration.size_px == (width, height)
