"""Which nodes are placed and what is said of the others, from agreements and attempts worked out by hand."""

import numpy as np
import pytest

from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.placement.attempt import Attempt
from pipeline.placement.pairwise import _reference
from pipeline.placement.verdicts import verdicts_of
from pipeline.registration.finding.verdict import Verdict
from pipeline.registration.graph.edges import PoseEdge
from pipeline.types import RegistrationResult

NAMES = ("A", "B", "C", "D")


def edge(source: int, target: int) -> PoseEdge:
    return PoseEdge(source, target, np.eye(4), np.eye(6))


def attempt(source: int, target: int, joined: bool = False, agreement: Agreement = NOTHING_SHARED) -> Attempt:
    """A search that found a sure pose, or a doubtful one."""
    verdict = Verdict("sure") if joined else Verdict("doubtful", ("too little is shared",))
    result = RegistrationResult(np.eye(4), (), joined, "converged")
    found = edge(source, target) if joined else None
    return Attempt(source, target, False, result, agreement, found, verdict, 0.9 if joined else 0.4)


@pytest.mark.parametrize(
    ("known", "links", "expected"),
    [
        ([True, False, False, False], [(1, 0), (2, 1), (3, 2)], (0, [0, 1, 2, 3])),
        ([False, False, False, True], [(1, 0), (2, 1), (3, 2)], (3, [0, 1, 2, 3])),
        ([False, True, True, False], [], (1, [1, 2])),
        ([True, False, False, False, False], [(1, 0), (3, 2), (4, 3)], (0, [0, 1])),
        ([True, False, False, False], [(2, 1), (3, 2)], (1, [1, 2, 3])),
        ([False, False, False, False], [(1, 0), (3, 2)], (0, [0, 1])),
        ([False, True, False], [], (1, [1])),
    ],
)
def test_the_group_of_the_known_poses_is_placed_if_it_has_several_nodes(known, links, expected):
    assert _reference(known, [edge(*link) for link in links]) == expected


def sentences(known, group, agreements=None, tried=()):
    found = verdicts_of(NAMES[: len(known)], known, group, agreements or {}, tried)
    return [verdict.sentence for verdict in found]


def test_a_node_with_the_only_known_pose_is_told_from_one_without():
    tried = [attempt(1, 0), attempt(2, 1, joined=True)]
    agreements = {(2, 1): Agreement(100, 60, 60)}
    only, *others = sentences([True, False, False], [1, 2], agreements, tried)
    assert only == (
        "A is left out: no pose of the others relative to it was found (best pose relative to B: too little "
        "is shared), so they are not in the frame of its given pose; try to give one of their poses, or "
        "images that share more of the place"
    )
    assert others == ["", ""]
    assert sentences([False] * 3, [1, 2], agreements, tried)[0] == (
        "A is left out: its pose is not known, and no pose relative to the others was found (best pose "
        "relative to B: too little is shared); try to give its pose, or images that share more of the place"
    )


def test_the_reason_is_that_of_an_attempt_to_join_the_placed_nodes():
    """C and D are joined to each other, which is no reason for leaving them out."""
    tried = [attempt(1, 0, joined=True), attempt(2, 1), attempt(3, 2, joined=True)]
    left_out = sentences([True, False, False, False], [0, 1], {(1, 0): Agreement(100, 60, 60)}, tried)[2:]
    assert "best pose relative to B: too little is shared" in left_out[0]
    assert "relative to the others was found; try" in left_out[1]


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("shared", [0, 1, 4, 5])
def test_overlaps_under_five_per_cent_confirm_no_pose(known, shared):
    agreements = {(1, 0): Agreement(100, 60, 60), (2, 1): Agreement(100, shared, shared)}
    sentence = sentences([True, known, known], [0, 1, 2], agreements)[2]
    expected = (
        "C has a pose that no other placed camera confirms: each measured less than 5 % of what it sees"
    )
    assert sentence == ("" if shared == 5 else expected)


def test_a_node_is_said_to_agree_badly_or_is_left_out_by_its_share():
    for within, expected in (
        (90, ""),
        (80, "C agrees badly with the others: only 80%"),
        (30, "C is left out"),
    ):
        agreements = {(1, 0): Agreement(100, 60, 60), (2, 1): Agreement(100, 50, within // 2)}
        sentence = sentences([True] * 3, [0, 1, 2], agreements)[2]
        assert sentence.startswith(expected)
        assert bool(sentence) == bool(expected)
