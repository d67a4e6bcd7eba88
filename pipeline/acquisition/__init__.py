"""Depth image to filtered point cloud (SPEC 2)."""

from pipeline.acquisition.back_project import back_project, depth_sigma_m
from pipeline.acquisition.outliers import FilterResult, filter_outliers

__all__ = ["FilterResult", "back_project", "depth_sigma_m", "filter_outliers"]
