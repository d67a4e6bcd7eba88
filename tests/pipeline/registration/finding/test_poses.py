"""Lengths as text."""

import pytest

from pipeline.registration.finding.poses import length

LENGTHS = {
    0.0042: "0.42 cm",
    0.0949: "9.5 cm",
    0.9949: "99 cm",
    0.995: "0.995 m",
    0.999: "0.999 m",
    1.0: "1 m",
    12.345: "12.3 m",
    999.4: "999 m",
    999.7: "1000 m",
    1234.5: "1234 m",
    5.5e6: "5500000 m",
    float("inf"): "inf m",
}


@pytest.mark.parametrize("metres", LENGTHS)
def test_a_length_has_no_exponent(metres):
    assert length(metres) == LENGTHS[metres]
