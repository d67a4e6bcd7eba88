"""What a session wants and what it has: a step is stale when the two differ."""

from __future__ import annotations

import dataclasses
import shlex
import threading
from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, Literal

from packetmesh.settings import differences
from pipeline.config import PRESETS, PipelineConfig

Step = Literal["scene", "depth", "fuse", "surface"]
CHAIN: tuple[Step, ...] = ("scene", "depth", "fuse", "surface")
"""The steps that compute, each from the one before it."""
StepStatus = Literal["fresh", "stale", "running", "failed", "missing"]


@dataclass(frozen=True, slots=True)
class Source:
    """Where the images come from: a demo scene by name, a rig folder, or one uploaded RGB-D pair."""

    scene: str | None = None
    rig: str | None = None
    color: str | None = None
    depth: str | None = None
    intrinsics: str | None = None
    depth_scale: float = 1000.0
    """Depth image units in one metre."""

    @property
    def title(self) -> str:
        """What to call it."""
        return self.scene or self.rig or "uploaded pair"

    def arguments(self) -> list[str]:
        """The arguments of ``packetmesh reconstruct`` that name it."""
        if self.scene is not None:
            return ["--scene", self.scene]
        if self.rig is not None:
            return ["--rig", self.rig]
        arguments = ["--color", str(self.color), "--depth", str(self.depth)]
        arguments += ["--intrinsics", str(self.intrinsics)]
        return arguments + (["--depth-scale", f"{self.depth_scale:g}"] if self.depth_scale != 1000.0 else [])


@dataclass(frozen=True, slots=True)
class Spec:
    """Everything that decides what the chain computes."""

    source: Source
    preset: str = "packetmesh"
    config: PipelineConfig = field(default_factory=PipelineConfig)

    def key(self, step: Step) -> tuple[Hashable, ...]:
        """What a step's result depends on; equal keys mean equal results."""
        config = self.config
        fusion = config.fusion
        parts: dict[Step, tuple[Hashable, ...]] = {
            "scene": (self.source,),
            "depth": (
                config.acquisition,
                config.depth,
                fusion.mode,
                fusion.register_inferred and config.inferred_registration,
            ),
            "fuse": (config.node_registration, fusion.align_nodes_with),
            "surface": (config.surface,),
        }
        reached = CHAIN[: CHAIN.index(step) + 1]
        return (step, *(part for name in reached for part in parts[name]))

    def with_preset(self, preset: str) -> Spec:
        """The same source with a preset's config."""
        return dataclasses.replace(self, preset=preset, config=PRESETS[preset])

    def command(self, out: str = "runs/from-app") -> str:
        """The command line that computes the same."""
        words = ["packetmesh", "reconstruct", *self.source.arguments(), "--preset", self.preset]
        changed = differences(self.config, PRESETS[self.preset])
        if changed:
            words += ["--set", *changed]
        return shlex.join([*words, "--out", out])


class SharedViews:
    """The newest views of all sessions: who wants what another has just got gets it at once."""

    def __init__(self, capacity: int = 24) -> None:
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

    def put(self, step: Step, key: Hashable, view: Any) -> None:
        """Keep a result."""
        self._views[step] = (key, view)
        self._failures.pop(step, None)

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

    def first_stale(self, spec: Spec) -> Step | None:
        """The next step to compute; None if all is fresh or a step before it failed."""
        for step in CHAIN:
            if not self.fresh(step, spec):
                return None if self.failure(step, spec) else step
        return None

    def status(self, step: Step, spec: Spec, running: Step | None) -> StepStatus:
        """What to mark a step with."""
        if step == running:
            return "running"
        if self.fresh(step, spec):
            return "fresh"
        if self.failure(step, spec):
            return "failed"
        return "stale" if step in self._views else "missing"
