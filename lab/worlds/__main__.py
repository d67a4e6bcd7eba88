"""Renders the demo rigs in assets/scenes again: ``python -m lab.worlds [NAME ...]``."""

from __future__ import annotations

import sys

from lab.worlds.demos import DEMOS, render_demo
from pipeline.io.demos import SCENES
from pipeline.io.rigs import save_rig


def main(names: list[str]) -> None:
    """Write the rigs of the demos named, or of all, with their truth."""
    for name in names or DEMOS:
        rig = render_demo(name)
        save_rig(SCENES / name, rig)
        shares = ", ".join(f"{frame.depth.coverage:.0%}" for frame in rig.frames)
        print(f"{name}: sensor depth covers {shares}")


if __name__ == "__main__":
    main(sys.argv[1:])
