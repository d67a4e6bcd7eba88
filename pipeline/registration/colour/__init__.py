"""Start poses from colour images: features with measured depth, matched and checked for one rigid motion."""

from pipeline.registration.colour.features import LiftedFeatures, lifted_features
from pipeline.registration.colour.matches import match_score
from pipeline.registration.colour.start import ColourStart, colour_start

__all__ = ["ColourStart", "LiftedFeatures", "colour_start", "lifted_features", "match_score"]
