"""The whole reconstruction, from a rig's images to a surface before and after fusion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.notebook import ShownInNotebooks
from packetmesh.progress import drain
from pipeline.config import PRESETS, PipelineConfig
from pipeline.merging import MergedClouds
from pipeline.nodes import NodeClouds
from pipeline.placement.outcome import Placement
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import Cache, Steps, run
from pipeline.surface.findings import Kept
from pipeline.types import Rig, SurfaceResult


@dataclass(frozen=True, slots=True)
class Reconstruction(ShownInNotebooks):
    """All results of the chain for one rig."""

    spec: Spec
    rig: Rig
    nodes: tuple[NodeClouds, ...]
    placement: Placement
    clouds: MergedClouds
    """Clouds from which the surfaces are made, world frame."""
    before: SurfaceResult
    """The surface of the sensor cloud alone."""
    after: SurfaceResult
    """The surface of the fused cloud."""
    truth_before: dict[str, float] | None
    """Comparison of the surface before fusion with the ground truth; None without truth."""
    truth_after: dict[str, float] | None
    timings_s: dict[str, float]
    """Time of each stage, measured when it was computed."""

    @property
    def kept(self) -> Kept:
        """Shares of the measurements that are kept and represented by the surfaces."""
        before, after = self.before.quality, self.after.quality
        return Kept(
            kept_share=float(np.mean(np.concatenate([node.filtered.keep for node in self.nodes]))),
            within_2pct_before=before.within_2pct_share,
            within_2pct_after=after.within_2pct_share,
            within_5pct_before=before.within_5pct_share,
            within_5pct_after=after.within_5pct_share,
            measured_ray_share=1.0 - after.no_hit_ray_share - after.guessed_ray_share,
            guessed_ray_share=after.guessed_ray_share,
        )


def reconstruct(rig: Rig, config: PipelineConfig = PRESETS["packetmesh"]) -> Reconstruction:
    """Run the whole chain on a rig.

    Args:
        rig: one to 200 camera nodes with colour and depth images, intrinsics and given poses.
        config: all settings; ``PRESETS["thesis"]`` reconstructs as the thesis does.

    Raises:
        PacketMeshError: a stage cannot work with its input; the message says why.

    >>> import packetmesh as pm
    >>> rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    >>> result = pm.reconstruct(rig, pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=3000"]))
    >>> result.after.quality.no_hit_ray_share < result.before.quality.no_hit_ray_share
    True
    """
    return drain(iterate_reconstruction(Spec(LoadedRig(rig), config=config)))


def iterate_reconstruction(spec: Spec, cache: Cache | None = None) -> Steps[Reconstruction]:
    """Run the chain for any source, with a report between stages; closing the generator cancels it.

    Args:
        spec: source and settings.
        cache: stores results of stages; None stores them for this run only.

    Raises:
        PacketMeshError: as ``reconstruct``.
    """
    results = yield from run(spec, cache)
    truth_before, truth_after = results["truth"].value
    return Reconstruction(
        spec=spec,
        rig=results["rig"].value,
        nodes=results["nodes"].value,
        placement=results["placement"].value,
        clouds=results["clouds"].value,
        before=results["before"].value,
        after=results["after"].value,
        truth_before=truth_before,
        truth_after=truth_after,
        timings_s={stage: done.elapsed_s for stage, done in results.items()},
    )
