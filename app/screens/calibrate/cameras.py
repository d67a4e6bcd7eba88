"""Calibration of every camera of a board session, first alone and then all together."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from app.compute.state import BoardViews
from app.compute.store import Store
from app.drawing.depth_bias_plots import bias_curve
from app.screens.calibrate.request import FOLDS, board_of, shots_of, true_parameters
from app.screens.calibrate.view import (
    BiasView,
    CalibrationView,
    CameraView,
    Photograph,
    PlacedCamera,
    RigView,
    WarpView,
)
from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress, part
from pipeline.calibration.board import Board
from pipeline.calibration.depth_bias import DepthFit
from pipeline.calibration.detect import detect
from pipeline.calibration.detection import Detection
from pipeline.calibration.estimate import FittedView, View, place
from pipeline.calibration.from_images import CameraReport, iterate_calibration
from pipeline.calibration.rig import RigCalibration
from pipeline.calibration.rig_from_images import RigReport, cameras_together, node_with_depth
from pipeline.calibration.shots import INFRARED, NodeShots, camera_images
from pipeline.calibration.warp import BoardWarp
from pipeline.io.depth_correction import DepthCorrection
from pipeline.io.images import read_color
from pipeline.types import ByteArray

PICTURE_WIDTH_PX, QUALITY = 640, 85
"""Width and JPEG quality of the photographs in the panel."""


@dataclass(frozen=True, slots=True)
class CameraFound:
    """A camera calibrated alone."""

    view: CameraView
    report: CameraReport | None
    """None if its views do not determine it."""


@dataclass(frozen=True, slots=True)
class CamerasFound:
    """All cameras, as the panel shows them and as ``packetmesh calibrate`` reports them."""

    view: CalibrationView
    reports: Mapping[str, CameraReport]
    """Reports by name of the cameras that their views determine: from all cameras together, or alone."""
    rig: RigReport | None = None
    """None for one camera, or if the cameras cannot be placed."""


def cameras_of(
    store: Store, views: BoardViews, share: float = 1.0
) -> Generator[Progress | CalibrationView, None, CamerasFound]:
    """Calibrate all cameras without their depth; yield partial results.

    The reported progress stays below ``share``.

    Raises:
        InputError: there are no photographs.
    """
    images = camera_images(shots_of(views))

    def compute() -> Generator[Progress | CalibrationView, None, CamerasFound]:
        view = CalibrationView(board_of(views))
        reports: dict[str, CameraReport] = {}
        for index, (name, moments) in enumerate(images.items()):
            begin, end = (0.9 * share * done / len(images) for done in (index, index + 1))
            found = yield from _camera_of(store, views, name, moments, begin, end)
            if found.report is not None:
                reports[name] = found.report
            view = replace(view, cameras=(*view.cameras, found.view))
            yield view
        if len(images) < 2:
            return CamerasFound(view, reports)
        yield Progress("placing the cameras", 0.9 * share)
        return _together(views, view, reports)

    return (yield from store.remember(("cameras", views), compute))


def finished(
    steps: Generator[Progress | CalibrationView, None, CamerasFound],
) -> Generator[Progress, None, CamerasFound]:
    """Yield only the progress of ``cameras_of``, and return its cameras."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        if isinstance(step, Progress):
            yield step


def own_views(views: BoardViews, *cameras: str) -> BoardViews:
    """Return the photographs without the dropped views of all other cameras.

    A result about these cameras, each calibrated alone, depends on nothing else.
    """
    return replace(views, dropped=tuple(one for one in views.dropped if one[0] in cameras))


def stage_name(kind: str, camera: str) -> str:
    """Return the store's name of a result about a camera; the slash of node_00/infrared becomes a hyphen."""
    return f"{kind}-{camera.replace('/', '-')}"


def _camera_of(
    store: Store, views: BoardViews, name: str, moments: Mapping[Path, str], begin: float, end: float
) -> Generator[Progress, None, CameraFound]:
    """Calibrate one camera alone, from its own views."""
    own = own_views(views, name)

    def compute() -> Generator[Progress, None, CameraFound]:
        yield Progress(f"{name}: looking for the board", begin)
        board, dropped = board_of(own), tuple(moment for _, moment in own.dropped)
        images = {path: read_color(path) for path in moments}
        left_out = [path.name for path, moment in moments.items() if moment in dropped]
        steps = iterate_calibration(list(images), board, own.lens, FOLDS, left_out, own.bent)
        reason, report = "", None
        try:
            report = yield from part(steps, name, begin, end, detail=True)
        except PacketMeshError as error:
            reason = str(error)
        found = (
            {path.name: detect(image, board) for path, image in images.items()}
            if report is None
            else report.detections
        )
        photographs = [_photograph(moments[path], image, found[path.name]) for path, image in images.items()]
        height_px, width_px = next(iter(images.values())).shape[:2]
        camera = CameraView(
            name,
            (width_px, height_px),
            tuple(photographs),
            reason=reason,
            dropped=dropped,
            truth=true_parameters(own, name),
            warp=None if report is None or report.warp is None else _warp(report.warp, board),
        )
        return CameraFound(camera if report is None else _with_lens(camera, report, moments), report)

    return (yield from store.remember((stage_name("camera", name), own), compute))


def _warp(found: BoardWarp, board: Board) -> WarpView:
    """Return the board's shape for the panel."""
    off_plane_m = found.off_plane_m.reshape(board.grid[::-1])
    return WarpView(off_plane_m, found.helps, found.rms_px, found.flat_rms_px)


def _photograph(moment: str, image: ByteArray, found: Detection) -> Photograph:
    zoom = min(1.0, PICTURE_WIDTH_PX / image.shape[1])
    size_px = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    small = image if zoom == 1.0 else cv2.resize(image, size_px, interpolation=cv2.INTER_AREA)
    encoded = cv2.imencode(".jpg", small[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return Photograph(moment, encoded.tobytes(), zoom, found.points_px, found.blobs_px, found.reason)


def _with_lens(camera: CameraView, report: CameraReport, moments: Mapping[Path, str]) -> CameraView:
    """Return the camera with the report's lens, and the poses that this lens gives to dropped views.

    Views are named by their moments.
    """
    names = {path.name: moment for path, moment in moments.items()}
    lens = replace(report.calibration, views=_named(report.calibration.views, names))
    placed = [*_named(report.held_out, names)]
    for name, moment in names.items():
        one = report.detections[name]
        if moment in camera.dropped and one.found:
            view = View(moment, one.points_px, report.board.points_m[one.indices])
            try:
                placed.append(place(view, lens.matrix, lens.distortion, lens.lens))
            except PacketMeshError:
                continue
    return replace(camera, calibration=lens, unseen=tuple(placed))


def _named(fitted: Sequence[FittedView], moments: Mapping[str, str]) -> tuple[FittedView, ...]:
    """Return views named by their moments instead of files."""
    return tuple(replace(view, name=moments[view.name]) for view in fitted)


def _together(views: BoardViews, view: CalibrationView, reports: Mapping[str, CameraReport]) -> CamerasFound:
    """Calibrate all lenses and poses together; if that fails, keep every camera alone."""
    nodes = shots_of(views)
    try:
        rig = cameras_together(nodes, reports, view.board, FOLDS)
    except PacketMeshError as error:
        return CamerasFound(replace(view, rig=str(error)), reports)
    images = camera_images(nodes)
    cameras = (
        _with_lens(one, rig.cameras[one.name], images[one.name]) if one.name in reports else one
        for one in view.cameras
    )
    return CamerasFound(replace(view, cameras=tuple(cameras), rig=_rig_view(rig.rig)), rig.cameras, rig)


def _rig_view(rig: RigCalibration) -> RigView:
    first, *others = rig.names
    placed = [PlacedCamera(first, np.eye(4), len(rig.moments_of(first)))]
    for name in others:
        pose = rig.relative(name)
        placed.append(
            PlacedCamera(
                name,
                pose.T_reference_camera,
                pose.moments,
                pose.rotation_sd_deg,
                pose.position_sd_m,
                None if rig.held_out is None else rig.held_out.rotation_deg[name],
                None if rig.held_out is None else rig.held_out.position_m[name],
            )
        )
    boards = dict(zip(rig.moments, rig.adjusted.bundle.T_first_board, strict=True))
    return RigView(tuple(placed), boards, rig.rms_px, None if rig.held_out is None else rig.held_out.rms_px)


UNITS = {
    "offset_m": ("Offset", 1000.0, "mm"),
    "scale": ("Scale", 100.0, "%"),
    "curvature_per_m": ("Curvature", 1000.0, "mm at 1 m"),
}
"""By field of ``DepthCorrection``: the term's name, the factor to the shown unit, and that unit."""


@dataclass(frozen=True, slots=True)
class DepthFound:
    """A depth correction, and its view for the panel."""

    correction: DepthCorrection
    view: BiasView


def bias_of(
    store: Store, views: BoardViews, cameras: CamerasFound, camera: str, done: float = 0.5
) -> Generator[Progress, None, DepthFound | str]:
    """Return the depth bias of a camera's node, or a sentence why it is unknown.

    Args:
        store: keeps the bias; that of a camera calibrated alone does not depend on others' dropped views.
        views: the photographs.
        cameras: the calibrated cameras.
        camera: one of them.
        done: share of the progress to report, 0 to 1.
    """
    name = camera.removesuffix(INFRARED)

    def compute() -> Generator[Progress, None, DepthFound | str]:
        yield Progress(f"depth of {name} against the board", done)
        return _bias(_node(views, name), cameras)

    together = cameras.rig is not None
    depends_on = views if together else own_views(views, name, name + INFRARED)
    return (yield from store.remember((stage_name("bias", name), together, depends_on), compute))


def depth_file(views: BoardViews, camera: str, moment: str) -> Path | None:
    """Return the file of the depth image on the pixel grid of a camera's photograph; None without one."""
    apart = camera.endswith(INFRARED)
    shots = _node(views, camera.removesuffix(INFRARED)).shots
    found = (one.depth for one in shots if one.moment == moment and (one.infrared is not None) == apart)
    return next(found, None)


def _node(views: BoardViews, name: str) -> NodeShots:
    (node,) = (one for one in shots_of(views) if one.name == name)
    return node


def _bias(node: NodeShots, cameras: CamerasFound) -> DepthFound | str:
    if node.name not in cameras.reports:
        camera = cameras.view.camera(node.name)
        reason = f"; {camera.reason}" if camera is not None and camera.reason else ""
        return f"{node.name} has no lens yet, and the depth bias cannot be estimated without one{reason}"
    report = node_with_depth(node, cameras.reports)
    if report.depth is not None:
        note = " ".join((*report.depth_notes, report.depth.note)).strip()
        return DepthFound(report.depth.correction, _view(report.depth, note))
    return report.depth_reason or (
        f"There are no depth images for the photographs of {node.name}; add depth_00.png for color_00.png "
        "and so on"
    )


def _view(fit: DepthFit, note: str) -> BiasView:
    """Return the fit for the panel."""
    rows = _rows(fit.correction)
    return BiasView(fit.terms, rows, fit.rms_before_m, fit.rms_after_m, bias_curve(fit), note)


def _rows(correction: DepthCorrection) -> tuple[tuple[str, float, float, float, str], ...]:
    rows = []
    for name, (title, times, unit) in UNITS.items():
        if name in correction.ci95:
            low, high = (times * float(end) for end in correction.ci95[name])
            value = times * float(getattr(correction, name))
            start = 100.0 if name == "scale" else 0.0
            rows.append((title, value - start, low - start, high - start, unit))
    return tuple(rows)
