"""What the thesis says of ball pivoting, computed anew: C21 to C24 (SPEC 5 and 8)."""

from pipeline.experiments.surface.detail import C23
from pipeline.experiments.surface.growth import C24
from pipeline.experiments.surface.holes import C22
from pipeline.experiments.surface.rule import C21

CLAIMS = (C21, C22, C23, C24)

__all__ = ["CLAIMS"]
