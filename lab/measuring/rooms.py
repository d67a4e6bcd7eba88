"""Rendered rooms that two cameras with imperfect calibrations see, reconstructed and ready to be measured.

The constants of the record in docs/results were fitted on the rooms of the seeds 7,900,000 to 7,900,067,
whose furniture is drawn from the same stock as that of the judged rooms (``pieces.from_stock``). Rooms from
``TUNING`` up have a stock of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lab.places.views import two_poses
from lab.worlds.demos import disturbed
from lab.worlds.render import Renderer
from lab.worlds.rooms import random_room
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PRESETS
from pipeline.kernels import geometry
from pipeline.measuring.surface import MeasuredSurface, surface_of_rig
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import run
from pipeline.types import CameraIntrinsics, FloatArray, RgbdFrame, Rig

TUNING, HELD_OUT = 8_000_000, 7_000_000
"""First seed of the rooms whose errors choose constants, and of the rooms that only judge them; in different
millions, so that they share no piece of furniture."""
OVERLAP = 0.5
"""Overlap of the two views (see ``OverlapMeter.share``)."""
FOCAL_SD = 0.003
"""Relative standard deviation of the focal lengths' errors, which the calibration also states (SPEC 1.4)."""
POINTS = 20_000
"""Largest number of points of the fused cloud; few, to be quick."""


@dataclass(frozen=True, slots=True)
class TrueView:
    """The true camera, its true pose, and what it sees from there."""

    camera: CameraIntrinsics
    T_world_camera: FloatArray
    z_m: FloatArray
    """(H, W) true depth."""
    normals: FloatArray
    """(H, W, 3) true shading normals, world frame, towards the camera; they are bent at bevelled edges."""

    def points_m(self) -> FloatArray:
        """Return (H, W, 3) true points, world frame."""
        return geometry.apply(self.T_world_camera, geometry.pixel_rays(self.camera) * self.z_m[..., None])


@dataclass(frozen=True, slots=True)
class Room:
    """A reconstructed room with its truth; the first camera's pose is right, so both share one world."""

    seed: int
    frames: tuple[RgbdFrame, ...]
    T_world_camera: tuple[FloatArray, ...]
    """(4, 4) poses that the chain found."""
    surface: MeasuredSurface
    true: tuple[TrueView, ...]
    scene: Scene


def measured_room(seed: int) -> Room | None:
    """Render and reconstruct the room of a seed.

    Returns None if the room is too full for a camera or no two views have the overlap, or if the chain fails
    or does not place a camera. The believed focal lengths are wrong by ``FOCAL_SD`` (every camera by its own
    error), and the second pose by 3 degrees and 6 cm before registration.
    """
    rng = np.random.default_rng([seed, 23])
    try:
        scene = random_room(seed)
        renderer = Renderer(scene, threads=1)
        poses = two_poses(scene, scene.intrinsics, OVERLAP, rng, renderer)
    except InputError:
        return None
    if poses is None:
        return None
    frames, true = [], []
    for index, T in enumerate((poses.target, poses.source)):
        view = renderer.view(scene.intrinsics, T, "fast", rng)
        sensed = sense_depth(view, scene.intrinsics, rng)
        matrix = scene.intrinsics.matrix.copy()
        matrix[[0, 1], [0, 1]] *= 1.0 + rng.normal(0.0, FOCAL_SD)
        believed = replace(scene.intrinsics, matrix=matrix)
        pose = T if index == 0 else disturbed(T, rng)
        frames.append(RgbdFrame(f"node_{index:02d}", view.rgb, sensed, believed, pose, scale_sd=FOCAL_SD))
        true.append(TrueView(scene.intrinsics, T, view.z_m.astype(np.float64), view.normals))
    config = with_settings(PRESETS["packetmesh"], [f"surface.max_points={POINTS}"])
    rig = Rig(f"room-{seed}", tuple(frames))
    try:
        done = drain(run(Spec(LoadedRig(rig), config=config), stages=("nodes", "placement", "after")))
    except (InputError, ReconstructionError):
        return None
    placement = done["placement"].value
    if not all(verdict.placed for verdict in placement.verdicts):
        return None
    surface = surface_of_rig(rig, done["nodes"].value, placement, done["after"].value)
    return Room(seed, rig.frames, placement.T_world_camera, surface, tuple(true), scene)
