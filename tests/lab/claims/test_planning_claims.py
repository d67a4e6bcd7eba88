"""D12 and D13: planned cameras beside what came of them."""

from dataclasses import asdict

import pytest

from app.reports.reproduction import write_reproduction_report
from lab.claims.planning import D12, D13, FEW_ROOMS, FIRST_ROOM, ROOMS, promise_chart
from lab.planning.judging import SUGGESTIONS, Suggested


def rooms(real, searched=1.0, best_rank=0):
    """Suggestions of four rooms that promise 9 to 0 points; ``real`` says what one of them gives."""
    found = []
    for room in range(4):
        for rank in range(SUGGESTIONS):
            promised = float(SUGGESTIONS - 1 - rank)
            one = Suggested(
                room, rank, "walls", promised, promised - 1.5, promised + 1.5, real(promised), True, 0.5,
                searched, 1.0,
            )  # fmt: skip
            found.append(asdict(one))
    return found


def test_kept_promises_hold_and_reversed_ones_do_not():
    kept = D12.judge(rooms(lambda promised: promised + 0.5))
    assert (kept.verdict, kept.ours["rank_correlation"]) == ("holds", pytest.approx(1.0))
    assert kept.ci95["mean_absolute_error_points"] == pytest.approx((0.5, 0.5))
    assert D12.judge(rooms(lambda promised: 9.0 - promised)).verdict == "does not hold"


@pytest.mark.parametrize("off_points", [1.2, 1.6])
def test_the_right_order_is_not_enough(off_points):
    """1.2 points are too far in the mean, and 1.6 outside of every interval."""
    verdict = D12.judge(rooms(lambda promised: promised + off_points))
    assert verdict.ours["inside_interval"] == (1.0 if off_points < 1.5 else 0.0)
    assert verdict.verdict == "does not hold"


def test_the_choice_must_be_above_the_others_in_every_room_and_near_the_best_that_there_is():
    assert D13.judge(rooms(lambda promised: promised)).verdict == "holds"
    assert D13.judge(rooms(lambda promised: promised, searched=0.94)).verdict == "does not hold"
    turned = rooms(lambda promised: promised)
    for row in turned[:SUGGESTIONS]:
        row["real"] = 9.0 - row["real"]
    verdict = D13.judge(turned)
    assert "3 of 4 rooms" in verdict.why
    assert verdict.verdict == "does not hold"


def test_the_chart_has_the_real_gains_over_the_promises():
    _, fifths = promise_chart(rooms(lambda promised: 2.0 * promised)).curves
    assert fifths.x == pytest.approx((0.5, 2.5, 4.5, 6.5, 8.5))
    assert fifths.y == pytest.approx((1.0, 5.0, 9.0, 13.0, 17.0))


def test_the_report_draws_both(tmp_path):
    made = rooms(lambda promised: promised)
    write_reproduction_report([D12.judge(made), D13.judge(made)], tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text()
    assert "Real gain against promise" in text
    assert "Gain down the ranking" in text


def test_the_judged_rooms_are_those_of_the_record():
    from lab.results.measure import COMMANDS

    command = COMMANDS["planning"]
    assert command[command.index("--skip") + 1] == str(FIRST_ROOM)
    assert FEW_ROOMS < ROOMS
