"""``python -m lab.worlds [NAME ...]``: render the demo rigs in assets/scenes again."""

from __future__ import annotations

import sys

from lab.worlds.board_files import save_board_views
from lab.worlds.demos import DEMOS, render_demo, render_demo_boards
from packetmesh.errors import InputError
from pipeline.io.demos import BOARDS, SCENES
from pipeline.io.rigs import save_rig


def main(names: list[str]) -> None:
    """Write the rigs of the named demos, or of all if none is named, with their truth and board views."""
    try:
        for name in names or DEMOS:
            rig = render_demo(name)
            save_rig(SCENES / name, rig)
            if boards := render_demo_boards(name):
                save_board_views(SCENES / name / BOARDS, boards)
            shares = ", ".join(f"{frame.depth.coverage:.0%}" for frame in rig.frames)
            print(f"{name}: sensor depth covers {shares}")
    except InputError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(sys.argv[1:])
