"""Every camera of a session with a board, by itself and then all together."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from app.screens.calibrate.request import FOLDS, board_of, shots_of, true_parameters
from app.screens.calibrate.view import CalibrationView, CameraView, Photograph, PlacedCamera, RigView
from app.state import BoardViews
from app.store import Store
from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.detect import Detection, detect
from pipeline.calibration.estimate import Calibration, FittedView, View, place
from pipeline.calibration.from_images import CameraReport, iterate_calibration
from pipeline.calibration.rig import RigCalibration, Seen, calibrate_rig
from pipeline.calibration.shots import NodeShots
from pipeline.io.images import read_color
from pipeline.types import ByteArray

PICTURE_WIDTH_PX, QUALITY = 640, 85
"""Of the photographs in the panel."""


@dataclass(frozen=True, slots=True)
class CameraFound:
    """A camera by itself."""

    view: CameraView
    report: CameraReport | None
    """None if its views do not determine it."""


def cameras_of(
    store: Store, views: BoardViews, share: float = 1.0
) -> Generator[Progress | CalibrationView, None, CalibrationView]:
    """All cameras, without their depth; yields what there is so far, in the first ``share`` of the work.

    Raises:
        InputError: there are no photographs.
    """
    board, nodes = board_of(views), shots_of(views)

    def compute() -> Generator[Progress | CalibrationView, None, CalibrationView]:
        view, found = CalibrationView(board), []
        for index, node in enumerate(nodes):
            step = 0.9 * share / len(nodes)
            found.append((yield from _camera_of(store, views, node, index * step, step)))
            view = replace(view, cameras=(*view.cameras, found[-1].view))
            yield view
        if len(nodes) < 2:
            return view
        yield Progress("placing the cameras", 0.9 * share)
        return _together(view, found, nodes)

    return (yield from store.remember(("cameras", views), compute))


def finished(
    steps: Generator[Progress | CalibrationView, None, CalibrationView],
) -> Generator[Progress, None, CalibrationView]:
    """Only the progress on the way to all cameras."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        if isinstance(step, Progress):
            yield step


def _camera_of(
    store: Store, views: BoardViews, node: NodeShots, begin: float, share: float
) -> Generator[Progress, None, CameraFound]:
    """One camera, which nothing but its own views changes."""
    board, dropped = board_of(views), _dropped(views, node.name)

    def compute() -> Generator[Progress, None, CameraFound]:
        yield Progress(f"{node.name}: looking for the board", begin)
        without = [shot.color.name for shot in node.shots if shot.moment in dropped]
        files = [shot.color for shot in node.shots]
        images = {path.name: read_color(path) for path in files}
        steps = iterate_calibration(files, board, views.lens, FOLDS, without)
        try:
            report: CameraReport | None = yield from _part(steps, node.name, begin, share)
            reason = ""
        except PacketMeshError as error:
            report, reason = None, str(error)
        found = (
            {name: detect(one, board) for name, one in images.items()}
            if report is None
            else report.detections
        )
        photographs = tuple(
            _photograph(shot.moment, images[shot.color.name], found[shot.color.name]) for shot in node.shots
        )
        first = next(iter(images.values()))
        camera = CameraView(node.name, (first.shape[1], first.shape[0]), photographs, dropped=dropped)
        camera = replace(camera, reason=reason, truth=true_parameters(views, node.name))
        if report is None:
            return CameraFound(camera, None)
        moments = {shot.color.name: shot.moment for shot in node.shots}
        unseen = [replace(view, name=moments[view.name]) for view in report.held_out]
        return CameraFound(
            _with_lens(camera, _named(report.calibration, moments), unseen, board, found, moments), report
        )

    key = (f"camera-{node.name}", views.folder, views.edition, board, views.lens, dropped)
    return (yield from store.remember(key, compute))


def _part(
    steps: Generator[Progress, None, CameraReport], name: str, begin: float, share: float
) -> Generator[Progress, None, CameraReport]:
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        yield Progress(f"{name}: {step.stage}", begin + share * step.fraction)


def _dropped(views: BoardViews, camera: str) -> tuple[str, ...]:
    """Moments of the views of a camera that are left out."""
    return tuple(moment for name, moment in views.dropped if name == camera)


def _named(lens: Calibration, moments: dict[str, str]) -> Calibration:
    """Its views by their moments instead of the names of files."""
    return replace(lens, views=tuple(replace(view, name=moments[view.name]) for view in lens.views))


def _photograph(moment: str, image: ByteArray, found: Detection) -> Photograph:
    zoom = min(1.0, PICTURE_WIDTH_PX / image.shape[1])
    size_px = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    small = image if zoom == 1.0 else cv2.resize(image, size_px, interpolation=cv2.INTER_AREA)
    encoded = cv2.imencode(".jpg", small[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return Photograph(moment, encoded.tobytes(), zoom, found.points_px, found.blobs_px, found.reason)


def _with_lens(
    camera: CameraView,
    lens: Calibration,
    unseen: Sequence[FittedView],
    board: Board,
    found: dict[str, Detection],
    moments: dict[str, str],
) -> CameraView:
    """The camera with its lens, by which the views that were dropped are placed, too."""
    placed = list(unseen)
    for name, moment in moments.items():
        if moment in camera.dropped and found[name].found:
            view = View(moment, found[name].points_px, board.points_m[found[name].indices])
            try:
                placed.append(place(view, lens.matrix, lens.distortion, lens.lens))
            except PacketMeshError:
                continue
    return replace(camera, calibration=lens, unseen=tuple(placed))


def _together(
    view: CalibrationView, found: Sequence[CameraFound], nodes: Sequence[NodeShots]
) -> CalibrationView:
    """All lenses and poses together; where that cannot be, every camera as it is by itself."""
    reports = {one.view.name: one.report for one in found if one.report is not None}
    seen = {
        node.name: _seen(reports[node.name], {shot.color.name: shot.moment for shot in node.shots})
        for node in nodes
        if node.name in reports
    }
    try:
        rig = calibrate_rig({name: one.calibration for name, one in reports.items()}, seen, view.board, FOLDS)
    except PacketMeshError as error:
        return replace(view, rig=str(error))
    cameras = []
    for camera, node in zip(view.cameras, nodes, strict=True):
        if camera.name in reports:
            moments = {shot.color.name: shot.moment for shot in node.shots}
            lens = _named(rig.cameras[camera.name], moments)
            apart = () if rig.held_out is None else rig.held_out.views[camera.name]
            unseen = [replace(one, name=moments[one.name]) for one in apart]
            detections = reports[camera.name].detections
            camera = _with_lens(camera, lens, unseen, view.board, detections, moments)
        cameras.append(camera)
    return replace(view, cameras=tuple(cameras), rig=_rig_view(rig))


def _seen(report: CameraReport, moments: dict[str, str]) -> dict[str, Seen]:
    """By moment."""
    return {moments[view.name]: Seen(view, report.detections[view.name].oriented) for view in report.views}


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
