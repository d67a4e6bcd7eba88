"""Several cameras at once: where they stand, from a board that they see at shared moments (SPEC 1.2, 1.3)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.bundle import Adjusted, Placement, Sighting, adjust, place_boards, residuals_px
from pipeline.calibration.estimate import Calibration, View, rms_px
from pipeline.calibration.lens import Optics
from pipeline.calibration.rig_start import Look, look, start
from pipeline.geometry import inverse, rigid, rotation_angle_rad, rotation_exp
from pipeline.types import FloatArray

LEAST_CAMERAS, MOST_CAMERAS = 2, 12
"""Six nodes, of which each may have a separate depth camera."""


@dataclass(frozen=True, slots=True)
class Seen:
    """The board as one image shows it, and whether a mark tells which way up."""

    view: View
    oriented: bool = True


@dataclass(frozen=True, slots=True)
class RelativePose:
    """Where one camera stands to another, and how sure that is."""

    camera: str
    reference: str
    T_reference_camera: FloatArray
    """(4, 4), metres."""
    covariance: FloatArray
    """(6, 6) of a small turn (radians) and of the camera's position (metres), along the reference's axes."""
    moments: int
    """At which both see the board."""

    @property
    def rotation_deg(self) -> float:
        """Angle between the cameras."""
        return float(np.degrees(rotation_angle_rad(self.T_reference_camera[:3, :3])))

    @property
    def baseline_m(self) -> float:
        """Distance between the cameras."""
        return float(np.linalg.norm(self.T_reference_camera[:3, 3]))

    @property
    def rotation_sd_deg(self) -> float:
        """Root mean square angle by which the rotation is off."""
        return float(np.degrees(np.sqrt(np.trace(self.covariance[:3, :3]))))

    @property
    def position_sd_m(self) -> float:
        """Root mean square distance by which the position is off."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    @property
    def baseline_sd_m(self) -> float:
        """Standard error of the distance."""
        along = self.T_reference_camera[:3, 3] / max(self.baseline_m, 1e-12)
        return float(np.sqrt(along @ self.covariance[3:, 3:] @ along))


@dataclass(frozen=True, slots=True)
class HeldOutRig:
    """Moments that had no part in the poses by which they are predicted."""

    residuals_px: Mapping[tuple[str, str], FloatArray]
    """(N, 2) by camera and moment; the board's pose alone is fitted, to all cameras that see it."""
    rotation_deg: Mapping[str, float]
    """By camera, the largest difference of its pose without a fold of the moments from that with all."""
    position_m: Mapping[str, float]

    @property
    def rms_px(self) -> float:
        """Over all points."""
        return rms_px(np.concatenate(list(self.residuals_px.values())))


@dataclass(frozen=True, slots=True)
class RigCalibration:
    """Cameras and boards in one frame."""

    names: tuple[str, ...]
    moments: tuple[str, ...]
    adjusted: Adjusted
    sightings: tuple[Sighting, ...]
    held_out: HeldOutRig | None
    """None if none was held out, or too few moments link the cameras for that."""

    @property
    def rms_px(self) -> float:
        """Over all points that any camera sees."""
        return rms_px(np.concatenate(self.adjusted.residuals_px))

    @property
    def T_first_camera(self) -> dict[str, FloatArray]:
        """(4, 4) pose of every camera in the frame of the first."""
        placed = self.adjusted.placement.T_camera_first
        return {name: inverse(T) for name, T in zip(self.names, placed, strict=True)}

    def camera_rms_px(self, name: str) -> float:
        """Over all points that one camera sees."""
        return rms_px(np.concatenate(list(self.residuals_px(name).values())))

    def residuals_px(self, name: str) -> dict[str, FloatArray]:
        """(N, 2) of one camera by moment, seen less predicted."""
        camera = self.names.index(name)
        every = zip(self.sightings, self.adjusted.residuals_px, strict=True)
        return {self.moments[one.moment]: off_px for one, off_px in every if one.camera == camera}

    def relative(self, camera: str, reference: str | None = None) -> RelativePose:
        """Where one camera stands to another, by default to the first."""
        reference = self.names[0] if reference is None else reference
        a, b = self.names.index(reference), self.names.index(camera)
        placed = self.adjusted.placement.T_camera_first
        T_a_b = placed[a] @ inverse(placed[b])
        x, y, z = T_a_b[:3, 3]
        by_a, by_b = np.eye(6), np.zeros((6, 6))
        by_a[3:, :3] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        by_b[:3, :3] = by_b[3:, 3:] = -T_a_b[:3, :3]
        J = np.zeros((6, len(self.names) * 6))
        J[:, 6 * a : 6 * a + 6] += by_a
        J[:, 6 * b : 6 * b + 6] += by_b
        covariance = J[:, 6:] @ self.adjusted.covariance @ J[:, 6:].T
        both = self.residuals_px(camera).keys() & self.residuals_px(reference).keys()
        return RelativePose(camera, reference, T_a_b, covariance, len(both))

    def pairs(self) -> list[RelativePose]:
        """Of every two cameras, the later to the earlier."""
        return [self.relative(b, a) for a, b in combinations(self.names, 2)]


def calibrate_rig(
    cameras: Mapping[str, Calibration],
    seen: Mapping[str, Mapping[str, Seen]],
    board: Board,
    folds: int = 0,
) -> RigCalibration:
    """Place cameras whose lenses are known.

    All poses of cameras and boards are adjusted together to the points in all images; two cameras need not
    see the board together if a third links them. The lenses stay as they are, and their uncertainty is
    carried into that of the poses. A board without a mark is turned as the other cameras have it (SPEC 1.2).

    OpenCV's ``calibrateMultiviewExtended`` finds the same poses (tests/pipeline/calibration/test_rig.py), but
    it takes every board as held the right way up, and tells nothing of how sure it is.

    Args:
        cameras: the lens of every camera by its name, the reference first.
        seen: by camera and moment.
        board: which is seen.
        folds: in how many turns moments are held out; 0 holds none out.

    Raises:
        InputError: too few cameras or too many, or some that never see the board together.
        ReconstructionError: the moments do not determine the poses.
    """
    names = tuple(cameras)
    if not LEAST_CAMERAS <= len(names) <= MOST_CAMERAS:
        raise InputError(
            f"{len(names)} cameras are given; a rig has two to six, each with one for depth at most"
        )
    optics = tuple(one.optics for one in cameras.values())
    seers = Counter(moment for name in names for moment in seen[name])
    moments = tuple(moment for moment, count in seers.items() if count > 1)
    looks = [
        look(_sighting(camera, index, seen[name][moment].view), optics[camera], seen[name][moment].oriented)
        for camera, name in enumerate(names)
        for index, moment in enumerate(moments)
        if moment in seen[name]
    ]
    problem = _Problem(names, optics, [one.covariance for one in cameras.values()], _turns(board))
    adjusted, sightings = problem.solved(looks)
    unseen = problem.held_out(sightings, adjusted.placement, moments, folds) if folds else None
    return RigCalibration(names, moments, adjusted, sightings, unseen)


def _sighting(camera: int, moment: int, view: View) -> Sighting:
    return Sighting(camera, moment, view.points_px, view.board_m)


def _turns(board: Board) -> list[FloatArray]:
    """(4, 4) motions in its plane after which the points of a board lie where they lay."""
    quarters = [0]
    if board.ambiguous:
        quarters = [0, 1, 2, 3] if board.columns == board.rows else [0, 2]
    return [rigid(rotation_exp(np.array([0.0, 0.0, 0.5 * np.pi * k])), np.zeros(3)) for k in quarters]


@dataclass(frozen=True, slots=True)
class _Problem:
    names: tuple[str, ...]
    optics: tuple[Optics, ...]
    lens_covariances: list[FloatArray]
    turns: list[FloatArray]

    def solved(self, looks: Sequence[Look]) -> tuple[Adjusted, tuple[Sighting, ...]]:
        begun, sightings = start(looks, self.optics, self.names, self.turns)
        return adjust(sightings, self.optics, self.lens_covariances, begun), sightings

    def held_out(
        self, sightings: Sequence[Sighting], whole: Placement, moments: Sequence[str], folds: int
    ) -> HeldOutRig | None:
        """Every moment by poses from the others."""
        residuals: dict[tuple[str, str], FloatArray] = {}
        turned_deg, moved_m = dict.fromkeys(self.names[1:], 0.0), dict.fromkeys(self.names[1:], 0.0)
        for fold in range(folds):
            known = [one for one in sightings if one.moment % folds != fold]
            left = [one for one in sightings if one.moment % folds == fold]
            try:
                cameras = self._without(known, whole)
            except ReconstructionError:
                return None
            for name, T, T_whole in zip(self.names[1:], cameras[1:], whole.T_camera_first[1:], strict=True):
                apart = inverse(T_whole) @ T
                turned_deg[name] = max(turned_deg[name], float(np.degrees(rotation_angle_rad(apart[:3, :3]))))
                off_m = inverse(T)[:3, 3] - inverse(T_whole)[:3, 3]
                moved_m[name] = max(moved_m[name], float(np.linalg.norm(off_m)))
            numbered, boards = _alone(left, whole)
            placed = place_boards(numbered, self.optics, Placement(cameras, boards))
            for one, off_px in zip(left, residuals_px(numbered, self.optics, placed), strict=True):
                residuals[self.names[one.camera], moments[one.moment]] = off_px
        return HeldOutRig(residuals, turned_deg, moved_m)

    def _without(self, known: Sequence[Sighting], whole: Placement) -> tuple[FloatArray, ...]:
        """(4, 4) of every camera in the first's frame, by some of the moments."""
        numbered, boards = _alone(known, whole)
        begun = Placement(whole.T_camera_first, boards)
        return adjust(numbered, self.optics, self.lens_covariances, begun).placement.T_camera_first


def _alone(some: Sequence[Sighting], whole: Placement) -> tuple[list[Sighting], tuple[FloatArray, ...]]:
    """Sightings with their moments numbered anew, and the boards of these."""
    kept = sorted({one.moment for one in some})
    numbered = [replace(one, moment=kept.index(one.moment)) for one in some]
    return numbered, tuple(whole.T_first_board[moment] for moment in kept)
