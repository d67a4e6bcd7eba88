"""The tables of docs/results.md about verdicts on simulated calibrations."""

from __future__ import annotations

from lab.results.markdown import Cell, Row, percent, table

HEADER = ("", "judged", "pass", "of these wrong", "fail", "of these wrong", "not decided", "of these good")
NO_MRCAL = "\n\nmrcal was not installed on this machine."


def calibration_verdicts(numbers: Row) -> str:
    """Return counts of right and wrong verdicts, and the frequency of good cameras by our probability."""
    rules = [(rule, *_cells(counts)) for rule, counts in numbers["rules"].items()]
    groups = [(title, *_cells(counts)) for title, counts in numbers["groups"].items()]
    bins = [
        (
            *(f"{one['from']:g} to {one['to']:g}", one["sessions"]),
            *(percent(one["mean_probability"]), percent(_share(one["good"], one["sessions"]))),
        )
        for one in numbers["probabilities"]
    ]
    ours = numbers["rules"]["packetmesh"]
    every = numbers["sessions"]
    last = "" if numbers["mrcal"] else NO_MRCAL
    not_good = ours["fail, wrong"] + ours["not decided, good"]
    return f"""{every} sessions are simulated as points, not as images: four lenses (thesis, brown, rational,
fisheye), the right lens model or any, flat and bent boards, good, few or similar views, blurred views, noise
of 0.1 to 1 px, seed {numbers["seed"]}; {numbers["without_a_camera"]} ended without a camera. *Wrong*: the
true camera contradicts a pass or a fail, that is, points are (not) within the accuracy over 95 % of the
image. mrcal judges the same points where it has the lens model: *uncertainty* passes if 2.45 times its
uncertainty is small enough, *two halves* if the difference of two halves of the views is. The limits of our
verdict were chosen by the sessions of seed 100 only.

{table(HEADER, rules)}

Of all sessions, a pass of ours is false in {percent(ours["pass, wrong"] / every)}, and a fail in
{percent(ours["fail, wrong"] / every)}; fails and undecided sessions together have a good camera in
{percent(not_good / every)}. Ours by kind of session:

{table(HEADER, groups)}

The probability that our verdict states, and how often the camera was good:

{table(("stated probability", "sessions", "its mean", "good cameras"), bins)}{last}"""


def _cells(counts: Row) -> tuple[Cell, ...]:
    """Return the numbers of a row, those of wrong verdicts with their share."""
    cells: list[Cell] = [counts["judged"]]
    for word, of_these in (
        ("pass", "pass, wrong"),
        ("fail", "fail, wrong"),
        ("not decided", "not decided, good"),
    ):
        share = percent(_share(counts[of_these], counts[word]))
        cells += [counts[word], f"{counts[of_these]} ({share})" if counts[word] else None]
    return tuple(cells)


def _share(count: int, of: int) -> float | None:
    return count / of if of else None
