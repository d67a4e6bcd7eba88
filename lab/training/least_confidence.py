"""Effect of the least confidence for filled depth on the surface.

``python -m lab.training.least_confidence [ROOMS]`` reconstructs one view of each of 24 rooms of the
validation split with ``depth.least_confidence`` from 0 to 0.8 and prints medians over them: rays without a
surface, the F-score at 5 cm, and the share of the area more than 5 cm off the truth, much of which joins
objects to their background. Test rooms, demo scenes and real frames are not used.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from lab.training.dataset import FIRST_SEED, viewed_room
from lab.worlds.raycast import world_mesh
from lab.worlds.sensor import sense_depth
from pipeline.config import PRESETS
from pipeline.kernels.geometry import scaled
from pipeline.reconstruct import reconstruct
from pipeline.types import DepthMap, RgbdFrame, Rig, RigTruth

LEVELS = (0.0, 0.2, 0.35, 0.5, 0.65, 0.8)
WIDTH_PX = 640


def rig_of(seed: int) -> Rig:
    """Return one view of a room, with sensor depth and truth."""
    room = viewed_room(seed, None, threads=0, views=1)
    ((small, T_world_camera),) = room.cameras
    camera = scaled(small, WIDTH_PX / small.width_px)
    view = room.renderer.view(camera, T_world_camera, "fast", room.rng)
    frame = RgbdFrame("node_00", view.rgb, sense_depth(view, camera, room.rng), camera, T_world_camera)
    truth = RigTruth(*world_mesh(room.scene), (T_world_camera,), (DepthMap(view.z_m),), (camera,))
    return Rig(f"room-{seed}", (frame,), truth)


def measured(rig: Rig, level: float) -> tuple[float, ...]:
    """Return shares, 0 to 1: rays without a surface, F-score, area over 5 cm off, at a least confidence."""
    preset = PRESETS["packetmesh"]
    result = reconstruct(rig, replace(preset, depth=replace(preset.depth, least_confidence=level)))
    truth = result.truth_after
    assert truth is not None
    return (result.after.quality.no_hit_ray_share, truth["f_score_5cm"], 1.0 - truth["accuracy_5cm"])


def main() -> None:
    """Print a table with a line per level."""
    rooms = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    shares = np.array(
        [
            [measured(rig, level) for level in LEVELS]
            for rig in map(rig_of, range(FIRST_SEED["validation"], FIRST_SEED["validation"] + rooms))
        ]
    )
    print("at least | rays without a surface | F-score at 5 cm | area off by more than 5 cm (per cent)")
    for level, row in zip(LEVELS, 100.0 * np.median(shares, axis=0), strict=True):
        print(f"{level:.2f} | " + " | ".join(f"{value:.2f}" for value in row))


if __name__ == "__main__":
    main()
