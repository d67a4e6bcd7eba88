"""Calibration of several cameras and their poses, from a board seen at shared moments (SPEC 1.2, 1.3)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.bundle import Adjusted, Bundle, Sighting, adjust, place_boards
from pipeline.calibration.estimate import LEAST_VIEWS, Calibration, FittedView, View, rms_px
from pipeline.calibration.rig_start import look, start
from pipeline.kernels.geometry import inverse, rigid, rotation_angle_rad, rotation_exp
from pipeline.types import FloatArray

LEAST_CAMERAS, MOST_CAMERAS = 2, 12
"""Least and most cameras: six nodes, each of which may have a separate depth camera."""

MISFIT, MISFIT_PX = 5.0, 2.0
"""A rig is accepted if its RMS is at most the first times that of the worst camera alone, or at most the
second in pixels."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Points of the board in one image, and whether a mark shows its orientation."""

    view: View
    oriented: bool = True


@dataclass(frozen=True, slots=True)
class RelativePose:
    """Pose of one camera relative to another, with its uncertainty."""

    camera: str
    reference: str
    T_reference_camera: FloatArray
    """(4, 4), metres."""
    covariance: FloatArray
    """(6, 6) covariance of a small rotation (radians) and the position (metres), in the reference's frame."""
    moments: int
    """Number of moments at which both see the board."""

    @property
    def rotation_deg(self) -> float:
        """Angle of the rotation between the cameras."""
        return float(np.degrees(rotation_angle_rad(self.T_reference_camera[:3, :3])))

    @property
    def baseline_m(self) -> float:
        """Distance between the cameras."""
        return float(np.linalg.norm(self.T_reference_camera[:3, 3]))

    @property
    def rotation_sd_deg(self) -> float:
        """Root mean square angle of the rotation's error."""
        return float(np.degrees(np.sqrt(np.trace(self.covariance[:3, :3]))))

    @property
    def position_sd_m(self) -> float:
        """Root mean square distance of the position's error."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    @property
    def baseline_sd_m(self) -> float:
        """Standard error of the distance between the cameras."""
        along = self.T_reference_camera[:3, 3] / max(self.baseline_m, 1e-12)
        return float(np.sqrt(along @ self.covariance[3:, 3:] @ along))


@dataclass(frozen=True, slots=True)
class HeldOutRig:
    """Held-out moments, predicted by poses that were estimated without them."""

    views: Mapping[str, tuple[FittedView, ...]]
    """Views by camera; only the board's pose is fitted, to all cameras that see it."""
    rotation_deg: Mapping[str, float]
    """Largest rotation, by camera, between its poses without a fold and with all moments."""
    position_m: Mapping[str, float]
    """Largest shift, by camera, between the same poses, metres."""

    @property
    def rms_px(self) -> float:
        """RMS over all points."""
        return rms_px(np.concatenate([one.residuals_px for views in self.views.values() for one in views]))


@dataclass(frozen=True, slots=True)
class RigCalibration:
    """Cameras and boards in one frame."""

    cameras: Mapping[str, Calibration]
    """Lenses estimated from all cameras together."""
    moments: tuple[str, ...]
    adjusted: Adjusted
    sightings: tuple[Sighting, ...]
    held_out: HeldOutRig | None
    """None if no moment was held out, or the moments without a fold do not determine the cameras."""

    @property
    def rms_px(self) -> float:
        """RMS over all points that any camera sees."""
        return rms_px(np.concatenate(self.adjusted.residuals_px))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cameras; the first is the reference of the others."""
        return tuple(self.cameras)

    @property
    def T_first_camera(self) -> dict[str, FloatArray]:
        """(4, 4) pose of every camera in the frame of the first."""
        placed = self.adjusted.bundle.T_camera_first
        return {name: inverse(T) for name, T in zip(self.names, placed, strict=True)}

    def moments_of(self, name: str) -> set[str]:
        """Return the moments at which a camera sees the board."""
        camera = self.names.index(name)
        return {self.moments[one.moment] for one in self.sightings if one.camera == camera}

    def relative(self, camera: str, reference: str | None = None) -> RelativePose:
        """Return the pose of one camera relative to another, by default the first."""
        reference = self.names[0] if reference is None else reference
        a, b = self.names.index(reference), self.names.index(camera)
        placed = self.adjusted.bundle.T_camera_first
        T_a_b = placed[a] @ inverse(placed[b])
        x, y, z = T_a_b[:3, 3]
        by_a, by_b = np.eye(6), np.zeros((6, 6))
        by_a[3:, :3] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        by_b[:3, :3] = by_b[3:, 3:] = -T_a_b[:3, :3]
        J = np.zeros((6, len(self.names) * 6))
        J[:, 6 * a : 6 * a + 6] += by_a
        J[:, 6 * b : 6 * b + 6] += by_b
        covariance = J[:, 6:] @ self.adjusted.camera_covariance @ J[:, 6:].T
        both = self.moments_of(camera) & self.moments_of(reference)
        return RelativePose(camera, reference, T_a_b, covariance, len(both))

    def pairs(self) -> list[RelativePose]:
        """Return the relative poses of all pairs, the later camera in the frame of the earlier."""
        return [self.relative(b, a) for a, b in combinations(self.names, 2)]


def calibrate_rig(
    cameras: Mapping[str, Calibration],
    seen: Mapping[str, Mapping[str, Seen]],
    board: Board,
    folds: int = 0,
) -> RigCalibration:
    """Estimate the cameras' poses, and refine their lenses, which a rig determines better than one camera.

    Lenses and all poses of cameras and boards are adjusted together to the points in all images; two cameras
    need not see the board together if a third links them. A board without a mark gets the orientation that
    agrees with the other cameras (SPEC 1.2).

    OpenCV's ``calibrateMultiviewExtended`` finds the same poses for the same lenses, but keeps each lens as
    estimated by its camera alone, which more than doubles the error of the poses; it assumes every board
    upright, and returns no uncertainty (tests/pipeline/calibration/test_rig.py).

    Args:
        cameras: every camera by name, calibrated by its own views, the reference first.
        seen: sightings by camera and moment, including moments seen by one camera only.
        board: the board in the images.
        folds: number of folds of held-out moments; 0 holds none out.

    Raises:
        InputError: there are too few cameras or too many, or some that never see the board together.
        ReconstructionError: the moments do not determine the poses, or no rigid rig explains them.
    """
    names = tuple(cameras)
    if not LEAST_CAMERAS <= len(names) <= MOST_CAMERAS:
        raise InputError(
            f"A rig has two to six cameras, each with one for depth at most, and {len(names)} are given"
        )
    optics = tuple(one.optics for one in cameras.values())
    moments = tuple(dict.fromkeys(moment for name in names for moment in seen[name]))
    looks = [
        look(
            Sighting(camera, moments.index(moment), one.view.points_px, one.view.board_m),
            optics[camera],
            one.oriented,
        )
        for camera, name in enumerate(names)
        for moment, one in seen[name].items()
    ]
    begun, sightings = start(looks, optics, names, _turns(board))
    try:
        adjusted = adjust(sightings, begun)
    except np.linalg.LinAlgError:
        raise ReconstructionError(
            "The images do not determine the cameras together; show the board to two cameras at once more "
            "often, tilted differently"
        ) from None
    _check_fit(rms_px(np.concatenate(adjusted.residuals_px)), max(one.rms_px for one in cameras.values()))
    titles = [seen[names[one.camera]][moments[one.moment]].view.name for one in sightings]
    views = _views(names, titles, sightings, adjusted.bundle)
    lenses = {
        name: replace(
            cameras[name],
            matrix=lens.matrix,
            distortion=lens.distortion,
            covariance=covariance,
            views=views[name],
        )
        for name, lens, covariance in zip(
            names, adjusted.bundle.optics, adjusted.lens_covariances, strict=True
        )
    }
    unseen = _held_out(names, titles, sightings, adjusted.bundle, folds) if folds else None
    return RigCalibration(lenses, moments, adjusted, sightings, unseen)


def _check_fit(together_px: float, alone_px: float) -> None:
    """Raise a ReconstructionError if the cameras fit much worse together than alone."""
    if together_px > max(MISFIT * alone_px, MISFIT_PX):
        raise ReconstructionError(
            f"The cameras do not fit together: points are off by {together_px:.1f} px, but by "
            f"{alone_px:.2f} px for a camera alone; check that images with the same number show the same "
            "moment, and that no camera moved"
        )


def _views(
    names: Sequence[str], titles: Sequence[str], sightings: Sequence[Sighting], bundle: Bundle
) -> dict[str, tuple[FittedView, ...]]:
    """Return the fitted views by camera, in the order of the sightings."""
    views: dict[str, list[FittedView]] = {name: [] for name in names}
    for title, one, off_px in zip(titles, sightings, bundle.residuals_px(sightings), strict=True):
        fitted = FittedView(title, bundle.T_camera_board(one), off_px, one.points_px, one.board_m)
        views[names[one.camera]].append(fitted)
    return {name: tuple(some) for name, some in views.items()}


def _turns(board: Board) -> list[FloatArray]:
    """Return the (4, 4) rotations about a board's normal that map its points onto each other."""
    quarters = [0]
    if board.ambiguous:
        square = board.columns == board.rows and board.pattern != "circles-asymmetric"
        quarters = [0, 1, 2, 3] if square else [0, 2]
    return [rigid(rotation_exp(np.array([0.0, 0.0, 0.5 * np.pi * k])), np.zeros(3)) for k in quarters]


def _held_out(
    names: Sequence[str], titles: Sequence[str], sightings: Sequence[Sighting], whole: Bundle, folds: int
) -> HeldOutRig | None:
    """Predict every moment with cameras estimated without its fold; None if the other folds do not link
    or do not determine them, or leave a camera too few views.
    """
    views: dict[str, tuple[FittedView, ...]] = dict.fromkeys(names, ())
    turned_deg, moved_m = dict.fromkeys(names[1:], 0.0), dict.fromkeys(names[1:], 0.0)
    for fold in range(folds):
        left = [index for index, one in enumerate(sightings) if one.moment % folds == fold]
        rest, begun = _alone([one for one in sightings if one.moment % folds != fold], whole)
        if not left or not _determined(rest, len(names)):
            return None
        unseen, boards = _alone([sightings[index] for index in left], whole)
        try:
            found = adjust(rest, begun).bundle
            placed = place_boards(unseen, replace(found, T_first_board=boards.T_first_board))
        except np.linalg.LinAlgError:
            return None
        for name, T, T_whole in zip(
            names[1:], found.T_camera_first[1:], whole.T_camera_first[1:], strict=True
        ):
            apart = np.degrees(rotation_angle_rad(T[:3, :3] @ T_whole[:3, :3].T))
            turned_deg[name] = max(turned_deg[name], float(apart))
            off_m = inverse(T)[:3, 3] - inverse(T_whole)[:3, 3]
            moved_m[name] = max(moved_m[name], float(np.linalg.norm(off_m)))
        for name, some in _views(names, [titles[index] for index in left], unseen, placed).items():
            views[name] += some
    return HeldOutRig(views, turned_deg, moved_m)


def _alone(some: Sequence[Sighting], whole: Bundle) -> tuple[list[Sighting], Bundle]:
    """Renumber the moments of some sightings, and return them with the bundle of only their boards."""
    kept = sorted({one.moment for one in some})
    numbered = [replace(one, moment=kept.index(one.moment)) for one in some]
    return numbered, replace(whole, T_first_board=tuple(whole.T_first_board[moment] for moment in kept))


def _determined(sightings: Sequence[Sighting], cameras: int) -> bool:
    """Return whether shared moments link all cameras, and each has enough views for its lens."""
    counts = Counter(one.camera for one in sightings)
    together = [
        {one.camera for one in sightings if one.moment == moment} for moment in {s.moment for s in sightings}
    ]
    linked = {0}
    for _ in range(cameras):
        linked |= set().union(*(some for some in together if some & linked))
    return len(linked) == cameras and min(counts[camera] for camera in range(cameras)) >= LEAST_VIEWS
