"""docs/results.md and the README's results are what the committed records say."""

import re
from dataclasses import replace

import pytest

from lab.results.markdown import change, listed, pivot, table, text
from lab.results.pages import (
    DEPTH_README,
    README,
    RECORDINGS,
    RESULTS,
    WORTH,
    marked,
    readme,
    readme_results,
    results_page,
    worth,
)
from lab.results.record import read_records
from lab.results.recordings import EVERY
from lab.results.tables import losses
from lab.walks.ours import OURS as WALKER

RECORDS = read_records()
DECIMAL = re.compile(r"\d+\.\d+")


def changed(value, factor=13.7):
    """The same numbers, all of them others, and so are their ratios."""
    if isinstance(value, dict):
        return {key: item if key in {"title", "header"} else changed(item) for key, item in value.items()}
    if isinstance(value, list):
        return [changed(item) for item in value]
    if isinstance(value, str):
        return DECIMAL.sub(lambda found: f"{factor * float(found[0]):.{len(found[0].split('.')[1])}f}", value)
    return factor * value + 1.0 if isinstance(value, float) else value


def other(record):
    return replace(record, numbers=changed(record.numbers))


def test_the_page_of_results_is_what_the_records_say():
    assert RESULTS.read_text("utf-8") == results_page(RECORDS), "run `make results`"


def test_the_results_in_the_readme_are_what_the_records_say():
    page = README.read_text("utf-8")
    assert readme(page, RECORDS) == page, "run `make results`"


def test_what_the_networks_readme_says_of_completion_is_what_the_records_say():
    page = DEPTH_README.read_text("utf-8")
    assert marked(page, worth(RECORDS)) == page, "run `make results`"
    assert WORTH.read_text("utf-8") == f"{worth(RECORDS)}\n", "run `make results`"


@pytest.mark.parametrize("name", RECORDS)
def test_another_record_makes_another_page(name):
    assert results_page({**RECORDS, name: other(RECORDS[name])}) != results_page(RECORDS)


def test_no_result_is_typed_into_the_readme_s_lines():
    others = {name: other(record) for name, record in RECORDS.items()}
    ours, theirs = (DECIMAL.findall("\n".join(readme_results(records))) for records in (RECORDS, others))
    assert ours
    assert [one for one, other_one in zip(ours, theirs, strict=True) if one == other_one] == []


def test_the_claims_that_do_not_reproduce_are_linked_to_the_whole_page():
    """They are in several sections."""
    (line,) = (line for line in readme_results(RECORDS) if line.startswith("**Not every claim"))
    assert "([which, and why](docs/results.md))" in line


@pytest.mark.parametrize(("frames_s", "heading"), [(20.0, "longer"), (40.0, "no longer")])
def test_a_walk_takes_longer_only_below_the_camera_s_rate(frames_s, heading):
    runs = [{"program": WALKER, "frames_s": frames_s}]
    records = {RECORDINGS: replace(RECORDS[RECORDINGS], numbers={EVERY: {"runs": runs}})}
    (line,) = readme_results(records)
    assert line.startswith(f"**A walk takes {heading} than it lasted.**")


def test_a_table_has_a_cell_for_every_column():
    lines = table(("a", "b"), [("x|y", 1.0), (None, 1234567)]).splitlines()
    assert lines == ["| a | b |", "| --- | --- |", "| x\\|y | 1 |", "| – | 1,234,567 |"]


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (0.012345, "0.0123"),
        (12345.6, "12,346"),
        (7, "7"),
        (-1.0, "-1"),
        (None, "–"),
        (1e-6, "1e-06"),
        (999.4, "999"),
        (999.7, "1,000"),
        (-999.7, "-1,000"),
    ],
)
def test_numbers_keep_three_digits(value, written):
    assert text(value) == written


def test_a_change_needs_both_ends():
    assert change(0.1384, 0.0376) == "13.8 → 3.8 %"
    assert change(None, 0.5) == "–"


def test_words_are_listed_as_in_a_sentence():
    assert listed([]) == "none"
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"


def test_a_pivot_leaves_what_was_not_run_empty():
    runs = [
        {"program": "ours", "cloud": "room", "s": 1.0},
        {"program": "theirs", "cloud": "room", "s": 2.0},
        {"program": "ours", "cloud": "terrain", "s": 3.0},
    ]
    lines = pivot(runs, "program", ("cloud",), lambda run: text(run["s"])).splitlines()
    assert lines == [
        "| program | room | terrain |",
        "| --- | --- | --- |",
        "| ours | 1 | 3 |",
        "| theirs | 2 | – |",
    ]


def test_a_loss_is_told_of_the_metric_that_lost():
    medians = {
        "icp": {"a": "1.00 (0%)", "b": "5.00 (0%)"},
        "ceicp-a": {"a": "2.00 (0%)", "b": "4.00 (0%)"},
        "ceicp-a plane": {"b": "6.00 (0%)"},
    }
    assert losses(medians, "icp") == ["a (1.00 against 2.00 cm)"]
    assert losses(medians, "icp", "ceicp-a plane") == ["b (5.00 against 6.00 cm)"]


def test_both_directions_have_a_table_and_their_losses():
    page = results_page(RECORDS)
    for direction in ("source to target (q2p)", "target to source (p2q)"):
        part = page.partition(f"**Matched {direction}**")[2]
        assert part.lstrip().startswith("| condition | icp |")
        assert "icp-gated ends nearer to the truth than ceicp-a in: " in part
