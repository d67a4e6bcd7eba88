"""Selection of the M of N cameras that send, for the best joint view of the surface (SPEC 6.3, thesis 3.6.2).

``q`` (N, V) is the quality of camera i's view of surface voxel v, from 0 to 1. A set S of cameras has value
``F(S) = sum_v w_v (1 - prod over i in S of (1 - q_iv))``: monotone and submodular, so that the greedy choice
of M cameras has at least 1 - 1/e of the optimum (Nemhauser, Wolsey and Fisher 1978).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Selection:
    """The selected cameras."""

    cameras: tuple[int, ...]
    """Camera indices, in the order of selection."""
    values: tuple[float, ...]
    """F after each selected camera."""
    evaluations: int
    """Number of computed gains of a single camera."""

    @property
    def value(self) -> float:
        """F of all selected cameras."""
        return self.values[-1] if self.values else 0.0


def view_quality(
    visible: BoolArray, distance_m: FloatArray, cos_incidence: FloatArray, reference_m: float
) -> FloatArray:
    """Return the view quality (N, V): visibility x resolution x incidence.

    Args:
        visible: (N, V) whether camera i sees voxel v.
        distance_m: (N, V) distance from camera to voxel.
        cos_incidence: (N, V) cosine between the line of sight and the surface normal.
        reference_m: distance up to which the resolution is full; beyond it pixels per area fall with the
            square of the distance.
    """
    resolution = np.minimum(1.0, (reference_m / np.maximum(distance_m, reference_m)) ** 2)
    return np.where(visible, resolution * np.clip(cos_incidence, 0.0, 1.0), 0.0)


def coverage(q: FloatArray, cameras: Sequence[int], weights: FloatArray | None = None) -> float:
    """Return F of a set of cameras, the expected weight of the voxels that at least one of them sees.

    F = sum_v w_v (1 - prod_i (1 - q_iv)) over voxels v (SPEC 6.3); ``weights`` w (V,) are one by default.
    """
    missed = np.prod(1.0 - q[list(cameras)], axis=0)
    return float(_weights(q, weights) @ (1.0 - missed))


def greedy(q: FloatArray, count: int, weights: FloatArray | None = None) -> Selection:
    """Select at most ``count`` cameras greedily by largest gain; cameras without a gain are left out.

    Gains are evaluated lazily: a camera's gain never grows, so old gains are upper bounds (Minoux 1978).

    Raises:
        InputError: ``q`` is no (N, V) array of shares, a weight is negative, or ``count`` is not 1 to N.
    """
    _check(q, count, weights)
    return _lazy(q, count, weights, np.ones(len(q)), np.zeros(len(q)), math.inf)


def greedy_by_cost(
    q: FloatArray, costs: FloatArray, budget: float, weights: FloatArray | None = None
) -> Selection:
    """Select cameras whose total cost stays within ``budget`` (bytes or joules).

    The result is the better of two greedy choices, by gain per cost and by gain; either alone can be
    arbitrarily bad, the better has at least (1 - 1/e) / 2 of the optimum (Leskovec et al. 2007, CELF).

    Args:
        q: (N, V) quality of each camera's view of each voxel.
        costs: (N,) cost of each camera's images, above zero.
        budget: largest total cost of the selected cameras.
        weights: (V,) weight of each voxel; one by default.

    Raises:
        InputError: ``q``, a weight or a cost is out of range, or the budget is less than every cost.
    """
    _check(q, len(q), weights)
    if costs.shape != (len(q),) or not np.all((costs > 0.0) & np.isfinite(costs)):
        raise InputError(f"{len(q)} cameras need as many costs above 0; try the bytes of their images")
    if not budget >= costs.min():
        raise InputError(f"A budget of {budget:g} pays for no camera; try at least {costs.min():g}")
    by_cost = _lazy(q, len(q), weights, costs, costs, budget)
    by_gain = _lazy(q, len(q), weights, np.ones(len(q)), costs, budget)
    return by_cost if by_cost.value >= by_gain.value else by_gain


def at_random(
    q: FloatArray, count: int, rng: np.random.Generator, weights: FloatArray | None = None
) -> Selection:
    """Select ``count`` cameras at random, independent of ``q``; raises as ``greedy``."""
    _check(q, count, weights)
    return _as_given(q, [int(camera) for camera in rng.permutation(len(q))[:count]], weights)


def nearest(
    q: FloatArray, count: int, distances_m: FloatArray, weights: FloatArray | None = None
) -> Selection:
    """Select the ``count`` cameras with the least (N,) distances, for example to the sink or the scene;
    raises as ``greedy``."""
    _check(q, count, weights)
    order = np.argsort(distances_m, kind="stable")[:count]
    return _as_given(q, [int(camera) for camera in order], weights)


def all_cameras(q: FloatArray, weights: FloatArray | None = None) -> Selection:
    """Select all cameras, in order, as the baseline."""
    _check(q, len(q), weights)
    return _as_given(q, list(range(len(q))), weights)


def _as_given(q: FloatArray, cameras: list[int], weights: FloatArray | None) -> Selection:
    values = tuple(coverage(q, cameras[: i + 1], weights) for i in range(len(cameras)))
    return Selection(tuple(cameras), values, evaluations=0)


def _lazy(
    q: FloatArray,
    count: int,
    weights: FloatArray | None,
    divisors: FloatArray,
    costs: FloatArray,
    budget: float,
) -> Selection:
    """Select lazily and greedily by gain / divisor; cameras above the remaining budget are left out."""
    remaining = _weights(q, weights).copy()
    chosen: list[int] = []
    values: list[float] = []
    value, evaluations = 0.0, len(q)
    heap = [(-float(row @ remaining) / float(divisors[i]), i, 0) for i, row in enumerate(q)]
    heapq.heapify(heap)
    while heap and len(chosen) < count:
        bound, camera, known = heapq.heappop(heap)
        if bound >= 0.0:
            break
        if costs[camera] > budget:
            continue
        if known < len(chosen):
            evaluations += 1
            gain = float(q[camera] @ remaining)
            heapq.heappush(heap, (-gain / float(divisors[camera]), camera, len(chosen)))
            continue
        value -= bound * float(divisors[camera])
        remaining *= 1.0 - q[camera]
        budget -= float(costs[camera])
        chosen.append(camera)
        values.append(value)
    return Selection(tuple(chosen), tuple(values), evaluations)


def _weights(q: FloatArray, weights: FloatArray | None) -> FloatArray:
    return np.ones(q.shape[1]) if weights is None else weights


def _check(q: FloatArray, count: int, weights: FloatArray | None) -> None:
    if q.ndim != 2 or q.size == 0 or not np.all((q >= 0.0) & (q <= 1.0)):
        raise InputError(
            f"View qualities of shape {q.shape} cannot be used; try shares from 0 to 1, "
            "a row a camera and a column a voxel"
        )
    if not 1 <= count <= len(q):
        raise InputError(f"{count} of {len(q)} cameras cannot be chosen; try 1 to {len(q)}")
    if weights is not None and (weights.shape != (q.shape[1],) or not np.all(weights >= 0.0)):
        raise InputError(f"{q.shape[1]} voxels need as many weights, none negative; got {weights.shape}")
