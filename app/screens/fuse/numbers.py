"""Tables and sentences about a race and about the chain's own registration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.drawing.colors import css
from app.screens.fuse.labels import MARKS, OFF_FROM
from app.screens.fuse.methods import color_of
from app.screens.fuse.view import (
    OFF_DIGITS,
    REACH_M,
    SUCCESS_M,
    FuseView,
    RaceLane,
    RaceStep,
    Reference,
    RegistrationRow,
)
from app.web.markup import Markdown, Markup
from app.window.tables import Row, number, table

STOPS = {"max_iterations": "limit"}
_OFF: dict[Reference, tuple[str, str]] = {
    "truth": ("error", "RMS distance of the moved points from their true places"),
    "pixels": ("error", "RMS distance of the moved points from the measured points of the same pixels"),
    "walk": ("error", "RMS distance of the moved points from their places by the poses of the whole walk"),
    "cloud": ("gap", "Median distance of the drawn points to the nearest point of the other cloud"),
}


def winner(reference: Reference, lanes: tuple[RaceLane, ...]) -> Markdown:
    """Return a sentence on which method ends nearest to the reference position, or on why that is unknown."""
    if reference == "cloud":
        return Markdown(
            "The truth of this scene is not known. RMSE alone does not show which method is better, "
            "because the methods pair and weight points differently."
        )
    ranking = sorted(((lane.steps[-1].point_error_m or 0.0), lane.label) for lane in lanes)
    (best_m, best), worst_m = ranking[0], ranking[-1][0]
    missed = f" No method ends within {100 * SUCCESS_M:.0f} cm." if best_m >= SUCCESS_M else ""
    if len(ranking) == 1:
        return Markdown("**{}** ends {} {}.{}").format(best, _cm(best_m), OFF_FROM[reference], missed)
    if _alike(best_m, worst_m):
        everyone = "both end" if len(ranking) == 2 else "all end"
        return Markdown("Here {} equally far, {}, {}.{}").format(
            everyone, _cm(best_m), OFF_FROM[reference], missed
        )
    places = Markdown(", ").join(
        Markdown("**{}** {}").format(label, _cm(error_m)) for error_m, label in ranking[1:]
    )
    return Markdown("**{}** ends {} {}, {}.{}{}").format(
        best, _cm(best_m), OFF_FROM[reference], places, _loss(ranking), missed
    )


def off_text(step: RaceStep, digits: int = OFF_DIGITS, unit: str = "cm") -> str:
    """Return a step's error in centimetres, followed by ``unit``; a gap out of reach as ``≥ 50 cm``."""
    if step.out_of_reach:
        return f"≥ {number(REACH_M, 0, unit, 100.0)}"
    return number(step.off_m, digits, unit, 100.0)


def _cm(error_m: float) -> str:
    return number(error_m, OFF_DIGITS, "cm", 100.0)


def _alike(one_m: float, other_m: float) -> bool:
    return bool(np.isclose(one_m, other_m, rtol=0.05, atol=2e-4))


def _loss(ranking: list[tuple[float, str]]) -> str:
    """Return a sentence if another method ends clearly nearer than the best CEICP; empty otherwise."""
    best_m, best = ranking[0]
    ours_m = [error_m for error_m, label in ranking if "CEICP" in label]
    return " So CEICP loses here." if ours_m and "CEICP" not in best and not _alike(best_m, ours_m[0]) else ""


def race_table(reference: Reference, lanes: tuple[RaceLane, ...]) -> Markup:
    """Return a table with a column for each lane, and the reasons of the verdicts that are not sure.

    Every row's name has an explanation.
    """

    def row(name: str, hint: str, value: Callable[[RaceLane], str]) -> Row:
        return (name, hint, *(value(lane) for lane in lanes))

    word, hint = _OFF[reference]
    rows = [
        row("Iterations", "Matchings and pose updates until it stopped.", lambda x: str(x.iterations)),
        row(
            "Stopped",
            "converged: it moves less than 0.1 mrad and a 3000th of the gate; stalled: no change of the "
            "error; limit: all allowed iterations done; degenerate: too few pairs to go on; lost: no pair "
            "of points to begin with.",
            lambda x: _stop_word(x.stop_reason),
        ),
        row(
            f"Start {word}",
            f"{hint}, at the start.",
            lambda x: off_text(x.steps[0]),
        ),
        row(
            f"End {word}",
            "The same measure at the end." + (" Below 2 cm counts as success." if word == "error" else ""),
            lambda x: off_text(x.steps[-1]),
        ),
        row(
            "AHD",
            "Average Hausdorff distance of the clouds at the end: mean distance to the nearest point, "
            "both ways. It hardly separates the methods if one cloud has holes.",
            lambda x: number(x.average_hausdorff_m, 2, "cm", 100),
        ),
        row(
            "RMSE",
            "Weighted RMS distance of the last pairs; not comparable between methods.",
            lambda x: number(x.steps[-1].rmse_m, 2, "cm", 100),
        ),
        row(
            "Verdict",
            "Whether to believe the end pose, judged by the clouds alone: sure, doubtful, or none if "
            "nothing speaks for it.",
            lambda x: x.verdict,
        ),
        row(
            "Eff. pairs",
            "Effective pairs of the last matching, (Σw)² / Σw²: this number of equal weights would have "
            "the same effect.",
            lambda x: f"{x.effective_pairs:,.0f}",
        ),
        row(
            "Time",
            "Preparation and all iterations, in this app's computing process.",
            lambda x: number(x.elapsed_s, 0, "ms", 1000),
        ),
    ]
    return table(rows, MARKS[: len(lanes)], [color_of(lane.rival) for lane in lanes]) + _doubts(lanes)


def _doubts(lanes: tuple[RaceLane, ...]) -> Markup:
    """Return a line for each lane whose end pose is not sure, with the reasons; empty if all are."""
    lines = [
        Markup("<b style='color: {}'>{}</b> Verdict {}.").format(
            css(color_of(lane.rival)), mark, lane.verdict_text
        )
        for mark, lane in zip(MARKS, lanes, strict=False)
        if lane.reasons
    ]
    if not lines:
        return Markup("")
    return Markup("<div style='padding: 0 0.8em 0.8em; font-size: 13px'>{}</div>").format(
        Markup("<br>").join(lines)
    )


def _stop_word(reason: str) -> str:
    """Return the reason of the stop in one word."""
    head = reason.partition(":")[0]
    return "lost" if reason.startswith("No pair") else STOPS.get(head, head)


def places_table(view: FuseView) -> Markup:
    """Return sentences on the chain's own registrations and a table of them; empty if there are none."""
    if not view.rows:
        return Markup("")
    rows = [_place_row(row) for row in view.rows]
    lines = [Markup("<b>The chain's own result.</b>{}").format(_agreeing(view)), *view.sentences]
    return Markup("<div style='padding: 0 0.8em; font-size: 13px'>{}</div>").format(
        Markup("<br>").join(lines)
    ) + table(rows, ("iterations", "error before", "after"))


def _agreeing(view: FuseView) -> str:
    """Return a sentence on the cameras' agreement; empty if no two measured the same place."""
    if not np.isfinite(view.agreement_share):
        return ""
    return (
        f" Where two cameras measured the same surface, {view.agreement_share:.1%} of the points agree "
        "within 2 %."
    )


def _place_row(row: RegistrationRow) -> Row:
    known = "Errors: RMS distance of the points from the truth. " if row.error_after_m is not None else ""
    return (
        f"{row.source} → {row.target}",
        f"{row.method.upper()}: {row.stop_reason}. {known}{_loop(row)}",
        str(row.iterations),
        number(row.error_before_m, 1, "cm", 100),
        number(row.error_after_m, 2, "cm", 100),
    )


def _loop(row: RegistrationRow) -> str:
    """Return a sentence on how well the other registrations agree with this one."""
    if not row.used:
        return "Not used: it was degenerate, or the other registrations or the measured depth contradict it."
    if not np.isfinite(row.loop_error_m):
        return "There is no loop to check it."
    return f"The loop over the other nodes differs from it by {number(row.loop_error_m, 1, 'cm', 100)}."
