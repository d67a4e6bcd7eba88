"""What the Fuse screen says and draws of a race, without a browser."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.drawing.colors import css
from app.screens.fuse.capture import capture_html, capture_sentence, cell_name
from app.screens.fuse.charts import kernel, weights
from app.screens.fuse.draw import gizmo_pose, start_of
from app.screens.fuse.lesson import numbers
from app.screens.fuse.methods import color_of
from app.screens.fuse.numbers import places_table, race_table, winner
from app.screens.fuse.view import (
    CAPTURE_SHIFTS_M,
    CAPTURE_TURNS_DEG,
    REACH_M,
    CaptureView,
    FuseView,
    PairHistogram,
    Race,
    RaceLane,
    RaceStep,
    RegistrationRow,
    Start,
)
from app.window.tables import UNKNOWN

NOTHING = np.empty((0, 3), np.float32)
EDGES_M = np.linspace(0.0, 0.3, 31)


def lane(label, error_m, reason="converged", sigma_m=float("nan"), kernel=False, word="sure", reasons=()):
    shown = PairHistogram(np.ones(30, int), np.ones(30), sigma_m)
    shades = np.zeros(0, np.uint8)
    lens = np.zeros((0, 3), np.uint8)
    step = RaceStep(
        np.eye(4), NOTHING, NOTHING, np.empty(0), 0.0, 0.01, 5.0, error_m, 0.03, shades, lens, shown
    )
    return RaceLane(("icp", "point"), label, kernel, (step,), reason, 3, 0.2, 0.01, 500.0, word, reasons)


@pytest.mark.parametrize(
    ("errors_m", "sentence"),
    [
        ({"ICP point": 0.118, "CEICP-A plane": 0.001}, "**CEICP-A plane** ends 0.10 cm from the truth, "),
        ({"ICP point": 0.010, "CEICP-A plane": 0.015}, "**CEICP-A plane** 1.50 cm. So CEICP loses here."),
        ({"ICP point": 0.05, "FICP plane": 0.09}, "No method ends within 2 cm."),
        (
            {"ICP point": 0.0100, "CEICP-A plane": 0.0101},
            "Here both end equally far, 1.00 cm, from the truth.",
        ),
        ({"A": 0.01, "B": 0.01, "C": 0.01}, "Here all end equally far"),
        ({"ICP point": 0.03}, "**ICP point** ends 3.00 cm from the truth. No method ends"),
        ({"ICP point": None, "CEICP-A plane": None}, "The truth of this scene is not known."),
    ],
)
def test_the_winner_is_named(errors_m, sentence):
    lanes = tuple(lane(label, error_m) for label, error_m in errors_m.items())
    assert sentence in winner("cloud" if None in errors_m.values() else "truth", lanes)


@pytest.mark.parametrize(
    ("gaps_m", "word"),
    [
        ((0.30, 0.20), "weights"),
        ((0.20, REACH_M), "plane"),
        ((REACH_M, 0.497), "weights"),
        ((0.200, 0.203), "alike"),
        ((REACH_M, REACH_M), UNKNOWN),
    ],
)
def test_a_question_on_two_ends_out_of_reach_has_no_answer(gaps_m, word):
    bare = lane("", None)
    lanes = tuple(
        replace(bare, rival=rival, steps=(replace(bare.steps[0], gap_m=gap_m),))
        for rival, gap_m in zip((("icp", "plane"), ("ceicp-a", "point")), gaps_m, strict=True)
    )
    assert numbers("office", Race(), SimpleNamespace(lanes=lanes))["more"] == word


def test_where_nobody_knows_the_truth_nothing_speaks_of_it():
    lanes = (lane("ICP point", 0.03), lane("CEICP-A point", 0.01))
    said = winner("pixels", lanes)
    assert said.startswith(
        "**CEICP-A point** ends 1.00 cm from the measured points of its pixels, **ICP point** 3.00"
    )
    unknown = race_table("cloud", tuple(lane(label, None) for label in ("ICP point", "CEICP-A point")))
    for html in (said, race_table("pixels", lanes), unknown):
        assert "tru" not in html
    assert unknown.count(">3.00 cm<") == 4


def test_a_ceicp_that_ties_with_the_winner_has_not_lost():
    lanes = (lane("FICP plane", 0.00100), lane("CEICP-A plane", 0.00102), lane("ICP point", 0.1))
    assert "loses" not in winner("truth", lanes)


def test_one_ceicp_that_loses_to_another_is_no_loss_of_ceicp():
    lanes = (lane("CEICP-A plane", 0.001), lane("ICP point", 0.01), lane("CEICP-N plane", 0.1))
    assert "loses" not in winner("truth", lanes)


def test_the_table_has_a_column_for_each_lane_and_explains_every_row():
    html = race_table(
        "truth", tuple(lane(str(i), 0.01, "No pair of points is within the gate") for i in range(4))
    )
    assert re.findall("[①②③④]", html) == list("①②③④")
    assert html.count("data-hint=") == 9
    assert html.count(">lost<") == 4
    for mark in "①②③④":  # in the colour of its method, as everywhere
        assert re.search(rf"color: {css(color_of(lane('0', 0.0).rival))};\">{mark}<", html)


def test_the_kernel_is_a_gaussian_of_the_distance_and_icp_has_none():
    ceicp = lane("CEICP-A plane", 0.0, sigma_m=0.1, kernel=True)
    f = kernel(ceicp, ceicp.steps[0].histogram, EDGES_M)
    assert f[0] == 1.0
    assert f[10] == pytest.approx(np.exp(-0.5))
    icp = lane("ICP point", 0.0)
    assert np.isnan(kernel(icp, icp.steps[0].histogram, EDGES_M)).all()


def test_weights_are_bridged_over_empty_bins_and_zero_beyond_the_last_pair():
    shown = PairHistogram(np.array([1, 0, 1, 0]), np.array([1.0, np.nan, 0.5, np.nan]), 0.1)
    np.testing.assert_allclose(weights(shown), [1.0, 0.75, 0.5, 0.0])


@pytest.mark.parametrize("seed", range(5))
def test_the_gizmo_means_the_start_it_stands_for(seed):
    start, center_m = Start.towards(25.0, 35.0, seed), np.array([0.3, -0.2, 2.0])
    again = start_of(gizmo_pose(start, center_m), center_m)
    np.testing.assert_allclose(again.turn_deg, start.turn_deg, atol=0.011)
    np.testing.assert_allclose(again.shift_cm, start.shift_cm, atol=0.011)


def test_the_map_names_every_cell_and_marks_what_arrives():
    errors_m = np.full((2, 5, 5), 0.3)
    errors_m[1, :2] = 0.001
    view = CaptureView(("ICP point", "CEICP-A plane"), errors_m)
    html = capture_html(view, 1)
    assert re.findall('data-packetmesh-press="([^"]+)"', html) == [
        cell_name(turn_deg, shift_m) for turn_deg in CAPTURE_TURNS_DEG for shift_m in CAPTURE_SHIFTS_M
    ]
    assert html.count("✓ 0.1") == 10
    assert html.count("✗ 30") == 15
    assert "ICP point 0, CEICP-A plane 10" in capture_sentence(view)


@pytest.mark.parametrize("share", [0.977, float("nan")])
def test_the_places_say_how_far_the_cameras_agree_and_which_node_is_left_out(share):
    row = RegistrationRow("b", "a", "icp", 3, "converged", 0.01, None, None, float("nan"), False)
    poses = (np.eye(4), np.eye(4))
    said = places_table(FuseView(poses, poses, (row,), share, ("b is left out: of <what> both measured",)))
    assert ("97.7% of the points agree within 2 %" in said) == np.isfinite(share)
    assert "nan" not in said.lower()
    assert "b is left out: of &lt;what&gt; both measured" in said
