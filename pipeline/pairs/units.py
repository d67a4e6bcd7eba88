"""Check that two clouds are in the same unit, by their sizes and shapes."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import FloatArray, PointCloud

_log = logging.getLogger(__name__)

_QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)
"""Quantiles of the distances from the middle, which describe a cloud's shape whatever its pose."""
_INNER = 0.95
"""The middle is the centroid of this share of the points, those nearest to the centroid of all."""
_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048, "yards": 0.9144}
_LARGE = 20.0
"""From this factor on a similar shape is enough: clouds of the same place do not differ so much in size."""
_KILO = 300.0, 3000.0
"""A factor between these is taken for a thousand, whatever the shapes."""
_SIMILAR, _SAME = 0.35, 0.02
"""Largest relative deviation of the quantiles' ratios for similar and for the same shapes."""
_LEAST_FACTOR = 1.05
"""Smaller factors are never taken for another unit."""
_NOTED_FACTOR = 1.01
"""From this factor on clouds of the same shape get a note about their sizes."""
_OF_DEVIATION = 3.0
"""A factor must differ from one by this many times the deviation."""
_USUAL_M = 0.05, 50.0
"""Usual sizes, metres: from objects to houses."""


@dataclass(frozen=True, slots=True)
class SizeRatio:
    """How the size of a source relates to that of a target."""

    factor: float
    """Median ratio of the quantiles of the distances from the middle, source over target."""
    deviation: float
    """Largest relative deviation of a ratio from ``factor``: 0 for clouds of the same shape, infinite if a
    quantile of a cloud is 0."""


def size_ratio(source_m: FloatArray, target_m: FloatArray) -> SizeRatio:
    """Compare the sizes and shapes of (N, 3) and (M, 3) points, whatever their poses."""
    there, here = _distances_m(source_m), _distances_m(target_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = there / here
    if not (np.isfinite(ratios).all() and (ratios > 0.0).all()):
        return SizeRatio(1.0, float("inf"))
    factor = float(np.median(ratios))
    return SizeRatio(factor, float(np.abs(ratios / factor - 1.0).max()))


def check_units(
    source: PointCloud,
    target: PointCloud,
    metres_per_unit: tuple[float, float] | None,
    with_scale: bool,
) -> None:
    """Check that two clouds seem to be in the same unit.

    Args:
        source: the cloud that moves, in metres.
        target: the cloud that stays, in metres.
        metres_per_unit: the metres per unit of both that the user has given; then only a factor of about a
            thousand is refused.
        with_scale: whether a scale is estimated; then only large factors are refused.

    Raises:
        InputError: one cloud is as large as if it were in another unit.
    """
    found = size_ratio(source.points_m, target.points_m)
    larger, smaller = ("source", "target") if found.factor > 1.0 else ("target", "source")
    factor = max(found.factor, 1.0 / found.factor)
    if _KILO[0] < factor < _KILO[1]:
        raise _thousand(larger, factor, target if larger == "source" else source, metres_per_unit)
    if metres_per_unit is not None or not _differs(found.deviation, factor, with_scale):
        if _NOTED_FACTOR < factor <= _LEAST_FACTOR and found.deviation <= _SAME and not with_scale:
            _log.warning(
                "The %s cloud is %.3f times as large as the other and of about the same shape; if both "
                "show the same place, try --scale, which estimates the factor",
                larger,
                factor,
            )
        return
    tolerance = _SIMILAR if factor >= _LARGE else _SAME
    name = min(_UNITS, key=lambda unit: abs(np.log(factor * _UNITS[unit])))
    if abs(factor * _UNITS[name] - 1.0) <= tolerance:
        what, metres = f"in {name} and the other in metres", _UNITS[name]
    else:
        what, metres = "in another unit", float(f"{1.0 / factor:.4g}")
    raise InputError(
        f"The {larger} cloud is {factor:.3g} times as large as the {smaller} and of about the same shape, as "
        f"if it were {what}; {unit_advice({larger: metres}, None)}, or 1 1 if both are in metres"
    )


def _distances_m(points_m: FloatArray) -> FloatArray:
    """Return quantiles of the distances from the middle."""
    lengths_m = np.linalg.norm(points_m - points_m.mean(axis=0), axis=1)
    middle_m = points_m[lengths_m <= np.quantile(lengths_m, _INNER)].mean(axis=0)
    return np.quantile(np.linalg.norm(points_m - middle_m, axis=1), _QUANTILES)


def _differs(deviation: float, factor: float, with_scale: bool) -> bool:
    """Return whether a factor of at least one means another unit.

    From 3000 on it does not: ``prepared_cloud`` refuses implausible sizes.
    """
    if factor >= _LARGE:
        return factor < _KILO[1] and deviation <= _SIMILAR
    alike = deviation <= _SAME and factor - 1.0 > _OF_DEVIATION * deviation
    return alike and factor > _LEAST_FACTOR and not with_scale


def _thousand(
    larger: str, factor: float, other: PointCloud, metres_per_unit: tuple[float, float] | None
) -> InputError:
    """Return the error for a factor of about 1000: the larger cloud in millimetres or the smaller in km."""
    size_m = 2.0 * float(_distances_m(other.points_m)[-1])
    kilometres = size_m < _USUAL_M[0] and _USUAL_M[0] <= factor * size_m <= _USUAL_M[1]
    if kilometres:
        smaller = "target" if larger == "source" else "source"
        return InputError(
            f"The {larger} cloud is {factor:.0f} times as large as the other, as if the {smaller} were in "
            f"kilometres and the other in metres; {unit_advice({smaller: 1000.0}, metres_per_unit)}"
        )
    return InputError(
        f"The {larger} cloud is {factor:.0f} times as large as the other, as if it were in millimetres and "
        f"the other in metres; {unit_advice({larger: 0.001}, metres_per_unit)}"
    )


def unit_advice(factors: dict[str, float], metres_per_unit: tuple[float, float] | None) -> str:
    """Return the advice to change the units of clouds that were converted to metres.

    Args:
        factors: by what the converted ``source``, ``target`` or both must be multiplied.
        metres_per_unit: the metres per unit that the user gave for this; without them the units in the files'
            headers were used.
    """
    source, target = metres_per_unit or (1.0, 1.0)
    numbers = f"{factors.get('source', 1.0) * source:.6g} {factors.get('target', 1.0) * target:.6g}"
    header = " (times the unit in a file's header, if it has one)" if metres_per_unit is None else ""
    return f"try --metres-per-unit {numbers}{header}"
