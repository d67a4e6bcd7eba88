"""A camera from image files of a board, image by image (SPEC 1.3)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.detect import Detection, detect
from pipeline.calibration.estimate import (
    LEAST_VIEWS,
    Calibration,
    FittedView,
    Lens,
    View,
    calibrate,
    held_out,
    rms_px,
)
from pipeline.io.images import read_color
from pipeline.types import CameraIntrinsics

ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")


@dataclass(frozen=True, slots=True)
class CameraReport:
    """A calibration and the images that it comes from."""

    board: Board
    detections: dict[str, Detection]
    """By the image's name."""
    calibration: Calibration
    held_out: tuple[FittedView, ...]
    """The same views, each by a lens of others; empty if none was held out."""

    @property
    def held_out_rms_px(self) -> float | None:
        """Over all points of views that the lens has not seen; None if none was held out."""
        if not self.held_out:
            return None
        return rms_px(np.concatenate([view.residuals_px for view in self.held_out]))

    @property
    def intrinsics(self) -> CameraIntrinsics:
        """The camera as the chain takes it.

        Raises:
            InputError: a rational lens, which it does not know.
        """
        found = self.calibration
        if found.lens == "rational":
            raise InputError("The chain knows no rational lens; calibrate with the lens 'thesis' or 'brown'")
        return CameraIntrinsics(found.matrix, found.distortion[:5].copy(), *found.size_px)

    def metrics(self) -> dict[str, Any]:
        """What ``--json`` prints."""
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
            "views": [
                {
                    "image": name,
                    "found": one.found,
                    "rms_px": fitted.get(name),
                    "held_out_rms_px": unseen.get(name),
                    "reason": one.reason,
                }
                for name, one in self.detections.items()
            ],
        }


def image_files(given: Sequence[str]) -> list[Path]:
    """The images that files, folders and patterns such as ``left*.jpg`` name, in order.

    Raises:
        InputError: one of them names no image.
    """
    files: list[Path] = []
    for word in given:
        path = Path(word)
        if path.is_dir():
            named = sorted(one for one in path.iterdir() if one.suffix.lower() in ENDINGS)
        elif any(sign in word for sign in "*?["):
            named = sorted(Path(path.anchor or ".").glob(str(path.relative_to(path.anchor))))
        else:
            named = [path] if path.is_file() else []
        if not named:
            raise InputError(
                f"{word} names no image; try files, a folder with images, or a pattern in quotes"
            )
        files += named
    return list(dict.fromkeys(files))


def iterate_calibration(
    files: Sequence[Path], board: Board, lens: Lens = "thesis", folds: int = 0
) -> Generator[Progress, None, CameraReport]:
    """Find the board in every image and estimate the camera.

    Args:
        files: images of one size.
        board: what they show.
        lens: which distortions the camera may have.
        folds: in how many turns views are held out; 0 holds none out, 2 half of them as the thesis does.

    Yields:
        Progress, before each image.

    Raises:
        InputError: unreadable images, several sizes, or the board in too few of them.
        ReconstructionError: the views do not determine the lens.
    """
    detections: dict[str, Detection] = {}
    sizes: dict[tuple[int, int], str] = {}
    for index, path in enumerate(files):
        yield Progress(f"looking for the board in {path.name}", 0.9 * index / len(files))
        image = read_color(path)
        sizes.setdefault((image.shape[1], image.shape[0]), path.name)
        if len(sizes) > 1:
            told = " and ".join(f"{name} of {width} x {height}" for (width, height), name in sizes.items())
            raise InputError(f"The images are not of one size: {told}; calibrate each camera by itself")
        detections[_name(path, detections)] = detect(image, board)
    yield Progress("estimating the camera", 0.9)
    views = [
        View(name, one.points_px, board.points_m[one.indices])
        for name, one in detections.items()
        if one.found
    ]
    if len(views) < LEAST_VIEWS:
        reasons = [one.reason for one in detections.values() if one.reason] or [
            "Take more, tilted differently"
        ]
        raise InputError(
            f"The board ({board.title}) is found in {len(views)} of {len(files)} images, and it takes "
            f"{LEAST_VIEWS}. {reasons[0]}"
        )
    size_px = next(iter(sizes))
    calibration = calibrate(views, size_px, lens)
    unseen = held_out(views, size_px, folds, lens) if folds else ()
    return CameraReport(board, detections, calibration, unseen)


def _name(path: Path, known: dict[str, Detection]) -> str:
    return path.name if path.name not in known else str(path)
