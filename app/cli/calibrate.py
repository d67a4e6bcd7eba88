"""``packetmesh calibrate``: a camera from images of a board."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain
from pipeline.config import Lens, Pattern

if TYPE_CHECKING:
    from pipeline.calibration.from_images import CameraReport


def calibrate(
    images: Annotated[tuple[str, ...], tyro.conf.Positional],
    out: Path,
    pattern: Pattern = "circles",
    columns: int = 11,
    rows: int = 9,
    spacing_mm: float = 35.0,
    lens: Lens = "thesis",
    held_out: int = 2,
    json: bool = False,
) -> None:
    """Estimate a camera from images of a board, with how sure each number is.

    Args:
        images: Three or more of one camera, the board tilted to all sides: files, a folder, or a pattern in
            quotes such as "left*.jpg".
        out: Folder for intrinsics.json, which the other commands take, metrics.json, and the same camera as
            OpenCV, ROS, COLMAP, Kalibr, MATLAB and Open3D have it, where they can hold it.
        pattern: What is printed on the board.
        columns: Circles, or inner corners, in a row.
        rows: How many rows of them.
        spacing_mm: Pitch of the circles, or side of a square; half the pitch in a row if rows are shifted.
        lens: Distortion: k1 and k2 (thesis), also p1, p2, k3 (brown), or k4 to k6 as well (rational).
        held_out: In so many turns images are left out and predicted; 2 leaves out half of them as the thesis
            does, 0 none.
        json: Print everything as one JSON object.
    """
    from packetmesh.errors import InputError
    from packetmesh.files import writable_folder
    from pipeline.calibration.board import Board
    from pipeline.calibration.from_images import image_files, iterate_calibration
    from pipeline.calibration.report import write_camera_folder

    board = Board(pattern, columns, rows, spacing_mm / 1000.0)
    if held_out < 0 or held_out == 1:
        raise InputError(f"--held-out {held_out} leaves no view to predict; try 2, or 0 for none")
    files = image_files(images)
    report = drain(iterate_calibration(files, board, lens, held_out), say_progress)
    writable_folder(out)
    for sentence in write_camera_folder(report, out):
        say(sentence)
    if json:
        print_json(report.metrics())
    else:
        say(_lines(report))


def _lines(report: CameraReport) -> str:
    """Parameters with their intervals, then the images."""
    found, intervals = report.calibration, report.calibration.intervals
    lines = [
        f"{name:>4} {found.parameters[name]:12.5g}   95 %: {low:.5g} to {high:.5g}"
        for name, (low, high) in intervals.items()
    ]
    unseen = report.held_out_rms_px
    beside = "" if unseen is None else f"; {unseen:.3f} px in images that it has not seen"
    lines.append(f"RMS {found.rms_px:.3f} px over {len(found.views)} images{beside}")
    missing = [f"not used: {name}. {one.reason}" for name, one in report.detections.items() if not one.found]
    return "\n".join([*lines, *missing])
