"""``packetmesh calibrate`` with several folders: several cameras at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.calibrate_depth import depth_lines
from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain

if TYPE_CHECKING:
    from pipeline.calibration.assess import Trust
    from pipeline.calibration.board import Board
    from pipeline.calibration.rig_from_images import RigReport
    from pipeline.calibration.shots import NodeShots
    from pipeline.config import Lens


def several_cameras(images: Sequence[str], rig: bool = False) -> tuple[NodeShots, ...]:
    """Return the nodes whose folders are named; none if the images are of one camera.

    Args:
        images: folders, files and patterns.
        rig: whether one folder holds the images of several cameras, which the file names tell apart.

    Raises:
        InputError: folders without images, more cameras than a rig may have, only one camera below a folder,
            or names that do not tell cameras apart.
    """
    from packetmesh.errors import InputError
    from pipeline.calibration.from_images import image_files
    from pipeline.calibration.shots import node_folders, node_shots, series_shots

    folders = [Path(word) for word in images]
    own_folders = all(map(Path.is_dir, folders)) and (len(folders) > 1 or bool(node_folders(folders[0])))
    if rig and not own_folders:
        return series_shots(image_files(images, one_camera=True))
    if not all(folder.is_dir() for folder in folders):
        return ()
    below = [one for folder in folders for one in (*node_folders(folder), *folder.glob("infrared_*"))]
    if len(folders) == 1 and not below:
        return ()
    nodes = node_shots(images)
    if len(nodes) == 1 and not any(shot.infrared for shot in nodes[0].shots):
        raise InputError(f"{folders[0]} holds one camera only; to calibrate it alone, give {nodes[0].folder}")
    return nodes


def calibrate_cameras(
    nodes: Sequence[NodeShots],
    out: Path,
    board: Board,
    lens: Lens,
    held_out: int,
    range_m: float,
    accuracy_m: float,
    without: Sequence[str],
    like: Path | None,
    depth_scale: float | None,
    json: bool,
) -> None:
    """Estimate all lenses and poses together, and write a folder that can be applied to a rig.

    Args:
        nodes: images of the nodes.
        out: folder for node_00/{intrinsics.json, pose.txt, ...} and so on, and metrics.json.
        board: the photographed board.
        lens: distortion model of all cameras.
        held_out: number of folds in which moments are left out and predicted; 0 leaves out none.
        range_m: distance at which the cameras will measure.
        accuracy_m: largest allowed error of a point at that distance.
        without: images to leave out, as node_01/color_03.png.
        like: a rig in whose world frame the cameras are placed, by the pose of its first node.
        depth_scale: depth units per metre; None takes whole numbers as millimetres, others as metres.
        json: print everything as one JSON object.
    """
    from app.reports.calibration import write_calibration_report
    from packetmesh.files import writable_folder
    from pipeline.calibration.assess import assess
    from pipeline.calibration.rig_from_images import iterate_rig_calibration
    from pipeline.calibration.rig_report import pose_like, rig_metrics, write_rig_folder
    from pipeline.io.calibrations import check_calibration_folder

    check_calibration_folder(out, [node.name for node in nodes])
    T_world_first = pose_like(like, nodes[0].name)
    steps = iterate_rig_calibration(nodes, board, lens, held_out, without, depth_scale)
    report = drain(steps, say_progress)
    trust = {
        name: assess(one.calibration, one.views, board, range_m, accuracy_m)
        for name, one in report.cameras.items()
    }
    writable_folder(out)
    for name, one in report.cameras.items():
        write_calibration_report(one, trust[name], out / name / "report.html")
    for sentence in write_rig_folder(report, out, T_world_first, trust):
        say(sentence)
    if json:
        print_json(rig_metrics(report, trust))
    else:
        say("\n".join(_lines(report, trust)))


def _lines(report: RigReport, trust: Mapping[str, Trust]) -> Iterator[str]:
    """Yield a line per camera and per pair, then depth sensors, verdicts, RMS error and unused images."""
    for name, one in report.cameras.items():
        found = one.calibration
        errors = found.standard_errors
        numbers = ", ".join(
            f"{key} {found.parameters[key]:.5g} ± {errors[key]:.2g}" for key in found.names[:4]
        )
        yield f"{name}: {numbers} px; RMS {found.rms_px:.3f} px over {len(found.views)} images"
    for pose in report.rig.pairs():
        yield (
            f"{pose.camera} from {pose.reference}: turned by {pose.rotation_deg:.2f} ± "
            f"{pose.rotation_sd_deg:.2g}°, {1000.0 * pose.baseline_m:.1f} ± "
            f"{1000.0 * pose.position_sd_m:.2g} mm away; {pose.moments} moments in common"
        )
    for name, one in report.cameras.items():
        yield from (f"{name}: {line}" for line in depth_lines(one))
    for name, worth in trust.items():
        for odd in worth.outliers:
            yield f"Consider leaving out: {odd.reason} (--without {name}/{odd.name})"
        yield f"{name}: {worth.verdict.sentence}"
    unseen = report.rig.held_out
    held_out = "" if unseen is None else f"; {unseen.rms_px:.3f} px at held-out moments"
    yield f"RMS {report.rig.rms_px:.3f} px over {len(report.rig.moments)} moments{held_out}"
    for name, one in report.cameras.items():
        for image, detection in one.detections.items():
            if not detection.found:
                yield f"not used: {name}/{image}. {detection.reason}"
