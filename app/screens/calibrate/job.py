"""The job of the Calibrate screen: the board in every photograph, the cameras that took them, their depth."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2

from app.screens.calibrate.bias import bias_of
from app.screens.calibrate.files import camera_files, true_parameters, view_name
from app.screens.calibrate.request import board_of, dropped_of
from app.screens.calibrate.view import CalibrationView, CameraView, Photograph
from app.state import BoardViews, Spec
from app.store import Store
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.detect import Detection, detect
from pipeline.calibration.estimate import FittedView, View, calibrate, held_out, place
from pipeline.calibration.outliers import outlier_views
from pipeline.io.images import read_color
from pipeline.types import ByteArray

PICTURE_WIDTH_PX, QUALITY = 640, 85
"""Of the photographs in the panel."""
FOLDS = 4
"""In so many turns views are held out."""
CAMERAS_SHARE, FOUND_SHARE = 0.7, 0.9
"""Of the work is for the cameras, the rest for their depth; and of a camera's for looking for the board."""


def calibrate_job(store: Store, spec: Spec) -> Generator[Progress | CalibrationView, None, CalibrationView]:
    """Find the board in all photographs, estimate every camera, then the bias of its depth; yields what there
    is so far.
    """
    views = spec.views
    assert views is not None
    board = board_of(views)
    folders = camera_files(Path(views.folder))
    view = CalibrationView(board, (), {})
    share = CAMERAS_SHARE / len(folders)
    for index, name in enumerate(folders):
        yield Progress(f"estimating {name}", (index + FOUND_SHARE) * share)
        camera = yield from camera_of(store, views, name, index * share, FOUND_SHARE * share)
        view = replace(view, cameras=(*view.cameras, camera))
        yield view
    for index, camera in enumerate(view.cameras):
        done = CAMERAS_SHARE + (1.0 - CAMERAS_SHARE) * index / len(folders)
        told = yield from bias_of(store, views, camera, done)
        view = replace(view, depth=view.depth | {camera.name: told if isinstance(told, str) else told.view})
    return view


def camera_of(
    store: Store, views: BoardViews, name: str, begin: float = 0.0, share: float = 1.0
) -> Generator[Progress, None, CameraView]:
    """One camera; its progress goes from ``begin`` over ``share``."""
    files = camera_files(Path(views.folder))[name]
    board = board_of(views)
    read_key = (f"board-{name}", views.folder, views.edition, board, tuple(file.name for file in files))
    dropped = dropped_of(views, name)

    def compute() -> Generator[Progress, None, CameraView]:
        found = yield from store.remember(read_key, lambda: _read(files, board, begin, share))
        return _camera(name, found, board, views, dropped)

    return (yield from store.remember((f"camera-{name}", views.lens, dropped, read_key), compute))


Found = tuple[Photograph, Detection, tuple[int, int]]
"""A photograph, what was found in it, and the width and height of the whole of it."""


def _read(
    files: Sequence[Path], board: Board, begin: float, share: float
) -> Generator[Progress, None, list[Found]]:
    found: list[Found] = []
    for index, path in enumerate(files):
        done = begin + share * index / len(files)
        yield Progress(f"looking for the board in {path.parent.name}/{path.name}", done)
        image = read_color(path)
        one = detect(image, board)
        jpeg, zoom = thinned(image)
        photograph = Photograph(view_name(path), jpeg, zoom, one.points_px, one.blobs_px, one.reason)
        found.append((photograph, one, (image.shape[1], image.shape[0])))
    return found


def thinned(image: ByteArray) -> tuple[bytes, float]:
    """A JPEG for the panel, and how many of its pixels make one of the image."""
    zoom = min(1.0, PICTURE_WIDTH_PX / image.shape[1])
    size_px = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
    small = image if zoom == 1.0 else cv2.resize(image, size_px, interpolation=cv2.INTER_AREA)
    encoded = cv2.imencode(".jpg", small[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return encoded.tobytes(), zoom


def _camera(
    name: str, found: Sequence[Found], board: Board, views: BoardViews, dropped: tuple[str, ...]
) -> CameraView:
    """The lens from the views that are left; why there is none, where they do not determine it."""
    size_px = found[0][2]
    seen = [
        View(photograph.name, one.points_px, board.points_m[one.indices])
        for photograph, one, _ in found
        if one.found
    ]
    used = [view for view in seen if view.name not in dropped]
    camera = CameraView(name, size_px, tuple(one[0] for one in found), dropped=dropped)
    camera = replace(camera, truth=true_parameters(Path(views.folder), name))
    try:
        _check_sizes(found)
        lens = calibrate(used, size_px, views.lens)
        unseen = [
            place(view, lens.matrix, lens.distortion, lens.lens) for view in seen if view.name in dropped
        ]
    except PacketMeshError as error:
        return replace(camera, reason=str(error))
    unseen += _held_out(used, size_px, views)
    return replace(camera, calibration=lens, unseen=tuple(unseen), outliers=outlier_views(lens, used))


def _held_out(used: Sequence[View], size_px: tuple[int, int], views: BoardViews) -> list[FittedView]:
    """Nothing where the views that are left do not determine the lens."""
    try:
        return list(held_out(used, size_px, min(FOLDS, len(used)), views.lens))
    except PacketMeshError:
        return []


def _check_sizes(found: Sequence[Found]) -> None:
    sizes = {size_px: photograph.name for photograph, _, size_px in found}
    if len(sizes) > 1:
        told = " and ".join(f"{name} of {width} x {height}" for (width, height), name in sizes.items())
        raise InputError(f"The images are not of one size: {told}; calibrate each camera by itself")
