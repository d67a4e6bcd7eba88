"""What is kept of a frame's measured depth, and as what."""

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
    """The measured depth of a frame and its outliers; colour has no say in either."""

    depth: DepthMap
    """(H, W) known where it was measured."""
    outliers: Outliers
    """Of the points of ``back_project``."""

    def cloud(self, frame: RgbdFrame) -> FilterResult:
        """The frame's sensor cloud, camera frame, with its outliers split off."""
        return split(back_project(frame, self.depth), self.outliers)


def acquire(frame: RgbdFrame, config: AcquisitionConfig) -> Acquired:
    """Find the outliers of a frame's depth, and average it over its surfaces.

    Args:
        frame: its depth, and the noise of its sensor where a calibration has found it.
        config: which outliers, and whether to average.

    Raises:
        InputError: no pixel has a depth, or as ``find_outliers``.
    """
    known = pixels_in_front(frame, frame.depth)
    planes = local_planes(frame.depth, frame.intrinsics, frame.noise)
    if config.outlier_mode == "flying":
        score = flying_score(planes)[known]
        outliers = Outliers(score <= FARTHEST_SD, score, FARTHEST_SD)
    else:
        outliers = find_outliers(back_project(frame), config, frame.intrinsics.fx_px)
    return Acquired(averaged(planes) if config.average else frame.depth, outliers)
