"""The path of a hand-held camera through a room: a closed curve in free space, a gaze and a hand's jitter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from lab.places.overlap import OverlapMeter
from lab.places.views import is_usable
from lab.worlds.raycast import RayCaster, world_mesh
from lab.worlds.scene import Rng, Scene
from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at, rigid, rotation_exp
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.types import CameraIntrinsics, FloatArray

RATE_HZ = 30.0
SPEED_M_S = 0.3
"""Largest speed of the path, without the jitter."""
TURN_DEG_S = 38.0
"""Largest speed of turning, without the jitter, which adds about 5 at most."""
HEIGHTS_M = (1.25, 1.65)
"""Heights of the waypoints above the floor; the curve and the jitter leave the range by less than 5 cm."""
CLEARANCE_M = 0.4
"""Least distance of every camera from furniture and walls."""
JITTER_M, JITTER_DEG = 0.005, 0.5
"""Root mean square length of the jitter's translation and rotation."""
JITTER_S = 0.14
"""Standard deviation of the window that smooths the jitter: after 0.2 s its correlation is 0.6."""
LARGEST_RADIUS_M = 2.0
"""Largest distance of a waypoint from the middle of the curve, level."""
TRIES = 300
"""Paths that are tried in a room."""
PITCHES_DEG = (-40.0, -8.0)
"""Range of the pitch of the gaze at the waypoints; negative is down."""
_PITCH_TRIES = 12
"""Pitches that are tried at a waypoint."""
_FULL_TURN_S = 9.9
"""A shorter walk turns there and back instead of once around."""
_SWEEP_SHARE = 0.42
"""Angle between the ends of the gaze's turn there and back, over the largest turn one way in that time."""
_FINE = 4000
"""Steps of a curve along which its time is summed."""


class NoWalkError(InputError):
    """A room is too full for a walk."""


class FreeSpace:
    """Clearances of the places in a room at which a hand can hold a camera.

    Args:
        scene: a closed room; parts[0] is its floor slab.
    """

    def __init__(self, scene: Scene) -> None:
        floor = scene.parts[0].vertices_m + scene.parts[0].T_world_part[:3, 3]
        self._surface = triangle_scene(*world_mesh(scene))
        self.floor_m = float(floor[:, 2].max())
        self.middle_m: FloatArray = 0.5 * (floor.min(axis=0) + floor.max(axis=0))[:2]
        """(2,) middle of the floor."""
        axes = [np.arange(floor[:, k].min(), floor[:, k].max(), 0.1) for k in range(2)]
        self.places_m: FloatArray = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        """(K, 2) places on a grid."""
        self.clear_m = self.clearances_m(self.places_m)
        """(K,) their clearances."""

    def distances_m(self, points_m: FloatArray) -> FloatArray:
        """Return (N,) distances of (N, 3) points to the nearest surface."""
        return self._surface.compute_distance(tensor(points_m, np.float32), nthreads=1).numpy()

    def clearances_m(self, places_m: FloatArray) -> FloatArray:
        """Return (N,) distances of (N, 2) places to the nearest surface, the least over a hand's heights."""
        heights_m = self.floor_m + np.linspace(*HEIGHTS_M, 4)
        return np.min([self.distances_m(np.insert(places_m, 2, z, axis=1)) for z in heights_m], axis=0)

    def reaches_m(self, center_m: FloatArray, angles_rad: FloatArray) -> FloatArray:
        """Return (N,) lengths of the free ways from a (2,) place in (N,) directions, less than 2 m."""
        lengths_m = np.arange(0.05, LARGEST_RADIUS_M, 0.05)
        ways = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
        places_m = center_m + lengths_m[:, None, None] * ways
        free = self.clearances_m(places_m.reshape(-1, 2)).reshape(places_m.shape[:2]) > CLEARANCE_M
        return 0.05 * np.cumprod(free, axis=0).sum(axis=0)


@dataclass(frozen=True, slots=True)
class _Curve:
    """Waypoints, equally spaced along the parameter 0 to 1; the last one is the first again."""

    center_m: FloatArray
    """(3,)."""
    offsets_m: FloatArray
    """(K, 3) positions relative to the centre."""
    gaze_rad: FloatArray
    """(K, 2) yaw and pitch; the last yaw may differ from the first by whole turns."""

    def at(self, u: FloatArray, size: float) -> tuple[FloatArray, FloatArray]:
        """Return (N, 3) positions and (N, 2) gaze at parameters (N,), the offsets multiplied by ``size``."""
        knots = np.linspace(0.0, 1.0, len(self.offsets_m))
        turn = np.outer(knots, self.gaze_rad[-1] - self.gaze_rad[0])
        offsets = CubicSpline(knots, self.offsets_m, bc_type="periodic")(u)
        level = self.gaze_rad - turn
        level[-1] = level[0]  # to the last bit
        swing = CubicSpline(knots, level, bc_type="periodic")(u)
        return self.center_m + size * offsets, swing + np.outer(u, self.gaze_rad[-1] - self.gaze_rad[0])

    def times_s(self, size: float) -> FloatArray:
        """Return (``_FINE`` + 1,) least times at which a camera reaches equally spaced parameters.

        The fourth root of a sum of fourth powers keeps both speeds below their limits without a kink.
        """
        positions_m, gaze_rad = self.at(np.linspace(0.0, 1.0, _FINE + 1), size)
        way_s = np.linalg.norm(np.diff(positions_m, axis=0), axis=1) / SPEED_M_S
        turn_s = np.linalg.norm(np.diff(gaze_rad, axis=0), axis=1) / np.radians(TURN_DEG_S)
        return np.concatenate([[0.0], np.cumsum((way_s**4 + turn_s**4) ** 0.25)])

    def size_in(self, duration_s: float) -> float:
        """Return the largest size, 0 to 1, that can be walked in this time; 0 if the gaze takes longer."""
        if self.times_s(1.0)[-1] <= duration_s:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(20):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.times_s(middle)[-1] <= duration_s else (low, middle)
        return low


def walk_poses(scene: Scene, camera: CameraIntrinsics, count: int, rng: Rng) -> list[FloatArray]:
    """Return T_world_camera of the frames of a walk that ends where it began.

    The camera walks around a place in the room, looking across it. If the time is too short for that, the
    loop is smaller, and the gaze turns there and back instead of once around; if it is long, there are
    several laps. All views pass ``is_usable``.

    Args:
        scene: a closed room.
        camera: camera of all frames.
        count: number of frames, ``RATE_HZ`` a second.
        rng: source of all randomness.

    Raises:
        NoWalkError: no path that was tried is free and has only usable views.
        InputError: ``count`` is not positive.
    """
    if count < 1:
        raise InputError(f"A walk of {count} frames is not possible; it has at least 1")
    space, meter = FreeSpace(scene), OverlapMeter(RayCaster(scene, threads=1), camera)
    duration_s = (count - 1) / RATE_HZ
    if space.clear_m.max() > CLEARANCE_M + 0.05:
        for _ in range(TRIES):
            curve = _random_curve(space, duration_s, rng)
            size = curve.size_in(duration_s)
            curve = _with_pitch(curve, size, min(1.0, duration_s / _FULL_TURN_S), meter, rng)
            size = min(size, curve.size_in(duration_s))
            if curve.times_s(size)[-1] > duration_s:  # the gaze alone takes longer
                continue
            poses = _handheld_poses(curve, size, count, rng)
            eyes_m = np.array([T[:3, 3] for T in poses])
            if space.distances_m(eyes_m).min() >= CLEARANCE_M and all(
                is_usable(meter.look(T)) for T in poses
            ):
                return poses
    raise NoWalkError(f"Scene '{scene.name}' leaves no room for a walk of {count} frames; take another seed.")


def _random_curve(space: FreeSpace, duration_s: float, rng: Rng) -> _Curve:
    """Return a curve around a free place, with a level gaze across it."""
    odds = np.maximum(space.clear_m - CLEARANCE_M - 0.02, 0.0) ** 2
    center_m = space.places_m[rng.choice(len(odds), p=odds / odds.sum())]
    knots = int(rng.integers(6, 9))
    around_rad = rng.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * np.arange(knots) / knots
    radii_m = space.reaches_m(center_m, around_rad)
    lap_s = 2.0 * np.pi * 0.8 * radii_m.mean() / SPEED_M_S
    laps = max(1, min(round(duration_s / max(lap_s, 0.1)), int(duration_s / _FULL_TURN_S)))
    around_rad = around_rad[0] + 2.0 * np.pi * np.arange(laps * knots + 1) / knots
    radii_m = np.resize(radii_m, laps * knots) * rng.uniform(0.65, 0.95, laps * knots)
    radii_m = np.append(radii_m, radii_m[0])
    heights_m = rng.normal(0.0, 0.06, laps * knots)
    height_m = rng.uniform(HEIGHTS_M[0] + 0.1, HEIGHTS_M[1] - 0.1)
    heights_m = np.clip(np.append(heights_m, heights_m[0]), *(np.array(HEIGHTS_M) - height_m))
    offsets_m = np.stack([radii_m * np.cos(around_rad), radii_m * np.sin(around_rad), heights_m], axis=1)
    offsets_m[-1] = offsets_m[0]  # to the last bit
    yaw_rad = around_rad + np.pi
    if duration_s < _FULL_TURN_S:
        sweep_rad = _SWEEP_SHARE * np.radians(TURN_DEG_S) * duration_s
        across_rad = np.arctan2(*(space.middle_m - center_m)[::-1]) + rng.normal(0.0, 0.8)
        yaw_rad = across_rad - 0.5 * sweep_rad * np.cos(around_rad - around_rad[0])
    gaze_rad = np.stack([yaw_rad, np.zeros_like(yaw_rad)], axis=1)
    return _Curve(np.append(center_m, space.floor_m + height_m), offsets_m, gaze_rad)


def _with_pitch(curve: _Curve, size: float, spread: float, meter: OverlapMeter, rng: Rng) -> _Curve:
    """Return the curve with random pitches, drawn again at each waypoint until its view is usable.

    After ``_PITCH_TRIES`` the last pitch is kept. ``spread``, 0 to 1, multiplies the pitches' variation.
    """
    base_deg = rng.uniform(-28.0, -16.0)
    gaze_rad = curve.gaze_rad.copy()
    for k, offset_m in enumerate(curve.offsets_m[:-1]):
        eye_m = curve.center_m + size * offset_m
        for spread_deg in np.linspace(2.0, 12.0, _PITCH_TRIES):
            gaze_rad[k, 1] = np.radians(np.clip(rng.normal(base_deg, spread * spread_deg), *PITCHES_DEG))
            if is_usable(meter.look(_looking(eye_m, gaze_rad[k]))):
                break
    gaze_rad[-1, 1] = gaze_rad[0, 1]
    return _Curve(curve.center_m, curve.offsets_m, gaze_rad)


def _handheld_poses(curve: _Curve, size: float, count: int, rng: Rng) -> list[FloatArray]:
    """Return T_world_camera of a curve's frames, equally spaced in time, with the hand's jitter."""
    times_s = curve.times_s(size)
    u = np.interp(np.linspace(0.0, times_s[-1], count), times_s, np.linspace(0.0, 1.0, _FINE + 1))
    positions_m, gaze_rad = curve.at(u, size)
    shake = _jitter(count, rng) / np.sqrt(3.0)
    return [
        _looking(eye_m, gaze) @ rigid(rotation_exp(np.radians(JITTER_DEG) * turn), JITTER_M * shift)
        for eye_m, gaze, turn, shift in zip(positions_m, gaze_rad, shake[:, :3], shake[:, 3:], strict=True)
    ]


def _jitter(count: int, rng: Rng) -> FloatArray:
    """Return (``count``, 6) smooth noise of unit variance."""
    window = JITTER_S * RATE_HZ
    margin = int(np.ceil(4.0 * window))
    noise = gaussian_filter1d(rng.standard_normal((count + 2 * margin, 6)), window, axis=0)
    return noise[margin : margin + count] * np.sqrt(2.0 * np.sqrt(np.pi) * window)


def _looking(eye_m: FloatArray, gaze_rad: FloatArray) -> FloatArray:
    """Return T_world_camera of an upright camera at ``eye_m`` (3,) with this yaw and pitch."""
    yaw, pitch = gaze_rad
    level = np.cos(pitch)
    return look_at(eye_m, eye_m + np.array([level * np.cos(yaw), level * np.sin(yaw), np.sin(pitch)]))
