"""Paired comparison of methods over the same cases (SPEC 4.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import wilcoxon

from pipeline.types import FloatArray

SIGNIFICANCE = 0.05


@dataclass(frozen=True, slots=True)
class Comparison:
    """One method compared with another, case by case."""

    rival: str
    ratio: float
    """Median over cases of our error over the rival's."""
    win_rate: float
    """Share of cases with the smaller error; equal errors count half."""
    p: float
    """p value of the two-sided Wilcoxon signed-rank test of the ratios' logarithms; ``holm`` corrects it."""
    cases: int

    @property
    def outcome(self) -> str:
        """``better``, ``worse``, or ``tie`` if the test finds no significant difference."""
        if not self.p < SIGNIFICANCE:
            return "tie"
        return "better" if self.ratio < 1.0 else "worse"


def compare(rival: str, ours: FloatArray, theirs: FloatArray) -> Comparison:
    """Compare (N,) errors of two methods on the same cases, with an uncorrected p.

    The test uses the logarithms of the ratios, so that no condition outweighs another.
    """
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    log_ratio = np.log(np.maximum(ours, 1e-12)) - np.log(np.maximum(theirs, 1e-12))
    p = float(wilcoxon(log_ratio).pvalue) if np.any(log_ratio) else 1.0
    wins = np.mean((log_ratio < 0) + 0.5 * (log_ratio == 0))
    return Comparison(rival, float(np.exp(np.median(log_ratio))), float(wins), p, len(ours))


def holm(comparisons: Sequence[Comparison]) -> tuple[Comparison, ...]:
    """Return the comparisons with p values corrected for their number (Holm 1979)."""
    adjusted = holm_p(np.array([comparison.p for comparison in comparisons])).tolist()
    return tuple(replace(comparison, p=p) for comparison, p in zip(comparisons, adjusted, strict=True))


def holm_p(p: FloatArray) -> FloatArray:
    """Return (m,) step-down adjusted p: the k-th smallest times (m - k + 1), never decreasing, at most 1."""
    order, adjusted = np.argsort(p, kind="stable"), np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(np.arange(len(p), 0, -1) * p[order]))
    return adjusted
