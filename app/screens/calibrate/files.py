"""Where the photographs of a board lie: ``BOARD/node_00/{color_00.png, depth_00.png}`` and so on, beside
``board.json`` and, where they were rendered, ``truth.json``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from app.state import BoardViews
from packetmesh.errors import InputError

ENDINGS = (".png", ".jpg", ".jpeg")
COLOR, DEPTH = "color_", "depth_"


def camera_files(folder: Path) -> dict[str, list[Path]]:
    """The photographs of each camera, by the names of the folders ``node_...``.

    Raises:
        InputError: there is none.
    """
    nodes = sorted(one for one in folder.glob("node_*") if one.is_dir())
    files = {
        node.name: [
            file
            for file in sorted(node.iterdir())
            if file.suffix.lower() in ENDINGS and not file.name.startswith(DEPTH)
        ]
        for node in nodes
    }
    files = {name: some for name, some in files.items() if some}
    if not files:
        raise InputError(
            f"There is no photograph in {folder.name}; try PNG or JPEG images of the board in folders node_00, "
            "node_01 and so on"
        )
    return files


def view_name(path: Path) -> str:
    """What a view is called: the number after ``color_``, or the file's name."""
    return path.stem.removeprefix(COLOR)


def depth_file(folder: Path, camera: str, view: str) -> Path | None:
    """The depth image of a view; None without one."""
    path = folder / camera / f"{DEPTH}{view}.png"
    return path if path.is_file() else None


def board_views(folder: Path) -> BoardViews:
    """The photographs in a folder, of the board that its board.json says, or else of the thesis's."""
    told = _told(folder / "board.json")
    try:
        return BoardViews(
            str(folder),
            0,
            told["pattern"],
            int(told["columns"]),
            int(told["rows"]),
            float(told["spacing_mm"]) / 1000.0,
        )
    except (KeyError, TypeError, ValueError):
        return BoardViews(str(folder))


def true_parameters(folder: Path, camera: str) -> dict[str, float]:
    """fx, fy, cx, cy, k1 and so on of a camera whose photographs were rendered; empty for real ones."""
    told = _told(folder / "truth.json")
    try:
        true = told["cameras"][camera]
        places = {name: float(true[name]) for name in ("fx", "fy", "cx", "cy")}
        lens = zip(("k1", "k2", "p1", "p2", "k3"), true["distortion"], strict=False)
        return places | {name: float(value) for name, value in lens}
    except (KeyError, TypeError, ValueError):
        return {}


def _told(path: Path) -> Any:
    """What a JSON file says; nothing if there is none or it is none."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
