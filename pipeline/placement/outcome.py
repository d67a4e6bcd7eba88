"""Results of the placement of a rig's nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import TypeVar

from pipeline.kernels import geometry
from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.types import FloatArray, RegistrationResult, Rig

Item = TypeVar("Item")
APART = "No two nodes could be placed relative to each other: the surface is of one node only"
"""Message for a rig whose placement failed."""


@dataclass(frozen=True, slots=True)
class NodeRegistration:
    """Registration of one node to another."""

    source: str
    target: str
    result: RegistrationResult
    loop_error_m: float = float("nan")
    """Point error against what the other registrations imply for these nodes; NaN if they imply nothing."""
    used: bool = True
    """False if it degenerated, or contradicts the loops or the measurements, and was not used."""
    agreement: Agreement = NOTHING_SHARED
    """Agreement of both nodes' points at this registration's pose."""


@dataclass(frozen=True, slots=True)
class NodeAgreement:
    """Agreement of two placed nodes' measurements at their final poses."""

    source: str
    target: str
    agreement: Agreement
    """Agreement in both nodes' points."""


@dataclass(frozen=True, slots=True)
class NodeVerdict:
    """Whether a node was placed, and how well it fits."""

    name: str
    placed: bool
    """False for a node that is excluded from the following stages."""
    agreement: Agreement
    """Agreement with the placed nodes that overlap it enough, together, at the final poses."""
    sentence: str = ""
    """Warning for the user; empty if there is none."""


@dataclass(frozen=True, slots=True)
class Placement:
    """The poses of all nodes."""

    registrations: tuple[NodeRegistration, ...]
    """All registrations; first those from given poses that place each node relative to an earlier one."""
    T_world_camera: tuple[FloatArray, ...]
    """(4, 4) corrected poses of all nodes; excluded nodes keep their given poses."""
    verdicts: tuple[NodeVerdict, ...] = ()
    """Verdict on each node; empty means that all are placed."""
    agreements: tuple[NodeAgreement, ...] = ()
    """Agreements of all pairs of placed nodes whose views meet."""
    covariances: tuple[FloatArray, ...] = ()
    """(6, 6) covariance of each node's small motion (turn in rad about the world's origin, then shift in m)
    relative to the node whose pose is kept; NaN for nodes that no registration reaches. Empty if unknown."""

    def placed(self, items: Sequence[Item]) -> list[Item]:
        """Return the items of placed nodes, from one item per node."""
        if not self.verdicts:
            return list(items)
        return [item for item, verdict in zip(items, self.verdicts, strict=True) if verdict.placed]

    @property
    def agreement(self) -> Agreement:
        """Agreement of all pairs of placed nodes together."""
        return reduce(add, (pair.agreement for pair in self.agreements), NOTHING_SHARED)

    @property
    def apart(self) -> bool:
        """Whether there are several nodes, but no two are placed relative to each other."""
        return len(self.verdicts) > 1 and sum(verdict.placed for verdict in self.verdicts) < 2

    @property
    def sentences(self) -> list[str]:
        """Warnings about nodes that were not placed, or whose pose nothing confirms."""
        return [verdict.sentence for verdict in self.verdicts if verdict.sentence]


def whole_placement(rig: Rig, present: Sequence[int], placement: Placement) -> Placement:
    """Return the poses of all nodes of a rig, from the placement of the nodes that are present.

    The other nodes keep their true poses, or without a truth their given poses, relative to the first placed
    node.

    Args:
        rig: the whole rig.
        present: indices of the nodes of ``placement``, in its order.
        placement: placement of these nodes, at least one of them placed.
    """
    believed = [frame.T_world_camera for frame in rig.frames]
    reference = believed if rig.truth is None else rig.truth.T_world_camera
    placed = placement.placed(list(zip(present, placement.T_world_camera, strict=True)))
    first, T_world_first = placed[0]
    T_here_reference = T_world_first @ geometry.inverse(reference[first])
    poses: list[FloatArray] = [T_here_reference @ pose for pose in reference]
    for index, pose in placed:
        poses[index] = pose
    return Placement(placement.registrations, tuple(poses))
