"""Simulated calibration sessions: a true camera, a board that may be bent, views of it, and noisy points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View
from pipeline.calibration.lens import Optics
from pipeline.config import Lens
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.types import FloatArray

LENSES: tuple[Lens, ...] = ("thesis", "brown", "rational", "fisheye")
SIZES_PX = ((640, 480), (1280, 960), (1920, 1080))
BOARDS = (Board("circles", 11, 9, 0.035), Board("chessboard", 9, 7, 0.03), Board("chessboard", 8, 6, 0.04))
NOISE_PX = (0.1, 1.0)
"""Least and largest standard deviation of a coordinate, drawn evenly in its logarithm."""
BENT, BLURRED, RIGHT = 0.3, 0.25, 0.5
"""Shares of sessions with a bent board, with blurred views, and with the true lens model; in the others the
lens model is drawn from all four."""
BEND = (0.001, 0.008)
"""Least and largest bend of a bent board, over its width."""
BLUR = 4.0
"""Standard deviation of the noise that blur adds along its direction, over that of the usual noise."""
RANGES_M, ACCURACIES_M = (1.0, 2.0, 3.0), (0.0025, 0.005, 0.01)
MOST_TRIES = 400
"""Poses tried for a view; if the board fits into the image at none, the session is drawn again."""
RIM_PX = 4.0
"""Least distance of a board's points from the image's rim."""

Views = Literal["good", "few", "similar"]


@dataclass(frozen=True, slots=True)
class Session:
    """A session and its truth."""

    optics: Optics
    """The true camera."""
    size_px: tuple[int, int]
    board: Board
    bend_m: float
    """Height of a bent board's middle over its outermost points; 0 if it is flat."""
    noise_px: float
    blurred: int
    """Number of blurred views."""
    kind: Views
    chosen: Lens
    """The lens model with which the camera is calibrated."""
    views: tuple[View, ...]
    """Noisy pixels of each view, with the points of the board as printed, which is flat."""
    boards_m: FloatArray
    """(N, 3) true places of all views' points in the camera's frame."""
    range_m: float
    accuracy_m: float

    @property
    def right_lens(self) -> bool:
        """Whether the chosen lens model can represent the true lens."""
        richer = {"thesis": ("thesis", "brown", "rational"), "brown": ("brown", "rational")}
        return self.chosen in richer.get(self.optics.lens, (self.optics.lens,))


def draw_session(seed: int, number: int) -> Session:
    """Draw a session; equal arguments give equal sessions."""
    rng = np.random.default_rng((seed, number))
    while True:
        drawn = _drawn(rng)
        if drawn is not None:
            return drawn


def _drawn(rng: np.random.Generator) -> Session | None:
    """Draw a session; None if a pixel of the camera has no ray, or the board fits into no view."""
    lens = LENSES[rng.integers(len(LENSES))]
    size_px = SIZES_PX[rng.integers(len(SIZES_PX))]
    optics = _camera(rng, lens, size_px)
    board = BOARDS[rng.integers(len(BOARDS))]
    chosen = lens if rng.random() < RIGHT else LENSES[rng.integers(len(LENSES))]
    kind: Views = ("good", "good", "few", "similar")[rng.integers(4)]
    count = int(rng.integers(3, 6)) if kind == "few" else int(rng.integers(8, 19))
    bend_m = _between(rng, BEND) * float(np.ptp(board.points_m[:, 0])) if rng.random() < BENT else 0.0
    noise_px = _between(rng, NOISE_PX)
    blurred = int(rng.integers(1, 1 + max(count // 4, 1))) if rng.random() < BLURRED else 0
    range_m, accuracy_m = rng.choice(RANGES_M), rng.choice(ACCURACIES_M)
    true_m = _bent(rng, board, bend_m)
    if not _everywhere(optics, size_px):
        return None
    poses = [_pose(rng, optics, size_px, true_m, kind) for _ in range(count)]
    views, boards_m = [], []
    for row, T in enumerate(poses):
        if T is None:
            return None
        boards_m.append(apply(T, true_m))
        points_px = optics.project(boards_m[-1])
        off_px = rng.normal(0.0, noise_px, points_px.shape)
        if row < blurred:
            way = rng.uniform(0.0, np.pi)
            off_px += rng.normal(0.0, BLUR * noise_px, (len(points_px), 1)) * (np.cos(way), np.sin(way))
        views.append(View(f"view {row}", points_px + off_px, board.points_m))
    order = rng.permutation(count)
    return Session(
        *(optics, size_px, board, bend_m, noise_px, blurred, kind, chosen),
        *(tuple(views[row] for row in order), np.concatenate(boards_m), float(range_m), float(accuracy_m)),
    )


def _between(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    """Draw a number evenly in its logarithm."""
    return float(np.exp(rng.uniform(*np.log(ends))))


def _camera(rng: np.random.Generator, lens: Lens, size_px: tuple[int, int]) -> Optics:
    """Draw a camera with this lens model."""
    width, height = size_px
    if lens == "fisheye":
        f_px = 0.5 * width / np.radians(rng.uniform(50.0, 70.0))
        distortion = rng.normal(0.0, 1.0, 4) * (0.05, 0.02, 0.01, 0.003)
    else:
        f_px = 0.5 * width / np.tan(np.radians(rng.uniform(24.0, 42.0)))
        distortion = np.zeros(8 if lens == "rational" else 5)
        distortion[:2] = rng.uniform(-0.3, 0.05), rng.uniform(-0.05, 0.15)
        if lens != "thesis":
            distortion[2:5] = *rng.normal(0.0, 0.002, 2), rng.uniform(-0.1, 0.1)
        if lens == "rational":
            distortion[5:] = rng.uniform(0.1, 0.6), rng.uniform(0.0, 0.2), rng.uniform(0.0, 0.05)
            distortion[0] += distortion[5]
            distortion[1] += distortion[6]
    matrix = np.array(
        [[f_px, 0.0, 0.5 * width], [0.0, f_px * rng.uniform(0.995, 1.005), 0.5 * height], [0.0, 0.0, 1.0]]
    )
    matrix[:2, 2] += rng.normal(0.0, 0.015, 2) * width
    return Optics(lens, matrix, distortion)


def _everywhere(optics: Optics, size_px: tuple[int, int]) -> bool:
    """Return whether all pixels of a coarse grid over the whole image have rays."""
    width, height = size_px
    rim = np.stack(np.meshgrid(np.linspace(0, width - 1, 9), np.linspace(0, height - 1, 7)), axis=-1)
    return bool(np.isfinite(optics.rays(rim.reshape(-1, 2))).all())


def _bent(rng: np.random.Generator, board: Board, bend_m: float) -> FloatArray:
    """Return the board's (N, 3) points, bent to a parabolic cylinder with a random direction."""
    points_m = board.points_m.copy()
    way = rng.uniform(0.0, np.pi)
    across = points_m[:, :2] @ (np.cos(way), np.sin(way))
    points_m[:, 2] = bend_m * (across / np.abs(across).max()) ** 2
    return points_m


def _pose(
    rng: np.random.Generator, optics: Optics, size_px: tuple[int, int], points_m: FloatArray, kind: Views
) -> FloatArray | None:
    """Draw a (4, 4) pose at which the whole board is in the image; None if none is found."""
    size = np.array(size_px, float)
    middle = 0.5 if kind == "similar" else None
    for _ in range(MOST_TRIES):
        at = np.full(2, middle) + rng.normal(0.0, 0.03, 2) if middle else rng.uniform(0.1, 0.9, 2)
        ray = optics.rays((at * size)[None])[0]
        tilt_deg = rng.uniform(6.0, 14.0) if kind == "similar" else rng.uniform(5.0, 45.0)
        side = rng.uniform(0.0, 2.0 * np.pi)
        tilt = np.radians(tilt_deg) * np.array([np.cos(side), np.sin(side), 0.0])
        turn = np.array([0.0, 0.0, np.radians(rng.uniform(-20.0, 20.0))])
        share = rng.uniform(0.3, 0.45) if kind == "similar" else rng.uniform(0.25, 0.7)
        away_m = float(np.ptp(points_m[:, 0])) * optics.matrix[0, 0] / (share * size[0])
        T = rigid(_facing(ray) @ rotation_exp(tilt) @ rotation_exp(turn), away_m * ray)
        if (apply(T, points_m)[:, 2] < 0.05 * away_m).any():
            continue
        points_px = optics.project(points_m, T)
        if ((points_px > RIM_PX) & (points_px < size - 1.0 - RIM_PX)).all():
            return T
    return None


def _facing(ray: FloatArray) -> FloatArray:
    """Return the (3, 3) rotation of a board perpendicular to a ray, with level rows."""
    right = np.cross((0.0, 1.0, 0.0), ray)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(ray, right), ray])
