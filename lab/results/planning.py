"""The table and the picture of docs/results.md about planned cameras."""

from __future__ import annotations

from lab.planning.measures import choice_good, promise_kept
from lab.results.chart import BOTTOM, COLORS, HEIGHT, LEFT, RIGHT, TOP, WIDTH, document, titled
from lab.results.markdown import Row, percent, table

PICTURE = "planning.svg"
"""File of the picture, next to the page."""
JUDGES = {"D12": promise_kept, "D13": choice_good}
"""The claims that this record judges."""
KINDS = ("the planner's choice", "other suggestions", "outside their interval")
"""Marks of the picture."""


def pictures(numbers: Row) -> dict[str, str]:
    """Return the record's picture as SVG by file name: the real gain of each suggestion over its promise."""
    gains = numbers["gains"]
    most = max(1.0, *(max(row["promised"], row["real"]) for row in gains))
    least = min(0.0, *(row["real"] for row in gains))
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def at(promised: float, real: float) -> tuple[float, float]:
        x = LEFT + width * promised / most
        return x, TOP + height * (most - real) / (most - least)

    parts = titled("promised, points", "real, points")
    for value in range(int(least), int(most) + 1):
        x, y = at(value, value)
        parts.append(f'<path d="M{LEFT} {y:.1f}h{width}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value}</text>')
        if value >= 0:
            parts.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{value}</text>')
    (x0, y0), (x1, y1) = at(0.0, 0.0), at(most, most)
    parts.append(f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" stroke="#999999"/>')
    for row in sorted(gains, key=lambda row: -row["rank"]):
        parts.append(_mark(*at(row["promised"], row["real"]), row))
    for k, (kind, rank, real) in enumerate(zip(KINDS, (0, 1, 1), (0.0, 0.0, 1.0), strict=True)):
        y = TOP + 14 + 22 * k
        sample = {"rank": rank, "low": 0.0, "high": 0.0, "real": real}
        parts.append(_mark(WIDTH - RIGHT + 26, y, sample))
        parts.append(f'<text x="{WIDTH - RIGHT + 39}" y="{y + 4}">{kind}</text>')
    return {PICTURE: document(parts)}


def _mark(x: float, y: float, row: Row) -> str:
    color = COLORS[0] if row["low"] <= row["real"] <= row["high"] else COLORS[1]
    fill = color if row["rank"] == 0 else "none"
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{fill}" stroke="{color}" stroke-width="1.5"/>'


def planning(numbers: Row) -> str:
    """Return the table of the record."""
    text = (
        f"In each of {numbers['rooms']:.0f} rendered rooms on which nothing was fitted, three cameras stand, "
        "and the planner judges up to 500 places for a fourth with the same sensor. The best, and nine "
        "others evenly down its ranking, are rendered there, and the whole chain is run again. The gain is "
        "the share of the first three cameras' rays that meet measured surface now and did not before, in "
        "points. The constants of chances, promise and interval come from other rooms, whose "
        "furniture is drawn from the same stock. The exhaustive search renders the depth of every allowed "
        "place, and counts the missing rays whose true points it measures. Of the sixty rooms before these, "
        "twenty gave the intervals their width, and others showed that glass and screens were promised."
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
    picture = f"![Real gain of every suggestion over its promise]({PICTURE})"
    verdicts = {name: judge(numbers) for name, judge in JUDGES.items()}
    claims = [
        f"Claim {name} {'holds' if holds else 'does not hold'}: {why}."
        for name, (holds, why) in verdicts.items()
    ]
    return "\n\n".join((text, picture, table(("measure", "value", "goal"), rows), *claims))
