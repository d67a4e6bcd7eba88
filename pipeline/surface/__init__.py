"""From an oriented cloud to a triangle mesh and its measures (SPEC 5)."""

from pipeline.rays import Camera, hit_depth
from pipeline.surface.ball_pivoting import reconstruct_surface, roll_ball, roll_or_nothing
from pipeline.surface.boundary import boundary_loops
from pipeline.surface.normals import estimate_normals
from pipeline.surface.quality import measure_quality, measured
from pipeline.surface.radii import nearest_distances_m, radii, spacing
from pipeline.surface.smooth import smooth
from pipeline.surface.texture import photographed
from pipeline.surface.truth import Yardstick, compare_with_truth, distances_to_truth_m, yardstick_of
from pipeline.surface.voxel import in_cubes_of, voxel_average, voxel_for_count

__all__ = [
    "Camera",
    "Yardstick",
    "boundary_loops",
    "compare_with_truth",
    "distances_to_truth_m",
    "estimate_normals",
    "hit_depth",
    "in_cubes_of",
    "measure_quality",
    "measured",
    "nearest_distances_m",
    "photographed",
    "radii",
    "reconstruct_surface",
    "roll_ball",
    "roll_or_nothing",
    "smooth",
    "spacing",
    "voxel_average",
    "voxel_for_count",
    "yardstick_of",
]
