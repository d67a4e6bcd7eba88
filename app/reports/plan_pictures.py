"""Pictures of what planned cameras would see, on the surface that the present ones know."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from app.drawing.colors import DELIVERED, INFERRED, LOSS
from pipeline.io.textures import Texture
from pipeline.kernels.geometry import apply, inverse, project, scaled
from pipeline.kernels.rays import Camera, camera_hits
from pipeline.planning.chances import judge
from pipeline.planning.plan import Plan
from pipeline.planning.seen import SeenPlace
from pipeline.surface.pictures import MeshPainter
from pipeline.types import ByteArray, FloatArray

WIDTH_PX = 560
TINT = 0.55
"""Weight of violet and red over the surface's own colour."""
MOST_GREEN = 0.85
"""Weight of green where a camera measures missing surface with certainty."""


def plan_pictures(seen: SeenPlace, plan: Plan, texture: Texture) -> Iterator[ByteArray]:
    """Yield an (H, W, 3) picture from each planned camera.

    Measured surface has the photographs' colours, guessed surface is violet, rays without a surface are
    red. What the camera would newly measure is green, the stronger the likelier; what an earlier camera of
    the plan probably measures is left out.
    """
    painter = MeshPainter(seen.surface)
    missed = np.ones(len(seen.targets.points_m))
    for planned in plan.cameras:
        lens = scaled(plan.sensor.intrinsics, WIDTH_PX / plan.sensor.intrinsics.width_px)
        camera = Camera(lens, planned.T_world_camera)
        chance = judge(seen, planned.T_world_camera, plan.sensor).chance
        rgb = _known(seen, painter, camera, texture)
        green = MOST_GREEN * _new_share(seen, camera, missed * chance)[..., None]
        missed *= 1.0 - chance
        yield np.rint((1.0 - green) * rgb + green * np.array(DELIVERED)).astype(np.uint8)


def _known(seen: SeenPlace, painter: MeshPainter, camera: Camera, texture: Texture) -> FloatArray:
    """Return the (H, W, 3) picture of the surface, tinted where it is guessed or missing."""
    rgb = painter.picture(camera, texture=texture).astype(float)
    triangle = camera_hits(seen.whole, camera)["primitive_ids"].numpy()
    hit = triangle < len(seen.guessed)
    guessed = hit.copy()
    guessed[hit] = seen.guessed[triangle[hit]]
    rgb[~hit] = 235.0
    for where, color in ((guessed, INFERRED), (~hit, LOSS)):
        rgb[where] = (1.0 - TINT) * rgb[where] + TINT * np.array(color)
    return rgb


def _new_share(seen: SeenPlace, camera: Camera, chance: FloatArray) -> FloatArray:
    """Return (H, W) chances that a pixel shows one of the targets and measures it.

    Each target is a disc as large as its part of the present camera's image is from here.
    """
    targets, lens = seen.targets, camera.intrinsics
    in_camera_m = apply(inverse(camera.T_world_camera), targets.points_m)
    rows = np.flatnonzero((chance > 0.0) & (in_camera_m[:, 2] > 0.0))
    rows = rows[np.argsort(chance[rows])]  # the likeliest last
    pixels = project(lens, in_camera_m[rows])
    present = [view.camera for view in seen.views]
    eyes_m = np.array([one.T_world_camera[:3, 3] for one in present])[targets.view[rows]]
    step_px = np.sqrt(targets.share * sum(view.meets.size for view in seen.views))
    side = step_px / np.array([one.intrinsics.fx_px for one in present])[targets.view[rows]]
    radii_m = 0.6 * side * np.linalg.norm(targets.points_m[rows] - eyes_m, axis=1)
    radii_px = np.maximum(1, np.rint(radii_m * lens.fx_px / in_camera_m[rows, 2]).astype(int))
    share = np.zeros((lens.height_px, lens.width_px), np.float32)
    for pixel, radius_px, row in zip(pixels, radii_px.tolist(), rows.tolist(), strict=True):
        cv2.circle(share, np.rint(pixel).astype(int).tolist(), radius_px, float(chance[row]), -1, cv2.LINE_AA)
    return np.clip(cv2.GaussianBlur(share, (0, 0), 1.2), 0.0, 1.0)
