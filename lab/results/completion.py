"""Text on the benefit of completion and its confidence, from their records."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from lab.benchmarks.filling import NETWORK, OURS
from lab.results import tables
from lab.results.markdown import Row, listed
from lab.results.record import Records
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.slopes import GRID_WIDTH_PX

TARGET, TARGET_PX = 0.75, 40
"""Target: error over that of the best other program, at discs of at least this many pixels."""
REPORTED_BIN = "80% to 90%"
"""The bin of confidence that the text reports."""
REPORTED_SHARES = (80.0, 90.0)
TUNING = (
    "Which sets had a part in tuning: the validation rooms had; held-out rooms, demo scenes and real frames "
    "had none."
)


def standing(records: Records) -> list[str]:
    """Return all paragraphs; none without the records."""
    found = []
    if "bench_depth" in records:
        runs = [run for run in records["bench_depth"].numbers["depth"]["runs"] if "group" in run]
        found += [target(runs), whole_holes(runs), reasons()]
    if "fill_claims" in records:
        found.append(trust(records["fill_claims"].numbers["D10"]))
    return found


def filling(numbers: Row) -> str:
    """Return the tables of hidden holes, their summary, and the images used for tuning."""
    runs = [run for run in numbers["depth"]["runs"] if "group" in run]
    return "\n\n".join((tables.filling(numbers), target(runs), whole_holes(runs), reasons(), TUNING))


def fill_claims(numbers: Row) -> str:
    """Return D10 with its summary."""
    return "\n\n".join((tables.our_claims(numbers), trust(numbers["D10"]), TUNING))


def depth_claims(numbers: Row) -> str:
    """Return C12 to C14, and the images used for tuning."""
    return tables.claims(numbers, TUNING)


def target(runs: Sequence[Row]) -> str:
    """Return a paragraph: the discs at which the target is reached, and the ratios at the others."""
    ratios = {}
    for group in _groups(runs, ", disc of "):
        kind, _, size = group.partition(", disc of ")
        if int(size.split()[0]) >= TARGET_PX:
            ours, _, other = _best(runs, group)
            ratios[f"{size} in {kind}"] = ours / other
    reached = [f"{place} ({ratio:.2f})" for place, ratio in ratios.items() if ratio <= TARGET]
    missed = [ratio for ratio in ratios.values() if ratio > TARGET]
    rest = f"; elsewhere it has {min(missed):.2f} to {max(missed):.2f} times that error" if missed else ""
    return (
        f"**The target.** Completion was to have at most {TARGET} times the error of the best of the others "
        f"at discs of {TARGET_PX} px and more. It reaches this at {listed(reached)}{rest}."
    )


def whole_holes(runs: Sequence[Row]) -> str:
    """Return a paragraph on hidden shapes of real holes, and on the sensors' own holes."""
    hidden, own = [], []
    for group in _groups(runs, ", hidden"):
        ours, other = (_run(runs, group, name) for name in (OURS, NETWORK))
        low, high = other["excess_ci95"]
        sure = "" if low > 0.0 or high < 0.0 else ", which is not certain"
        more = 100.0 * (ours["abs_rel"] / other["abs_rel"] - 1.0)
        hidden.append(f"{group.removesuffix(', hidden')} {more:+.0f} %{sure}")
    for group in _groups(runs, ", own holes"):
        ours_error, best, other_error = _best(runs, group)
        network = _run(runs, group, NETWORK)["abs_rel"]
        less, than_best = (100.0 * (ours_error / error - 1.0) for error in (network, other_error))
        named = "the best of the others" if best == NETWORK else f"{than_best:+.0f} % to {best}, the best"
        own.append(f"{group.removesuffix(', own holes')} {less:+.0f} % ({named})")
    return (
        "**Where completion helps.** Error of completion against that of the colour network alone. Over "
        f"all hidden pixels of shapes of real holes: {'; '.join(hidden)}. In the sensors' own holes, which "
        f"is where it is used and why it ships: {'; '.join(own)}."
    )


def reasons() -> str:
    """Return a paragraph with the reasons for the remaining error and the numbers of the training."""
    images, minutes = _training()
    return (
        f"**Why no better.** It was trained on {images:,} frames in {minutes} minutes of two cores, and "
        f"its loss was still falling. Its grid has {GRID_WIDTH_PX} cells across, and what is smaller "
        "is blurred. Near a rim the surrounding measurements nearly determine the depth, so that simple "
        "programs, which continue them, do well."
    )


def trust(claim: Row) -> str:
    """Return a paragraph on the pixels whose confidence is 80 to 90 %: the share that is right, by group."""
    (bins,) = (found for found in claim["tables"] if found["title"] == "Confidence in bins")
    rows = [row for row in bins["rows"] if row[1] == REPORTED_BIN]
    shares = {group: true for group, _, _, _, true in rows}
    pixels = [int(str(row[2]).replace(",", "")) for row in rows]
    right = sum(count * _share(true) for count, true in zip(pixels, shares.values(), strict=True))
    low, high = REPORTED_SHARES
    modest = [group for group, true in shares.items() if _share(true) > high]
    sure = [group for group, true in shares.items() if _share(true) < low]
    measured = "; ".join(f"{group}: {true}" for group, true in shares.items())
    return (
        f"**Its confidence.** Share of right pixels among those with a confidence of {low:.0f} to "
        f"{high:.0f} %: {measured}; of all groups together {right / sum(pixels):.1f} %. "
        f"Confidence too low in: {'; '.join(modest) or 'none'}; too high in: {'; '.join(sure) or 'none'}. A "
        "sensor's own holes are where it fails: dark, shiny and far things, unlike what surrounds them. "
        "Hidden shapes are where the sensor had measured, on things that are easier to continue, so their "
        "confidence has odds of its own; both odds were fitted on validation rooms, all hole pixels counting "
        "the same."
    )


def _groups(runs: Sequence[Row], ending: str) -> list[str]:
    return [group for group in dict.fromkeys(run["group"] for run in runs) if ending in group]


def _run(runs: Sequence[Row], group: str, program: str) -> Row:
    return next(run for run in runs if run["group"] == group and run["program"] == program)


def _best(runs: Sequence[Row], group: str) -> tuple[float, str, float]:
    """Return our error, and the best other program with its error."""
    others = [run for run in runs if run["group"] == group and run["program"] != OURS]
    best = min(others, key=lambda run: run["abs_rel"])
    return _run(runs, group, OURS)["abs_rel"], best["program"], best["abs_rel"]


def _share(cell: str) -> float:
    return float(cell.split("%")[0])


@cache
def _training() -> tuple[int, int]:
    """Return the training's frames and minutes, from the network's file."""
    import onnxruntime

    session = onnxruntime.InferenceSession(SHIPPED_COMPLETION, providers=["CPUExecutionProvider"])
    metadata = session.get_modelmeta().custom_metadata_map
    return int(metadata["images_seen"]), int(metadata["minutes"])
