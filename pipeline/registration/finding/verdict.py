"""The verdict on a pose: sure, doubtful or none, and why (SPEC 4.12).

The thresholds were fitted on pairs of views of the validation rooms of ``lab.places``; ``packetmesh bench
--only places`` judges them on other rooms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pipeline.registration.finding.evidence import Evidence

Word = Literal["sure", "doubtful", "none"]

LEAST_OVERLAP = 1.0 / 6.0
"""Least share of a cloud's points that the other can judge."""
LEAST_ON, LEAST_ON_COLORED, LEAST_ON_BARE = 0.75, 0.7, 0.95
"""Least share of the judged points on the other's surface: where free space or colours could refute the pose,
where both could and the colours match, and where nothing else could."""
LEAST_ONE_SIDE = 0.6
"""Least share of the points on the surface that have both clouds' middles on one side."""
LITTLE_THROUGH, MOST_THROUGH = 0.01, 0.02
"""Shares of the judged points in free space: a few are already a sign of a wrong pose. Above the first, poses
nearby are tried; the second is the largest that may be sure."""
LITTLE_STIFFNESS, LEAST_STIFFNESS = 0.01, 0.006
"""Stiffness of the points on the surfaces. Below the first, other poses along the motion that is held least
are tried; below the second, noise may decide along it, so that no pose is sure without these trials."""
MOST_HEIGHT = 1.7
"""Largest ratio of the distances from the surfaces to the noise of the points."""
LEAST_CORRELATION = 0.75
"""Least correlation of the colours where the clouds meet: floor on ceiling has about 0."""
NO_POSE_ON, NO_POSE_OVERLAP = 0.35, 0.02
"""With a smaller share on the surface, or a smaller overlap, there is no pose."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether to believe a pose."""

    word: Word
    reasons: tuple[str, ...] = ()
    """Why it is not sure, a clause each; empty if it is."""

    @property
    def sure(self) -> bool:
        """Whether nothing speaks against the pose."""
        return self.word == "sure"

    @property
    def text(self) -> str:
        """The verdict in one line."""
        return f"{self.word}: {'; '.join(self.reasons)}" if self.reasons else self.word


def verdict_on(evidence: Evidence, more: tuple[str, ...] = (), tried: bool = False) -> Verdict:
    """Judge a pose by its evidence.

    Args:
        evidence: evidence of the clouds for and against the pose.
        more: further reasons for doubt, from other poses that were tried.
        tried: True leaves out the test of the stiffness, because other poses are tried instead.
    """
    if evidence.overlap_share < NO_POSE_OVERLAP or evidence.on_share < NO_POSE_ON:
        return Verdict("none", (*_reasons(evidence, tried), *more))
    reasons = (*_reasons(evidence, tried), *more)
    return Verdict("doubtful" if reasons else "sure", reasons)


def _reasons(evidence: Evidence, tried: bool) -> tuple[str, ...]:
    """Return the tests that the evidence does not pass."""
    reasons = []
    if evidence.overlap_share < LEAST_OVERLAP:
        reasons.append(f"the clouds share only {evidence.overlap_share:.0%} of their points")
    if evidence.through_share > MOST_THROUGH:
        reasons.append(
            f"{evidence.through_share:.1%} of the shared points lie in space that the other camera saw to be "
            "empty"
        )
    if evidence.on_share < _least_on(evidence):
        reasons.append(f"only {evidence.on_share:.0%} of the shared points lie on the other cloud's surface")
    elif evidence.one_side_share < LEAST_ONE_SIDE:
        reasons.append("the clouds see what they share from opposite sides, like two rooms back to back")
    elif evidence.height_ratio > MOST_HEIGHT:
        reasons.append(f"the surfaces are {evidence.height_ratio:.1f} times the points' noise apart")
    if evidence.color_correlation < LEAST_CORRELATION:  # NaN without colours
        reasons.append(f"the colours there do not match (correlation {evidence.color_correlation:.2f})")
    if evidence.open_motions:
        reasons.append(f"the overlap does not determine {evidence.open_motions}")
    elif evidence.stiffness < LEAST_STIFFNESS and not tried:
        reasons.append("the surfaces where the clouds meet hardly determine the pose in one direction")
    return tuple(reasons)


def _least_on(evidence: Evidence) -> float:
    """Return the least share on the surface for a sure pose: less where other evidence speaks for it, too."""
    colors_match = evidence.color_correlation >= LEAST_CORRELATION  # not without colours
    if evidence.refutable:
        return LEAST_ON_COLORED if colors_match else LEAST_ON
    return LEAST_ON if colors_match else LEAST_ON_BARE
