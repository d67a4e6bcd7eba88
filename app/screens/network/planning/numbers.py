"""Tables and sentences on a plan."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.drawing.colors import BRAND, GHOST, NEUTRAL, css
from app.drawing.quantities import STANDS_ON
from app.screens.network.planning.view import Arrival, Ghost, GhostsView, PlanView, PromiseView, TakenView
from app.web.markup import Markdown, Markup
from app.window.tables import Row, number, table

BAR = Markup(
    '<div style="display: flex; justify-content: space-between; margin-top: 0.3em">'
    "<span>image of new {}</span><span>{}</span></div>"
    '<div style="position: relative; height: 0.8em; background: #e4e8ec; border-radius: 2px; '
    'overflow: hidden; display: flex"><div style="width: {:.1f}%; background: {}"></div>'
    '<div style="width: {:.1f}%; background: {}; opacity: 0.45"></div>{}</div>'
)
SCALE = Markup(
    '<div style="display: flex; justify-content: space-between; color: {}">'
    "<span>0 s</span><span>{}</span><span>{:.2f} s</span></div>"
)
DEADLINE = Markup(
    '<div style="position: absolute; left: {:.1f}%; top: 0; bottom: 0; width: 2px; background: {}"></div>'
)


def points(promise: PromiseView) -> str:
    """Return a promise in points (hundredths of all rays) with its 95 % interval."""
    low, high = promise.ci95_share
    return f"{100.0 * promise.gain_share:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def dark_part(promise: PromiseView) -> str:
    """Say how much of a promise is on dark surface, as a part of a sentence; empty if nothing is."""
    dark = f"{100.0 * promise.dark_share:.1f}"
    return "" if dark == "0.0" else f", {dark} of them on a dark surface that may stay without depth"


def summary(plan: PlanView, ghosts: GhostsView) -> Markdown:
    """Return markdown: what all ghosts promise together, how good the plan is, and notes."""
    count = len(ghosts.ghosts)
    who = "The new camera promises" if count == 1 else f"The {count} new cameras together promise"
    then = plan.measured_share + ghosts.total.gain_share
    text = Markdown(
        "**{} {} points**{}: {:.1f} % of the present cameras' rays meet measured surface now, about {:.1f} % "
        "would then; in brackets the 95 % interval."
    ).format(who, points(ghosts.total), dark_part(ghosts.total), 100.0 * plan.measured_share, 100.0 * then)
    if ghosts is plan.ghosts:
        least = f"{100.0 * plan.at_least_of_best:.0f}"
        text += Markdown(
            " It is {} best choice among the {} judged cameras that can be registered{}."
        ).format("the" if least == "100" else f"at least {least} % of the", plan.candidates, plan.ruled_out)
    for note in (*plan.notes, *_doubts(plan, ghosts.ghosts)):
        text += Markdown("\n\n{}.").format(note.rstrip("."))
    return text


def _doubts(plan: PlanView, ghosts: Sequence[Ghost]) -> list[str]:
    """Return sentences on ghosts that cannot stand where they were dragged."""
    doubts = []
    for row, ghost in enumerate(ghosts, 1):
        if ghost.overlap_share < plan.least_overlap:
            doubts.append(
                f"New {row} shares {ghost.overlap_share:.0%} of its image with a present camera; with less "
                f"than {plan.least_overlap:.0%} registration may not find its pose"
            )
        if not ghost.free:
            doubts.append(f"No present camera sees that there is free space where new {row} stands")
    return doubts


def ghost_table(ghosts: GhostsView, arrivals: Sequence[Arrival]) -> Markup:
    """Return HTML of a table with a column for each ghost; without arrivals, times are being computed."""
    columns = [f"new {row}" for row in range(1, len(ghosts.ghosts) + 1)]
    sent = [
        (seconds_text(one.seconds_to_90_s), seconds_text(one.seconds_to_99_s), number(one.joules, 2, "J"))
        for one in arrivals
    ] or [("…", "…", "…")] * len(columns)
    rows: list[Row] = [
        ("Height", "Above the floor.", *(number(one.height_m, 2, "m") for one in ghosts.ghosts)),
        (
            "Stands on",
            "Kind of place; by hand: dragged from where the planner put it.",
            *(STANDS_ON[one.where] for one in ghosts.ghosts),
        ),
        (
            "Promise, points",
            "Hundredths of the present cameras' rays that newly meet measured surface, of each camera beyond "
            "those before it, with the 95 % interval.",
            *(points(one.promise) for one in ghosts.ghosts),
        ),
        (
            "Of it on dark surface",
            "Points of the promise on surface that looks dark to a present sensor; a camera of the same kind "
            "may get no depth there, either.",
            *(number(one.promise.dark_share, 1, "", 100.0) for one in ghosts.ghosts),
        ),
        (
            "Overlap",
            "Share of its image that one present camera sees, too, by which it is registered.",
            *(number(one.overlap_share, 0, "%", 100.0) for one in ghosts.ghosts),
        ),
        (
            "90 % there after",
            "Until 90 % of the bytes of its image are at the sink.",
            *(one[0] for one in sent),
        ),
        (
            "99 % there after",
            "Until 99 % of the bytes of its image are at the sink.",
            *(one[1] for one in sent),
        ),
        (
            "Energy of the image",
            "Of radio and computer until 99 % have arrived, or until the end of the run.",
            *(one[2] for one in sent),
        ),
    ]
    return table(rows, columns, [GHOST] * len(columns))


def seconds_text(seconds: float) -> str:
    """Return a time with its unit; infinite times are never."""
    return number(seconds, 2, "s") if math.isfinite(seconds) else "never"


def delivery_bars(arrivals: Sequence[Arrival], deadline_s: float | None) -> Markup:
    """Return HTML of a bar for each ghost's image: until 90 % of it have arrived, then until 99 % have."""
    ends_s = [one.seconds_to_99_s for one in arrivals if math.isfinite(one.seconds_to_99_s)]
    whole_s = 1.05 * max([*ends_s, deadline_s or 0.0], default=1.0)
    lines, line = [], _deadline(deadline_s, whole_s)
    for row, one in enumerate(arrivals, 1):
        if math.isfinite(one.seconds_to_99_s):
            most, rest = one.seconds_to_90_s, one.seconds_to_99_s - one.seconds_to_90_s
            text = f"99 % after {one.seconds_to_99_s:.2f} s"
        else:
            most, rest, text = 0.0, 0.0, "its image does not arrive"
        shares = 100.0 * most / whole_s, 100.0 * rest / whole_s
        lines.append(BAR.format(row, text, shares[0], css(GHOST), shares[1], css(GHOST), line))
    note = "" if deadline_s is None else f"blue line: deadline, {deadline_s:g} s"
    scale = SCALE.format(css(NEUTRAL), note, whole_s)
    return Markup('<div style="padding: 0 0.8em 0.8em; font-size: 13px">{}{}</div>').format(
        Markup("").join(lines), scale
    )


def _deadline(deadline_s: float | None, whole_s: float) -> Markup:
    if deadline_s is None:
        return Markup("")
    return DEADLINE.format(100.0 * deadline_s / whole_s, css(BRAND))


def kept_sentence(taken: TakenView) -> Markdown:
    """Return markdown: the promise of a camera that was added, and its real gain."""
    low, high = taken.promise.ci95_share
    real, gain = taken.real_share, taken.promise.gain_share
    text = Markdown(
        "**Promised {} points{}, really {:.1f}** (hundredths of the earlier cameras' rays). "
    ).format(points(taken.promise), dark_part(taken.promise), 100.0 * real)
    if not taken.placed:
        return text + Markdown("Registration did not find the new camera's pose, so its image was left out.")
    if not low <= real <= high:
        return text + Markdown("That is outside the 95 % interval: the promise was not kept.")
    return text + Markdown(
        "That is inside the 95 % interval, {:.1f} points from the promise. The interval is wide, "
        "{:.1f} points, so one camera says little about it."
    ).format(100.0 * abs(real - gain), 100.0 * (high - low))
