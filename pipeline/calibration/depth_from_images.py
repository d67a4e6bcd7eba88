"""Bias of a depth sensor from depth images taken together with photographs of a board (SPEC 1.5)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.calibration.depth_bias import DepthFit, fit_depth
from pipeline.calibration.depth_samples import board_depth_samples
from pipeline.calibration.estimate import Calibration
from pipeline.calibration.from_images import CameraReport, paths_by_name
from pipeline.io.images import ReadDepth, read_depth_noted


def depth_beside(images: Sequence[Path]) -> dict[str, Path]:
    """Find the depth image of each photograph: depth_00.png next to color_00.png, color_00.jpg and so on.

    Returns:
        Paths by the photograph's name in a report; photographs without depth are left out.
    """
    beside = {
        name: path.with_name(f"depth_{path.stem.partition('_')[2]}.png")
        for name, path in paths_by_name(images).items()
    }
    return {name: path for name, path in beside.items() if path.is_file()}


def with_depth(
    report: CameraReport,
    depths: Mapping[str, Path],
    depth_camera: CameraReport | None = None,
    depth_scale: float | None = None,
) -> CameraReport:
    """Add the depth sensor's bias to a report, or the reason why it is unknown.

    Args:
        report: report of the node's colour camera.
        depths: depth images, by the name of the photograph of the same moment.
        depth_camera: the camera with the depth's pixel grid, whose images' names are in ``depths``; None if
            it is the colour camera.
        depth_scale: depth units per metre; by default whole numbers are millimetres.
    """
    if not depths:
        return report
    own = depth_camera or report
    legacy = [name for name, one in own.detections.items() if one.legacy]
    try:
        images = _read(own.calibration, depths, depth_scale)
        report = replace(report, depth_notes=_doubts(images))
        found = _fit(own.calibration, images, report.board, legacy)
    except InputError as error:
        return replace(report, depth_reason=str(error))
    return replace(report, depth=found)


def depth_fit(calibration: Calibration, depths: Mapping[str, Path], board: Board) -> DepthFit:
    """Estimate the bias of depth images on a camera's pixel grid.

    Args:
        calibration: calibration of the camera, with its views.
        depths: 16-bit images in millimetres, by the names of their views.
        board: the board in the views.

    Raises:
        InputError: images are unreadable, too few, on another pixel grid, or show no board.
    """
    return _fit(calibration, _read(calibration, depths, None), board)


def _read(
    calibration: Calibration, depths: Mapping[str, Path], depth_scale: float | None
) -> dict[str, ReadDepth]:
    """Read the depth images of a camera's views, by the view's name."""
    names = [view.name for view in calibration.views if view.name in depths]
    return {name: read_depth_noted(depths[name], depth_scale) for name in names}


def _fit(
    calibration: Calibration, images: Mapping[str, ReadDepth], board: Board, legacy: Collection[str] = ()
) -> DepthFit:
    measured = [images[view.name].depth if view.name in images else None for view in calibration.views]
    return fit_depth(board_depth_samples(calibration, measured, board, legacy))


def _doubts(images: Mapping[str, ReadDepth]) -> tuple[str, ...]:
    """Return the sentences about a doubtful depth scale of the first image that has any."""
    doubtful = ((name, read.notes) for name, read in images.items() if read.notes)
    name, notes = next(doubtful, ("", ()))
    return tuple(f"Depth image of {name}: {note}" for note in notes)
