"""Verdicts on the answers of a race: the evidence of both clouds, other poses, and a mirrored cloud."""

from __future__ import annotations

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration import point_error_m
from pipeline.registration.finding.evidence import Evidence, Judge
from pipeline.registration.finding.poses import compared_points_m, length, same, turn_deg
from pipeline.registration.finding.rivals import better_slide, mirrored_axis, quarter_turns
from pipeline.registration.finding.starts import default_gates_m
from pipeline.registration.finding.surface import Surface
from pipeline.registration.finding.verdict import Verdict, verdict_on
from pipeline.types import FloatArray, PointCloud


class Belief:
    """Judges the poses of two clouds, which are prepared once.

    Quarter turns and a mirrored source are tried where the clouds have no colours that would refute them, and
    poses nearby where a little of the source is in free space or the surfaces hold the pose only a little.
    These trials take about a second; the evidence of a pose takes 10 ms.
    """

    def __init__(
        self,
        source: PointCloud,
        target: PointCloud,
        config: RegistrationConfig,
        from_cameras: tuple[bool, bool] = (False, False),
    ) -> None:
        """Prepare both clouds.

        Args:
            source: the cloud that moves.
            target: the cloud that stays.
            config: gate, metric and seed of further registrations.
            from_cameras: whether a camera at the origin is known to have measured the source, and the target.
        """
        self._source, self._target, self._config = source, target, config
        surfaces = (
            Surface(cloud, config.seed, from_camera)
            for cloud, from_camera in zip((source, target), from_cameras, strict=True)
        )
        self._judge = Judge(*surfaces)
        self._known: list[tuple[FloatArray, tuple[str, ...]]] = []
        """Judged poses, each with the reasons for doubt that the trials gave."""

    def verdict(self, T_target_source: FloatArray) -> Verdict:
        """Return the verdict on a (4, 4) pose."""
        evidence = self._judge(T_target_source)
        verdict = verdict_on(evidence)
        colored = bool(np.isfinite(evidence.color_correlation))
        if verdict.word == "none" or evidence.open_motions or (colored and not verdict.sure):
            return verdict
        for T, reasons in self._known:
            if same(T, T_target_source, self._source, self._target):
                return verdict_on(evidence, reasons)
        reasons = self._nearby(T_target_source, evidence) if verdict.sure else ()
        if not colored:
            other = self._other_pose if verdict.sure else self._mirrored
            reasons = (*reasons, *other(T_target_source, evidence))
        self._known.append((T_target_source, reasons))
        return verdict_on(evidence, reasons)

    def _nearby(self, T: FloatArray, evidence: Evidence) -> tuple[str, ...]:
        """Return a reason for doubt if the source fits better at a pose nearby, or none."""
        clouds = self._source, self._target
        better = better_slide(*clouds, T, evidence, self._judge, self._config)
        if better is None or same(better.T_target_source, T, *clouds):
            return ()
        away_m = point_error_m(better.T_target_source, T, compared_points_m(self._source))
        return (f"{length(away_m)} away, the source fits better",)

    def _other_pose(self, T: FloatArray, evidence: Evidence) -> tuple[str, ...]:
        """Return a reason for doubt if the source fits as well or better after quarter turns, or none."""
        turns = quarter_turns(self._source, self._target, T, self._config.gate_m, self._judge, self._config)
        rivals = [
            turn
            for turn in turns
            if verdict_on(turn.evidence).sure
            and not evidence.clearly_better(turn.evidence)
            and not same(turn.T_target_source, T, self._source, self._target)
        ]
        if not rivals:
            return ()
        found = [
            (not one.evidence.clearly_better(evidence), turn_deg(one.T_target_source, T)) for one in rivals
        ]
        as_well, turned_deg = min(found)
        return (f"turned by {turned_deg:.0f} degrees, the source fits {'as well' if as_well else 'better'}",)

    def _mirrored(self, T: FloatArray, evidence: Evidence) -> tuple[str, ...]:
        """Return a reason for doubt if the mirrored source fits, or none."""
        gates_m = default_gates_m(self._target, "surfaces", self._config.seed)
        axis = mirrored_axis(self._source, self._target, [T], gates_m, self._judge, evidence, self._config)
        return (f"one cloud is mirrored, since with {axis} negated the source fits",) if axis else ()
