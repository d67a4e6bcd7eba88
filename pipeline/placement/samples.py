"""Samples of the nodes' clouds: the placement of a rig holds some thousand points of each node."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import NodePoints, RegistrationConfig
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.placement.agreement import Agreement, agreement, compared_points
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud, RgbdFrame

GRAPH_POINTS = 1000
"""Most points of a node at which the pose graph measures errors."""
VIEW_POINTS = 600
"""About the number of a node's points that are projected into another node's image."""


@dataclass(frozen=True, slots=True)
class NodeSample:
    """A node's images and the points of it that are registered and compared."""

    frame: RgbdFrame
    cloud: PointCloud
    """Points drawn for registration, with normals."""
    measured: PointCloud
    """Measured points that are compared with other cameras' images."""

    @property
    def name(self) -> str:
        """The node's name."""
        return self.frame.name

    @property
    def graph_points_m(self) -> FloatArray:
        """(N, 3) points at which the pose graph measures errors."""
        return self.cloud.points_m[:: max(1, -(-len(self.cloud) // GRAPH_POINTS))]


def sample_of(
    frame: RgbdFrame, node: NodeClouds, config: RegistrationConfig, align_with: NodePoints
) -> NodeSample:
    """Draw the points of a node that its placement uses.

    The drawn points are those that a registration of the whole cloud would draw.

    Args:
        frame: the node's images.
        node: the node's clouds.
        config: settings of the registration.
        align_with: which of the node's clouds is registered.

    Raises:
        InputError: as for ``draw``.
    """
    cloud = draw(getattr(node, align_with), config.max_points, config.seed, node.name).cloud
    if cloud.normals is None:
        cloud = replace(cloud, normals=Normals(cloud.points_m).all)
    return NodeSample(frame, cloud, PointCloud(compared_points(node.sensor).points_m.copy()))


def both_ways(source: NodeSample, target: NodeSample, T_target_source: FloatArray) -> Agreement:
    """Compute the agreement of two nodes at a pose, counted in the points of both."""
    there, back = target.frame, source.frame
    return agreement(source.measured, T_target_source, there.intrinsics, there.depth) + agreement(
        target.measured, geometry.inverse(T_target_source), back.intrinsics, back.depth
    )


def shared_view(node: NodeSample, other: NodeSample, T_node: FloatArray, T_other: FloatArray) -> float:
    """Return the share of a node's points that project into another node's image at (4, 4) poses of both."""
    points_m = node.measured.points_m[:: max(1, len(node.measured) // VIEW_POINTS)]
    seen_m = geometry.apply(geometry.inverse(T_other) @ T_node, points_m)
    seen_m = seen_m[seen_m[:, 2] > 0.1]
    uv = geometry.project(other.frame.intrinsics, seen_m)
    size_px = (other.frame.intrinsics.width_px, other.frame.intrinsics.height_px)
    return float(np.all((uv >= 0) & (uv < size_px), axis=1).sum()) / max(1, len(points_m))
