"""The depth images that were taken beside a session's photographs, against the board in these (SPEC 1.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.calibration.depth_bias import DepthFit, fit_depth
from pipeline.calibration.depth_samples import board_depth_samples
from pipeline.calibration.from_images import CameraReport
from pipeline.io.images import read_depth


def depth_beside(photographs: Sequence[Path]) -> dict[str, Path]:
    """By the photograph's name, the depth image of the same moment: depth_00.png beside color_00.jpg."""
    found = {}
    for path in photographs:
        kind, _, moment = path.stem.partition("_")
        depth = path.with_name(f"depth_{moment}.png")
        if moment and kind != "depth" and depth.is_file():
            found[path.name] = depth
    return found


def fit_session_depth(report: CameraReport, depth: Mapping[str, Path]) -> DepthFit:
    """A depth sensor's bias and noise from a camera's views of a board.

    Args:
        report: of the camera on whose pixel grid the depth lies.
        depth: 16-bit images in millimetres by the view's name; others are not looked at.

    Raises:
        InputError: an unreadable depth image, or too few that show the board.
    """
    views = report.calibration.views
    images = [read_depth(depth[view.name]) if view.name in depth else None for view in views]
    return fit_depth(board_depth_samples(report.calibration, images, report.board))
