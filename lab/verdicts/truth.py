"""The true error of a calibrated camera, from the camera that was simulated."""

from __future__ import annotations

import numpy as np

from lab.verdicts.session import Session
from pipeline.calibration.estimate import settle
from pipeline.calibration.lens import Optics
from pipeline.calibration.trust import sight
from pipeline.calibration.verdict import LEAST_SHARE
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray


def true_error_m(session: Session, found: Optics) -> FloatArray:
    """Return the (G,) errors, metres, of a calibrated camera over a grid of pixels, at the session's range.

    A pixel's error is the distance of the calibrated camera's ray from the true point at that pixel. The
    camera gets the pose that fits the true boards best. Pixels without a ray have an infinite error.

    Args:
        session: the session, with its true camera.
        found: the calibrated camera.
    """
    boards_px = session.optics.project(session.boards_m)
    T = settle(session.boards_m, boards_px, np.eye(4), found)
    seen = sight(session.optics, session.size_px, session.range_m)
    grid_px = np.stack(np.meshgrid(seen.columns_px, seen.rows_px), axis=-1).reshape(-1, 2)
    rays, points_m = found.rays(grid_px), apply(T, seen.points_m)
    off_m = np.linalg.norm(np.cross(points_m, rays), axis=1)
    return np.where(np.isfinite(off_m), off_m, np.inf)


def truly_good(session: Session, found: Optics) -> bool:
    """Return whether the true error is within the session's accuracy over ``LEAST_SHARE`` of the image."""
    return bool((true_error_m(session, found) <= session.accuracy_m).mean() >= LEAST_SHARE)
