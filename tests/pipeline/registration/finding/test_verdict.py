"""Each test of a verdict fails alone, with its own words."""

from dataclasses import replace

import pytest

from pipeline.registration.finding.evidence import Evidence
from pipeline.registration.finding.verdict import verdict_on

GOOD = Evidence((1000, 1000), (2000, 2000), 1950, 0, True, 1.0, 1.0, 0.05, "", float("nan"))


def test_nothing_against_a_pose_is_sure():
    verdict = verdict_on(GOOD)
    assert verdict.sure
    assert verdict.text == "sure"
    assert verdict_on(replace(GOOD, color_correlation=0.95)).sure


@pytest.mark.parametrize(
    ("change", "word", "says"),
    [
        ({"judged": (100, 100), "on": 195}, "doubtful", "share only 5% of their points"),
        (
            {"through": 60},
            "doubtful",
            "3.0% of the shared points lie in space that the other camera saw to be empty",
        ),
        ({"on": 1200}, "doubtful", "only 60% of the shared points lie on the other cloud's surface"),
        ({"refutable": False, "on": 1880}, "doubtful", "only 94% of the shared points lie on"),
        ({"one_side_share": 0.5}, "doubtful", "from opposite sides, like two rooms back to back"),
        ({"height_ratio": 1.8}, "doubtful", "the surfaces are 1.8 times the points' noise apart"),
        ({"color_correlation": 0.2}, "doubtful", "colours there do not match (correlation 0.20)"),
        ({"open_motions": "sliding along y"}, "doubtful", "the overlap does not determine sliding along y"),
        ({"stiffness": 1e-3}, "doubtful", "hardly determine the pose in one direction"),
        ({"on": 500}, "none", "only 25% of the shared points"),
        ({"judged": (20, 20), "on": 40}, "none", "share only 1% of their points"),
        ({"judged": (0, 0), "on": 0}, "none", "share only 0% of their points"),
    ],
)
def test_each_fault_has_its_words(change, word, says):
    verdict = verdict_on(replace(GOOD, **change))
    assert verdict.word == word
    assert not verdict.sure
    assert verdict.reasons
    assert says in verdict.text
    assert verdict.text.startswith(f"{word}: ")


def test_less_stiffness_is_enough_where_registrations_from_both_sides_came_back():
    assert not verdict_on(replace(GOOD, stiffness=0.004)).sure
    assert verdict_on(replace(GOOD, stiffness=0.004), tried=True).sure
    assert not verdict_on(replace(GOOD, open_motions="sliding along y"), tried=True).sure


def test_other_poses_are_a_reason_too():
    verdict = verdict_on(GOOD, ("turned by 90 degrees, the source fits as well",))
    assert verdict.word == "doubtful"
    assert verdict.text == "doubtful: turned by 90 degrees, the source fits as well"
