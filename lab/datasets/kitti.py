"""KITTI raw drives with the improved ground truth or the laser's own points, and Eigen's split.

Geiger et al., "Vision meets Robotics", IJRR 2013; Uhrig et al., "Sparsity Invariant CNNs", 3DV 2017.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Load, Pair, load_pair, window
from lab.datasets.projection import nearest_per_pixel
from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, read_bytes, read_text
from pipeline.io.images import read_color
from pipeline.types import BoolArray, FloatArray

log = logging.getLogger(__name__)

LIST = "test_files.txt"
"""File in the set's folder with Eigen's test split, as in monodepth2 and later projects."""
UNITS_PER_METRE = 256.0
GARG = (0.40810811, 0.99189189, 0.03594771, 0.96405229)
"""Top, bottom, left and right of the crop of Garg et al., ECCV 2016, as shares of height and width."""
_LINE = re.compile(
    r"(?P<drive>\S*drive_\d{4}_sync)(?:/image_0(?P<camera>[23])/data/|\s+)(?P<frame>\d+)(?:\.\w+)?"
    r"(?:\s+(?P<side>[lr])\b)?"
)


@dataclass(frozen=True, slots=True)
class _Place:
    """One image of one drive; ``picture``, ``improved`` and ``laser`` are its files, None if missing."""

    root: Path
    drive: str
    """Folder below ``root``, such as ``2011_09_26/2011_09_26_drive_0002_sync``."""
    camera: int
    """2 is the left colour camera, 3 the right one."""
    number: int

    @property
    def picture(self) -> Path | None:
        stem = self.root / self.drive / f"image_0{self.camera}" / "data" / f"{self.number:010d}"
        return _first(stem.with_suffix(ending) for ending in (".png", ".jpg"))

    @property
    def improved(self) -> Path | None:
        """Improved ground truth, in the folders of the raw data or of the depth benchmark."""
        below = f"proj_depth/groundtruth/image_0{self.camera}/{self.number:010d}.png"
        drives = (self.drive, *(f"{part}/{Path(self.drive).name}" for part in ("train", "val")))
        return _first(self.root / drive / below for drive in drives)

    @property
    def cameras(self) -> Path:
        """Calibration file of the cameras; each day has one."""
        return self.root / Path(self.drive).parent / "calib_cam_to_cam.txt"

    @property
    def laser(self) -> Path | None:
        return _first([self.root / self.drive / "velodyne_points/data" / f"{self.number:010d}.bin"])


def find(root: Path) -> list[Load]:
    """Return the frames that the file ``LIST`` names, or without it the left colour camera's in all drives.

    If any frame has the improved ground truth, only those that have it are returned, as in published tables
    (652 of the 697 test frames); otherwise the truth is the laser's points.

    Raises:
        InputError: a line of the list names no frame.
    """
    places = _listed(root / LIST) if (root / LIST).is_file() else _found(root)
    there = [place for place in places if place.picture]
    if len(there) < len(places):
        log.warning("%d of %d listed pictures are not below %s", len(places) - len(there), len(places), root)
    improved = [place for place in there if place.improved]
    return [partial(_load, place) for place in improved or [place for place in there if place.laser]]


def _first(paths: Iterable[Path]) -> Path | None:
    return next((path for path in paths if path.is_file()), None)


def _listed(file: Path) -> list[_Place]:
    places = []
    for line in filter(str.strip, read_text(file, "list of KITTI frames").splitlines()):
        match = _LINE.match(line)
        if match is None:
            raise InputError(
                f"The list {file} has the line '{line[:80]}', which names no frame; "
                "try lines such as '2011_09_26/2011_09_26_drive_0002_sync 0000000069 l'"
            )
        camera = int(match["camera"] or (3 if match["side"] == "r" else 2))
        places.append(_Place(file.parent, match["drive"], camera, int(match["frame"])))
    return places


def _found(root: Path) -> list[_Place]:
    pictures = [path for path in root.glob("*/*_sync/image_02/data/*") if path.stem.isdecimal()]
    return [
        _Place(root, path.parents[2].relative_to(root).as_posix(), 2, int(path.stem))
        for path in sorted(pictures)
    ]


def _load(place: _Place) -> Pair:
    assert place.picture is not None
    if place.improved:
        pair = load_pair(place.picture, place.improved, UNITS_PER_METRE)
    else:
        rgb = read_color(place.picture)
        pair = Pair(place.picture, rgb, _laser_depth(place, rgb.shape[:2]))
    return replace(pair, judged=judged(pair.rgb.shape))


def judged(shape: tuple[int, ...]) -> BoolArray:
    """Return (H, W) True inside the crop of Garg et al."""
    top, bottom, left, right = GARG
    height, width = shape[:2]
    rows = slice(int(top * height), int(bottom * height))
    return window(shape, rows, slice(int(left * width), int(right * width)))


def _laser_depth(place: _Place, shape: tuple[int, int]) -> FloatArray:
    """Return (H, W) depth, metres, of the laser's points along the camera's axis; NaN without a point.

    monodepth's tables use the coordinate along the laser's forward axis instead, which is about 27 cm larger.
    """
    assert place.laser is not None
    data = read_bytes(place.laser, MAX_IMAGE_BYTES, "laser scan")
    if len(data) % 16:
        raise InputError(f"The laser scan {place.laser} is truncated; try to copy or unpack it again")
    points_m = np.frombuffer(data, "<f4").reshape(-1, 4)[:, :3].astype(np.float64)
    file = place.cameras.with_name("calib_velo_to_cam.txt")
    R, T_m = _matrix(file, "R", (3, 3)), _matrix(file, "T", (3,))
    R_rect = _matrix(place.cameras, "R_rect_00", (3, 3))
    P = _matrix(place.cameras, f"P_rect_0{place.camera}", (3, 4))
    rectified_m = (points_m[points_m[:, 0] >= 0] @ R.T + T_m) @ R_rect.T
    image = rectified_m @ P[:, :3].T + P[:, 3]
    image = image[image[:, 2] > 0]
    pixels = np.rint(image[:, :2] / image[:, 2:]).astype(int) - 1  # KITTI counts from one, as Matlab does
    return nearest_per_pixel(pixels, image[:, 2], shape)


def _matrix(file: Path, key: str, shape: tuple[int, ...]) -> FloatArray:
    """Return the numbers of the line ``key: numbers`` in this shape."""
    for line in read_text(file, "KITTI calibration").splitlines():
        if line.startswith(f"{key}:"):
            try:
                return np.array(line.partition(":")[2].split(), dtype=np.float64).reshape(shape)
            except ValueError:
                break
    raise InputError(f"The KITTI calibration {file} has no {key} of {shape} numbers; try to copy it again")
