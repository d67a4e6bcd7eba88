"""The section about filling says what its record says, programs and sizes side by side."""

import pytest

from lab.results.completion import target, trust, whole_holes
from lab.results.pages import readme_results
from lab.results.record import Record
from lab.results.tables import filling


def run(program, group, error):
    return {
        "program": program,
        "group": group,
        "abs_rel": error,
        "abs_rel_ci95": [0.5 * error, 2.0 * error],
        "excess_ci95": [-0.25 * error, 0.5 * error],
        "close_share": 1.0 - error,
    }


RUNS = [
    run(program, group, error * factor)
    for group, error in (
        ("rooms, hidden", 0.02),
        ("rooms, disc of 10 px", 0.01),
        ("rooms, disc of 120 px", 0.1),
    )
    for program, factor in (
        ("packetmesh", 2.0),
        ("colour network", 2.5),
        ("flat guess", 1.0),
        ("nearest", 3.0),
        ("inpaint-ns", 4.0),
    )
]
NUMBERS = {
    "depth": {
        "ours_s": 0.25,
        "peers": {"flat guess": 0.125},
        "runs": [{"elapsed_s": 0.02, "rounds": 50}, *RUNS],
    }
}
PAGE = filling(NUMBERS)


def test_all_hole_pixels_are_the_headline_with_their_interval():
    assert "| packetmesh | 0.0400 [0.0200, 0.0800] / 96.0 % |" in PAGE
    assert "| flat guess | 0.0200 [0.0100, 0.0400] / 98.0 % |" in PAGE


def test_the_best_is_named_even_if_it_is_not_ours():
    assert "most pixels within 5 %: rooms, hidden: flat guess and flat guess." in PAGE


def test_everybody_else_has_the_difference_to_ours():
    assert "| flat guess | -0.0050 to +0.0100 |" in PAGE
    assert PAGE.count("| packetmesh | ") == 3


def test_sizes_stand_side_by_side():
    assert "**Discs hidden: rooms**\n\n| program | 10 px | 120 px |" in PAGE
    assert "| packetmesh | 0.0200 [0.0100, 0.0400] | 0.2000 [0.1000, 0.4000] |" in PAGE


@pytest.mark.parametrize(("factor", "heading"), [(2.0, "does not beat"), (0.5, "beats")])
def test_the_readme_compares_ours_with_the_flat_guess(factor, heading):
    runs = [run("packetmesh", "rooms, hidden", 0.02 * factor), run("flat guess", "rooms, hidden", 0.02)]
    numbers = {"depth": {"runs": runs}}
    record = Record("bench_depth", "c", "abc", "2026-01-01", {}, "a machine", numbers)
    (line,) = readme_results({"bench_depth": record})
    assert line.startswith(f"**Completion {heading} a flat guess.**")
    assert f"hidden holes of rooms is {factor:.2f} times that of one depth everywhere" in line


def test_what_completion_is_worth_is_said_of_the_target_the_hidden_and_the_own_holes():
    runs = [
        run("packetmesh", "rooms, disc of 75 px", 0.066),
        run("nearest", "rooms, disc of 75 px", 0.1),
        run("packetmesh", "rooms, disc of 40 px", 0.104),
        run("nearest", "rooms, disc of 40 px", 0.1),
        run("packetmesh", "rooms, disc of 10 px", 0.5),
        run("nearest", "rooms, disc of 10 px", 0.1),
        run("packetmesh", "rooms, hidden", 0.0105),
        run("colour network", "rooms, hidden", 0.01),
        run("packetmesh", "rooms, own holes", 0.091),
        run("colour network", "rooms, own holes", 0.1),
    ]
    assert "It reaches this at 75 px in rooms (0.66); elsewhere it has 1.04 to 1.04 times" in target(runs)
    said = whole_holes(runs)
    assert "rooms +5 %, which is not certain" in said
    assert "own holes, which is where it is used and why it ships: rooms -9 %" in said


def test_confidence_is_too_low_where_more_are_right_and_too_high_where_fewer_are():
    found = (("a", 9, 93), ("b", 27, 71))
    rows = [[group, "80% to 90%", pixels, "85.0%", f"{true}% [1%, 2%]"] for group, pixels, true in found]
    said = trust(
        {"tables": [{"title": "Confidence in bins", "rows": [*rows, ["a", "0% to 10%", 1, "", ""]]}]}
    )
    assert (
        "a: 93% [1%, 2%]; b: 71% [1%, 2%]; of all groups together 76.5 %. Confidence too low in: a; too "
        "high in: b." in said
    )
