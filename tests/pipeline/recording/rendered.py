"""A recording whose frames are rendered from a demo scene's mesh when they are requested."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from pipeline.importing.recorded import DepthView
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import inverse, look_at, pixel_rays, rigid, rotation_angle_rad, rotation_exp
from pipeline.kernels.rays import Camera, camera_hits, depth_of, triangle_scene
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, FloatArray, IntArray, RgbdFrame

CAMERA = CameraIntrinsics.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
"""A Kinect's field of view in a quarter of its pixels."""
NOISE = DepthNoise(s0_m=0.001, s1_m=0.0, p=0.0, q=0.0)
FRAMES_PER_S = 30.0
MIDDLE_M = np.array([2.35, 2.15, 0.8])
"""Middle of the living room, above its furniture."""


@dataclass(frozen=True)
class Rendered:
    """Frames of a mesh; has what ``recording.Recording`` has."""

    vertices_m: FloatArray
    triangles: IntArray
    T_true: Sequence[FloatArray]
    """(4, 4) poses of the colour camera in the world of the mesh."""
    noise_m: float = 0.0
    """Standard deviation of the depth, along the optical axis."""
    seed: int = 0
    T_color_depth: FloatArray | None = None
    """(4, 4) pose of the depth camera in the colour camera's frame; None if it is the same camera."""
    given: bool = False
    """Whether the recording comes with its poses."""
    blind: frozenset[int] = frozenset()
    """Frames without any depth."""
    name: str = "rendered"
    notes: tuple[str, ...] = ()

    @cached_property
    def times_s(self) -> FloatArray:
        return np.arange(len(self.T_true)) / FRAMES_PER_S

    @property
    def T_world_camera(self) -> tuple[FloatArray, ...] | None:
        return tuple(self.T_true) if self.given else None

    @property
    def T_true_depth(self) -> list[FloatArray]:
        """(4, 4) true poses of the depth camera."""
        return [T @ self._T_color_depth for T in self.T_true]

    def view(self, index: int) -> DepthView:
        z_m = self._depth(self.T_true[index] @ self._T_color_depth)
        if self.noise_m:
            rng = np.random.default_rng((self.seed, index))
            z_m = (z_m + self.noise_m * rng.standard_normal(z_m.shape)).astype(np.float32)
        if index in self.blind:
            z_m = np.full_like(z_m, np.nan)
        return DepthView(DepthMap(z_m), CAMERA, self._T_color_depth, NOISE)

    def frame(self, index: int) -> RgbdFrame:
        T = self.T_true[index]
        z_m = self._depth(T)
        points_m = (pixel_rays(CAMERA) * z_m[..., None]) @ T[:3, :3].T + T[:3, 3]
        rgb = color_at(points_m.reshape(-1, 3)).reshape(*z_m.shape, 3)
        return RgbdFrame(f"frame_{index:05d}", rgb, DepthMap(z_m), CAMERA, T, pose_known=self.given)

    @property
    def _T_color_depth(self) -> FloatArray:
        return np.eye(4) if self.T_color_depth is None else self.T_color_depth

    @cached_property
    def _scene(self) -> Any:
        return triangle_scene(self.vertices_m, self.triangles)

    def _depth(self, T_world_camera: FloatArray) -> FloatArray:
        return depth_of(camera_hits(self._scene, Camera(CAMERA, T_world_camera))).z_m


def color_at(points_m: FloatArray) -> np.ndarray:
    """Return (N, 3) uint8 colours of (N, 3) world points: 50 levels a metre along each axis, 0 if unknown."""
    return np.clip(np.nan_to_num(50.0 * points_m), 0.0, 255.0).astype(np.uint8)


@cache
def living_room() -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of a room of 4.7 x 4.3 m with furniture."""
    truth = load_demo("living-room").truth
    assert truth is not None
    return truth.vertices_m, truth.triangles


def in_the_living_room(T_true: Sequence[FloatArray], **options: Any) -> Rendered:
    return Rendered(*living_room(), T_true, **options)


def around(count: int, radius_m: float = 0.3, turn_m: float = 0.5) -> list[FloatArray]:
    """Poses along a closed path in a corner of the room, which look at the middle and around it."""
    poses = []
    for angle in 2.0 * np.pi * np.arange(count) / count:
        circle = np.array([np.cos(angle) - 1.0, np.sin(angle), 0.3 * np.sin(2.0 * angle)])
        swing = np.array([np.sin(angle), np.cos(angle) - 1.0, 0.2 * np.sin(angle)])
        poses.append(look_at([1.0, 1.5, 1.5] + radius_m * circle, MIDDLE_M + turn_m * swing))
    return poses


def errors(poses: Sequence[FloatArray | None], truth: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return (N,) metres and degrees between poses in the first frame's camera and the true ones.

    NaN where there is no pose; the first frame must have one.
    """
    shifts_m, turns_deg = np.full(len(poses), np.nan), np.full(len(poses), np.nan)
    for k, T in enumerate(poses):
        if T is not None:
            apart = inverse(inverse(truth[0]) @ truth[k]) @ T
            shifts_m[k] = np.linalg.norm(apart[:3, 3])
            turns_deg[k] = np.degrees(rotation_angle_rad(apart[:3, :3]))
    return shifts_m, turns_deg


def moved(axis: Sequence[float], angle_deg: float, shift_m: Sequence[float]) -> FloatArray:
    """Return the (4, 4) motion that turns about an axis and then shifts."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    return rigid(rotation_exp(np.radians(angle_deg) * unit), np.asarray(shift_m, float))
