"""Length, width and height of a box, measured in the point cloud of one view of it on a plane (SPEC 7)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import label

from packetmesh.errors import ReconstructionError
from pipeline.types import FloatArray

ON_PLANE_M = 0.005
"""Points nearer to a plane than this belong to it."""
DRAWS = 400
"""Random triples of points through which planes are tried."""
SOME = 4000
"""Number of points on which planes are tried."""
ABOVE_M = 0.015
"""Height above which points do not belong to the ground."""
CELL_M = 0.025
"""Least distance between two separate objects."""
LEAST_FACE = 0.1
"""Least share of the box's points on a face."""
ON_FACE_M = 0.008
"""Points nearer to a face's plane than this belong to the face."""
FLAT, UPRIGHT = 0.95, 0.3
"""Cosine of the angle between a face and the ground: least for a top face, most for an upright one."""
WITHIN = (0.01, 0.99)


@dataclass(frozen=True, slots=True)
class Plane:
    """The plane n . x = d."""

    normal: FloatArray
    """(3,) unit normal n."""
    offset_m: float
    """Offset d."""

    def heights_m(self, points_m: FloatArray) -> FloatArray:
        """Return (N,) signed distances of (N, 3) points from the plane."""
        return points_m @ self.normal - self.offset_m


def box_size_m(points_m: FloatArray, seed: int = 0) -> FloatArray:
    """Return (3,) length, width and height in metres; the length is the longer horizontal one.

    The ground is the plane with the most points (RANSAC with 5 mm, then least squares). The box is the
    largest connected object above it, and its faces are planes in that object. The height is the top face's
    mean height above the ground. The horizontal axes follow the largest upright face or, if none is visible,
    the smallest rectangle around the top face. Length and width are extents of the top face along these axes,
    from the 1st to the 99th percentile of its area, divided by 0.98.

    Args:
        points_m: (N, 3) points of one view from above, in the camera's frame, one per pixel.
        seed: seed of the planes that are tried.

    Raises:
        ReconstructionError: there is no plane, or no box on it.
    """
    rng = np.random.default_rng(seed)
    ground = _plane(points_m, rng)
    if ground.offset_m > 0.0:  # the camera, at the origin, is above the ground
        ground = Plane(-ground.normal, -ground.offset_m)
    box_m = _largest(points_m[ground.heights_m(points_m) > ABOVE_M])
    faces = _faces(box_m, rng)
    tops = [face for face in faces if abs(face.normal @ ground.normal) > FLAT]
    upright = [face for face in faces if abs(face.normal @ ground.normal) < UPRIGHT]
    if not tops:
        raise ReconstructionError("Nothing on the plane has a flat top; is the object a box seen from above?")
    top_m = box_m[np.abs(tops[0].heights_m(box_m)) < ON_FACE_M]
    axes = _axes(ground.normal, upright[0].normal if upright else None, top_m)
    area = top_m[:, 2] ** 3  # proportional to the area of a pixel on a plane
    width_m, length_m = sorted(_extent_m(top_m @ axis, area) for axis in axes)
    return np.array([length_m, width_m, ground.heights_m(top_m).mean()])


def _extent_m(along_m: FloatArray, area: FloatArray) -> float:
    """Return a face's extent along one of its sides, from its points' positions there and their areas."""
    order = np.argsort(along_m)
    share = np.cumsum(area[order]) / area.sum()
    low_m, high_m = np.interp(WITHIN, share, along_m[order])
    return float(high_m - low_m) / (WITHIN[1] - WITHIN[0])


def _plane(points_m: FloatArray, rng: np.random.Generator) -> Plane:
    """Return the plane with the most points near it, fitted to them."""
    if len(points_m) < 3:
        raise ReconstructionError("There are too few points for a plane; is the object in the picture?")
    some = points_m[rng.choice(len(points_m), min(SOME, len(points_m)), replace=False)]
    a, b, c = some[rng.integers(len(some), size=(3, DRAWS))]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    a, normals = a[lengths > 0.0], normals[lengths > 0.0] / lengths[lengths > 0.0, None]
    near = np.abs(some @ normals.T - np.einsum("nk,nk->n", a, normals)) < ON_PLANE_M
    best = int(near.sum(axis=0).argmax())
    plane = Plane(normals[best], float(a[best] @ normals[best]))
    for _ in range(2):
        mine = points_m[np.abs(plane.heights_m(points_m)) < ON_PLANE_M]
        middle = mine.mean(axis=0)
        normal = np.linalg.svd(mine - middle, full_matrices=False)[2][-1]
        plane = Plane(normal, float(normal @ middle))
    return plane


def _largest(points_m: FloatArray) -> FloatArray:
    """Return the points of the largest connected object."""
    if not len(points_m):
        raise ReconstructionError("Nothing stands on the plane; is the object in the picture?")
    cells = np.floor((points_m - points_m.min(axis=0)) / CELL_M).astype(int)
    room = np.zeros(cells.max(axis=0) + 1, bool)
    room[tuple(cells.T)] = True
    things, _ = label(room, np.ones((3, 3, 3)))
    mine = things[tuple(cells.T)]
    return points_m[mine == np.bincount(mine).argmax()]


def _faces(box_m: FloatArray, rng: np.random.Generator) -> list[Plane]:
    """Return the visible faces of the box, the largest first."""
    faces: list[Plane] = []
    left_m = box_m
    while len(faces) < 3 and len(left_m) > LEAST_FACE * len(box_m):
        face = _plane(left_m, rng)
        mine = np.abs(face.heights_m(left_m)) < ON_FACE_M
        if mine.sum() < LEAST_FACE * len(box_m):
            break
        faces.append(face)
        left_m = left_m[~mine]
    return faces


def _axes(up: FloatArray, upright: FloatArray | None, top_m: FloatArray) -> FloatArray:
    """Return (2, 3) horizontal directions of the box's sides."""
    if upright is not None:
        side = upright - (upright @ up) * up
        side /= np.linalg.norm(side)
        return np.stack([side, np.cross(up, side)])
    across = np.linalg.svd(up[None])[2][1:]
    turned = np.radians(cv2.minAreaRect((top_m @ across.T).astype(np.float32))[2])
    cosine, sine = np.cos(turned), np.sin(turned)
    return np.array([[cosine, sine], [-sine, cosine]]) @ across
