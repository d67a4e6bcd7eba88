"""Specification of a reconstruction, and what the result of each of its stages depends on.

This module neither computes nor imports large libraries, so that a program that only shows results is light.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

from packetmesh.settings import differences
from pipeline.config import MOST_AVERAGED, PRESETS, PipelineConfig
from pipeline.sources import Recorded, RigFolder, Source

StageName = Literal[
    "rig",
    "inferred",
    "outliers",
    "nodes",
    "placement",
    "fused",
    "clouds",
    "after",
    "before",
    "truth",
    "poisson",
    "alpha",
]


@dataclass(frozen=True, slots=True)
class Spec:
    """Everything that determines the result of the chain."""

    source: Source
    preset: str = "packetmesh"
    """The preset from which ``config`` started; it only affects the command line."""
    config: PipelineConfig = field(default_factory=PipelineConfig)

    def with_preset(self, preset: str) -> Self:
        """Return the spec with a preset's config."""
        return replace(self, preset=preset, config=PRESETS[preset])

    def command(self, out: str = "runs/from-app") -> str:
        """Return the command line that computes the same result."""
        words = ["packetmesh", "reconstruct", *self.source.arguments(), "--preset", self.preset]
        changed = differences(self.config, PRESETS.get(self.preset, PipelineConfig()))
        if changed:
            words += ["--set", *changed]
        return shlex.join([*words, "--out", out])


@dataclass(frozen=True, slots=True)
class Needs:
    """Dependencies of a stage's result."""

    settings: Callable[[Spec], tuple[Any, ...]]
    """Returns the part of the spec that the stage uses."""
    after: tuple[StageName, ...] = ()
    """Stages whose results it uses."""


def _averaged(spec: Spec) -> int:
    """Return the number of frames to average; ``MOST_AVERAGED`` if the source's rig does not depend on it."""
    return spec.config.recording.frames if isinstance(spec.source, Recorded | RigFolder) else MOST_AVERAGED


NEEDS: dict[StageName, Needs] = {
    "rig": Needs(lambda spec: (spec.source, _averaged(spec))),
    "inferred": Needs(lambda spec: (spec.config.depth.of_network(),), ("rig",)),
    "outliers": Needs(lambda spec: (spec.config.acquisition,), ("rig",)),
    "nodes": Needs(
        lambda spec: (
            spec.config.depth,
            spec.config.fusion.mode,
            spec.config.inferred_registration if spec.config.fusion.register_inferred else None,
        ),
        ("rig", "inferred", "outliers"),
    ),
    "placement": Needs(
        lambda spec: (
            spec.config.node_registration,
            spec.config.fusion.align_nodes_with,
            spec.config.acquisition,
        ),
        ("rig", "nodes"),
    ),
    "fused": Needs(
        lambda spec: (
            spec.config.fusion.mode,
            spec.config.surface.max_points,
            spec.config.surface.smoothing_passes,
        ),
        ("rig", "nodes", "placement"),
    ),
    "clouds": Needs(lambda spec: (spec.config.surface.smoothing_passes,), ("nodes", "placement", "fused")),
    "after": Needs(lambda spec: (spec.config.surface,), ("rig", "placement", "fused")),
    "before": Needs(lambda spec: (spec.config.surface,), ("rig", "placement", "clouds")),
    "truth": Needs(lambda spec: (), ("rig", "placement", "after", "before")),
    "poisson": Needs(lambda spec: (), ("rig", "placement", "fused")),
    "alpha": Needs(lambda spec: (spec.config.surface,), ("rig", "placement", "fused")),
}
"""Dependencies of all stages; ``pipeline.stages`` has their functions."""
REBUILD: tuple[StageName, ...] = ("rig", "inferred", "outliers", "nodes", "placement", "fused", "after")
"""Stages from the images to the surface, in their order."""
CHAIN: tuple[StageName, ...] = (*REBUILD[:-1], "clouds", "after", "before", "truth")
"""Stages of a reconstruction, including comparison with measurements and truth; the other stages are
baselines."""
SIDE_BY_SIDE: frozenset[tuple[StageName, StageName]] = frozenset({("after", "before")})
"""Consecutive stages that run in parallel: they do not need each other and take about as long. Running the
network parallel to the outlier filter would save less than .1 s and take 0.2 GB more with three nodes
(``packetmesh bench --only chain``).
"""


def whole_s(timings_s: Mapping[str, float]) -> float:
    """Return the time of all stages together; of two that run in parallel only the longer one counts."""
    hidden_s = (min(timings_s.get(stage, 0.0) for stage in pair) for pair in SIDE_BY_SIDE)
    return sum(timings_s.values()) - sum(hidden_s)


def key(spec: Spec, stage: StageName) -> tuple[Hashable, ...]:
    """Return the stage's name with everything its result depends on; equal keys mean equal results."""
    needs = NEEDS[stage]
    return (stage, *needs.settings(spec), *(key(spec, earlier) for earlier in needs.after))
