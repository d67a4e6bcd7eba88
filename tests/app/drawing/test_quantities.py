"""Lengths, angles and areas as a reader wants them: unit and decimals that fit, and an honest interval."""

import pytest

from app.compute.measures import Quantity
from app.drawing.quantities import quantity_text, short_text


def quantity(value, low, high, unit="m", name="length"):
    return Quantity(name, value, unit, low, high, False)


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (quantity(0.203, 0.200, 0.206), "20.3 ± 0.3 cm"),
        (quantity(0.2034, 0.2016, 0.2052), "20.34 ± 0.18 cm"),
        (quantity(0.2, 0.165, 0.235), "20 ± 4 cm"),
        (quantity(0.2, 0.186, 0.214), "20.0 ± 1.4 cm"),
        (quantity(2.3456, 2.3336, 2.3576), "2.346 ± 0.012 m"),
        (quantity(0.203, 0.191, 0.260), "20 cm (19 to 26)"),
        (quantity(90.24, 89.44, 91.04, "deg", "angle"), "90.2 ± 0.8°"),
        (quantity(90.2, 70.0, 95.0, "deg", "angle"), "90° (70 to 95)"),
        (quantity(0.0123, 0.0120, 0.0126, "m2", "area"), "123 ± 3 cm²"),
        (quantity(0.512, 0.48, 0.544, "m2", "area"), "0.51 ± 0.03 m²"),
    ],
)
def test_a_number_is_written_with_its_interval_in_the_unit_that_fits(one, text):
    assert quantity_text(one) == text


def test_a_label_has_one_number_with_its_interval_or_the_sides_of_a_box():
    width, depth, height = (quantity(value, value - 0.003, value + 0.003) for value in (0.301, 0.2, 0.151))
    assert short_text([width]) == "30.1 ± 0.3 cm"
    assert short_text([width, depth, height]) == "30.1 × 20.0 × 15.1 cm"
    assert short_text([quantity(1.5, 1.49, 1.51), depth, height]) == "1.500 × 0.200 × 0.151 m"
