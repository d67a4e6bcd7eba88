"""What the thesis says of ball pivoting, computed anew: C21 to C24 (SPEC 5 and 8)."""

from lab.claims.surface.detail import C23
from lab.claims.surface.growth import C24
from lab.claims.surface.holes import C22
from lab.claims.surface.rule import C21

CLAIMS = (C21, C22, C23, C24)

__all__ = ["CLAIMS"]
