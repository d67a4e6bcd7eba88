"""A session's spec and its results; a step is stale if its result belongs to another spec."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from app.compute.measures import NO_MEASURES, Tape
from app.compute.records import Shown
from network_sim.config import NetworkConfig
from pipeline import spec
from pipeline.config import Baseline, Lens, Pattern
from pipeline.spec import StageName

Step = Literal["scene", "depth", "fuse", "surface", "calibrate", "network"]
CHAIN: tuple[Step, ...] = ("scene", "depth", "fuse", "surface")
"""The steps of the chain, each computed from the one before it."""
STEPS: tuple[Step, ...] = (*CHAIN, "calibrate", "network")
"""All steps that compute; calibration and network depend on no step of the chain."""
StepStatus = Literal["fresh", "stale", "running", "failed", "missing"]

STAGE_OF: Mapping[Step, StageName] = {
    "scene": "rig",
    "depth": "nodes",
    "fuse": "placement",
    "surface": "after",
}
"""The pipeline stage whose result each step shows."""


@dataclass(frozen=True, slots=True)
class Sent:
    """How the rig's images are sent: a ``pipeline.deliver.DeliverySpec`` without the rig and its chain."""

    network: NetworkConfig
    coding: str = "exact"
    moments: int = 20
    down: tuple[str, ...] = ()
    """Names of nodes that have failed."""
    leave_out_seen: bool = False
    """Whether nodes leave out tiles that another camera shows, which the sink tells them."""
    order: Literal["own", "worth"] = "own"
    """Order of the depth tiles: the coding's own, or by what the sink expects each to add to the surface."""


@dataclass(frozen=True, slots=True)
class BoardViews:
    """Photographs of a calibration board and the settings of the calibration."""

    folder: str
    """Folder that holds ``node_00/color_00.png`` and so on, or the photographs of one camera."""
    edition: int = 0
    """Counter that increases when photographs are added to the folder."""
    pattern: Pattern = "circles"
    columns: int = 11
    rows: int = 9
    spacing_m: float = 0.035
    dictionary: str = ""
    """Dictionary of a ChArUco board's markers; empty if any may be on the board."""
    tag_spacing: float = 0.3
    """Gap between two AprilTags over the side of a tag."""
    lens: Lens = "thesis"
    bent: bool = False
    """Whether the board's own shape is estimated too; only for the photographs of one camera."""
    dropped: tuple[tuple[str, str], ...] = ()
    """Camera and view of the photographs that are left out, in order."""


@dataclass(frozen=True, slots=True)
class Spec(spec.Spec):
    """All settings and sources that a session computes from."""

    shown: Shown = "after"
    """The surface that is drawn and exported."""
    tape: Tape = NO_MEASURES
    """Measures on the surface after fusion, for the report and the exports."""
    networks: tuple[NetworkConfig, ...] = ()
    """Settings of the simulated networks that are compared; empty until the screen is first opened."""
    sent: Sent | None = None
    """A delivery of the rig's own images; None until its screen is first opened."""
    views: BoardViews | None = None
    """Photographs to calibrate from; None until the screen is opened, or if there are none."""

    def command(self, out: str = "runs/from-app") -> str:
        """Return the command line that computes the same, including the surface that is shown."""
        line = spec.Spec.command(self, out)
        return f"{line} --baseline {self.shown}" if self.shown in get_args(Baseline) else line

    def includes(self, step: Step) -> bool:
        """Whether the step is to be computed: calibration and network wait until their screen is opened."""
        if step == "calibrate":
            return self.views is not None
        return step != "network" or bool(self.networks) or self.sent is not None

    def key(self, step: Step) -> tuple[Hashable, ...]:
        """Return everything that a step's result depends on; equal keys mean equal results."""
        if step == "calibrate":
            return (step, self.views)
        if step == "network":
            chain = () if self.sent is None else spec.key(self, "truth")
            return (step, self.networks, self.sent, chain)
        return spec.key(self, STAGE_OF[step])


@dataclass(slots=True)
class Results:
    """The latest view of every step, with the key it was computed for."""

    _views: dict[Step, tuple[Hashable, Any]] = field(default_factory=dict)
    _failures: dict[Step, tuple[Hashable, str]] = field(default_factory=dict)
    _shown: dict[Step, Hashable] = field(default_factory=dict)
    """Key of the result, complete or partial, that the panels show of each step."""

    def put(self, step: Step, key: Hashable, view: Any) -> None:
        """Keep a complete result as the one that the panels show, and forget an earlier failure."""
        self._views[step] = (key, view)
        self._shown[step] = key
        self._failures.pop(step, None)

    def begin(self, step: Step, key: Hashable) -> None:
        """Record that the panels show a partial result with this key."""
        self._shown[step] = key

    def shows_other(self, step: Step, spec: Spec) -> bool:
        """Whether the panels show a result of this step that does not belong to ``spec``."""
        return step in self._shown and self._shown[step] != spec.key(step)

    def shown_key(self, step: Step) -> Hashable:
        """Return the key of the result of this step that the panels show; None without one."""
        return self._shown.get(step)

    def fail(self, step: Step, key: Hashable, sentence: str) -> None:
        """Record a failure, so that the step is not tried again until its key changes."""
        self._failures[step] = (key, sentence)

    def retry_failed(self) -> None:
        """Forget all failures, so that the steps are tried again."""
        self._failures.clear()

    def view(self, step: Step) -> Any:
        """Return the last result of a step, stale or not; None if there is none."""
        return self._views[step][1] if step in self._views else None

    def failure(self, step: Step, spec: Spec) -> str | None:
        """Return the error sentence of a step that failed for this spec, or None."""
        key, sentence = self._failures.get(step, (None, None))
        return sentence if key == spec.key(step) else None

    def fresh(self, step: Step, spec: Spec) -> bool:
        """Whether a step's last result belongs to ``spec``."""
        return step in self._views and self._views[step][0] == spec.key(step)

    def first_stale(self, spec: Spec, steps: Sequence[Step] = CHAIN) -> Step | None:
        """Return the first of ``steps`` without a fresh result.

        Returns:
            The step; None if all are fresh, the step failed, or it or a step before it is not to be computed.
        """
        for step in steps:
            if not spec.includes(step):
                return None
            if not self.fresh(step, spec):
                return None if self.failure(step, spec) else step
        return None

    def status(self, step: Step, spec: Spec, running: Collection[Step] = ()) -> StepStatus:
        """Return the status shown in the stepper."""
        if step in running:
            return "running"
        if self.fresh(step, spec):
            return "fresh"
        if self.failure(step, spec):
            return "failed"
        return "stale" if step in self._views else "missing"
