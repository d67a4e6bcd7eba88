"""Places built from triangles, whose cameras see what geometry says."""

import numpy as np

from pipeline.kernels.geometry import look_at, pixel_rays
from pipeline.kernels.rays import Camera, camera_hits, triangle_scene
from pipeline.planning.seen import SeenPlace
from pipeline.planning.sensors import Sensor
from pipeline.planning.space import FreeSpace
from pipeline.planning.targets import Targets
from pipeline.planning.views import Meets, PresentView
from pipeline.types import CameraIntrinsics, Surface

LENS = CameraIntrinsics.pinhole(100.0, 100.0, 79.5, 59.5, 160, 120)
PLAIN = Sensor("plain", LENS, 0.4, 4.5, 0.0)
"""A time-of-flight camera with one eye; its image is 1.6 m wide in a distance of 1 m."""


def sheet(corner_m, along_m, up_m, cell_m):
    """A rectangle of equal cells; its normal is along x up. Returns vertices and triangles."""
    corner_m, along_m, up_m = (np.asarray(of, float) for of in (corner_m, along_m, up_m))
    columns, rows = (max(1, round(np.linalg.norm(side) / cell_m)) for side in (along_m, up_m))
    s, t = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    vertices_m = corner_m + s.reshape(-1, 1) * along_m + t.reshape(-1, 1) * up_m
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    lower = np.stack([first, first + 1, first + columns + 2], axis=1)
    upper = np.stack([first, first + columns + 2, first + columns + 1], axis=1)
    return vertices_m, np.concatenate([lower, upper]).astype(np.int32)


def joined(sheets):
    """One surface of several sheets."""
    vertices_m, triangles, count = [], [], 0
    for points_m, faces in sheets:
        vertices_m.append(points_m)
        triangles.append(faces + count)
        count += len(points_m)
    return Surface(np.vstack(vertices_m), np.vstack(triangles).astype(np.int32), None)


def box_room(width_m=4.0, depth_m=3.0, height_m=2.5, cell_m=0.1, ceiling=True):
    """The inner sides of a box, with normals inwards."""
    sides = [
        ((0, 0, 0), (width_m, 0, 0), (0, depth_m, 0)),  # floor
        ((width_m, 0, 0), (-width_m, 0, 0), (0, 0, height_m)),
        ((0, depth_m, 0), (width_m, 0, 0), (0, 0, height_m)),
        ((0, 0, 0), (0, depth_m, 0), (0, 0, height_m)),
        ((width_m, depth_m, 0), (0, -depth_m, 0), (0, 0, height_m)),
    ]
    if ceiling:
        sides.append(((width_m, 0, height_m), (-width_m, 0, 0), (0, depth_m, 0)))
    return [sheet(*side, cell_m) for side in sides]


def targets_at(points_m, normal, dark_return=0.0, apart_rad=0.0):
    """Unmeasured rays of the first camera, with one normal."""
    points_m = np.reshape(np.asarray(points_m, float), (-1, 3))
    count = len(points_m)
    normals = np.tile(np.asarray(normal, float), (count, 1))
    dark_return, apart_rad = (np.full(count, float(value)) for value in (dark_return, apart_rad))
    return Targets(points_m, normals, np.zeros(count, int), dark_return, apart_rad, 0.001)


def view_through(scene, camera):
    """What a camera sees of a surface of which all is measured."""
    z_m = camera_hits(scene, camera)["t_hit"].numpy()
    meets = np.where(np.isfinite(z_m), Meets.MEASURED, Meets.NOTHING)
    shape = z_m.shape
    return PresentView(
        camera, meets, np.where(meets == Meets.MEASURED, z_m, np.nan),
        -pixel_rays(camera.intrinsics), np.zeros(shape), np.zeros(shape),
    )  # fmt: skip


def place(sheets, targets, cameras=(), guessed_sheets=()):
    """A place of measured and guessed sheets, in which all space is free."""
    surface = joined([*sheets, *guessed_sheets])
    measured = sum(len(faces) for _, faces in sheets)
    guessed = np.arange(len(surface.triangles)) >= measured
    whole = triangle_scene(surface.vertices_m, surface.triangles)
    known = triangle_scene(surface.vertices_m, surface.triangles[~guessed])
    views = tuple(view_through(known, Camera(LENS, T)) for T in cameras)
    low_m, high_m = surface.vertices_m.min(axis=0) - 1.0, surface.vertices_m.max(axis=0) + 1.0
    space = FreeSpace(low_m, np.ones(np.ceil((high_m - low_m) / 0.1).astype(int), bool))
    return SeenPlace(surface, whole, known, guessed, views, targets, space, 1.0)


def at(eye_m, target_m):
    """Pose of a camera that looks from one place at another."""
    return look_at(np.asarray(eye_m, float), np.asarray(target_m, float))
