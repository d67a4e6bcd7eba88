"""The job that compares one view's depth, measured and corrected, with the board's plane."""

from __future__ import annotations

from collections.abc import Generator

import cv2
import numpy as np

from app.compute.records import Picture
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate.cameras import bias_of, cameras_of, depth_file, finished
from app.screens.calibrate.maps import off_picture
from app.screens.calibrate.request import board_of
from app.screens.calibrate.view import DepthErrorView
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import Calibration
from pipeline.io.images import read_depth
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray

LEAST_SCALE_M = 0.01
"""Least error at which the colour scale ends, metres."""


def depth_job(store: Store, spec: Spec, name: str, view: str) -> Generator[Progress, None, DepthErrorView]:
    """Return pictures of a view's depth error on the board; none without a depth image, a board or a lens."""
    views = spec.views
    assert views is not None
    known = yield from finished(cameras_of(store, views))
    camera = known.view.camera(name)
    fitted = None if camera is None else camera.fitted(view)
    path = None if fitted is None else depth_file(views, name, view)
    if camera is None or camera.calibration is None or fitted is None or path is None:
        return DepthErrorView(name, view, {})
    depth = read_depth(path)
    found = yield from bias_of(store, views, known, name)
    off_m = depth.z_m - board_depth_m(camera.calibration, fitted.T_camera_board, board_of(views))
    off_most_m = np.abs(off_m[np.isfinite(off_m)])
    most_m = max(float(np.quantile(off_most_m, 0.95)), LEAST_SCALE_M) if len(off_most_m) else LEAST_SCALE_M
    zoom = camera.photographs[0].zoom
    pictures: dict[str, Picture] = {
        "off-before": off_picture(off_m, most_m, zoom, "Measured depth minus the board's plane"),
    }
    if not isinstance(found, str):
        corrected_m = found.correction.apply(depth).z_m - depth.z_m
        pictures["off-after"] = off_picture(
            off_m + corrected_m, most_m, zoom, "Corrected depth minus the board's plane"
        )
    return DepthErrorView(name, view, pictures)


def board_depth_m(lens: Calibration, T_camera_board: FloatArray, board: Board) -> FloatArray:
    """Return (H, W) depth of the board's plane between its outermost points, metres; NaN elsewhere."""
    width_px, height_px = lens.size_px
    low_m, high_m = board.points_m[:, :2].min(axis=0), board.points_m[:, :2].max(axis=0)
    along = np.linspace(0.0, 1.0, 16, endpoint=False)[:, None]
    corners = np.array([[low_m[0], low_m[1]], [high_m[0], low_m[1]], high_m, [low_m[0], high_m[1]]])
    rim = np.concatenate([a + along * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])
    rim_px = lens.optics.project(apply(T_camera_board, np.column_stack([rim, np.zeros(len(rim))])))
    inside = np.zeros((height_px, width_px), np.uint8)
    cv2.fillPoly(inside, [np.rint(rim_px).astype(np.int32)], 1)
    v, u = np.nonzero(inside)
    rays = lens.optics.rays(np.column_stack([u, v]).astype(float))
    normal = T_camera_board[:3, 2]
    depth_m = np.full((height_px, width_px), np.nan)
    depth_m[v, u] = (normal @ T_camera_board[:3, 3]) * rays[:, 2] / (rays @ normal)
    return depth_m
