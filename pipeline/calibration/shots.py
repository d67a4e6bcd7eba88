"""Images of a calibration session, grouped by camera and moment.

``BOARD/node_00/{color_00.png, depth_00.png, infrared_00.png}``, ``BOARD/node_01/...``, or one folder of
photographs per camera. The moment is the last number in an image's name, or else the whole name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from packetmesh.errors import InputError
from packetmesh.files import read_json
from pipeline.calibration.board import TAG_SPACING, Board
from pipeline.calibration.series import camera_series, same_moments
from pipeline.config import Pattern
from pipeline.types import AnyPath

ENDINGS = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".tif", ".tiff")
MOST_CAMERAS = 6
BOARD_FILE = "board.json"
INFRARED = "/infrared"
"""Suffix of a node's name for its separate depth camera."""
_LAST_NUMBER = re.compile(r"(\d+)\D*$")


@dataclass(frozen=True, slots=True)
class Shot:
    """Images of one node at one moment."""

    moment: str
    color: Path
    depth: Path | None = None
    """16-bit image on the pixel grid of ``infrared`` if there is one, else of ``color``."""
    infrared: Path | None = None
    """Image of a separate depth camera."""


@dataclass(frozen=True, slots=True)
class NodeShots:
    """The images of one node."""

    name: str
    """node_00 and so on."""
    folder: Path
    shots: tuple[Shot, ...]
    """Shots in the order of their moments."""


def node_shots(folders: Sequence[AnyPath]) -> tuple[NodeShots, ...]:
    """List the images of every node of a session.

    Args:
        folders: one that contains node_00, node_01 and so on, or one per camera.

    Raises:
        InputError: a path is no folder, a folder is repeated or has no images, there are too many nodes, or
            two images of a node are of one moment.
    """
    paths = [Path(folder) for folder in folders]
    for path in paths:
        if not path.is_dir():
            raise InputError(
                f"{path} is no folder; several cameras take a folder each, or one with node_00, node_01"
            )
    if len(paths) == 1:
        paths = node_folders(paths[0]) or paths
    if len({path.resolve() for path in paths}) < len(paths):
        raise InputError("A folder is given twice; give each camera's own")
    if len(paths) > MOST_CAMERAS:
        raise InputError(
            f"{len(paths)} folders of images are given; a rig has at most {MOST_CAMERAS} cameras"
        )
    named = all(path.name.startswith("node_") for path in paths) and len(
        {path.name for path in paths}
    ) == len(paths)
    return tuple(
        NodeShots(path.name if named else f"node_{index:02d}", path, _shots(path))
        for index, path in enumerate(paths)
    )


def series_shots(files: Sequence[Path]) -> tuple[NodeShots, ...]:
    """Group the images of one folder by the cameras in their names: node_00 and so on, in the order of the
    cameras' names.

    The moment is the last number of a name. If a camera has the same last number twice, as in
    left-1700000000.250.png, it is the whole name without the camera's part.

    Raises:
        InputError: the names distinguish no cameras, an image is of none of them, there are too many cameras,
            or two images of a camera are of one moment.
    """
    series = camera_series(files) or same_moments(files)
    if not series:
        raise InputError(
            f"The names of the images ({files[0].name} and so on) do not tell cameras apart; name them as "
            "left-0000.png and right-0000.png or cam0_00.png and cam1_00.png, or give a folder for each "
            "camera"
        )
    others = set(files).difference(*series.values())
    if others:
        raise InputError(
            f"The name of {min(others).name} does not tell its camera, as the others' do "
            f"({' and '.join(series)}); rename it, or leave it out with a pattern in quotes"
        )
    if len(series) > MOST_CAMERAS:
        raise InputError(f"The images are of {len(series)} cameras, and a rig has at most {MOST_CAMERAS}")
    numbered = all(len(set(map(moment_of, paths.values()))) == len(paths) for paths in series.values())
    return tuple(
        NodeShots(
            f"node_{index:02d}",
            next(iter(paths)).parent,
            tuple(Shot(moment, path) for moment, path in _by_moment(paths, numbered).items()),
        )
        for index, paths in enumerate(series.values())
    )


def camera_images(nodes: Iterable[NodeShots]) -> dict[str, dict[Path, str]]:
    """Return the moments of images by camera: node_00 and, for a separate depth camera, node_00/infrared."""
    found: dict[str, dict[Path, str]] = {}
    for node in nodes:
        found[node.name] = {shot.color: shot.moment for shot in node.shots}
        infrared = {shot.infrared: shot.moment for shot in node.shots if shot.infrared is not None}
        if infrared:
            found[node.name + INFRARED] = infrared
    return found


def node_folders(folder: Path) -> list[Path]:
    """List node_00, node_01 and so on in a session's folder; empty for a folder of photographs."""
    return sorted(one for one in folder.glob("node_*") if one.is_dir())


def board_beside(
    images: Sequence[AnyPath],
    pattern: Pattern | None = None,
    columns: int | None = None,
    rows: int | None = None,
    spacing_mm: float | None = None,
    dictionary: str | None = None,
    tag_spacing: float | None = None,
) -> Board:
    """Return the board in images: the given values, else those of a board.json, else the thesis's.

    The file is searched next to a given image, and in and directly above a given folder. A dictionary in it
    is used only for its own pattern.

    Raises:
        InputError: the file is unreadable or lacks pattern, columns, rows or spacing_mm, or the board is
            impossible.
    """
    known = Board()
    for path in (one / BOARD_FILE for word in images for one in (Path(word), Path(word).parent)):
        if path.is_file():
            known = read_board(path)
            break
    if dictionary is None:
        dictionary = known.dictionary if pattern in (None, known.pattern) else ""
    return Board(
        pattern or known.pattern,
        known.columns if columns is None else columns,
        known.rows if rows is None else rows,
        known.spacing_m if spacing_mm is None else spacing_mm / 1000.0,
        dictionary,
        known.tag_spacing if tag_spacing is None else tag_spacing,
    )


def read_board(path: AnyPath) -> Board:
    """Read the board from a file.

    Raises:
        InputError: the file is unreadable or lacks pattern, columns, rows or spacing_mm, or the board is
            impossible.
    """
    values = read_json(path, "board file")
    try:
        pattern, columns, rows = str(values["pattern"]), int(values["columns"]), int(values["rows"])
        spacing_m = float(values["spacing_mm"]) / 1000.0
        dictionary = str(values.get("dictionary", ""))
        tag_spacing = float(values.get("tag_spacing", TAG_SPACING))
    except (ValueError, KeyError, TypeError, OverflowError):
        raise InputError(
            f"The board file {path} lacks a valid pattern, columns, rows or spacing_mm, or its tag_spacing "
            "is no number; correct it"
        ) from None
    try:
        return Board(cast(Pattern, pattern), columns, rows, spacing_m, dictionary, tag_spacing)
    except InputError as error:
        raise InputError(f"The board file {path} describes an impossible board: {error}") from None


def photographs(folder: Path) -> list[Path]:
    """Return the colour images in a folder, by name, without depth_00.png or infrared_00.png."""
    return [path for path in _images(folder) if path.stem.partition("_")[0] not in ("depth", "infrared")]


def _images(folder: Path) -> list[Path]:
    """Return the image files in a folder; macOS adds hidden files with names such as ._color_00.png."""
    return sorted(
        path for path in folder.iterdir() if path.suffix.lower() in ENDINGS and not path.name.startswith(".")
    )


def _shots(folder: Path) -> tuple[Shot, ...]:
    color = _by_moment({path: path.stem for path in photographs(folder)})
    if not color:
        raise InputError(f"{folder} holds no image of a camera; try color_00.png, color_01.png and so on")
    depth, infrared = (
        _by_moment({path: path.stem for path in _images(folder) if path.stem.startswith(f"{kind}_")})
        for kind in ("depth", "infrared")
    )
    return tuple(
        Shot(moment, path, depth.get(moment), infrared.get(moment)) for moment, path in color.items()
    )


def _by_moment(images: Mapping[Path, str], numbered: bool = True) -> dict[str, Path]:
    """Return images by moment: the last number in each name if ``numbered``, else the whole name.

    Raises:
        InputError: two images are of one moment.
    """
    found: dict[str, Path] = {}
    for path, stem in images.items():
        moment = moment_of(stem) if numbered else stem
        if moment in found:
            raise InputError(
                f"{found[moment]} and {path.name} are both of moment {moment}; give each camera's images a "
                "folder of its own, numbered by moments"
            )
        found[moment] = path
    return found


def moment_of(stem: str) -> str:
    """Return an image's moment: the last number in its name without leading zeros, or else the name."""
    number = _LAST_NUMBER.search(stem)
    return stem if number is None else number[1].lstrip("0") or "0"
