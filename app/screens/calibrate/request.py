"""What is asked of the photographs of a board, in the terms of the pipeline."""

from __future__ import annotations

from app.state import BoardViews
from pipeline.calibration.board import Board


def board_of(views: BoardViews) -> Board:
    """What is photographed."""
    return Board(views.pattern, views.columns, views.rows, views.spacing_m)


def dropped_of(views: BoardViews, camera: str) -> tuple[str, ...]:
    """Names of the views of a camera that are left out."""
    return tuple(name for one, name in views.dropped if one == camera)
