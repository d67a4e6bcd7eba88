"""``python -m lab.walks --room SEED --frames N --out DIR``: render a walk as a TUM sequence."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from lab.walks.walk import kinect, render_walk
from lab.worlds.demos import DEMOS, build_demo
from lab.worlds.rooms import random_room
from packetmesh.errors import InputError


def main() -> None:
    """Render one walk, which takes about 0.1 s per frame at 320 px, and 0.4 s at 640 px."""
    parser = argparse.ArgumentParser(prog="python -m lab.walks", description=__doc__)
    place = parser.add_mutually_exclusive_group(required=True)
    place.add_argument("--room", type=int, metavar="SEED", help="a random room")
    place.add_argument("--scene", choices=sorted(DEMOS), help="a demo scene; its room must be closed")
    parser.add_argument("--frames", type=int, required=True, help="number of frames, 30 a second")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    parser.add_argument("--width", type=int, default=320, help="width of the images in pixels, 4:3")
    parser.add_argument("--seed", type=int, default=0, help="seed of path, light, film and sensor")
    options = parser.parse_args()
    try:
        scene = random_room(options.room) if options.scene is None else build_demo(options.scene)
        render_walk(scene, options.frames, kinect(options.width), options.out, options.seed)
    except InputError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
