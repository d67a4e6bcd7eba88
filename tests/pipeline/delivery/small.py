"""A rig whose images are so small that a delivery takes seconds."""

from dataclasses import replace

import numpy as np

from network_sim.presets import PRESETS as NETWORKS
from packetmesh.settings import with_settings
from pipeline.config import PRESETS
from pipeline.delivery.sending import DeliverySpec
from pipeline.io.demos import load_demo
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, Rig, Walk

EVERY = 4
"""Of the pixels in each direction."""
CONFIG = with_settings(PRESETS["packetmesh"], ["surface.max_points=2500"])

TIMES_S = 1_000.0 + np.array([0.0, 0.25, 0.5, 2.0, 4.0])
"""Clock of a recording at its frames."""
KEYFRAMES, READY_S = (1, 2, 4), (0.25, 0.5, 4.0)
"""Its keyframes, and their times since its first frame."""


def small_rig(nodes=2, scene="office"):
    rig = load_demo(scene)
    frames = tuple(small_frame(frame) for frame in rig.frames[:nodes])
    truth = replace(
        rig.truth,
        T_world_camera=rig.truth.T_world_camera[:nodes],
        depth=tuple(thinned(depth) for depth in rig.truth.depth[:nodes]),
        intrinsics=tuple(frame.intrinsics for frame in frames),
    )
    return Rig(rig.name, frames, truth)


def walked(rig):
    """Three images as the keyframes of one camera that walks; it stood still before, and was lost once."""
    first, second, third = (frame.T_world_camera for frame in rig.frames)
    poses, nothing = (first, first, second, None, third), PointCloud(np.zeros((0, 3)))
    walk = Walk(TIMES_S, poses, KEYFRAMES, (), nothing, 0.01, np.zeros(0, int), poses)
    return replace(rig, truth=None, walk=walk)


def small_frame(frame):
    depth, camera = thinned(frame.depth), frame.intrinsics
    matrix = np.diag([1 / EVERY, 1 / EVERY, 1.0]) @ camera.matrix
    height, width = depth.z_m.shape
    rgb = np.ascontiguousarray(frame.rgb[::EVERY, ::EVERY])
    intrinsics = CameraIntrinsics(matrix, camera.distortion, width, height)
    return replace(frame, rgb=rgb, depth=depth, intrinsics=intrinsics)


def thinned(depth):
    return DepthMap(np.ascontiguousarray(depth.z_m[::EVERY, ::EVERY]), depth.kind)


def delivery_spec(rig, *network, coding="raw", moments=4, preset="office"):
    return DeliverySpec(
        Spec(LoadedRig(rig), config=CONFIG), with_settings(NETWORKS[preset], network), coding, moments
    )
