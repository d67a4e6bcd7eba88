"""Demos in assets: rendered rigs with ground truth and walks of one camera, each described by a file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.types import AnyPath, Rig

SCENES = Path(__file__).resolve().parents[2] / "assets" / "scenes"
RECORDINGS = SCENES.with_name("recordings")
TRUE_PATH = "truth.txt"
"""File of a walk's true poses; with TUM's name, groundtruth.txt, they would be read as known poses."""
BOARDS = "board"
"""Folder with board images, in scenes whose nodes need calibration."""


@dataclass(frozen=True, slots=True)
class DemoScene:
    """A demo scene that comes with PacketMesh."""

    title: str
    """Displayed name."""
    description: str
    seed: int
    """Seed, together with the name, of its sensor noise and of its nodes' pose errors; of a walk, seed of
    path, film and sensor."""


def _described(folder: Path) -> dict[str, DemoScene]:
    scenes = {
        path.parent.name: DemoScene(**json.loads(path.read_text(encoding="utf-8")))
        for path in folder.glob("*/scene.json")
    }
    return dict(sorted(scenes.items(), key=lambda item: (item[0] != "living-room", item[0])))


DEMO_SCENES: dict[str, DemoScene] = _described(SCENES)
"""Demo scenes by name; the first, the living room, is opened at the start."""
DEMO_WALKS: dict[str, DemoScene] = _described(RECORDINGS)
"""Demo recordings of a walking camera by name."""
DEMOS: dict[str, DemoScene] = DEMO_SCENES | DEMO_WALKS
"""All demos by name, in the order in which they are offered."""


def board_views_of(scene: str) -> Path | None:
    """Return the folder with a demo's board images, for calibrating its nodes; None if there is none.

    It contains node_00/{color_00.jpg, depth_00.png, ...}, node_01/..., board.json and truth.json; images
    with the same number were taken at the same time.

    >>> import packetmesh as pm
    >>> (pm.board_views_of("uncalibrated") / "node_00" / "color_00.jpg").is_file()
    True
    """
    folder = SCENES / scene / BOARDS
    return folder if scene in DEMO_SCENES and folder.is_dir() else None


CALIBRATED_SCENES = tuple(name for name in DEMO_SCENES if board_views_of(name) is None)
"""Scenes whose intrinsics and depth are correct, used for claims and benchmarks."""


def load_demo(name: str, calibration: AnyPath | None = None) -> Rig:
    """Load the rig of a demo with its truth: the scene's mesh, the nodes' poses and hole-free depth.

    Args:
        name: a key of ``DEMO_SCENES``.
        calibration: a folder whose files replace the rig's own, as in ``load_rig``.

    Raises:
        InputError: the demo or its files do not exist, or the calibration is for another rig.

    >>> import packetmesh as pm
    >>> rig = pm.load_demo("office")
    >>> len(rig.frames), rig.truth.T_world_camera[0].shape
    (3, (4, 4))
    """
    if name in DEMO_WALKS:
        raise InputError(
            f"The demo {name!r} is a recording, not a rig; try `packetmesh reconstruct --scene {name}`"
        )
    if name not in DEMO_SCENES:
        raise InputError(f"There is no demo scene {name!r}; try one of {', '.join(DEMOS)}")
    from pipeline.io.rigs import load_rig  # imports large libraries, which listing the scenes does not need

    return load_rig(SCENES / name, calibration)
