"""The demo scenes that ship in assets/scenes: rendered rigs with their truth, each described by a file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.types import AnyPath, Rig

SCENES = Path(__file__).resolve().parents[2] / "assets" / "scenes"
BOARDS = "board"
"""Folder of a scene whose nodes need calibration: what they see of a board."""


@dataclass(frozen=True, slots=True)
class DemoScene:
    """A place that ships."""

    title: str
    """Its name on a screen."""
    description: str
    seed: int
    """Of its sensor noise and of its nodes' pose errors, together with its name."""


def _described() -> dict[str, DemoScene]:
    scenes = {
        path.parent.name: DemoScene(**json.loads(path.read_text(encoding="utf-8")))
        for path in SCENES.glob("*/scene.json")
    }
    return dict(sorted(scenes.items(), key=lambda item: (item[0] != "living-room", item[0])))


DEMO_SCENES: dict[str, DemoScene] = _described()
"""By name; the living room first, which opens by itself."""


def board_views_of(scene: str) -> Path | None:
    """The folder with views of a board by a demo's nodes, from which they can be calibrated; None without.

    It holds node_00/{color_00.jpg, depth_00.png, ...}, node_01/..., board.json and truth.json; images of
    the same number are of the same moment.

    >>> import packetmesh as pm
    >>> (pm.board_views_of("uncalibrated") / "node_00" / "color_00.jpg").is_file()
    True
    """
    folder = SCENES / scene / BOARDS
    return folder if scene in DEMO_SCENES and folder.is_dir() else None


CALIBRATED_SCENES = tuple(name for name in DEMO_SCENES if board_views_of(name) is None)
"""Those whose nodes' intrinsics and depth are right, on which claims and benchmarks are measured."""


def load_demo(name: str, calibration: AnyPath | None = None) -> Rig:
    """The shipped rig of a demo, with its truth: the scene's mesh, the nodes' poses and hole-free depth.

    Args:
        name: a key of ``DEMO_SCENES``.
        calibration: a folder that is laid over it, as ``load_rig`` does.

    Raises:
        InputError: there is no demo of that name, its files are missing, or the calibration is not its own.

    >>> import packetmesh as pm
    >>> rig = pm.load_demo("office")
    >>> len(rig.frames), rig.truth.T_world_camera[0].shape
    (3, (4, 4))
    """
    if name not in DEMO_SCENES:
        raise InputError(f"There is no demo scene {name!r}; try one of {', '.join(DEMO_SCENES)}")
    from pipeline.io.rigs import load_rig  # large libraries; a list of the scenes needs none

    return load_rig(SCENES / name, calibration)
