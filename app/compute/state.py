"""What a session wants and what it has: a step is stale when the two differ."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from app.compute.records import Shown
from app.compute.turns import Turns
from network_sim.config import NetworkConfig
from pipeline import spec
from pipeline.config import Baseline, Lens, Pattern
from pipeline.spec import StageName

Step = Literal["scene", "depth", "fuse", "surface", "calibrate", "network"]
CHAIN: tuple[Step, ...] = ("scene", "depth", "fuse", "surface")
"""The steps of the chain, each computed from the one before it."""
STEPS: tuple[Step, ...] = (*CHAIN, "calibrate", "network")
"""All steps that compute; calibration and network wait for nothing of the chain."""
StepStatus = Literal["fresh", "stale", "running", "failed", "missing"]

STAGE_OF: Mapping[Step, StageName] = {
    "scene": "rig",
    "depth": "nodes",
    "fuse": "placement",
    "surface": "after",
}
"""The stage of the chain whose result each step shows."""


@dataclass(frozen=True, slots=True)
class Sent:
    """How the rig's images are sent: a ``pipeline.deliver.DeliverySpec`` without the rig and its chain."""

    network: NetworkConfig
    coding: str = "raw"
    moments: int = 20
    down: tuple[str, ...] = ()
    """Names of nodes that have failed."""


@dataclass(frozen=True, slots=True)
class BoardViews:
    """Photographs of a board, and what is to be made of them."""

    folder: str
    """``node_00/color_00.png`` and so on below it, or the photographs of one camera."""
    edition: int = 0
    """Counts what was added to the folder."""
    pattern: Pattern = "circles"
    columns: int = 11
    rows: int = 9
    spacing_m: float = 0.035
    lens: Lens = "thesis"
    bent: bool = False
    """Whether the board's own shape is estimated, too; of one camera's photographs only."""
    dropped: tuple[tuple[str, str], ...] = ()
    """Camera and view of those that are left out, in order."""


@dataclass(frozen=True, slots=True)
class Spec(spec.Spec):
    """Everything that a session asks for."""

    shown: Shown = "after"
    """The surface that is drawn, and so exported."""
    networks: tuple[NetworkConfig, ...] = ()
    """Runs of a camera network of its own, beside each other; none until somebody looks."""
    sent: Sent | None = None
    """A delivery of the rig's own images; None until somebody looks."""
    views: BoardViews | None = None
    """Photographs to calibrate from; None until somebody looks, or where there are none."""

    def command(self, out: str = "runs/from-app") -> str:
        """The command line that computes the same, with the surface that is shown."""
        line = spec.Spec.command(self, out)
        return f"{line} --baseline {self.shown}" if self.shown in get_args(Baseline) else line

    def asks_for(self, step: Step) -> bool:
        """Whether anybody wants the step: those beside the chain wait until somebody looks."""
        if step == "calibrate":
            return self.views is not None
        return step != "network" or bool(self.networks) or self.sent is not None

    def key(self, step: Step) -> tuple[Hashable, ...]:
        """What a step's result depends on; equal keys mean equal results."""
        if step == "calibrate":
            return (step, self.views)
        if step == "network":
            chain = () if self.sent is None else spec.key(self, "truth")
            return (step, self.networks, self.sent, chain)
        return spec.key(self, STAGE_OF[step])


class SharedViews:
    """The newest views of all sessions: who wants what another has just got gets it at once."""

    def __init__(self, capacity: int = 24) -> None:
        self.turns = Turns()
        self._views: OrderedDict[Hashable, Any] = OrderedDict()
        self._capacity = capacity
        self._lock = threading.Lock()

    def get(self, key: Hashable) -> Any:
        """The view for this key, or None."""
        with self._lock:
            if key in self._views:
                self._views.move_to_end(key)
            return self._views.get(key)

    def put(self, key: Hashable, view: Any) -> None:
        """Keep a view, and forget the one that was wanted longest ago."""
        with self._lock:
            self._views[key] = view
            self._views.move_to_end(key)
            while len(self._views) > self._capacity:
                self._views.popitem(last=False)


@dataclass(slots=True)
class Results:
    """The latest view of every step, with the key it was computed for."""

    _views: dict[Step, tuple[Hashable, Any]] = field(default_factory=dict)
    _failures: dict[Step, tuple[Hashable, str]] = field(default_factory=dict)
    _shown: dict[Step, Hashable] = field(default_factory=dict)
    """The key of what the panels show of a step, all or the beginning of it."""

    def put(self, step: Step, key: Hashable, view: Any) -> None:
        """Keep a result."""
        self._views[step] = (key, view)
        self._shown[step] = key
        self._failures.pop(step, None)

    def begin(self, step: Step, key: Hashable) -> None:
        """The panels show what there is so far of a result."""
        self._shown[step] = key

    def shows_other(self, step: Step, spec: Spec) -> bool:
        """Whether the panels show something of a step that is not what ``spec`` asks for."""
        return step in self._shown and self._shown[step] != spec.key(step)

    def fail(self, step: Step, key: Hashable, sentence: str) -> None:
        """Remember that this cannot be computed, so that it is not tried again until something changes."""
        self._failures[step] = (key, sentence)

    def retry_failed(self) -> None:
        """Try failed steps again."""
        self._failures.clear()

    def view(self, step: Step) -> Any:
        """The last result of a step, stale or not; None if there is none."""
        return self._views[step][1] if step in self._views else None

    def failure(self, step: Step, spec: Spec) -> str | None:
        """Why a step cannot be computed as things are."""
        key, sentence = self._failures.get(step, (None, None))
        return sentence if key == spec.key(step) else None

    def fresh(self, step: Step, spec: Spec) -> bool:
        """Whether a step's result is what ``spec`` asks for."""
        return step in self._views and self._views[step][0] == spec.key(step)

    def first_stale(self, spec: Spec, steps: Sequence[Step] = CHAIN) -> Step | None:
        """The next of ``steps`` to compute; None if all are fresh, one failed, or nobody asks for it."""
        for step in steps:
            if not spec.asks_for(step):
                return None
            if not self.fresh(step, spec):
                return None if self.failure(step, spec) else step
        return None

    def status(self, step: Step, spec: Spec, running: Collection[Step] = ()) -> StepStatus:
        """What to mark a step with."""
        if step in running:
            return "running"
        if self.fresh(step, spec):
            return "fresh"
        if self.failure(step, spec):
            return "failed"
        return "stale" if step in self._views else "missing"
