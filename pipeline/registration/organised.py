"""Registration of two depth images without a search tree: a point's partner is found through its pixel.

The source's points are projected into the target's image, and the nearest of the points around is the partner
(projective association: Blais and Levine, "Registering multiview range data to create 3D computer objects",
PAMI 1995). Those within the current scale of CEICP-A are compared, at least 3 x 3 and at most 17 x 17.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.progress import drain
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import scaled
from pipeline.kernels.kdtree import compiled
from pipeline.registration.ceicp import GATE_IN_SIGMAS
from pipeline.registration.loop import iterate_matched
from pipeline.registration.matching import Matching, mean_normals
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.sample import Sample
from pipeline.types import (
    CameraIntrinsics,
    DepthMap,
    FloatArray,
    IntArray,
    PointCloud,
    RegistrationResult,
    RegistrationStep,
)

WIDTH = 160
"""Approximate number of squares of pixels across the image; each square becomes one point."""
SAME_SURFACE = 0.02
"""Depths within this share of a square's nearest depth are averaged."""
ARM = 2
"""Distance, in squares, of the neighbours from which a normal is computed."""
BENT = 0.02
"""Largest difference, as a share, of a square's 1/z from the mean of its two neighbours'; beyond it there is
an edge, and no normal."""
WIDEST = 8
"""Largest search radius around the projected point, squares."""
SIGMA_OF_SPACING = 0.6
"""Smallest scale of CEICP-A over the distance of two squares at the median depth."""


@dataclass(frozen=True, slots=True)
class OrganisedCloud:
    """Points of a depth image, one for each square of pixels, with normals."""

    points_m: FloatArray
    """(N, 3) points in the camera's frame; only those that have a normal."""
    normals: FloatArray
    """(N, 3) unit normals towards the camera."""
    rows: IntArray
    """(H, W) row of each square's point; -1 without one."""
    z_m: FloatArray
    """(H, W) depth of each square, also of those without a normal; NaN where unknown."""
    camera: CameraIntrinsics
    """Pinhole camera of the squares."""

    def __len__(self) -> int:
        return len(self.points_m)

    @property
    def spacing_m(self) -> float:
        """Distance of two neighbouring squares at the median depth, metres."""
        return float(np.median(self.points_m[:, 2])) / self.camera.fx_px

    @property
    def cloud(self) -> PointCloud:
        """The points with their normals."""
        return PointCloud(self.points_m, normals=self.normals)


def organised(depth: DepthMap, camera: CameraIntrinsics) -> OrganisedCloud:
    """Average 1/z of a depth image over squares of pixels, and compute normals.

    Rows and columns that remain at the right and at the bottom are not used.

    Args:
        depth: (H, W) depth, metres.
        camera: its camera, without distortion.
    """
    step_px = max(1, round(camera.width_px / WIDTH))
    inverse, across, along = _squares(depth.z_m, step_px, SAME_SURFACE)
    x = (across - camera.cx_px) / camera.fx_px
    y = (along - camera.cy_px) / camera.fy_px
    points_m, normals, rows = _with_normals(inverse, x, y, ARM, BENT)
    height_px, width_px = inverse.shape
    small = scaled(camera, 1.0 / step_px)
    small = replace(small, width_px=width_px, height_px=height_px)
    with np.errstate(divide="ignore"):
        z_m = np.where(inverse > 0.0, 1.0 / inverse, np.nan)
    return OrganisedCloud(points_m, normals, rows, z_m, small)


def register_organised(
    source: OrganisedCloud, target: OrganisedCloud, config: RegistrationConfig, T_init: FloatArray
) -> RegistrationResult:
    """Register two depth images by CEICP-A with the plane metric.

    Args:
        source: the image that moves.
        target: the image that stays.
        config: settings, with the method ceicp-a and the plane metric; ``sigma_min_m`` is replaced by
            ``SIGMA_OF_SPACING`` times the spacing of the target's squares.
        T_init: (4, 4) start pose T_target_source.

    Raises:
        ReconstructionError: no point of the source lies near the target at the start pose.
    """
    config = replace(config, sigma_min_m=SIGMA_OF_SPACING * target.spacing_m)
    samples = [Sample(one.cloud, np.arange(len(one))) for one in (source, target)]
    steps: list[RegistrationStep] = []
    matcher = OrganisedMatcher(source, target)
    reason = drain(iterate_matched(matcher, samples[0], samples[1], config, T_init), steps.append)
    T = steps[-1].T_target_source if steps else T_init
    return RegistrationResult(T, tuple(steps), reason in ("converged", "stalled"), reason)


def shared_shares(
    source: OrganisedCloud, target: OrganisedCloud, T_target_source: FloatArray, within: float
) -> tuple[float, float]:
    """Return the share of the source's points that the target's image judges, and that of these which agree.

    A point is judged if its square in the target has depth and it is not well behind this depth.

    Args:
        source: an organised cloud.
        target: another.
        T_target_source: (4, 4) pose.
        within: largest difference of depths that agree, as a share.
    """
    judged, agreeing = _judged(source.points_m, T_target_source, target.z_m, _values(target.camera), within)
    return judged / max(1, len(source)), agreeing / max(1, judged)


class OrganisedMatcher:
    """Finds the pairs of two organised clouds at any pose, as a ``matching.Matches``."""

    def __init__(self, source: OrganisedCloud, target: OrganisedCloud) -> None:
        self._source, self._target = source, target
        self._image = _image(target)
        self._order = np.random.default_rng(0).permutation(len(source))
        self.target_normals = Normals(target.points_m, target.normals)
        """Normals of all points of the target."""

    def match(
        self,
        T_target_source: FloatArray,
        neighbours: int = 1,
        source_share: float = 1.0,
        target_share: float = 1.0,
        gate_m: float = float("inf"),
    ) -> Matching:
        """Pair a share of the source's points; ``neighbours`` and ``target_share`` are not used."""
        count = min(len(self._order), max(6, round(source_share * len(self._order))))
        found = _partners(self._source.points_m, self._order[:count], T_target_source, *self._image, gate_m)
        normals, cosines = mean_normals(
            T_target_source, self._source.normals, self._target.normals, found[0], found[1]
        )
        return Matching(*found, normals, cosines)


def _image(cloud: OrganisedCloud) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return points, rows, and fx, fy, cx, cy of a target."""
    return cloud.points_m, cloud.rows, _values(cloud.camera)


def _values(camera: CameraIntrinsics) -> FloatArray:
    return np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px])


@compiled
def _squares(z: FloatArray, step: int, same: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (H, W) mean 1/z of each square's nearest surface, 0 without depth, and the mean u and v there.

    The mean of 1/z of a plane is that at the mean pixel.
    """
    height, width = z.shape[0] // step, z.shape[1] // step
    inverse, across, along = np.zeros((height, width)), np.zeros((height, width)), np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            nearest = np.inf
            for v in range(row * step, row * step + step):
                for u in range(column * step, column * step + step):
                    if 0.0 < z[v, u] < nearest:
                        nearest = z[v, u]
            if nearest == np.inf:
                continue
            count, total, total_u, total_v = 0, 0.0, 0.0, 0.0
            for v in range(row * step, row * step + step):
                for u in range(column * step, column * step + step):
                    if 0.0 < z[v, u] <= nearest * (1.0 + same):
                        count += 1
                        total += 1.0 / z[v, u]
                        total_u += u
                        total_v += v
            if 2 * count >= step * step:
                inverse[row, column] = total / count
                across[row, column], along[row, column] = total_u / count, total_v / count
    return inverse, across, along


@compiled
def _with_normals(
    inverse: FloatArray, x: FloatArray, y: FloatArray, arm: int, bent: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return points and unit normals of the squares that lie on a smooth surface, and (H, W) their rows."""
    height, width = inverse.shape
    points, normals = np.empty((height * width, 3)), np.empty((height * width, 3))
    rows, count = np.full((height, width), -1), 0
    right, down = np.empty(3), np.empty(3)
    for row in range(arm, height - arm):
        for column in range(arm, width - arm):
            here = inverse[row, column]
            left_, right_ = inverse[row, column - arm], inverse[row, column + arm]
            above, below = inverse[row - arm, column], inverse[row + arm, column]
            if here <= 0.0 or left_ <= 0.0 or right_ <= 0.0 or above <= 0.0 or below <= 0.0:
                continue
            if abs(0.5 * (left_ + right_) - here) > bent * here:
                continue
            if abs(0.5 * (above + below) - here) > bent * here:
                continue
            for side, (z_a, z_b, r, c) in enumerate(((left_, right_, 0, arm), (above, below, arm, 0))):
                out = right if side == 0 else down
                out[0] = x[row + r, column + c] / z_b - x[row - r, column - c] / z_a
                out[1] = y[row + r, column + c] / z_b - y[row - r, column - c] / z_a
                out[2] = 1.0 / z_b - 1.0 / z_a
            n_x = down[1] * right[2] - down[2] * right[1]
            n_y = down[2] * right[0] - down[0] * right[2]
            n_z = down[0] * right[1] - down[1] * right[0]
            length = np.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
            if length == 0.0:
                continue
            points[count, 0], points[count, 1] = x[row, column] / here, y[row, column] / here
            points[count, 2] = 1.0 / here
            normals[count, 0], normals[count, 1], normals[count, 2] = n_x / length, n_y / length, n_z / length
            rows[row, column] = count
            count += 1
    return points[:count].copy(), normals[:count].copy(), rows


@compiled
def _partners(
    points: FloatArray,
    order: IntArray,
    T: FloatArray,
    targets: FloatArray,
    rows: IntArray,
    camera: FloatArray,
    gate: float,
) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
    """Build the arrays of a ``Matching``: each moved point with the nearest target in its window."""
    height, width = rows.shape
    reach_m = gate / GATE_IN_SIGMAS
    near, partners = np.empty(len(order), np.intp), np.empty(len(order), np.intp)
    moved, fixed = np.empty((len(order), 3)), np.empty((len(order), 3))
    distances, count, place = np.empty(len(order)), 0, np.empty(3)
    for i in order:
        for k in range(3):
            place[k] = T[k, 0] * points[i, 0] + T[k, 1] * points[i, 1] + T[k, 2] * points[i, 2] + T[k, 3]
        if place[2] <= 1e-6:
            continue
        u = round(camera[0] * place[0] / place[2] + camera[2])
        v = round(camera[1] * place[1] / place[2] + camera[3])
        reach = max(1, round(min(float(WIDEST), reach_m * camera[0] / place[2])))
        best, partner = gate * gate, -1
        for row in range(max(0, v - reach), min(height, v + reach + 1)):
            for column in range(max(0, u - reach), min(width, u + reach + 1)):
                j = rows[row, column]
                if j >= 0:
                    squared = 0.0
                    for k in range(3):
                        squared += (place[k] - targets[j, k]) ** 2
                    if squared <= best:
                        best, partner = squared, j
        if partner >= 0:
            near[count], partners[count], distances[count] = i, partner, np.sqrt(best)
            for k in range(3):
                moved[count, k], fixed[count, k] = place[k], targets[partner, k]
            count += 1
    return near[:count], partners[:count], moved[:count], fixed[:count], distances[:count]


@compiled
def _judged(
    points: FloatArray, T: FloatArray, z: FloatArray, camera: FloatArray, within: float
) -> tuple[int, int]:
    """Return how many points fall on a target's square that does not hide them, and how many agree."""
    height, width = z.shape
    judged, agreeing, place = 0, 0, np.empty(3)
    for i in range(len(points)):
        for k in range(3):
            place[k] = T[k, 0] * points[i, 0] + T[k, 1] * points[i, 1] + T[k, 2] * points[i, 2] + T[k, 3]
        if place[2] <= 1e-6:
            continue
        u = round(camera[0] * place[0] / place[2] + camera[2])
        v = round(camera[1] * place[1] / place[2] + camera[3])
        if 0 <= u < width and 0 <= v < height and z[v, u] > 0.0:
            ratio = place[2] / z[v, u]
            judged += ratio <= 1.0 + 2.5 * within
            agreeing += abs(ratio - 1.0) <= within
    return judged, agreeing
