"""What is asked of the photographs of a board, in the terms of the pipeline."""

from __future__ import annotations

import json
from pathlib import Path

from app.state import BoardViews
from pipeline.calibration.board import Board
from pipeline.calibration.shots import BOARD_FILE, NodeShots, node_shots, read_board

TRUTH = "truth.json"


def views_in(folder: Path) -> BoardViews:
    """The photographs in a folder, of the board that its board.json says, or else of the thesis's.

    Raises:
        InputError: the file says something else.
    """
    path = folder / BOARD_FILE
    board = read_board(path) if path.exists() else Board()
    return BoardViews(str(folder), 0, board.pattern, board.columns, board.rows, board.spacing_m)


def board_of(views: BoardViews) -> Board:
    """What is photographed."""
    return Board(views.pattern, views.columns, views.rows, views.spacing_m)


def shots_of(views: BoardViews) -> tuple[NodeShots, ...]:
    """The images of every camera.

    Raises:
        InputError: there are none.
    """
    return node_shots([views.folder])


def true_parameters(views: BoardViews, camera: str) -> dict[str, float]:
    """fx, fy, cx, cy, k1 and so on of a camera whose photographs were rendered; empty for real ones."""
    try:
        told = json.loads(Path(views.folder, TRUTH).read_text(encoding="utf-8"))
        true = told["cameras"][camera]
        places = {name: float(true[name]) for name in ("fx", "fy", "cx", "cy")}
        lens = zip(("k1", "k2", "p1", "p2", "k3"), true["distortion"], strict=False)
        return places | {name: float(value) for name, value in lens}
    except (OSError, KeyError, TypeError, ValueError):
        return {}
