"""Joint estimation of a fisheye lens and board poses.

OpenCV's own estimation starts from a pinhole camera, and fails unpredictably for boards far from the
optical axis. This one starts from equidistant lenses of several focal lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from pipeline.calibration.lens import FREE, Optics, Projection
from pipeline.types import FloatArray

FOCAL_SHARES = (0.2, 0.3, 0.45, 0.7, 1.1)
"""Starting focal lengths over the image's longer side: from a half sphere to a narrow view."""
TRIED = 2
"""Number of starts that are optimised: those with the least error of the placed boards."""
STEPS, STILL = 100, 1e-10
"""Most Levenberg-Marquardt steps, and the relative gain below which they stop."""
LARGEST_DAMPING = 1e12

Boards = Sequence[tuple[FloatArray, FloatArray]]
"""(N, 3) points of a board and (N, 2) pixels where they are seen, for each view."""


def estimate_fisheye(
    boards: Boards, size_px: tuple[int, int], place: Callable[[int, Optics], FloatArray | None]
) -> tuple[Optics, list[FloatArray]] | None:
    """Estimate the lens and the (4, 4) poses of the boards; returns None if no start places all of them.

    Args:
        boards: boards of three views or more.
        size_px: width and height of the images.
        place: returns the pose of a view for a given lens, or None.
    """
    beginnings: list[tuple[float, Optics, list[FloatArray]]] = []
    for share in FOCAL_SHARES:
        f_px, (width, height) = share * max(size_px), size_px
        middle = 0.5 * width - 0.5, 0.5 * height - 0.5
        optics = _optics(np.array([f_px, f_px, *middle, 0.0, 0.0, 0.0, 0.0]))
        placed = [place(row, optics) for row in range(len(boards))]
        poses = [pose for pose in placed if pose is not None]
        if len(poses) == len(boards):
            linear = [optics.linearised(board, T) for (board, _), T in zip(boards, poses, strict=True)]
            beginnings.append((_cost(linear, [pixels for _, pixels in boards]), optics, poses))
    beginnings = sorted(beginnings, key=lambda one: one[0])[:TRIED]
    ends = [adjust(boards, optics, poses) for _, optics, poses in beginnings]
    return min(ends, key=lambda one: one[0])[1:] if ends else None


def adjust(
    boards: Boards, optics: Optics, poses: Sequence[FloatArray]
) -> tuple[float, Optics, list[FloatArray]]:
    """Minimise the sum of squared image distances; returns this sum, the lens and the poses."""
    lens = _numbers(optics)
    turns = [np.concatenate([cv2.Rodrigues(T[:3, :3])[0].ravel(), T[:3, 3]]) for T in poses]
    seen = [pixels for _, pixels in boards]
    linear = [optics.linearised(board, T) for (board, _), T in zip(boards, poses, strict=True)]
    cost, damping = _cost(linear, seen), 1e-3
    for _ in range(STEPS):
        by_lens, by_poses = _step(linear, seen, damping)
        trial, moved = lens + by_lens, [pose + step for pose, step in zip(turns, by_poses, strict=True)]
        tried = [
            _optics(trial).linearised(board, _pose(pose))
            for (board, _), pose in zip(boards, moved, strict=True)
        ]
        after = _cost(tried, seen)
        if not after < cost:
            damping *= 10.0
            if damping > LARGEST_DAMPING:
                break
            continue
        gain, damping = (cost - after) / max(cost, 1e-300), 0.1 * damping
        lens, turns, linear, cost = trial, moved, tried, after
        if gain < STILL:
            break
    return cost, _optics(lens), [_pose(pose) for pose in turns]


def _step(
    linear: Sequence[Projection], seen: Sequence[FloatArray], damping: float
) -> tuple[FloatArray, list[FloatArray]]:
    """Return the changes of the lens and of each pose; the poses are eliminated from the normal equations."""
    count = linear[0].by_lens.shape[1]
    normal, right = np.zeros((count, count)), np.zeros(count)
    reduced, parts = np.zeros((count, count)), []
    for one, pixels in zip(linear, seen, strict=True):
        off_px = (pixels - one.points_px).ravel()
        own = _damped(one.by_pose.T @ one.by_pose, damping)
        both = one.by_pose.T @ np.column_stack([one.by_lens, off_px])
        solved = np.linalg.solve(own, both)
        parts.append(solved)
        normal += one.by_lens.T @ one.by_lens
        reduced += both[:, :-1].T @ solved[:, :-1]
        right += one.by_lens.T @ off_px - both[:, :-1].T @ solved[:, -1]
    by_lens = np.linalg.lstsq(_damped(normal, damping) - reduced, right, rcond=None)[0]
    return by_lens, [solved[:, -1] - solved[:, :-1] @ by_lens for solved in parts]


def _damped(normal: FloatArray, damping: float) -> FloatArray:
    return normal + damping * np.diag(np.diag(normal))


def _cost(linear: Sequence[Projection], seen: Sequence[FloatArray]) -> float:
    return float(sum(((pixels - one.points_px) ** 2).sum() for one, pixels in zip(linear, seen, strict=True)))


def _numbers(optics: Optics) -> FloatArray:
    k = optics.matrix
    return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *optics.distortion])


def _optics(numbers: FloatArray) -> Optics:
    fx, fy, cx, cy = numbers[:4]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Optics("fisheye", matrix, numbers[4 : len(FREE["fisheye"])].copy())


def _pose(numbers: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(numbers[:3])[0], numbers[3:]
    return T
