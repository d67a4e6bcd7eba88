"""The job that adds a planned camera to a demo room: rendered from there, reconstructed, and compared."""

from __future__ import annotations

import zlib
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.compute.seen_places import place_of
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.network.planning.planned import promise_view
from app.screens.network.planning.view import Pose, TakenView
from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.io.demos import DEMO_SCENES
from pipeline.io.rigs import save_rig
from pipeline.planning.chances import judge
from pipeline.planning.promise import measured_share, promise
from pipeline.planning.sensors import sensor_named
from pipeline.reconstruct import iterate_reconstruction
from pipeline.sources import RigFolder
from pipeline.stages import cameras_of
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, RgbdFrame, Rig, RigTruth


def take_job(
    store: Store, spec: Spec, demo: str, sensor: str, pose: Pose, folder: str
) -> Generator[Progress, None, TakenView]:
    """Render a camera of a demo room, add it to the rig, and reconstruct with it.

    The promise is that of this camera alone, beyond the present ones; the real gain is counted on the rays
    of the present cameras, too, at the poses that registration finds with the new one.

    Args:
        store: store of the results.
        spec: the room, perhaps with cameras that were added before.
        demo: name of the demo room.
        sensor: name of the camera's sensor.
        pose: where it stands.
        folder: folder for the rig with the new camera; it must not exist.

    Raises:
        PacketMeshError: the larger rig cannot be reconstructed.
    """
    place = yield from part(place_of(store, spec), "the present cameras", 0.0, 0.1, detail=True)
    base, T = place.done, np.reshape(pose, (4, 4))
    new = sensor_named(sensor, base.rig)
    promised = promise(judge(place.seen, T, new).chance, place.seen.targets)
    yield Progress("rendering the room", 0.1)
    larger = with_camera(base.rig, demo, new.intrinsics, T)
    save_rig(folder, larger)
    source = RigFolder(folder)
    steps = iterate_reconstruction(replace(spec, source=source), store)
    after = yield from part(steps, "with the new camera", 0.3, 0.95, detail=True)
    yield Progress("counting rays", 0.95)
    before_share = measured_share(base, cameras_of(base.rig, base.placement))
    placed = after.placement.placed(range(len(larger.frames)))
    earlier = sum(row < len(base.rig.frames) for row in placed)
    cameras = cameras_of(after.rig, after.placement)[:earlier]
    real_share = measured_share(after, cameras) - before_share
    return TakenView(source, promise_view(promised), real_share, len(base.rig.frames) in placed)


def with_camera(rig: Rig, demo: str, lens: CameraIntrinsics, T_world_camera: FloatArray) -> Rig:
    """Return the rig of a demo room with one more camera, rendered as the room's own cameras are.

    Raises:
        InputError: the rig has no truth.
    """
    from lab.worlds.demos import build_demo  # here, so that other jobs' processes do not load the rooms
    from lab.worlds.render import Renderer
    from lab.worlds.sensor import sense_depth

    if rig.truth is None:
        raise InputError(f"The rig {rig.name} has no truth; take a camera in a demo room")
    scene = build_demo(demo)
    renderer = Renderer(scene, threads=1)
    rng = np.random.default_rng([DEMO_SCENES[demo].seed, zlib.crc32(T_world_camera.tobytes())])
    view = renderer.view(lens, T_world_camera, "photo", rng)
    name = f"node_{len(rig.frames):02d}"
    frame = RgbdFrame(name, view.rgb, sense_depth(view, lens, rng), lens, T_world_camera)
    truth = rig.truth
    known = RigTruth(
        truth.vertices_m,
        truth.triangles,
        (*truth.T_world_camera, T_world_camera),
        (*truth.depth, DepthMap(renderer.depth(lens, T_world_camera))),
        (*truth.intrinsics, lens),
    )
    return Rig(Path(rig.name).name, (*rig.frames, frame), known)
