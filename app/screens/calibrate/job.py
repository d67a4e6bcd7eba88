"""The job of the Calibrate screen: the board in every photograph, and the cameras that took them."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2

from app.screens.calibrate.view import CalibrationView, CameraView, Photograph
from app.state import BoardViews, Spec
from app.store import Store
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.detect import Detection, detect
from pipeline.calibration.estimate import FittedView, View, calibrate, held_out, place
from pipeline.calibration.from_images import ENDINGS
from pipeline.io.images import read_color
from pipeline.types import ByteArray

PICTURE_WIDTH_PX, QUALITY = 640, 85
"""Of the photographs in the panel."""
FOLDS = 4
"""In so many turns views are held out."""
FOUND_SHARE = 0.9
"""Of the work is looking for the board."""


def calibrate_job(store: Store, spec: Spec) -> Generator[Progress | CalibrationView, None, CalibrationView]:
    """Find the board in all photographs and estimate every camera; yields the cameras as they come."""
    views = spec.views
    assert views is not None
    board = Board(views.pattern, views.columns, views.rows, views.spacing_m)
    folders = camera_files(Path(views.folder))
    view = CalibrationView(board, ())
    for index, (name, files) in enumerate(folders.items()):

        def read(files: Sequence[Path] = files, index: int = index) -> Generator[Progress, None, list[Found]]:
            return (yield from _read(files, board, index / len(folders), 1.0 / len(folders)))

        key = (f"board-{name}", views.folder, views.edition, board, tuple(file.name for file in files))
        found = yield from store.remember(key, read)
        yield Progress(f"estimating {name}", (index + FOUND_SHARE) / len(folders))
        dropped = tuple(one for camera, one in views.dropped if camera == name)
        view = replace(view, cameras=(*view.cameras, _camera(name, found, board, views, dropped)))
        if len(view.cameras) < len(folders):
            yield view
    return view


def camera_files(folder: Path) -> dict[str, list[Path]]:
    """The photographs of each camera: below folders ``node_...``, or those of one camera in the folder itself.

    Raises:
        InputError: there is none.
    """
    nodes = sorted(one for one in folder.glob("node_*") if one.is_dir()) or [folder]
    files = {
        one.name if one != folder else "camera": sorted(
            file
            for file in one.iterdir()
            if file.suffix.lower() in ENDINGS and not file.name.startswith("depth")
        )
        for one in nodes
        if one.is_dir()
    }
    files = {name: some for name, some in files.items() if some}
    if not files:
        raise InputError(f"There is no photograph in {folder.name}; try PNG or JPEG images of the board")
    return files


Found = tuple[Photograph, Detection, tuple[int, int]]
"""A photograph, what was found in it, and the width and height of the whole of it."""


def _read(
    files: Sequence[Path], board: Board, begin: float, share: float
) -> Generator[Progress, None, list[Found]]:
    found: list[Found] = []
    for index, path in enumerate(files):
        done = begin + FOUND_SHARE * share * index / len(files)
        yield Progress(f"looking for the board in {path.parent.name}/{path.name}", done)
        image = read_color(path)
        one = detect(image, board)
        jpeg, zoom = thinned(image)
        photograph = Photograph(view_name(path), jpeg, zoom, one.points_px, one.blobs_px, one.reason)
        found.append((photograph, one, (image.shape[1], image.shape[0])))
    return found


def view_name(path: Path) -> str:
    """What a view is called: the number after ``color_``, or the file's name."""
    _, sign, number = path.stem.partition("_")
    return number if sign and path.stem.startswith("color_") else path.stem


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
    camera = CameraView(name, size_px, tuple(one[0] for one in found), None, "", (), dropped)
    used = [view for view in seen if view.name not in dropped]
    try:
        _check_sizes(found)
        lens = calibrate(used, size_px, views.lens)
        unseen: list[FittedView] = [
            place(view, lens.matrix, lens.distortion) for view in seen if view.name in dropped
        ]
        unseen += held_out(used, size_px, min(FOLDS, len(used)), views.lens)
    except PacketMeshError as error:
        return replace(camera, reason=str(error))
    return replace(camera, calibration=lens, unseen=tuple(unseen))


def _check_sizes(found: Sequence[Found]) -> None:
    sizes = {size_px: photograph.name for photograph, _, size_px in found}
    if len(sizes) > 1:
        told = " and ".join(f"{name} of {width} x {height}" for (width, height), name in sizes.items())
        raise InputError(f"The images are not of one size: {told}; calibrate each camera by itself")
