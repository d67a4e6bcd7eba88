"""The job that computes the nodes' registration for the Fuse screen."""

from __future__ import annotations

from collections.abc import Generator, Sequence

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.fuse.view import FuseView, RegistrationRow
from packetmesh.progress import Progress
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.placement.outcome import NodeRegistration
from pipeline.registration import point_error_m
from pipeline.types import FloatArray, Rig


def fuse_job(store: Store, spec: Spec) -> Generator[Progress, None, FuseView]:
    """Return the nodes' poses and the registrations that led to them."""
    rig, nodes, placement = yield from store.stages(spec, "rig", "nodes", "placement")
    believed = tuple(frame.T_world_camera for frame in rig.frames)
    rows = tuple(
        _registration_row(rig, row, nodes, spec.config.node_registration.method)
        for row in placement.registrations
    )
    share = placement.agreement.within_2pct_share
    return FuseView(believed, placement.T_world_camera, rows, share, tuple(placement.sentences))


def _registration_row(
    rig: Rig, registration: NodeRegistration, nodes: Sequence[NodeClouds], method: str
) -> RegistrationRow:
    names = [node.name for node in nodes]
    source, target = names.index(registration.source), names.index(registration.target)
    result, points_m = registration.result, nodes[source].sensor.points_m
    before = after = None
    T_true = true_pose(rig, source, target)
    if T_true is not None:
        T_believed = geometry.inverse(rig.frames[target].T_world_camera) @ rig.frames[source].T_world_camera
        before = point_error_m(T_believed, T_true, points_m)
        after = point_error_m(result.T_target_source, T_true, points_m)
    return RegistrationRow(
        source=registration.source,
        target=registration.target,
        method=method,
        iterations=len(result.steps),
        stop_reason=result.stop_reason,
        rmse_m=result.steps[-1].rmse_m if result.steps else float("nan"),
        error_before_m=before,
        error_after_m=after,
        loop_error_m=registration.loop_error_m,
        used=registration.used,
    )


def true_pose(rig: Rig, source: int, target: int) -> FloatArray | None:
    """Return the true (4, 4) T_target_source of two nodes; None without ground truth."""
    if rig.truth is None:
        return None
    return geometry.inverse(rig.truth.T_world_camera[target]) @ rig.truth.T_world_camera[source]
