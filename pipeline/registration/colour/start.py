"""A start pose of one frame in another's camera frame, from features that both colour images show."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.registration.colour.features import LiftedFeatures
from pipeline.registration.colour.matches import matches
from pipeline.registration.consensus import consensus
from pipeline.types import FloatArray

LEAST_VOTES = 3.5
"""Least votes of a start pose: more than any of 42 pairs of views of different rooms has (random rooms 92000
to 92013)."""


@dataclass(frozen=True, slots=True)
class ColourStart:
    """A start pose from colour, or the reason that there is none."""

    T_target_source: FloatArray | None
    """(4, 4) pose; None if the images show too little in common."""
    matches: int
    """Number of pairs of features that look alike."""
    inliers: int
    """Number of those that fit the pose."""
    votes: float
    """Votes for the pose: a sum over the pairs that fit, where pairs that are farther off count less."""
    rival_votes: float
    """Votes for the best of the clearly different poses; close to ``votes`` if the scene repeats itself."""
    why_none: str
    """Reason for which there is no pose, one sentence; else empty."""


def colour_start(source: LiftedFeatures, target: LiftedFeatures) -> ColourStart:
    """Find the pose of the source frame on which most pairs of features that look alike agree.

    It is accurate to some centimetres, enough to start a registration. The same features give exactly the
    same pose.
    """
    if why := source.why_none or target.why_none:
        return ColourStart(None, 0, 0, 0.0, 0.0, why)
    pairs = matches(source, target)
    found = consensus(pairs)
    if not found or found[0].votes < LEAST_VOTES:
        fit = int(found[0].inliers.sum()) if found else 0
        why = (
            f"Of {len(pairs)} features that look alike in {source.name} and {target.name}, {fit} agree on "
            "one pose, too few for a start; let the views share more, or give a start pose."
        )
        return ColourStart(None, len(pairs), fit, 0.0, 0.0, why)
    best, rival_votes = found[0], found[1].votes if len(found) > 1 else 0.0
    return ColourStart(best.T_target_source, len(pairs), int(best.inliers.sum()), best.votes, rival_votes, "")
