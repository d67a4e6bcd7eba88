"""What a plan promises, with its interval: shares of the present cameras' rays on measured surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.rays import Camera
from pipeline.reconstruct import Reconstruction
from pipeline.surface.quality import guessed_share, missed_share, seen_by

KEPT = 0.75
"""Share of an expected gain that was real on average, in the rooms of ``lab.planning``'s tuning."""
SPREAD = 0.5
"""Half of the 95 % interval as a share of the promise, and"""
LEAST_SPREAD = 0.003
"""its least, a share of all rays; both hold 95 % of the real gains in those rooms."""


@dataclass(frozen=True, slots=True)
class Promise:
    """An expected gain: share of the present cameras' rays that newly meet measured surface."""

    gain_share: float
    ci95_share: tuple[float, float]


def promise(expected_targets: float, target_share: float) -> Promise:
    """Return the promise for an expected number of targets, each of which is a share of all rays."""
    gain = KEPT * expected_targets * target_share
    half = max(LEAST_SPREAD, SPREAD * gain)
    return Promise(gain, (max(0.0, gain - half), gain + half))


def measured_share(done: Reconstruction, cameras: Sequence[Camera]) -> float:
    """Return the share of the cameras' rays that meet measured surface of a reconstruction."""
    surface = done.after
    views = list(seen_by(surface.vertices_m, surface.triangles, cameras, surface.source))
    guessed = guessed_share(views)
    return 1.0 - missed_share([view.depth for view in views], cameras) - float(np.nan_to_num(guessed))
