"""What is found out about where the nodes of a rig stand."""

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
APART = "No two nodes stand beside each other: the surface is of one node only"
"""What is said of a rig that failed."""


@dataclass(frozen=True, slots=True)
class NodeRegistration:
    """How one node found its place beside another."""

    source: str
    target: str
    result: RegistrationResult
    loop_error_m: float = float("nan")
    """How far it is from what the other registrations say about these two nodes; NaN where they say
    nothing."""
    used: bool = True
    """False if it degenerated, or contradicts the loops or what both measured, and was left out."""
    agreement: Agreement = NOTHING_SHARED
    """Of both nodes' points at this registration's pose."""


@dataclass(frozen=True, slots=True)
class NodeAgreement:
    """What two placed nodes both measured, at their final poses."""

    source: str
    target: str
    agreement: Agreement
    """Of both nodes' points."""


@dataclass(frozen=True, slots=True)
class NodeVerdict:
    """Whether a node has found its place."""

    name: str
    placed: bool
    """False for a node that is left out of everything that follows."""
    agreement: Agreement
    """With all placed nodes together, at the final poses."""
    sentence: str = ""
    """What is to be said of it; empty where all is well."""


@dataclass(frozen=True, slots=True)
class Placement:
    """The nodes beside each other."""

    registrations: tuple[NodeRegistration, ...]
    """Those of nodes whose poses were given, that place each beside an earlier one, first."""
    T_world_camera: tuple[FloatArray, ...]
    """Corrected poses of all nodes; of one that is left out, as it believes."""
    verdicts: tuple[NodeVerdict, ...] = ()
    """One for each node; empty says that all are placed."""
    agreements: tuple[NodeAgreement, ...] = ()
    """Of all pairs of placed nodes."""

    def placed(self, items: Sequence[Item]) -> list[Item]:
        """Of one item for each node, those of the nodes that are placed."""
        if not self.verdicts:
            return list(items)
        return [item for item, verdict in zip(items, self.verdicts, strict=True) if verdict.placed]

    @property
    def agreement(self) -> Agreement:
        """Of all pairs of placed nodes together."""
        return reduce(add, (pair.agreement for pair in self.agreements), NOTHING_SHARED)

    @property
    def apart(self) -> bool:
        """Whether there are several nodes, of which no two stand beside each other."""
        return len(self.verdicts) > 1 and not self.agreements

    @property
    def sentences(self) -> list[str]:
        """What a person must know of nodes that found no place, or one that nothing confirms."""
        return [verdict.sentence for verdict in self.verdicts if verdict.sentence]


def whole_placement(rig: Rig, present: Sequence[int], placement: Placement) -> Placement:
    """The nodes that found a place, and the others beside the first, as the truth or the rig believes."""
    believed = [frame.T_world_camera for frame in rig.frames]
    reference = believed if rig.truth is None else rig.truth.T_world_camera
    placed = placement.placed(list(zip(present, placement.T_world_camera, strict=True)))
    first, T_world_first = placed[0]
    T_here_reference = T_world_first @ geometry.inverse(reference[first])
    poses: list[FloatArray] = [T_here_reference @ pose for pose in reference]
    for index, pose in placed:
        poses[index] = pose
    return Placement(placement.registrations, tuple(poses))
