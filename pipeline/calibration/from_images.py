"""Calibration of a camera from image files of a board (SPEC 1.3)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.depth_bias import DepthFit
from pipeline.calibration.detect import detect
from pipeline.calibration.detection import Detection
from pipeline.calibration.estimate import (
    LEAST_VIEWS,
    Calibration,
    FittedView,
    Lens,
    View,
    calibrate,
    check_possible,
    held_out,
    rms_px,
)
from pipeline.calibration.no_image import is_video, why_no_image
from pipeline.calibration.one_camera import check_series_agree
from pipeline.calibration.refine import refined_px
from pipeline.calibration.series import check_one_camera
from pipeline.calibration.shots import photographs
from pipeline.calibration.warp import BoardWarp, board_warp
from pipeline.io.images import read_color
from pipeline.types import CameraIntrinsics


@dataclass(frozen=True, slots=True)
class CameraReport:
    """A calibration and its images."""

    board: Board
    detections: dict[str, Detection]
    """Detections by the image's name."""
    views: tuple[View, ...]
    """Views from which the camera was estimated."""
    calibration: Calibration
    held_out: tuple[FittedView, ...]
    """The same views, each fitted with a lens estimated from other views; empty if none was held out."""
    left_out: tuple[str, ...] = ()
    """Images that the user excluded."""
    warp: BoardWarp | None = None
    """Warp of the board; None if it was not requested."""
    depth: DepthFit | None = None
    """Bias of the depth sensor; None without depth images, or if it is unknown."""
    depth_reason: str = ""
    """Reason why the bias is unknown although there are depth images; else empty."""
    depth_notes: tuple[str, ...] = ()
    """Doubts about the depth scale, one sentence each."""

    @property
    def held_out_rms_px(self) -> float | None:
        """RMS over all points of held-out views; None if none was held out."""
        if not self.held_out:
            return None
        return rms_px(np.concatenate([view.residuals_px for view in self.held_out]))

    @property
    def distances_m(self) -> tuple[float, float]:
        """Least and largest distance of the board's centre from the camera."""
        away_m = [float(np.linalg.norm(view.T_camera_board[:3, 3])) for view in self.calibration.views]
        return min(away_m), max(away_m)

    @property
    def intrinsics(self) -> CameraIntrinsics:
        """The camera for the reconstruction."""
        found = self.calibration
        fisheye = found.lens == "fisheye"
        kept = 4 if fisheye else 8 if found.lens == "rational" else 5
        return CameraIntrinsics(found.matrix, found.distortion[:kept].copy(), *found.size_px, fisheye)

    def metrics(self) -> dict[str, Any]:
        """Return the values that ``--json`` prints."""
        found = self.calibration
        fitted = {view.name: view.rms_px for view in found.views}
        unseen = {view.name: view.rms_px for view in self.held_out}
        return {
            "board": self.board.title,
            "lens": found.lens,
            "image_size_px": list(found.size_px),
            "rms_px": found.rms_px,
            "held_out_rms_px": self.held_out_rms_px,
            "matrix": found.matrix.tolist(),
            "distortion": found.distortion.tolist(),
            "standard_errors": found.standard_errors,
            "ci95": {name: list(interval) for name, interval in found.intervals.items()},
            "board_distance_m": list(self.distances_m),
            "left_out": list(self.left_out),
            "board_warp": self._warp_metrics(),
            "depth": None if self.depth is None else self.depth.metrics(),
            "views": [
                {
                    "image": name,
                    "found": one.found,
                    "used": name in fitted,
                    "rms_px": fitted.get(name),
                    "held_out_rms_px": unseen.get(name),
                    "reason": one.reason,
                }
                for name, one in self.detections.items()
            ],
        }

    def _warp_metrics(self) -> dict[str, Any] | None:
        if self.warp is None:
            return None
        return {
            "warp_m": self.warp.warp_m,
            "used": self.warp.helps,
            "held_out_rms_px_flat": self.warp.flat_rms_px,
            "held_out_rms_px": self.warp.rms_px,
        }


def image_files(given: Sequence[str], one_camera: bool = False) -> list[Path]:
    """Return the images named by files, folders and patterns such as ``left*.jpg``, in order.

    Args:
        given: files, folders and patterns.
        one_camera: whether one camera took all images even if names or EXIF data indicate several.

    Raises:
        InputError: an argument names no image, or the images are of several cameras.
    """
    files: list[Path] = []
    for word in given:
        path = Path(word)
        if path.is_dir():
            named = photographs(path)
        elif any(sign in word for sign in "*?[") and not path.is_file():
            named = sorted(Path(path.anchor or ".").glob(str(path.relative_to(path.anchor))))
        else:
            named = [path] if path.is_file() and not is_video(path) else []
        if not named:
            raise InputError(f"{word} names no image{why_no_image(path)}")
        files += named
    files = list(dict.fromkeys(files))
    if not one_camera:
        check_one_camera(files)
    return files


def paths_by_name(files: Sequence[Path]) -> dict[str, Path]:
    """Return images by their names in a report: the file's name, or its path if several have that name."""
    count = Counter(path.name for path in files)
    return {path.name if count[path.name] == 1 else str(path): path for path in files}


def iterate_calibration(
    files: Sequence[Path],
    board: Board,
    lens: Lens = "thesis",
    folds: int = 0,
    without: Sequence[str] = (),
    warp: bool = False,
    one_camera: bool = False,
) -> Generator[Progress, None, CameraReport]:
    """Find the board in every image and estimate the camera.

    Circle centres are then refined without perspective bias, using the first estimate; they are used if the
    RMS does not grow.

    Args:
        files: images of one size.
        board: the board in them.
        lens: distortion model of the camera.
        folds: number of folds of held-out views; 0 holds none out, 2 half of them like the thesis. With few
            views a number above 0 is increased so that three remain for the lens.
        without: names of images to leave out.
        warp: whether to also estimate the board's points, and use them if held-out views then fit better;
            it takes two folds at least.
        one_camera: whether one camera took all images even if series of their names fit better alone.

    Yields:
        Progress before each image and each later step.

    Raises:
        InputError: images are unreadable, differ in size or are of several cameras, too few show the board,
            or an image to leave out does not exist.
        ReconstructionError: the views do not determine the lens, or the camera that fits best cannot exist.
    """
    detections, paths, size_px = yield from _detections(files, board)
    for name in without:
        if name not in detections:
            raise InputError(f"{name} is not among the images, so it cannot be left out; check its name")
    views = [
        View(name, one.points_px, board.points_m[one.indices])
        for name, one in detections.items()
        if one.found and name not in without
    ]
    if len(views) < LEAST_VIEWS:
        raise InputError(_too_few(detections, without, board, len(views)))
    yield Progress("estimating the camera", 0.7)
    calibration = calibrate(views, size_px, lens)
    if not one_camera:
        check_series_agree(calibration, views, paths)
    if board.pattern in ("circles", "circles-asymmetric"):
        again: list[View] = []
        for view, fitted in zip(views, calibration.views, strict=True):
            yield Progress(f"centring circles in {view.name}", 0.7 + 0.2 * len(again) / len(views))
            gray = cv2.cvtColor(read_color(paths[view.name]), cv2.COLOR_RGB2GRAY)
            again.append(replace(view, points_px=refined_px(gray, board, fitted, calibration.optics)))
        better = calibrate(again, size_px, lens)
        if better.rms_px <= calibration.rms_px:
            views, calibration = again, better
    yield Progress("holding views out", 0.9)
    bent = board_warp(views, size_px, board, _folds(max(folds, 2), len(views)), lens) if warp else None
    if bent is not None and bent.helps:
        check_possible(bent.calibration)
        views = [replace(view, board_m=bent.board_m) for view in views]
        return CameraReport(
            board, detections, tuple(views), bent.calibration, bent.held_out, tuple(without), bent
        )
    folds = _folds(folds, len(views))
    unseen = held_out(views, size_px, folds, lens) if folds else ()
    return CameraReport(board, detections, tuple(views), calibration, unseen, tuple(without), bent)


def _detections(
    files: Sequence[Path], board: Board
) -> Generator[Progress, None, tuple[dict[str, Detection], dict[str, Path], tuple[int, int]]]:
    """Detect the board in each image; returns detections and paths by name, and the size of all images."""
    detections: dict[str, Detection] = {}
    paths = paths_by_name(files)
    sizes: dict[tuple[int, int], str] = {}
    for index, (name, path) in enumerate(paths.items()):
        yield Progress(f"looking for the board in {path.name}", 0.7 * index / len(paths))
        image = read_color(path)
        sizes.setdefault((image.shape[1], image.shape[0]), name)
        if len(sizes) > 1:
            listed = " and ".join(f"{name} of {width} x {height}" for (width, height), name in sizes.items())
            raise InputError(
                f"The images are not of one size: {listed}; give each camera's images a folder of its own, "
                "and hold a camera upright or sideways in all of them"
            )
        detections[name] = detect(image, board)
    return detections, paths, next(iter(sizes))


def _folds(most: int, views: int) -> int:
    """Return how many folds leave enough views for the lens; 0 if none are requested or possible."""
    if not most or views <= LEAST_VIEWS:
        return 0
    return next(folds for folds in range(min(most, views), views + 1) if _left(views, folds) >= LEAST_VIEWS)


def _left(views: int, folds: int) -> int:
    return views - -(-views // folds)


def _too_few(detections: dict[str, Detection], without: Sequence[str], board: Board, found: int) -> str:
    reasons = [f" {name}: {one.reason}" for name, one in detections.items() if one.reason]
    besides = f", {len(without)} left out" if without else ""
    return (
        f"The board ({board.title}) is found in {found} of {len(detections)} images{besides}, and it takes "
        f"{LEAST_VIEWS}, tilted differently.{reasons[0] if reasons else ' Take more'}"
    )
