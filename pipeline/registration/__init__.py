"""Iterative registration of two clouds, errors of a registration, and fusion of clouds (SPEC 4)."""

from pipeline.registration.fusion import fuse
from pipeline.registration.loop import iterate_registration, register, register_timed
from pipeline.registration.metrics import average_hausdorff_m, point_error_m, rotation_error_rad
from pipeline.registration.visibility import hidden_from

__all__ = [
    "average_hausdorff_m",
    "fuse",
    "hidden_from",
    "iterate_registration",
    "point_error_m",
    "register",
    "register_timed",
    "rotation_error_rad",
]
