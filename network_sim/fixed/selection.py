"""Which M of N cameras send, so that together they see the surface best (SPEC 6.3, thesis 3.6.2).

``q`` (N, V) is the quality of camera i's view of surface voxel v, from 0 to 1. A set S of cameras has value
``F(S) = sum_v w_v (1 - prod over i in S of (1 - q_iv))``: monotone and submodular, so that taking the best
next camera M times gives at least 1 - 1/e of the optimum (Nemhauser, Wolsey and Fisher 1978).
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
    """The cameras that send."""

    cameras: tuple[int, ...]
    """In the order in which they were chosen."""
    values: tuple[float, ...]
    """F after each of them."""
    evaluations: int
    """Gains of a single camera that were computed."""

    @property
    def value(self) -> float:
        """F of all of them."""
        return self.values[-1] if self.values else 0.0


def view_quality(
    visible: BoolArray, distance_m: FloatArray, cos_incidence: FloatArray, reference_m: float
) -> FloatArray:
    """(N, V) visibility x resolution x incidence.

    Args:
        visible: (N, V) whether camera i sees voxel v.
        distance_m: (N, V) from camera to voxel.
        cos_incidence: (N, V) cosine between the line of sight and the surface's normal.
        reference_m: distance up to which the resolution is full; beyond it pixels per area fall with the
            square of the distance.
    """
    resolution = np.minimum(1.0, (reference_m / np.maximum(distance_m, reference_m)) ** 2)
    return np.where(visible, resolution * np.clip(cos_incidence, 0.0, 1.0), 0.0)


def coverage(q: FloatArray, cameras: Sequence[int], weights: FloatArray | None = None) -> float:
    """F of a set of cameras; ``weights`` (V,) are one by default."""
    missed = np.prod(1.0 - q[list(cameras)], axis=0)
    return float(_weights(q, weights) @ (1.0 - missed))


def greedy(q: FloatArray, count: int, weights: FloatArray | None = None) -> Selection:
    """At most ``count`` cameras, always the one with the largest gain next; none that gains nothing.

    Lazy: a camera's gain never grows while others are chosen, so that old gains are bounds (Minoux 1978).

    Raises:
        InputError: ``q`` is no (N, V) array of shares, a weight is negative, or ``count`` is not 1 to N.
    """
    _check(q, count, weights)
    return _lazy(q, count, weights, np.ones(len(q)), np.zeros(len(q)), math.inf)


def greedy_by_cost(
    q: FloatArray, costs: FloatArray, budget: float, weights: FloatArray | None = None
) -> Selection:
    """Cameras whose costs stay within ``budget``: bytes, or joules.

    The better of two greedy choices, by gain per cost and by gain alone; either alone can be arbitrarily bad,
    the better one has at least (1 - 1/e) / 2 of the optimum (Leskovec et al. 2007, CELF).

    Args:
        q: (N, V) how well each camera sees each voxel.
        costs: (N,) what each camera's images cost, above zero.
        budget: what all chosen ones may cost together.
        weights: (V,) what each voxel is worth; one by default.

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
    """``count`` cameras drawn without regard to what they see."""
    _check(q, count, weights)
    return _as_given(q, [int(camera) for camera in rng.permutation(len(q))[:count]], weights)


def nearest(
    q: FloatArray, count: int, distances_m: FloatArray, weights: FloatArray | None = None
) -> Selection:
    """The ``count`` cameras with the least of the (N,) distances, to the sink or to what is looked at."""
    _check(q, count, weights)
    order = np.argsort(distances_m, kind="stable")[:count]
    return _as_given(q, [int(camera) for camera in order], weights)


def all_cameras(q: FloatArray, weights: FloatArray | None = None) -> Selection:
    """Every camera, in order: the baseline of every selection."""
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
    """Lazy greedy by gain over divisor; a camera that the rest of the budget does not pay for is left out."""
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
