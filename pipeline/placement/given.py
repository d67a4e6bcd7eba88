"""Given poses as evidence: they determine the motions that the nodes' surfaces leave open (SPEC 4.14).

Two cameras that share a bare wall can slide along it: registration from the given poses then ends anywhere,
and a small wrong pair moves a node by decimetres. What the surfaces do determine they determine thirty times
as well as a pose measured by hand, so that the given pose moves a node there by a thousandth of its error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.registration.graph.edges import PoseEdge, adjoint
from pipeline.registration.graph.pose_graph import PoseGraph, motion_covariances, optimised
from pipeline.types import FloatArray

GIVEN_RAD, GIVEN_M = np.radians(3.0), 0.06
"""Standard error of a given pose about and along each axis; those of the demo scenes are that far off."""
GIVEN_INFORMATION = np.diag(3 * [GIVEN_RAD**-2] + 3 * [GIVEN_M**-2])
LOOSE_M = 0.02
"""A registration is loose if the standard error of its shift in some direction is larger. That of rigs whose
surfaces determine all motions is about 2 mm, that along a bare wall a metre."""
LOOSE = (
    "{} shares too little shape with the others to determine its place in all directions; where it is open, "
    "its given pose counts, as if that was right to about 6 cm and 3 degrees"
)


def shift_error_m(covariance: FloatArray) -> float:
    """Return the largest standard error of the shift, from the (6, 6) covariance of a motion."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[-1]))


def is_loose(edge: PoseEdge) -> bool:
    """Return whether a registration leaves a shift open."""
    information = edge.information if edge.weak_information is None else edge.weak_information
    return shift_error_m(np.linalg.inv(information)) > LOOSE_M


def given_edges(
    T_world_camera: Sequence[FloatArray], known: Sequence[bool], graph: PoseGraph, reference: int
) -> list[PoseEdge]:
    """Return the given poses, relative to the reference's, of the nodes that the graph has placed."""
    if not known[reference]:
        return []
    T_reference_world = np.linalg.inv(T_world_camera[reference])
    return [
        PoseEdge(node, reference, T_reference_world @ T_world_camera[node], GIVEN_INFORMATION)
        for node, T in enumerate(graph.T_reference_node)
        if node != reference and known[node] and np.isfinite(T).all()
    ]


def with_given_poses(
    graph: PoseGraph, held: Sequence[PoseEdge], given: Sequence[PoseEdge], reference: int
) -> PoseGraph:
    """Solve a graph with the given poses, from which the search starts, as further evidence.

    Args:
        graph: solution without them.
        held: registrations that gave it.
        given: the given poses as edges to the reference.
        reference: node whose pose is the identity.
    """
    reached = np.array([bool(np.isfinite(T).all()) for T in graph.T_reference_node])
    start = [T if there else np.eye(4) for T, there in zip(graph.T_reference_node, reached, strict=True)]
    for edge in given:
        start[edge.source] = edge.T_target_source
    joined = [edge for edge in held if reached[edge.source] and reached[edge.target]]
    T, _ = optimised(np.array(start), [*joined, *given])
    T_reference = np.linalg.inv(T[reference]) @ T
    T_reference[~reached] = np.nan
    return replace(graph, T_reference_node=tuple(T_reference))


def loose_nodes(graph: PoseGraph, held: Sequence[PoseEdge], reference: int) -> list[int]:
    """Return the nodes whose place the registrations leave open in some direction."""
    covariances = motion_covariances(graph.T_reference_node, held, reference)
    return [
        node
        for node, (T, covariance) in enumerate(zip(graph.T_reference_node, covariances, strict=True))
        if np.isfinite(covariance).all() and _own_error_m(T, covariance) > LOOSE_M
    ]


def _own_error_m(T_reference_node: FloatArray, covariance: FloatArray) -> float:
    """Return the standard error of a node's shift at its own place."""
    to_node = adjoint(np.linalg.inv(T_reference_node))
    return shift_error_m(to_node @ covariance @ to_node.T)
