"""Public calls for the calibration of one camera, and of several."""

from __future__ import annotations

from collections.abc import Sequence

from packetmesh.progress import drain
from pipeline.calibration.board import Board
from pipeline.calibration.from_images import CameraReport, image_files, iterate_calibration
from pipeline.calibration.rig_from_images import RigReport, iterate_rig_calibration
from pipeline.calibration.shots import board_beside, node_shots
from pipeline.config import Lens
from pipeline.types import AnyPath


def calibrate(
    images: Sequence[AnyPath],
    board: Board | None = None,
    lens: Lens = "thesis",
    held_out: int = 2,
    one_camera: bool = False,
) -> CameraReport:
    """Estimate one camera from images of a board.

    Args:
        images: three or more, with different tilts: files, folders, or patterns such as "left*.jpg".
        board: the board in them; None uses a board.json next to them, or else the thesis's.
        lens: distortion model of the camera.
        held_out: number of folds of images that are left out and predicted; 0 leaves out none.
        one_camera: whether one camera took all images even if their names or EXIF data indicate several.

    Raises:
        InputError: images are unreadable, differ in size or are of several cameras, or too few show the
            board.
        ReconstructionError: the images do not determine the lens.

    >>> import packetmesh as pm
    >>> report = pm.calibrate([pm.board_views_of("uncalibrated") / "node_00"], held_out=0)
    >>> round(report.intrinsics.fx_px), report.calibration.rms_px < 0.1
    (542, True)
    """
    files = image_files([str(word) for word in images], one_camera)
    given = board_beside(images) if board is None else board
    return drain(iterate_calibration(files, given, lens, held_out, one_camera=one_camera))


def calibrate_cameras(
    folders: Sequence[AnyPath], board: Board | None = None, lens: Lens = "thesis", held_out: int = 2
) -> RigReport:
    """Estimate several cameras and their poses from images of a board at shared moments.

    Args:
        folders: one with node_00, node_01 and so on, or one per camera; images with the same number belong
            to the same moment.
        board: the board in them; None uses a board.json next to them, or else the thesis's.
        lens: distortion model of the cameras.
        held_out: number of folds of moments that are left out and predicted; 0 leaves out none.

    Raises:
        InputError: as for ``calibrate``, or there are too few or too many cameras, or some never see the
            board together with others.
        ReconstructionError: the images do not determine the lenses or the poses.

    >>> import packetmesh as pm
    >>> boards = pm.board_views_of("uncalibrated")
    >>> report = pm.calibrate_cameras([boards / "node_00", boards / "node_01"], held_out=0)
    >>> pose = report.rig.relative("node_01")
    >>> round(pose.rotation_deg), round(pose.baseline_m, 2)
    (25, 0.93)
    >>> pm.write_calibration("calibration", report.nodes())
    """
    given = board_beside(folders) if board is None else board
    return drain(iterate_rig_calibration(node_shots(folders), given, lens, held_out))
