"""The lanes of the dock: the frames of each node, and the curves of their results."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.drawing.colors import DELIVERED, INFERRED, LOSS, SOURCE
from app.drawing.timeline import Curve, CurvesLane, FramesLane, Lane
from app.screens.network.delivery_view import DeliveryView
from app.screens.network.labels import CAUSES
from app.screens.network.packets import Frames
from app.screens.network.view import NetworkView, What
from network_sim.types import Cause, to_ns
from pipeline.types import FloatArray

HALTS = (What.AIR, What.LOSS, What.DROP, What.ARRIVE, What.EXPIRE)
"""Events at which the step buttons stop."""


def lanes_of(
    delivery: DeliveryView | None, runs: Sequence[NetworkView], frames: Sequence[Frames]
) -> list[Lane]:
    """Return the dock's lanes: the frames and the growth of a delivery, or the frames of each street run.

    A single street run also has a lane of curves. ``frames`` are the delivery's, or each run's.
    """
    if delivery is not None:
        return [frames_lane(delivery.run, frames[0]), growth_lane(delivery)]
    lanes: list[Lane] = [frames_lane(*one) for one in zip(runs, frames, run_names(runs), strict=True)]
    return [*lanes, run_curves(runs[0])] if len(runs) == 1 else lanes


def frames_lane(view: NetworkView, frames: Frames, run: str = "") -> FramesLane:
    """Return a lane with one row per node; names start with the run's name if two are compared."""
    names = [f"{run} · {view.names[node]}" if run else view.names[node] for node in view.lane_nodes]
    return FramesLane(view.levels, names, frames.line, [CAUSES[cause] for cause in Cause])


def run_names(runs: Sequence[NetworkView]) -> list[str]:
    """Return short names of compared runs; an empty one for a single run."""
    if len(runs) < 2:
        return [""] * len(runs)
    schemes = [run.label.split(":")[0] for run in runs]
    return schemes if len({*schemes}) == len(runs) else [f"run {index + 1}" for index in range(len(runs))]


def stops_ns(*views: NetworkView) -> NDArray[np.int64]:
    """Return (S,) start times of all events at which the step buttons stop."""
    return np.unique(np.concatenate([one.pieces.start_ns[np.isin(one.pieces.what, HALTS)] for one in views]))


def growth_lane(view: DeliveryView) -> CurvesLane:
    """Return a lane of the arrived data and the quality of its surface over the computed moments."""
    return CurvesLane("At the sink", _growth(view))


def _growth(view: DeliveryView) -> list[Curve]:
    t_ns = np.array(view.times_ns, np.int64)
    by_time = {one.t_ns: one for one in view.moments}
    moments = [by_time.get(t) for t in view.times_ns]

    def percent(values: list[float | None]) -> FloatArray:
        return np.array([np.nan if value is None else 100.0 * value for value in values])

    score = percent([None if one is None else one.f_score for one in moments])
    holes = percent([None if one is None else one.no_hit_share for one in moments])
    arrived = 100.0 * view.arrived_bytes / max(view.total_bytes, 1)
    curves = [
        Curve("bytes", "%", DELIVERED, view.arrived_ns, arrived, 0.0, 100.0, 0),
        Curve("rays without a surface", "%", LOSS, t_ns, holes, 0.0, 100.0, 0),
    ]
    if np.isfinite(score).any() or not view.moments:
        curves.insert(1, Curve("F-score", "%", INFERRED, t_ns, score, 0.0, 100.0, 0))
    return curves


def run_curves(view: NetworkView) -> CurvesLane:
    """Return a lane of the delivery ratio and the throughput over a run."""
    delivery, throughput = view.series["delivery"], view.series["throughput"]
    most = float(np.nanmax(throughput.values, initial=1.0))
    curves = [
        Curve("delivered", "%", DELIVERED, _ns(delivery.t_s), delivery.values, 0.0, 100.0, 0),
        Curve("throughput", "kbit/s", SOURCE, _ns(throughput.t_s), throughput.values, 0.0, most),
    ]
    return CurvesLane("Of the packets", curves)


def _ns(t_s: FloatArray) -> NDArray[np.int64]:
    return np.array([to_ns(float(one)) for one in t_s], np.int64)
