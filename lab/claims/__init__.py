"""The thesis's claims, computed anew: each with what the thesis says, a tolerance and a function.

A claim that does not come out is reported as not reproduced; that is a result, not an error.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from lab.claims import outliers
from lab.claims.claim import Claim, Verdict
from lab.claims.depth.claims import CLAIMS as DEPTH_CLAIMS
from lab.claims.network.claims import CLAIMS as NETWORK_CLAIMS
from lab.claims.registration.claims import CLAIMS as REGISTRATION_CLAIMS
from lab.claims.surface import CLAIMS as SURFACE_CLAIMS
from packetmesh.errors import InputError
from packetmesh.progress import Progress

CLAIMS: dict[str, Claim] = {
    claim.id: claim
    for claim in (
        outliers.C10,
        *DEPTH_CLAIMS,
        *REGISTRATION_CLAIMS,
        *SURFACE_CLAIMS,
        *NETWORK_CLAIMS.values(),
    )
}


def run_experiments(
    only: Iterable[str] = (), folder: Path | None = None, claims: Mapping[str, Claim] = CLAIMS
) -> Iterator[Progress | Verdict]:
    """Compute the claims named, or all of them; what takes long reports its progress in between.

    Args:
        only: names of claims; empty for all.
        folder: keeps the results of long work, so that an interrupted run goes on where it stopped; None
            keeps nothing.
        claims: what can be computed, by name; other packages bring claims of their own.

    Raises:
        InputError: a name is not a claim.
    """
    wanted = list(only) or list(claims)
    unknown = [name for name in wanted if name not in claims]
    if unknown:
        raise InputError(f"There is no claim {', '.join(unknown)}; known are {', '.join(claims)}")
    with tempfile.TemporaryDirectory() as temporary:
        prepared: dict[Any, Any] = {}
        for claim in (claims[name] for name in wanted):
            if claim.prepare is None:
                yield claim.judge()
                continue
            if claim.prepare not in prepared:
                prepared[claim.prepare] = yield from claim.prepare(folder or Path(temporary))
            yield claim.judge(prepared[claim.prepare])


__all__ = ["CLAIMS", "Claim", "Verdict", "run_experiments"]
