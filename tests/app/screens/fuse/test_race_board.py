"""What stands over the lanes of a race, and the colours of its points."""

import re
from dataclasses import replace
from itertools import combinations
from typing import get_args

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.drawing.colors import MOST_DISTANCE_M
from app.screens.fuse.board import scale, score
from app.screens.fuse.labels import COMPARISONS, RIVALS
from app.screens.fuse.lens import Distances, shades_of
from app.screens.fuse.methods import METHODS, color_of
from app.screens.fuse.numbers import off_text, race_table
from app.screens.fuse.view import REACH_M, SUCCESS_M, Race, Reference
from pipeline import config
from pipeline.kernels.geometry import rigid, rotation_exp
from tests.app.screens.fuse.test_numbers import lane


def test_every_method_says_what_it_does_in_two_sentences_and_where_it_is_from():
    assert METHODS.keys() == config.METHODS.keys()
    for name, about in METHODS.items():
        assert len(re.findall(r"\.(?= |$)", about.text)) == 2, name
        assert re.search(r"\d{4}|thesis", about.source), name


def test_every_method_and_metric_has_a_colour_of_its_own():
    colors = np.array([color_of(rival) for rival in RIVALS.values()], float)
    assert min(np.abs(one - other).max() for one, other in combinations(colors, 2)) >= 12


SEEN = {  # linear RGB as a person sees it, from Machado, Oliveira, Fernandes (2009), severity 1
    "normal": np.eye(3),
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}


@pytest.mark.parametrize("eyes", SEEN)
def test_four_lanes_are_told_apart_whatever_colours_one_sees(eyes):
    colors = np.array([[color_of(rival) for rival in COMPARISONS["All four"]]]) / 255.0
    linear = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ np.transpose(SEEN[eyes]), 0.0, 1.0)
    shown = np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055)
    lab = cv2.cvtColor(shown.astype(np.float32), cv2.COLOR_RGB2LAB)[0]
    assert min(np.linalg.norm(one - other) for one, other in combinations(lab, 2)) > 18


def test_the_default_race_differs_in_the_weights_only_and_the_next_in_the_metric_only():
    weights, metric, everything = COMPARISONS.values()
    assert Race().rivals == weights
    assert len({method for method, _ in weights}) == len({kind for _, kind in metric}) == 2
    assert len({kind for _, kind in weights}) == len({method for method, _ in metric}) == 1
    assert {*weights, *metric} < {*everything}


@pytest.mark.parametrize(
    ("error_m", "number", "state"),
    [(0.104, "10.40", "missed"), (0.000328, "0.03", "arrived"), (SUCCESS_M, "2.00", "missed")],
)
def test_the_number_over_a_lane_is_its_distance_from_the_truth(error_m, number, state):
    said = score(lane("ICP point", error_m), 0)
    assert (said["number"], said["unit"], said["state"]) == (number, "cm off", state)


def test_without_truth_it_is_the_distance_to_the_other_cloud_and_nobody_arrives():
    said = score(lane("ICP point", None), 0)
    assert (said["number"], said["unit"]) == ("3.00", "cm to the nearest point")
    assert said["state"] == "running"


@pytest.mark.parametrize(
    ("gap_m", "number", "text"),
    [(0.4999, "49.99", "49.99 cm"), (REACH_M, "≥ 50", "≥ 50 cm"), (float("nan"), "–", "–")],
)
def test_a_distance_beyond_the_search_is_given_as_a_lower_limit(gap_m, number, text):
    """Also where it is the last one, in the table."""
    bare = lane("ICP point", None)
    far = replace(bare, steps=(replace(bare.steps[0], gap_m=gap_m),))
    assert score(far, 0)["number"] == number
    assert off_text(far.steps[0]) == text
    assert race_table("cloud", (far,)).count(f">{text}</td>") == 2
    known = replace(far.steps[0], point_error_m=0.7)
    assert off_text(known) == "70.00 cm"


def test_the_scale_names_the_truth_only_where_it_is_known():
    texts = {reference: scale(reference)["text"] for reference in get_args(Reference)}
    assert len(set(texts.values())) == len(texts)
    assert [reference for reference, text in texts.items() if "truth" in text] == ["truth"]


def cloud():
    return np.random.default_rng(0).uniform(-1.0, 1.0, (500, 3))


def test_points_are_as_far_off_as_the_motion_carries_them():
    points_m = cloud()
    T_true = rigid(rotation_exp(np.array([0.1, 0.2, -0.3])), np.array([1.0, 0.0, 0.5]))
    distances = Distances(points_m, T_true, cKDTree(points_m))
    moved_m, gap_m = distances.at(rigid(np.eye(3), np.array([0.0, 0.03, 0.04])) @ T_true)
    np.testing.assert_allclose(moved_m, 0.05)
    assert np.isnan(gap_m)
    assert distances.at(T_true)[0].max() == 0.0


def test_without_truth_points_are_as_far_off_as_their_partners():
    points_m = cloud()
    distances = Distances(points_m, None, cKDTree(points_m))
    near_m, gap_m = distances.at(rigid(np.eye(3), np.array([0.0, 0.001, 0.0])))
    np.testing.assert_allclose(near_m, 0.001)
    assert gap_m == pytest.approx(0.001)
    far_m, gap_m = distances.at(rigid(np.eye(3), np.array([0.0, 9.0, 0.0])))
    assert (far_m == REACH_M).all()
    assert gap_m == REACH_M


def test_the_scale_of_the_colours_is_fixed():
    distances_m = MOST_DISTANCE_M * np.array([0.0, 0.5, 1.0, 7.0])
    assert shades_of(distances_m).tolist() == [0, 128, 255, 255]
