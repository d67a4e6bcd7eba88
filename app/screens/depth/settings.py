"""Controls of the Depth screen's settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.screens.depth.labels import ALIGNMENTS
from app.screens.depth.view import ModelChoice
from app.window.controls import Choice, Number, Toggle
from pipeline.config import PipelineConfig

FIRST = (
    Choice(
        "Alignment",
        "depth.alignment",
        ALIGNMENTS,
        hint="How inferred depth is aligned with the sensor's: by one factor; by a factor and an offset; "
        "or by these and a correction C that varies smoothly over the image.",
    ),
    Choice(
        "Holes filled by",
        "depth.fill",
        {
            "auto": "automatic: completion, or your own network",
            "completion": "completion: colours and depth",
            "network": "the colour network, aligned",
        },
    ),
)
CONFIDENCE_CONTROLS = (
    Number(
        "Reach (% of the diagonal)",
        "depth.reach",
        1.0,
        100.0,
        1.0,
        per_unit=100.0,
        hint="Largest distance from a measured pixel at which inferred depth is used, in % of the "
        "image's diagonal.",
    ),
    Number(
        "Least confidence (%)",
        "depth.least_confidence",
        0.0,
        100.0,
        1.0,
        per_unit=100.0,
        hint="Inferred depth with a lower confidence is left out; 0 leaves out nothing.",
    ),
)
ADVANCED = (
    Choice(
        "Outlier filter",
        "acquisition.outlier_mode",
        {
            "flying": "flying pixels",
            "thesis": "thesis: mean + t sigma",
            "depth_normalised": "depth-normalised",
            "robust": "robust",
        },
    ),
    Number("Neighbours N", "acquisition.outlier_neighbours", 1, 16, 1),
    Number("Threshold t (σ)", "acquisition.outlier_t", 0.0, 4.0, 0.1),
    Toggle("Average the noise", "acquisition.average"),
    Toggle("Centre crop", "depth.crop"),
    Choice("Fusion", "fusion.mode", {"union": "union: all points", "fill": "fill: only the holes"}),
    Toggle("Rigid fit", "fusion.register_inferred"),
)


def with_model(choice: ModelChoice) -> Callable[[PipelineConfig], PipelineConfig]:
    """Return the edit that sets another network."""
    return lambda config: replace(config, depth=choice.put_into(config.depth))
