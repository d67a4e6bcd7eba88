"""Real gain of a suggested camera: it is rendered, added to its rig, and the rig reconstructed again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from pipeline.planning.promise import measured_share
from pipeline.reconstruct import Reconstruction, reconstruct
from pipeline.stages import cameras_of
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, RgbdFrame, Rig


@dataclass(frozen=True, slots=True)
class Outcome:
    """Real gain of a camera after it was rendered and added to the rig."""

    gain_share: float
    """Share of the earlier cameras' rays that meet measured surface now and did not before."""
    placed: bool
    """Whether registration found the camera's pose."""


def frame_at(
    scene: Scene,
    renderer: Renderer,
    camera: CameraIntrinsics,
    name: str,
    T_world_camera: FloatArray,
    seed: int,
) -> RgbdFrame:
    """Return what a Kinect at this pose would send of a scene, its depth in whole millimetres."""
    rng = np.random.default_rng([seed, 4242])
    view = renderer.view(camera, T_world_camera, "fast", rng)
    sensed = sense_depth(view, camera, rng)
    depth = DepthMap((np.rint(1000.0 * sensed.z_m) / 1000.0).astype(np.float32))
    return RgbdFrame(name, view.rgb, depth, camera, T_world_camera)


def outcome(
    scene: Scene, renderer: Renderer, base: Reconstruction, T_world_camera: FloatArray, seed: int
) -> Outcome:
    """Add a rendered camera to a rig, reconstruct again, and compare on the rays of the earlier cameras."""
    rig = base.rig
    name = f"node_{len(rig.frames):02d}"
    frame = frame_at(scene, renderer, scene.intrinsics, name, T_world_camera, seed)
    larger = Rig(rig.name, (*rig.frames, frame))
    after = reconstruct(larger)
    before_share = measured_share(base, cameras_of(base.rig, base.placement))
    earlier = [
        k for k in range(len(rig.frames)) if after.placement.placed(range(len(larger.frames))).count(k)
    ]
    cameras = cameras_of(larger, after.placement)[: len(earlier)]
    placed = len(rig.frames) in after.placement.placed(range(len(larger.frames)))
    return Outcome(measured_share(after, cameras) - before_share, placed)
