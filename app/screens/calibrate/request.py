"""Board photographs as inputs of the pipeline, and the command line for them."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

from app.compute.state import BoardViews
from pipeline.calibration.board import Board
from pipeline.calibration.shots import BOARD_FILE, NodeShots, camera_images, node_shots, read_board
from pipeline.io.demos import DEMO_SCENES, SCENES, board_views_of
from pipeline.sources import Calibrated, Demo, RigFolder, Source

TRUTH = "truth.json"
FOLDS = 4
"""Number of folds in which views, or moments of several cameras, are held out."""


def views_in(folder: Path) -> BoardViews:
    """Return the photographs in a folder, with the board of its board.json, or else the thesis's board.

    Raises:
        InputError: board.json describes no board.
    """
    path = folder / BOARD_FILE
    board = read_board(path) if path.exists() else Board()
    size = board.columns, board.rows, board.spacing_m
    return BoardViews(str(folder), 0, board.pattern, *size, board.dictionary, board.tag_spacing)


def board_of(views: BoardViews) -> Board:
    """Return the photographed board."""
    size = views.columns, views.rows, views.spacing_m
    return Board(views.pattern, *size, views.dictionary, views.tag_spacing)


def shots_of(views: BoardViews) -> tuple[NodeShots, ...]:
    """Return the images of every node.

    Raises:
        InputError: there are none, too many nodes, or two images of one moment.
    """
    return node_shots([views.folder])


def several(views: BoardViews) -> bool:
    """Whether the photographs are from more than one camera."""
    return len(camera_images(shots_of(views))) > 1


def true_parameters(views: BoardViews, camera: str) -> dict[str, float]:
    """Return fx, fy, cx, cy, k1 and so on of a rendered camera; empty for real ones."""
    try:
        record = json.loads(Path(views.folder, TRUTH).read_text(encoding="utf-8"))
        true = record["cameras"][camera]
        places = {name: float(true[name]) for name in ("fx", "fy", "cx", "cy")}
        lens = zip(("k1", "k2", "p1", "p2", "k3"), true["distortion"], strict=False)
        return places | {name: float(value) for name, value in lens}
    except (OSError, KeyError, TypeError, ValueError):
        return {}


def calibrate_command(views: BoardViews, source: Source) -> str:
    """Return the command line that calibrates the same cameras; several get poses in the world frame of the
    scene's rig, if it is a folder with poses.
    """
    board, nodes = board_of(views), shots_of(views)
    folder = views.folder if len(nodes) > 1 else str(nodes[0].folder)
    words = ["packetmesh", "calibrate", folder, "--pattern", board.pattern]
    words += ["--columns", str(board.columns), "--rows", str(board.rows)]
    words += ["--spacing-mm", f"{1000.0 * board.spacing_m:g}", "--lens", views.lens, "--held-out", str(FOLDS)]
    if board.dictionary:
        words += ["--dictionary", board.dictionary]
    if board.pattern == "aprilgrid":
        words += ["--tag-spacing", f"{board.tag_spacing:g}"]
    if views.bent:
        words.append("--board-warp")
    images = camera_images(nodes)
    names = {
        (camera, moment): f"{camera}/{path.name}" if len(images) > 1 else path.name
        for camera, moments in images.items()
        for path, moment in moments.items()
    }
    if views.dropped:
        words += ["--without", *(names[one] for one in views.dropped if one in names)]
    if len(images) > 1 and (rig := _folder(source)) and (rig / nodes[0].name / "pose.txt").exists():
        words += ["--like", str(rig)]
    return shlex.join([*words, "--out", "runs/calibration"])


def _folder(source: Source) -> Path | None:
    """Return the folder of a scene's rig; None if it is no rig on disk."""
    if isinstance(source, Demo):
        return SCENES / source.name
    return Path(source.path) if isinstance(source, RigFolder) else None


def inner(source: Source) -> Source:
    """Return a source without the calibration laid over it."""
    return source.source if isinstance(source, Calibrated) else source


def with_boards() -> list[str]:
    """Return the demo scenes that have views of a board."""
    return [name for name in DEMO_SCENES if board_views_of(name) is not None]
