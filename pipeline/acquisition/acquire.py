"""Outlier detection and averaging of a frame's measured depth."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.acquisition.averaging import averaged
from pipeline.acquisition.back_project import back_project, pixels_in_front
from pipeline.acquisition.flying import flying_score
from pipeline.acquisition.outliers import FilterResult, Outliers, find_outliers, split
from pipeline.acquisition.planes import FARTHEST_SD, local_planes
from pipeline.config import AcquisitionConfig
from pipeline.types import DepthMap, RgbdFrame


@dataclass(frozen=True, slots=True)
class Acquired:
    """The measured depth of a frame and its outliers; neither depends on colour."""

    depth: DepthMap
    """(H, W) depth, known where it was measured."""
    outliers: Outliers
    """Outliers among the points of ``back_project``."""

    def cloud(self, frame: RgbdFrame) -> FilterResult:
        """Return the frame's sensor cloud, camera frame, with its outliers split off."""
        return split(back_project(frame, self.depth), self.outliers)


def acquire(frame: RgbdFrame, config: AcquisitionConfig) -> Acquired:
    """Find the outliers of a frame's depth, and average the depth over its surfaces.

    Args:
        frame: frame with its depth, and its sensor's noise if it was calibrated.
        config: outlier mode, and whether to average.

    Raises:
        InputError: no pixel has a depth, or as for ``find_outliers``.
    """
    known = pixels_in_front(frame, frame.depth)
    least_sd_m = None if frame.averaging is None else frame.averaging.sd_m
    planes = local_planes(frame.depth, frame.intrinsics, frame.noise, least_sd_m)
    if config.outlier_mode == "flying":
        score = flying_score(planes)[known]
        outliers = Outliers(score <= FARTHEST_SD, score, FARTHEST_SD)
    else:
        outliers = find_outliers(back_project(frame), config, frame.intrinsics.fx_px)
    return Acquired(averaged(planes) if config.average else frame.depth, outliers)
