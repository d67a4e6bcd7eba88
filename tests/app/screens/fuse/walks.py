"""A walk made by hand: a camera on a circle, whose tracking drifts, with a good and a wrong loop."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.types import CameraIntrinsics, Link, PointCloud, Walk

FRAMES, FRAME_S, LOST = 40, 0.1, (21, 22, 23)
KEYFRAMES = (0, 10, 20, 30, 39)
DRIFT_M = 0.002
"""Per frame, along the world's x."""
T_COLOR_DEPTH = rigid(rotation_exp(np.array([0.0, 0.0, 0.4])), np.array([0.05, -0.01, 0.02]))
CAMERA = CameraIntrinsics.pinhole(300.0, 300.0, 160.0, 120.0, 320, 240)
WRONG = rigid(rotation_exp(np.array([0.0, np.radians(5.0), 0.0])), np.array([0.0, 0.0, 0.3]))
"""By how much the wrong loop moves the source, in its own frame."""


def pose(frame):
    """(4, 4) final pose of the colour camera."""
    angle = 2.0 * np.pi * frame / FRAMES
    return rigid(rotation_exp(np.array([0.0, angle, 0.0])), np.array([np.sin(angle), 0.2, np.cos(angle)]))


def tracked(frame):
    """(4, 4) pose of the colour camera by tracking alone."""
    return rigid(np.eye(3), np.array([DRIFT_M * frame, 0.0, 0.0])) @ pose(frame)


def link(source, target, T_extra=None, **options):
    """A registration as the depth cameras see it: that of the final poses, with an error at the source."""
    T_color = inverse(pose(target)) @ pose(source) @ (np.eye(4) if T_extra is None else T_extra)
    T = inverse(T_COLOR_DEPTH) @ T_color @ T_COLOR_DEPTH
    return Link(source, target, T, np.eye(6), 0.6, 0.98, **options)


def walk(count=500, lost=LOST, loops=None, seed=0):
    """A walk whose map of ``count`` points was measured at random frames that are not lost."""
    rng = np.random.default_rng(seed)
    known = [k for k in range(FRAMES) if k not in lost]
    first = rng.choice(known[:-4] or known, count)
    points = PointCloud(rng.normal(size=(count, 3)), colors=rng.integers(0, 255, (count, 3), dtype=np.uint8))
    if loops is None:
        loops = (link(39, 0, loop=True), link(30, 10, WRONG, loop=True, used=False))
    return Walk(
        times_s=100.0 + FRAME_S * np.arange(FRAMES),
        T_world_camera=tuple(pose(k) if k in known else None for k in range(FRAMES)),
        keyframes=tuple(k for k in KEYFRAMES if k in known),
        links=(*(link(b, a) for a, b in pairwise(KEYFRAMES) if b in known), *loops),
        map=points,
        voxel_m=0.02,
        first_frames=first,
        T_world_tracked=tuple(tracked(k) if k in known else None for k in range(FRAMES)),
    )
