"""Cameras that stand around boards, and what each sees of them, known to the last digit."""

from dataclasses import dataclass

import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import Calibration, View, calibrate
from pipeline.calibration.rig import Seen
from pipeline.kernels.geometry import apply, inverse, look_at, project, rigid, rotation_exp
from pipeline.types import CameraIntrinsics, FloatArray

BOARD = Board()
MIDDLE_M = np.array([0.0, 0.0, 1.2])
EDGE_PX = 3


@dataclass(frozen=True)
class Session:
    """A board at several moments before several cameras."""

    board: Board
    cameras: dict[str, CameraIntrinsics]
    T_first_camera: dict[str, FloatArray]
    T_first_board: list[FloatArray]
    seen: dict[str, dict[str, Seen]]

    def lenses(self) -> dict[str, Calibration]:
        """From each camera's own views."""
        return {
            name: calibrate(
                [one.view for one in self.seen[name].values()], (camera.width_px, camera.height_px)
            )
            for name, camera in self.cameras.items()
        }


def camera_of(index: int) -> CameraIntrinsics:
    """Each of another size and lens."""
    width, height = ((640, 480), (800, 600), (512, 424), (640, 480))[index % 4]
    focal = 0.95 * width
    matrix = np.array([[focal, 0, 0.5 * width - 2], [0, 1.01 * focal, 0.5 * height + 3], [0, 0, 1]])
    return CameraIntrinsics(matrix, np.array([-0.1 + 0.04 * index, 0.03, 0, 0, 0]), width, height)


def session(
    cameras: int = 3,
    moments: int = 16,
    seed: int = 0,
    noise_px: float = 0.2,
    board: Board = BOARD,
    apart_deg: float = 25.0,
    pairs_only: bool = False,
    marked: bool = True,
) -> Session:
    """Cameras on an arc that look at its middle, and boards before them, tilted to all sides.

    Args:
        pairs_only: every moment is seen by two neighbours alone, so that only a chain links all.
        marked: if not, each sighting reads the board upside down as often as not.
    """
    rng = np.random.default_rng(seed)
    names = [f"node_{index:02d}" for index in range(cameras)]
    lenses = [camera_of(index) for index in range(cameras)]
    angles = np.radians(apart_deg * (np.arange(cameras) - 0.5 * (cameras - 1)))
    stands = [
        look_at(MIDDLE_M + 1.2 * np.array([np.sin(a), 0.05 * i, -np.cos(a)]), MIDDLE_M, up=(0, -1, 0))
        for i, a in enumerate(angles)
    ]
    T_first_world = inverse(stands[0])
    boards: list[FloatArray] = []
    seen: dict[str, dict[str, Seen]] = {name: {} for name in names}
    while len(boards) < moments:
        facing = rng.uniform(angles[0], angles[-1]) if cameras > 1 else 0.0
        turn = rotation_exp(np.array([0.0, -facing, 0.0])) @ rotation_exp(rng.uniform(-0.55, 0.55, 3))
        T_world_board = rigid(turn, MIDDLE_M + rng.uniform(-0.2, 0.2, 3))
        views = {}
        for name, lens, stand in zip(names, lenses, stands, strict=True):
            points_m = apply(inverse(stand) @ T_world_board, board.points_m)
            pixels = project(lens, points_m) + rng.normal(0.0, noise_px, (len(points_m), 2))
            size = np.array([lens.width_px, lens.height_px])
            if ((pixels > EDGE_PX) & (pixels < size - EDGE_PX)).all():
                views[name] = pixels
        if pairs_only:
            first = len(boards) % (cameras - 1)
            views = {name: views[name] for name in names[first : first + 2] if name in views}
        if len(views) < 2:
            continue
        for name, pixels in views.items():
            flipped = not marked and rng.random() < 0.5
            view = View(str(len(boards)), pixels[::-1] if flipped else pixels, board.points_m)
            seen[name][str(len(boards))] = Seen(view, oriented=marked)
        boards.append(T_first_world @ T_world_board)
    T_first_camera = {name: T_first_world @ stand for name, stand in zip(names, stands, strict=True)}
    return Session(board, dict(zip(names, lenses, strict=True)), T_first_camera, boards, seen)
