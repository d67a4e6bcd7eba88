"""The thesis's table of the noise experiment, number by number as docs/SPEC.md 1.4 copies it."""

import re

import pytest

from pipeline.calibration.thesis_table import TABLE_4_1
from tests.paths import ROOT

NUMBER = r"-?\d*\.\d+"


def test_every_number_is_that_of_the_specification():
    section = (ROOT / "docs/SPEC.md").read_text().partition("Table 4.1 [T]")[2].partition("Check:")[0]
    rows = re.findall(rf"({NUMBER}): ((?:{NUMBER}, ){{5}}{NUMBER})", section)
    assert {float(sigma): tuple(map(float, row.split(", "))) for sigma, row in rows} == TABLE_4_1


def test_no_intrinsic_is_off_by_half_a_percent_and_k1_by_176():
    """The two shares that docs/SPEC.md draws from the table."""
    truth = 500.0, 500.0, 300.0, 250.0
    off = [
        abs(one / right - 1.0)
        for row in TABLE_4_1.values()
        for one, right in zip(row[:4], truth, strict=True)
    ]
    assert max(off) == pytest.approx(0.00495, abs=5e-6)
    assert TABLE_4_1[1.0][4] / 0.05 - 1.0 == pytest.approx(1.76, abs=0.005)
