"""Conversion of a depth image to a filtered point cloud (SPEC 2)."""

from pipeline.acquisition.acquire import Acquired, acquire
from pipeline.acquisition.back_project import back_project, depth_sigma_m, without_rayless
from pipeline.acquisition.outliers import FilterResult, Outliers, filter_outliers, find_outliers, split

__all__ = [
    "Acquired",
    "FilterResult",
    "Outliers",
    "acquire",
    "back_project",
    "depth_sigma_m",
    "filter_outliers",
    "find_outliers",
    "split",
    "without_rayless",
]
