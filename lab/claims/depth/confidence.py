"""D10: whether the confidence of filled depth equals the share of it that is correct (SPEC 3.5)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.benchmarks.filling import CLOSE, hidden_cases, sites
from lab.claims.claim import Claim, Outcome, bootstrap_ci95
from lab.claims.depth.scenes import Site, real_folders
from lab.claims.exhibits import Chart, Curve, Table, plain_curve
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, align_depth, complete, judge
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.io.demos import SCENES
from pipeline.types import BoolArray, FloatArray

EDGES = np.linspace(0.0, 1.0, 11)
"""Edges of the confidence bins."""
LARGEST_GAP = 0.1
"""Largest accepted difference between a bin's confidence and correct share, averaged over pixels."""
NOTE = (
    "Pixels of hidden depth, and of the sensors' own holes where the truth is known, before any is left out "
    "for little confidence. Confidence: its mean in the bin. Correct share: pixels within 5 % of the "
    "reference, and the 95 % interval by resampling rooms, demo scenes, or hidden parts of the real frames."
)


@dataclass(frozen=True, slots=True)
class Reliability:
    """Confidence and correct share of a group of images, by bin."""

    group: str
    counts: FloatArray
    """(places, 3, 10) for every place and bin: pixels, sum of their confidences, correct pixels."""

    @property
    def confidence(self) -> FloatArray:
        """(10,) mean confidence; NaN in an empty bin."""
        return self._share(1)

    @property
    def true(self) -> FloatArray:
        """(10,) share that is correct; NaN in an empty bin."""
        return self._share(2)

    @property
    def pixels(self) -> FloatArray:
        """(10,) number of pixels."""
        return self.counts.sum(axis=0)[0]

    @property
    def filled(self) -> list[int]:
        """The bins that have pixels."""
        return [int(number) for number in np.flatnonzero(self.pixels)]

    @property
    def gap(self) -> float:
        """Difference between a bin's mean confidence and correct share, absolute, averaged over pixels."""
        return gap_of(self.counts)

    @property
    def gap_ci95(self) -> tuple[float, float]:
        """95 % interval of the gap, by resampling places."""
        rng = np.random.default_rng(0)
        drawn = rng.integers(0, len(self.counts), (2000, len(self.counts)))
        low, high = np.percentile([gap_of(self.counts[rows]) for rows in drawn], (2.5, 97.5))
        return float(low), float(high)

    def true_ci95(self, number: int) -> tuple[float, float]:
        """Return the 95 % interval of a bin's correct share, by resampling places that have pixels there."""
        counts = self.counts[:, [2, 0], number]
        return bootstrap_ci95(
            counts[counts[:, 1] > 0],
            statistic=lambda counts, axis: np.divide(*counts.sum(axis=axis).T),
        )

    def _share(self, row: int) -> FloatArray:
        total = self.counts.sum(axis=0)
        with np.errstate(invalid="ignore"):
            return total[row] / total[0]


def gap_of(counts: FloatArray) -> float:
    """Return the expected calibration error of (places, 3, bins) counts (Naeini, Cooper, Hauskrecht 2015)."""
    pixels, confidence, right = counts.sum(axis=0)
    return float(np.abs(confidence - right).sum() / pixels.sum())


def binned(confidence: FloatArray, right: BoolArray) -> FloatArray:
    """Return (3, 10) counts by bin of (N,) confidences: pixels, sum of confidences, pixels with ``right``."""
    confidence = confidence.astype(np.float64)
    return np.stack(
        [np.histogram(confidence, EDGES, weights=weights)[0] for weights in (None, confidence, right * 1.0)]
    )


def confidence_trial(site: Site) -> list[dict[str, Any]]:
    """Return the counts of every image of a site, with its group and place, as plain values."""
    network, config = DepthNetwork(), DepthConfig()
    found = []
    for case in hidden_cases(site):
        aligned = align_depth(network.infer(case.rgb), case.sensor, config.alignment)
        completed = complete(case.sensor, case.rgb)
        hidden = case.hole if case.measured else None
        judged = judge(aligned, case.sensor, case.rgb, float("inf"), 0.0, completed, hidden)
        answered = case.hole & judged.depth.valid
        truth_m = case.truth_m[answered]
        right = np.abs(judged.depth.z_m[answered] - truth_m) <= CLOSE * truth_m
        counts = binned(judged.confidence[answered], right)
        found.append({"group": case.group, "place": case.place, "counts": counts.tolist()})
    return found


def all_confidences(
    folder: Path, scheduler: str | None
) -> Generator[Progress, None, tuple[Reliability, ...]]:
    """Run the trials of all sites and return the counts of every group of images."""
    data = (SHIPPED_MODEL, SHIPPED_COMPLETION, SCENES, *real_folders())
    trials = yield from iterate_trials(
        "D10, confidence", confidence_trial, sites(), folder, scheduler, data=data
    )
    return reliabilities([image for trial in trials for image in trial])


def reliabilities(images: Sequence[dict[str, Any]]) -> tuple[Reliability, ...]:
    """Return the images' counts by group, summed by place."""
    found: dict[str, dict[str, FloatArray]] = {}
    for image in images:
        places = found.setdefault(image["group"], {})
        places[image["place"]] = places.get(image["place"], 0.0) + np.array(image["counts"])
    return tuple(Reliability(group, np.stack([*places.values()])) for group, places in found.items())


def judge_confidence(measured: Sequence[Reliability]) -> Outcome:
    """Return D10's numbers and verdict."""
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for one in measured:
        pixels, confidence, right = one.counts.sum(axis=(0, 2))
        ours |= {f"confidence_{one.group}": confidence / pixels, f"correct_share_{one.group}": right / pixels}
        ours[f"gap_{one.group}"] = one.gap
        ci95[f"gap_{one.group}"] = one.gap_ci95
    sentences = (
        f"{one.group}: confidence {ours[f'confidence_{one.group}']:.0%}, correct share "
        f"{ours[f'correct_share_{one.group}']:.0%}, {100.0 * one.gap:.1f} points apart bin by bin"
        for one in measured
    )
    return Outcome(
        {name: float(value) for name, value in ours.items()},
        ci95,
        all(one.gap <= LARGEST_GAP for one in measured),
        "; ".join(sentences),
        (confidence_chart(measured), confidence_table(measured)),
    )


def confidence_chart(measured: Sequence[Reliability]) -> Chart:
    """Return a chart of the correct share over the confidence, by bin."""
    curves = []
    for one in measured:
        numbers = one.filled
        low, high = zip(*(one.true_ci95(number) for number in numbers), strict=True)
        confidence, true = (tuple(values[numbers].tolist()) for values in (one.confidence, one.true))
        curves.append(Curve(one.group, confidence, true, low, high))
    return Chart(
        "Correct share against confidence",
        "mean confidence",
        "share within 5 %",
        (plain_curve("equal", (0.0, 1.0), (0.0, 1.0)), *curves),
        NOTE,
    )


def confidence_table(measured: Sequence[Reliability]) -> Table:
    """Return the chart's numbers as a table."""
    rows = []
    for one in measured:
        for number in one.filled:
            low, high = one.true_ci95(number)
            span = f"{EDGES[number]:.0%} to {EDGES[number + 1]:.0%}"
            true = f"{one.true[number]:.1%} [{low:.1%}, {high:.1%}]"
            rows.append((one.group, span, int(one.pixels[number]), f"{one.confidence[number]:.1%}", true))
    return Table(
        "Confidence in bins", ("images", "bin", "pixels", "confidence", "correct share"), tuple(rows), NOTE
    )


D10 = Claim(
    id="D10",
    claim="The confidence of what fills a hole is the share of it that is right",
    thesis="ours beyond the thesis, which trusts every inferred depth alike",
    tolerance=(
        "expected calibration error over ten bins at most 0.1 in every group of images; right is within 5 %"
    ),
    experiment=judge_confidence,
    prepare=all_confidences,
)
