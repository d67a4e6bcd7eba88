"""Renders the demo rigs in assets/scenes again: ``python -m assets.make_scenes [NAME ...]``."""

from __future__ import annotations

import sys
from pathlib import Path

from pipeline.io import save_rig
from pipeline.scenes.demos import DEMO_SCENES, render_demo


def main(names: list[str]) -> None:
    """Write the rigs of the demos named, or of all."""
    for name in names or DEMO_SCENES:
        rig = render_demo(name)
        save_rig(Path(__file__).parent / "scenes" / name, rig)
        shares = ", ".join(f"{frame.depth.coverage:.0%}" for frame in rig.frames)
        print(f"{name}: sensor depth covers {shares}")


if __name__ == "__main__":
    main(sys.argv[1:])
