"""The thesis's claims about the network (SPEC 8, C26 to C36)."""

from __future__ import annotations

from network_sim.experiments import link, radio, selection, street
from pipeline.experiments.claim import Claim

_ALL = (*link.CLAIMS, *street.CLAIMS, *radio.CLAIMS, *selection.CLAIMS)

CLAIMS: dict[str, Claim] = {claim.id: claim for claim in sorted(_ALL, key=lambda claim: claim.id)}
