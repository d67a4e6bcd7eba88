"""``packetmesh calibrate``: a camera from images of a board."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.calibrate_depth import depth_lines
from app.cli.calibrate_rig import calibrate_cameras, several_cameras
from app.cli.text import print_json, say, say_progress, wrong_use
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
    dictionary: str | None = None,
    tag_spacing: float | None = None,
    lens: Lens = "thesis",
    held_out: int = 2,
    range_m: float = 2.0,
    accuracy_mm: float = 5.0,
    without: tuple[str, ...] = (),
    board_warp: bool = False,
    like: Path | None = None,
    depth_scale: float | None = None,
    rig: bool = False,
    one_camera: bool = False,
    json: bool = False,
) -> None:
    """Estimate cameras from images of a board, with the uncertainty of each number.

    Args:
        images: Three or more images of one camera, with the board tilted to all sides: files, a folder, or
            a pattern in quotes such as "left*.jpg". Several cameras: a folder for each, or one folder with
            node_00, node_01 and so on; images of the same number show the same moment.
        out: Folder for intrinsics.json, which the other commands read, report.html with pictures of all
            results, metrics.json, and the camera in the formats of OpenCV, ROS, COLMAP, Kalibr, MATLAB and
            Open3D, as far as they support its lens.
        pattern: Pattern on the board. This option and the next five default to the values of a board.json
            in the folder of the images, or else to 11 x 9 circles at 35 mm.
        columns: Circles, inner corners or AprilTags in a row.
        rows: Number of rows.
        spacing_mm: Pitch of the circles, or side of a square or of an AprilTag; half the pitch in a row if
            rows are shifted.
        dictionary: Markers of a ChArUco board, such as 4X4_50 or APRILTAG_36H11; without it, all
            dictionaries of OpenCV are tried in turn.
        tag_spacing: AprilGrid: the gap between two tags, divided by the side of a tag; 0.3 on Kalibr's
            boards.
        lens: Distortion model: k1 and k2 (thesis), also p1, p2, k3 (brown), also k4 to k6 (rational), or
            the k1 to k4 of a fisheye.
        held_out: Number of parts of the images; each part is left out in turn and predicted. 2 leaves out
            half of them as the thesis does, 0 none.
        range_m: Distance at which the camera will measure; the verdict is for points at this distance.
        accuracy_mm: Largest allowed error of a point at that distance, in millimetres.
        without: Names of images to leave out, such as those that the command suggests.
        board_warp: One camera only: also estimate the board's shape, and use it if it predicts held-out
            images better.
        like: Several cameras only: a rig whose world frame is used; the pose of its first node places the
            cameras in it.
        depth_scale: Depth units per metre in the depth images of the photographs; without it, whole numbers
            are millimetres and floating-point numbers metres.
        rig: One folder holds the images of several cameras, which the file names tell apart, such as
            left-0000.jpg and right-0000.jpg.
        one_camera: One camera took all images, even if their names or EXIF data tell several.
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
    from pipeline.folders.inputs import check_cameras_stay

    if not images:
        wrong_use("calibrate needs images of a board: files, a folder, or a pattern in quotes")
    board = board_beside(images, pattern, columns, rows, spacing_mm, dictionary, tag_spacing)
    if held_out < 0 or held_out == 1:
        raise InputError(f"--held-out {held_out} leaves no view to predict; try 2, or 0 for none")
    if rig and one_camera:
        raise InputError("--rig and --one-camera contradict each other; give one of them")
    check_cameras_stay(out)
    nodes = several_cameras(images, rig)
    if nodes and board_warp:
        raise InputError(
            "--board-warp works with one camera, because several cameras are placed by a flat board; "
            "give one camera's folder, or leave out --board-warp"
        )
    if nodes:
        if rig:
            for node in nodes:
                say(f"{node.name}: {node.shots[0].color.name} and so on, {len(node.shots)} images")
        accuracy_m = accuracy_mm / 1000.0
        how = board, lens, held_out, range_m, accuracy_m, without, like, depth_scale
        calibrate_cameras(nodes, out, *how, json)
        return
    files = image_files(images, one_camera)
    steps = iterate_calibration(files, board, lens, held_out, without, board_warp, one_camera)
    report = drain(steps, say_progress)
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
    held_out = "" if unseen is None else f"; {unseen:.3f} px in held-out images"
    yield f"RMS {found.rms_px:.3f} px over {len(found.views)} images{held_out}"
    nearest_m, farthest_m = report.distances_m
    yield (
        f"The board was {nearest_m:.2g} to {farthest_m:.2g} m away; if that is wrong, correct --spacing-mm"
    )
    if report.warp is not None:
        used = "used" if report.warp.helps else "not used"
        yield (
            f"The board is bent by {1000.0 * report.warp.warp_m:.2g} mm, which is {used}: RMS error of "
            f"held-out images {report.warp.rms_px:.3f} px with it, {report.warp.flat_rms_px:.3f} px with "
            "a flat board"
        )
    for name, one in report.detections.items():
        if not one.found:
            yield f"not used: {name}. {one.reason}"


def _trust_lines(trust: Trust) -> Iterator[str]:
    """Yield the coverage, the views to leave out, and the verdict."""
    yield f"Points cover {100.0 * trust.coverage.share:.0f} % of the image"
    for one in trust.outliers:
        yield f"Consider leaving out: {one.reason} (--without {one.name})"
    yield trust.verdict.sentence
