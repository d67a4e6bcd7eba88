"""Errors in the tuning rooms, printed, by which constants of ``pipeline.measuring`` were chosen."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from types import ModuleType

import numpy as np
from scipy.stats import chi2

from lab.measuring.clicks import Click, clicks
from lab.measuring.rooms import FOCAL_SD, TUNING, Room, measured_room
from pipeline.kernels import geometry
from pipeline.measuring import views
from pipeline.measuring.guesses import CHANCES, CONFIDENCES, class_of
from pipeline.measuring.propagation import Z95
from pipeline.placement import attempt
from pipeline.registration.graph.edges import small_motion
from pipeline.types import FloatArray

CLICKS = 3000
MOST_OF_A_ROOM = 60
"""Most guessed clicks of a room that count in a class, so that no room decides alone."""
MEASURED = 300
"""Clicks in a room; the depths of those on measured surface are compared."""
FACTORS = (1.0, 1.25, 1.5, 2.0)
"""Values of ``MISFIT_FACTOR`` that are tried."""
SHARES = (1e-5, 1e-4, 1e-3)
"""Values of ``WEAK_SHARE`` that are tried."""


def guesses(rooms: int) -> None:
    """Print ``guesses.QUANTILES``: the quantiles of the guesses' errors, by class of confidence."""
    errors: list[list[float]] = [[] for _ in CONFIDENCES[1:]]
    for room in _rooms(rooms):
        own: list[list[float]] = [[] for _ in errors]
        for click in islice(clicks(room, np.random.default_rng([room.seed, 31])), CLICKS):
            if click.mark.guessed:
                own[class_of(click.mark.confidence)].append(click.log_error)
        for all_rooms, some in zip(errors, own, strict=True):
            all_rooms += some[:MOST_OF_A_ROOM]
    for some in errors:
        values = ", ".join(f"{value:.3f}" for value in np.quantile(some, CHANCES))
        _write(f"    ({values}),")


def misfit(rooms: int) -> None:
    """Print the share of measured clicks whose depth is in its interval, by ``views.MISFIT_FACTOR``."""
    for factor in FACTORS:
        with _set(views, "MISFIT_FACTOR", factor):
            scores = np.concatenate([_depth_scores(room) for room in _rooms(rooms)])
        _write(
            f"MISFIT_FACTOR {factor:g}: {100.0 * np.mean(np.abs(scores) < Z95):.1f} % of {len(scores)} "
            "depths are inside their intervals"
        )


def poses(rooms: int) -> None:
    """Print the poses' errors for each value of ``edges.WEAK_SHARE``; ``poses.SLACK_OF_SCALE`` is their size.

    The turn (rad) and the shift (as a share of the distance of what is seen) are divided by the relative
    standard deviation of the focal length, ``FOCAL_SD``.
    """
    for share in SHARES:
        with _set(attempt, "WEAK_SHARE", share):
            found = np.array([_pose_error(room) for room in _rooms(rooms)])
        turn, shift = np.sqrt(np.mean(found[:, :2] ** 2, axis=0)) / FOCAL_SD
        held = 100.0 * np.mean(found[:, 2] < chi2.ppf(0.95, 6))
        _write(
            f"WEAK_SHARE {share:g}: {held:.0f} % of {len(found)} poses are in their 95 % ellipsoid, "
            f"root mean square turn {turn:.2f}, shift {shift:.2f} (SLACK_OF_SCALE, each direction)"
        )


def _rooms(count: int) -> Iterator[Room]:
    for seed in range(TUNING, TUNING + count):
        room = measured_room(seed)
        sys.stderr.write(f"{seed}: {'no two views' if room is None else 'measured'}\n")
        if room is not None:
            yield room


def _depth_scores(room: Room) -> FloatArray:
    """Return the depth errors of measured clicks, each divided by the standard deviation of its mark."""
    found = islice(clicks(room, np.random.default_rng([room.seed, 37])), MEASURED)
    return np.array([_depth_score(click) for click in found if not click.mark.guessed])


def _depth_score(click: Click) -> float:
    mark = click.mark
    ray = mark.normal if mark.ray is None else mark.ray
    off_sd_m = float(np.sqrt(mark.normal @ mark.covariance_m2 @ mark.normal))
    return click.log_error * mark.range_m * max(abs(float(ray @ mark.normal)), 0.05) / max(off_sd_m, 1e-9)


def _pose_error(room: Room) -> tuple[float, float, float]:
    """Return the error of the second camera's pose, root mean square over the three directions.

    Returns:
        Turn (rad); shift at the middle of what the camera sees, over its distance from the camera; and
        squared Mahalanobis distance of the whole error by the pose's covariance.
    """
    view, covariance = room.true[1], room.surface.pose_covariances[1]
    motion = small_motion(view.T_world_camera @ geometry.inverse(room.T_world_camera[1]))
    middle_m = view.points_m().reshape(-1, 3).mean(axis=0)
    away_m = float(np.linalg.norm(middle_m - view.T_world_camera[:3, 3]))
    shift_m = motion[3:] + np.cross(motion[:3], middle_m)
    turn_rad, shift = np.linalg.norm(motion[:3]), np.linalg.norm(shift_m) / away_m
    distance = float(motion @ np.linalg.solve(covariance, motion))
    return float(turn_rad / np.sqrt(3.0)), float(shift / np.sqrt(3.0)), distance


@contextmanager
def _set(module: ModuleType, name: str, value: float) -> Iterator[None]:
    """Give a module's constant another value within the context."""
    before = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, before)


def _write(line: str) -> None:
    sys.stdout.write(f"{line}\n")
