"""One node's clouds as input of a chain's ball pivoting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from packetmesh.progress import drain
from pipeline.config import PipelineConfig
from pipeline.kernels.rays import Camera
from pipeline.merging import MergedClouds
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import run
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.types import DepthMap, Rig, SurfaceResult

CHAINS = {"thesis": "the thesis's union", "packetmesh": "filling only the holes"}
"""The presets, and their treatment of the inferred points."""


@dataclass(frozen=True, slots=True)
class ChainClouds:
    """Sensor and fused cloud of one node at its true pose."""

    name: str
    merged: MergedClouds
    camera: Camera
    true_depth: DepthMap

    def rolled(self, when: str, sigmas: Sequence[float]) -> SurfaceResult:
        """Return the cloud's surface ``before`` or ``after`` fusion, by balls of r_F + ``sigmas`` sigma_D."""
        merged = self.merged
        cloud = merged.sensor if when == "before" else merged.fused
        return reconstruct_surface(cloud, [merged.r_F_m + factor * merged.sigma_D_m for factor in sigmas])


def single_node(rig: Rig, index: int) -> Rig:
    """Return node ``index`` of a rig with known truth as a rig of its own, as in the thesis."""
    assert rig.truth is not None
    pose = rig.truth.T_world_camera[index]
    frame = replace(rig.frames[index], T_world_camera=pose)
    truth = replace(
        rig.truth,
        T_world_camera=(pose,),
        depth=(rig.truth.depth[index],),
        intrinsics=(rig.truth.intrinsics[index],),
    )
    return Rig(f"{rig.name}/{frame.name}", (frame,), truth)


def chain_clouds(rig: Rig, index: int, config: PipelineConfig) -> ChainClouds:
    """Run a chain on node ``index`` of a rig with known truth, up to the clouds for ball pivoting."""
    alone = single_node(rig, index)
    assert alone.truth is not None
    frame = alone.frames[0]
    results = drain(run(Spec(LoadedRig(alone), config=config), stages=("clouds",)))
    camera = Camera(frame.intrinsics, frame.T_world_camera)
    return ChainClouds(alone.name, results["clouds"].value, camera, alone.truth.depth[0])
