"""What a person asks of the chain, and what each of its stages depends on.

Nothing here computes or imports what does, so that a program that only shows results stays light.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

from packetmesh.settings import differences
from pipeline.config import PRESETS, PipelineConfig
from pipeline.sources import Source

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
    """Everything that decides what the chain computes."""

    source: Source
    preset: str = "packetmesh"
    """The preset that ``config`` started from; it decides nothing but the command line."""
    config: PipelineConfig = field(default_factory=PipelineConfig)

    def with_preset(self, preset: str) -> Self:
        """The same with a preset's config."""
        return replace(self, preset=preset, config=PRESETS[preset])

    def command(self, out: str = "runs/from-app") -> str:
        """The command line that computes the same."""
        words = ["packetmesh", "reconstruct", *self.source.arguments(), "--preset", self.preset]
        changed = differences(self.config, PRESETS.get(self.preset, PipelineConfig()))
        if changed:
            words += ["--set", *changed]
        return shlex.join([*words, "--out", out])


@dataclass(frozen=True, slots=True)
class Needs:
    """What the result of a stage depends on."""

    settings: Callable[[Spec], tuple[Any, ...]]
    """The part of the spec that it takes."""
    after: tuple[StageName, ...] = ()
    """The stages whose results it takes."""


NEEDS: dict[StageName, Needs] = {
    "rig": Needs(lambda spec: (spec.source,)),
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
        lambda spec: (spec.config.node_registration, spec.config.fusion.align_nodes_with), ("rig", "nodes")
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
"""All stages; ``pipeline.stages`` has what they do."""
REBUILD: tuple[StageName, ...] = ("rig", "inferred", "outliers", "nodes", "placement", "fused", "after")
"""The stages from the images to the surface, in their order."""
CHAIN: tuple[StageName, ...] = (*REBUILD[:-1], "clouds", "after", "before", "truth")
"""The stages of a reconstruction, which compares it with what was measured and true; the others are baselines
beside it."""
SIDE_BY_SIDE: frozenset[tuple[StageName, StageName]] = frozenset({("after", "before")})
"""Stages that follow each other in the chain, do not wait for each other and take about as long. Network and
outlier filter beside each other would save less than .1 s, and take 0.2 GB more with three nodes
(``packetmesh bench --only chain``).
"""


def key(spec: Spec, stage: StageName) -> tuple[Hashable, ...]:
    """The name of a stage with all that its result depends on; equal keys mean equal results."""
    needs = NEEDS[stage]
    return (stage, *needs.settings(spec), *(key(spec, earlier) for earlier in needs.after))
