"""The numbers of the Calibrate screen that need no photographs: what goes together, the thesis's table."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.screens.calibrate import scatter as thesis
from app.screens.calibrate.labels import HELD_OUT, RMS
from app.screens.calibrate.noise_view import NoiseRequest, NoiseView
from app.screens.calibrate.numbers import correlation_html, signed, strongest_sentence
from app.screens.calibrate.photographs import Bar, bars_html
from app.screens.calibrate.scatter import PAIRS, nearest_cell, noise_sheet
from app.screens.calibrate.trust import verdict_html
from app.window.tables import term
from lab.claims.calibration.protocol import TRUTH
from pipeline.calibration.correlation import DISTANCE, Correlations, Pair

NAMES = ("fx", "fy", "cx", "cy", "k1", "k2")


def trials(count, sigma_px=0.4):
    truth = np.array([525.0, 525.0, 320.0, 240.0, -0.05, 0.02])
    sd = np.array([1.0, 1.0, 0.8, 0.8, 0.004, 0.01])
    found = truth + sd * np.random.default_rng(0).standard_normal((count, 6))
    return NoiseView(NoiseRequest("node_01", sigma_px), NAMES, truth, found, np.diag(sd**2), 0.5)


def test_the_printed_camera_is_that_of_the_claims():
    assert dict(zip(thesis.NAMES, thesis.TRUE, strict=True)) == TRUTH


def test_the_thesis_is_shown_at_the_nearest_noise_and_not_without_any():
    assert nearest_cell(0.0, NAMES) is None
    assert nearest_cell(0.55, NAMES).sigma_px == 0.6
    cell = nearest_cell(1.0, NAMES)
    assert cell.error("fx", 600.0) == pytest.approx(600.0 * 2.474 / 500.0)
    assert cell.error("k1", -0.3) == pytest.approx(0.0882)
    assert cell.error("p1", 0.0) is None
    fisheye = nearest_cell(1.0, ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"))
    assert (fisheye.error("k1", -0.3), fisheye.error("fx", 600.0)) == (None, cell.error("fx", 600.0))


@pytest.mark.parametrize(
    ("pair", "words"),
    [
        (
            Pair("fx", DISTANCE, 0.97),
            ("fx and the board's distance are correlated positively (.97)", "more tilted views"),
        ),
        (Pair("k1", "k2", -0.95), ("k1 and k2 are correlated negatively (.95)", "nearer to its corners")),
        (Pair("cx", "p1", 0.9), ("a tilted lens",)),
        (Pair("cy", "k1", 0.9), ("opposite sides",)),
        (Pair("cx", "cy", 0.9), ("(.90): views tilted to opposite sides separate them",)),
        (Pair("p1", "p2", 0.9), ("(.90): views tilted to opposite sides separate them",)),
        (Pair("fx", "fy", 0.98), ("(.98): both depend on the distance of the board",)),
        (Pair("fx", "k1", 0.9), ("to the corners of the image",)),
        (Pair("fx", "k1", -0.5), ("separate all parameters", "is .50")),
    ],
)
def test_the_strongest_pair_is_a_sentence_with_advice(pair, words):
    sentence = strongest_sentence(pair)
    assert all(word in sentence for word in words)


def test_the_square_has_every_pair_once():
    matrix = np.array([[1.0, -0.97, 0.3], [-0.97, 1.0, 0.0], [0.3, 0.0, 1.0]])
    shown = correlation_html(Correlations(("fx", "k1", DISTANCE), matrix))
    assert shown.count("<td ") == 3
    for told in ("fx and k1: −.97", "fx and dist.: .30", "k1 and dist.: .00"):
        assert told in shown
    assert [signed(value) for value in (1.0, -1.0, 0.0, -0.001)] == ["1.00", "−1.00", ".00", ".00"]


def test_the_sheet_has_axes_with_units_signs_and_the_thesis_beside_the_trials():
    sheet = noise_sheet(trials(50))
    assert sheet.title == "node_01, 0.40 px of noise: 50 of 200 trials"
    assert len(sheet.figures) == len(PAIRS)
    titles = [
        axis.title.text for figure in sheet.figures for axis in (figure.layout.xaxis, figure.layout.yaxis)
    ]
    assert titles == ["fx (px)", "fy (px)", "cx (px)", "cy (px)", "k1 (no unit)", "k2 (no unit)"]
    for figure in sheet.figures:
        inside, outside, _, truth, printed = figure.data
        assert len(inside.x) + len(outside.x) == 50
        low, high = figure.layout.xaxis.range
        assert low < min(*inside.x, *truth.x, *printed.x)
        assert max(*inside.x, *truth.x, *printed.x) < high
    assert "thesis: printed at 0.4 px (Table 4.1)" in sheet.legend
    assert sheet.table.count("<tr>") == 1 + len(NAMES)
    assert "thesis" in sheet.table
    assert "Table 4.1" not in noise_sheet(trials(3, 0.0)).legend


def test_the_row_of_bars_explains_its_words_and_shows_names_as_text():
    shown = bars_html((Bar("<i>'", 0.2, 0.3), Bar('"><b>', None, None)), "<i>'")
    assert all(word in shown for word in (term("RMS", RMS), term("held out", HELD_OUT)))
    for name in ("&lt;i&gt;&#39;", "&#34;&gt;&lt;b&gt;"):
        assert f'data-packetmesh-pick="{name}" title="View {name}:' in shown


@pytest.mark.parametrize(
    ("passed", "failed", "sign"),
    [(True, False, "✓ PASS"), (False, True, "✗ FAIL"), (False, False, "? NOT DECIDED")],
)
def test_the_verdict_has_three_signs_and_shows_names_as_text(passed, failed, sign):
    shown = verdict_html(
        SimpleNamespace(passed=passed, failed=failed, lines=("Good enough", "Outlier: view <b>"))
    )
    assert sign in shown
    assert "view &lt;b&gt;" in shown
