"""The thesis's claims about the network (SPEC 8, C26 to C36)."""

from __future__ import annotations

from lab.claims.claim import Claim
from lab.claims.network import link, radio, selection, street

_ALL = (*link.CLAIMS, *street.CLAIMS, *radio.CLAIMS, *selection.CLAIMS)

CLAIMS: dict[str, Claim] = {claim.id: claim for claim in sorted(_ALL, key=lambda claim: claim.id)}
