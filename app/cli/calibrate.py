"""``packetmesh calibrate``: a camera from images of a board."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.calibrate_depth import depth_lines
from app.cli.calibrate_rig import calibrate_cameras, several_cameras
from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain
from pipeline.config import Lens, Pattern

if TYPE_CHECKING:
    from pipeline.calibration.assess import Trust
    from pipeline.calibration.from_images import CameraReport


def calibrate(
    images: Annotated[tuple[str, ...], tyro.conf.Positional],
    out: Path,
    pattern: Pattern | None = None,
    columns: int | None = None,
    rows: int | None = None,
    spacing_mm: float | None = None,
    lens: Lens = "thesis",
    held_out: int = 2,
    range_m: float = 2.0,
    accuracy_mm: float = 5.0,
    without: tuple[str, ...] = (),
    board_warp: bool = False,
    like: Path | None = None,
    depth_scale: float | None = None,
    json: bool = False,
) -> None:
    """Estimate cameras from images of a board, with how sure each number is.

    Args:
        images: Three or more of one camera, the board tilted to all sides: files, a folder, or a pattern in
            quotes such as "left*.jpg". Several cameras: a folder each, or one with node_00, node_01 and so
            on, where images of the same number show the same moment.
        out: Folder for intrinsics.json, which the other commands take, report.html with pictures of all that
            follows, metrics.json, and the same camera as OpenCV, ROS, COLMAP, Kalibr, MATLAB and Open3D have
            it, where they can hold it.
        pattern: What is printed on the board; this and the next three are, where they are not given, those of
            a board.json beside the images, or else 11 x 9 circles at 35 mm.
        columns: Circles, or inner corners, in a row.
        rows: How many rows of them.
        spacing_mm: Pitch of the circles, or side of a square; half the pitch in a row if rows are shifted.
        lens: Distortion: k1 and k2 (thesis), also p1, p2, k3 (brown), or k4 to k6 as well (rational); or a
            fisheye's k1 to k4. The other commands take thesis and brown.
        held_out: In so many turns images are left out and predicted; 2 leaves out half of them as the thesis
            does, 0 none.
        range_m: Where the camera will measure: the verdict is about points so far away.
        accuracy_mm: Within how many millimetres a point must be placed there.
        without: Names of images to leave out, such as those that the command proposes.
        board_warp: One camera: whether to estimate the board's shape, too, and to use it if that predicts
            images better.
        like: Several cameras: a rig in whose world they are placed, by the pose of its first node.
        depth_scale: Depth units in a metre in depth images beside the photographs; without it whole numbers
            are millimetres and floating-point numbers metres.
        json: Print everything as one JSON object.
    """
    from app.reports.calibration import write_calibration_report
    from packetmesh.errors import InputError
    from packetmesh.files import writable_folder
    from pipeline.calibration.assess import assess
    from pipeline.calibration.depth_from_images import depth_beside, with_depth
    from pipeline.calibration.from_images import image_files, iterate_calibration
    from pipeline.calibration.report import metrics, write_camera_folder
    from pipeline.calibration.shots import board_beside

    board = board_beside(images, pattern, columns, rows, spacing_mm)
    if held_out < 0 or held_out == 1:
        raise InputError(f"--held-out {held_out} leaves no view to predict; try 2, or 0 for none")
    nodes = several_cameras(images)
    if nodes and board_warp:
        raise InputError(
            "--board-warp works with one camera: several are placed by a board that is taken as flat; give "
            "each camera's folder alone with it, or do without it"
        )
    if nodes:
        accuracy_m = accuracy_mm / 1000.0
        how = board, lens, held_out, range_m, accuracy_m, without, like, depth_scale
        calibrate_cameras(nodes, out, *how, json)
        return
    files = image_files(images)
    report = drain(iterate_calibration(files, board, lens, held_out, without, board_warp), say_progress)
    report = with_depth(report, depth_beside(files), depth_scale=depth_scale)
    trust = assess(report.calibration, report.views, board, range_m, accuracy_mm / 1000.0)
    writable_folder(out)
    write_calibration_report(report, trust, out / "report.html")
    for sentence in write_camera_folder(report, out, trust):
        say(sentence)
    if json:
        print_json(metrics(report, trust))
    else:
        say("\n".join((*_camera_lines(report), *depth_lines(report), *_trust_lines(trust))))


def _camera_lines(report: CameraReport) -> Iterator[str]:
    """Yield the parameters with their intervals, then the images."""
    found = report.calibration
    for name, (low, high) in found.intervals.items():
        yield f"{name:>4} {found.parameters[name]:12.5g}   95 %: {low:.5g} to {high:.5g}"
    unseen = report.held_out_rms_px
    beside = "" if unseen is None else f"; {unseen:.3f} px in images that it has not seen"
    yield f"RMS {found.rms_px:.3f} px over {len(found.views)} images{beside}"
    nearest_m, farthest_m = report.distances_m
    yield (f"The board was {nearest_m:.2g} to {farthest_m:.2g} m away; if that is wrong, so is --spacing-mm")
    if report.warp is not None:
        used = "used" if report.warp.helps else "not used"
        yield (
            f"The board is bent by {1000.0 * report.warp.warp_m:.2g} mm, which is {used}: images held out "
            f"have {report.warp.rms_px:.3f} px with it and {report.warp.flat_rms_px:.3f} px with a flat board"
        )
    for name, one in report.detections.items():
        if not one.found:
            yield f"not used: {name}. {one.reason}"


def _trust_lines(trust: Trust) -> Iterator[str]:
    """Yield the coverage, the views to leave out, and the verdict."""
    yield f"Points were seen in {100.0 * trust.coverage.share:.0f} % of the image"
    for one in trust.outliers:
        yield f"Perhaps leave out: {one.reason} (--without {one.name})"
    yield trust.verdict.sentence
