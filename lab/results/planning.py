"""The table of docs/results.md about planned cameras."""

from __future__ import annotations

from lab.results.markdown import Row, percent, table


def planning(numbers: Row) -> str:
    """Return the table of the record."""
    text = (
        f"In each of {numbers['rooms']:.0f} rendered rooms on which nothing was fitted, three cameras stand, "
        "and the planner judges up to 500 places for a fourth with the same sensor. The best, and nine "
        "others evenly down its ranking, are rendered there, and the whole chain is run again. The gain is "
        "the share of the first three cameras' rays that meet measured surface now and did not before, in "
        "points. The constants of chances, promise and interval come from other rooms, whose "
        "furniture is drawn from the same stock. The exhaustive search renders the depth of every allowed "
        "place, and counts the missing rays whose true points it measures. The intervals are those from the "
        "other rooms; they were widened by two thirds after this, to hold 95 %."
    )
    rows = [
        ("suggestions", f"{numbers['suggestions']:.0f}", ""),
        (
            "rank correlation of promised and real gain, all together",
            f"{numbers['rank_correlation']:.2f}",
            ".85",
        ),
        ("the same within a room, mean", f"{numbers['rank_correlation_in_room']:.2f}", ""),
        ("mean absolute error, points", f"{numbers['mean_absolute_error_points']:.2f}", "1"),
        ("promised minus real, mean, points", f"{numbers['mean_error_points']:+.2f}", ""),
        ("real gain inside the 95 % interval", percent(numbers["inside_interval"]), "90 %"),
        ("new camera placed by registration", percent(numbers["placed"]), ""),
        ("real gain of the best suggestion, mean, points", f"{numbers['best_real_points']:.2f}", ""),
        ("real gain of the others, mean, points", f"{numbers['others_real_points']:.2f}", ""),
        (
            "rooms where the best is above the others' mean",
            f"{numbers['rooms_best_above']:.0f} of {numbers['rooms']:.0f}",
            "all",
        ),
        ("best suggestion over the exhaustive search's best", percent(numbers["share_of_search"]), "95 %"),
    ]
    return f"{text}\n\n{table(('measure', 'value', 'goal'), rows)}"
