"""Anderson acceleration of a sequence of poses, with a safeguard (Zhang, Yao, Deng 2021, section 3.2)."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.registration.weighting import PairWeights
from pipeline.types import FloatArray


class Anderson:
    """Extrapolates the fixed point of T -> T_proposed from the last few poses and their updates.

    A pose is represented by the logarithm of the motion from the first pose to it: six numbers, and a
    seventh for the scale. The next pose is the affine combination of the last updates with the smallest
    combined residual (Walker, Ni 2011); the first call after a reset returns the proposal.
    """

    def __init__(self, memory: int = 5, center_m: ArrayLike = (0.0, 0.0, 0.0), spread_m: float = 1.0) -> None:
        """Start without any pose.

        Args:
            memory: number m of differences that are combined.
            center_m: (3,) point of the target frame about which rotations are taken.
            spread_m: length of a translation that counts as much as a rotation by one radian. With the
                centre and spread of the moving cloud, the poses depend neither on the frame nor on the unit.
        """
        self._to_unit = rigid(np.eye(3), -np.asarray(center_m, dtype=np.float64))
        self._to_unit[:3] /= spread_m
        self._from_unit = np.linalg.inv(self._to_unit)
        self._proposals: deque[FloatArray] = deque(maxlen=memory + 1)
        self._residuals: deque[FloatArray] = deque(maxlen=memory + 1)
        self._T_first = np.eye(4)

    def mix(self, T_current: FloatArray, T_proposed: FloatArray) -> FloatArray:
        """Return the next (4, 4) pose, from the current one and its plain update."""
        if not self._residuals:
            self._T_first = np.array(T_current, dtype=np.float64)
        proposal = self._coordinates(T_proposed)
        self._proposals.append(proposal)
        self._residuals.append(proposal - self._coordinates(T_current))
        if len(self._residuals) == 1:
            return T_proposed
        residual_changes = np.diff(np.array(self._residuals), axis=0).T
        proposal_changes = np.diff(np.array(self._proposals), axis=0).T
        shares = np.linalg.lstsq(residual_changes, self._residuals[-1])[0]
        motion = similarity_exp(proposal - proposal_changes @ shares)
        return self._from_unit @ motion @ self._to_unit @ self._T_first

    def reset(self) -> None:
        """Forget all poses: the next call returns its proposal."""
        self._proposals.clear()
        self._residuals.clear()

    def _coordinates(self, T: FloatArray) -> FloatArray:
        """Return the (7,) logarithm of the motion from the first pose to ``T``."""
        return similarity_log(self._to_unit @ T @ np.linalg.inv(self._T_first) @ self._from_unit)


class Acceleration:
    """Anderson acceleration of poses that undoes each extrapolation which raises the method's energy."""

    def __init__(self, moved_m: FloatArray) -> None:
        """Take frame and unit from the mean and spread of the (N, 3) moving points at the start pose."""
        center_m = moved_m.mean(axis=0)
        spread_m = float(np.sqrt(np.mean(np.sum((moved_m - center_m) ** 2, axis=1))))
        self._mixer = Anderson(center_m=center_m, spread_m=spread_m or 1.0)
        self._energy = float("inf")
        self._sigma_m = float("nan")
        self._plain: FloatArray | None = None

    def fallback(self, kept: PairWeights) -> FloatArray | None:
        """Return the pose of the last plain update if the extrapolated one raised the energy, else None."""
        if kept.sigma_m != self._sigma_m:
            self._mixer.reset()
        elif self._plain is not None and kept.energy > self._energy:
            self._mixer.reset()
            plain, self._plain = self._plain, None
            return plain
        return None

    def extrapolated(self, T: FloatArray, T_plain: FloatArray, kept: PairWeights) -> FloatArray:
        """Return the next pose, from the current one and its plain update."""
        self._energy, self._sigma_m, self._plain = kept.energy, kept.sigma_m, T_plain
        return self._mixer.mix(T, T_plain)


def similarity_log(T: FloatArray) -> FloatArray:
    """Return (7,): rotation vector and translation of the log of T's rigid part, and the log of its scale."""
    scale = np.cbrt(np.linalg.det(T[:3, :3]))
    omega_rad = Rotation.from_matrix(T[:3, :3] / scale).as_rotvec()
    return np.concatenate([omega_rad, np.linalg.solve(_left_jacobian(omega_rad), T[:3, 3]), [np.log(scale)]])


def similarity_exp(coordinates: FloatArray) -> FloatArray:
    """Return the (4, 4) transform with a given (7,) logarithm."""
    omega_rad, translation, log_scale = coordinates[:3], coordinates[3:6], coordinates[6]
    return rigid(np.exp(log_scale) * rotation_exp(omega_rad), _left_jacobian(omega_rad) @ translation)


def _left_jacobian(omega_rad: FloatArray) -> FloatArray:
    """Return (3, 3) I + (1 - cos a)/a^2 [w] + (a - sin a)/a^3 [w]^2 with a = |w|, numerically safe at 0."""
    angle = float(np.linalg.norm(omega_rad))
    x, y, z = omega_rad
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    second = (angle - np.sin(angle)) / angle**3 if angle > 1e-2 else 1.0 / 6.0 - angle**2 / 120.0
    return np.eye(3) + 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2 * skew + second * skew @ skew
