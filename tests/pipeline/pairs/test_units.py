"""Two clouds of which one is in another unit: the factor, its name, and the option that settles it."""

import re

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.pairs.register import prepared_cloud
from pipeline.pairs.units import check_units, size_ratio
from pipeline.types import PointCloud

RNG = np.random.default_rng(8)
AWAY = rigid(rotation_exp(np.array([0.3, -0.9, 0.5])), [2.0, -1.0, 0.5])


def room(count: int, size_m=(6.0, 5.0, 3.0)) -> np.ndarray:
    """Random points on the walls of a room."""
    points = RNG.uniform(0.0, 1.0, (count, 3))
    points[np.arange(count), RNG.integers(0, 3, count)] = RNG.integers(0, 2, count)
    return points * size_m


def checked(source_m, target_m, metres_per_unit=None, with_scale=False):
    check_units(PointCloud(source_m), PointCloud(target_m), metres_per_unit, with_scale)


def test_the_ratio_does_not_depend_on_the_pose():
    points_m = room(3000)
    found = size_ratio(apply(AWAY, 3.0 * points_m), points_m)
    assert found.factor == pytest.approx(3.0, rel=1e-9)
    assert found.deviation == pytest.approx(0.0, abs=1e-9)
    assert size_ratio(points_m, room(3000, (6.0, 1.0, 1.0))).deviation > 0.1


UNITS = [
    ("millimetres", 0.001),
    ("centimetres", 0.01),
    ("inches", 0.0254),
    ("feet", 0.3048),
    ("yards", 0.9144),
]


@pytest.mark.parametrize(("name", "metres"), UNITS)
@pytest.mark.parametrize("moving", [True, False])
def test_a_unit_is_named_and_the_option_brings_the_clouds_to_one_size(name, metres, moving):
    one, other = apply(AWAY, room(20_000)) / metres, room(20_000)
    pair = (one, other) if moving else (other, one)
    with pytest.raises(InputError, match=f"in {name} and the other in metres") as caught:
        checked(*pair)
    factors = [
        float(word) for word in re.search(r"--metres-per-unit (\S+) ([^,\s]+)", str(caught.value)).groups()
    ]
    assert factors == ([metres, 1.0] if moving else [1.0, metres])
    scaled = [factor * points for factor, points in zip(factors, pair, strict=True)]
    checked(*scaled)
    checked(*scaled, tuple(factors))


def test_kilometres_are_named():
    with pytest.raises(InputError, match=r"the source were in kilometres.*--metres-per-unit 1000 1"):
        checked(0.001 * room(3000), room(3000))


def test_any_factor_is_named_where_the_shapes_are_the_same():
    with pytest.raises(
        InputError, match=r"target cloud is 2\.\d+ times .* in another unit; try --metres-per"
    ) as caught:
        checked(room(20_000), apply(AWAY, 2.5 * room(20_000)))
    factor = float(re.search(r"--metres-per-unit 1 (\S+) ", str(caught.value))[1])
    assert factor == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("metres_per_unit", [(1.0, 1.0), None])
def test_parts_of_a_place_may_differ_in_size(metres_per_unit):
    whole = room(20_000)
    checked(whole[whole[:, 0] < 2.0], whole, metres_per_unit)
    checked(whole, room(20_000) * 1.03, metres_per_unit)


def test_given_units_settle_it_except_for_a_thousand():
    checked(3.28 * room(3000), room(3000), (1.0, 1.0))
    checked(3.28 * room(3000), room(3000), with_scale=True)
    with pytest.raises(InputError, match="in millimetres"):
        checked(1000.0 * room(3000), room(3000), (1.0, 1.0))
    with pytest.raises(InputError, match="in centimetres"):
        checked(100.0 * room(3000), room(3000), with_scale=True)


def test_a_scale_of_two_per_cent_is_noted_and_scale_silences_the_note(caplog):
    points_m = room(5000)
    checked(1.02 * apply(AWAY, points_m), points_m)
    assert "source cloud is 1.020 times as large" in caplog.text
    assert "try --scale" in caplog.text
    caplog.clear()
    checked(1.02 * points_m, points_m, with_scale=True)
    checked(points_m, points_m)
    assert not caplog.records


def test_advice_takes_the_given_units_along():
    """Both clouds are in millimetres: whichever of them was left out, the advice is the unit of both."""
    source, target = 1000.0 * room(3000), 1000.0 * room(3000)
    for given in ((1.0, 0.001), (0.001, 1.0)):
        with pytest.raises(InputError, match=r"try --metres-per-unit 0\.001 0\.001$"):
            checked(given[0] * source, given[1] * target, given)
    checked(0.001 * source, 0.001 * target, (0.001, 0.001))
    with pytest.raises(InputError, match=r"in kilometres.*; try --metres-per-unit 0\.3048 304\.8$"):
        checked(room(3000), 0.001 * room(3000), (0.3048, 0.3048))


def test_without_given_units_the_advice_names_those_of_the_headers():
    with pytest.raises(InputError, match=r"per-unit 0\.001 1 \(times the unit in a file's header, if it has"):
        checked(1000.0 * room(3000), room(3000))


def test_an_implausible_size_is_told_in_whole_metres_and_takes_the_given_units_along():
    cloud = PointCloud(1000.0 * room(3000))
    with pytest.raises(InputError, match=r"is 6000 m across.*; try --metres-per-unit 0\.001 0\.001 \("):
        prepared_cloud(cloud, "source", None)
    with pytest.raises(
        InputError, match=r"; try --metres-per-unit 0\.0001 0\.001 if both are in millimetres"
    ):
        prepared_cloud(cloud, "source", None, (0.1, 1.0))
