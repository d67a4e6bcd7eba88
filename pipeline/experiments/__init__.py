"""The thesis's claims, computed anew: each with what the thesis says, a tolerance and a function.

A claim that does not come out is reported as not reproduced; that is a result, not an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pipeline.errors import InputError
from pipeline.experiments import holes, outliers
from pipeline.experiments.claim import Claim, Verdict

CLAIMS: dict[str, Claim] = {claim.id: claim for claim in (outliers.C10, holes.C22)}


def run_experiments(only: Iterable[str] = ()) -> Iterator[Verdict]:
    """Compute the claims named, or all of them.

    Raises:
        InputError: a name is not a claim.
    """
    wanted = list(only) or list(CLAIMS)
    unknown = [name for name in wanted if name not in CLAIMS]
    if unknown:
        raise InputError(f"There is no claim {', '.join(unknown)}; known are {', '.join(CLAIMS)}")
    for name in wanted:
        yield CLAIMS[name].judge()


__all__ = ["CLAIMS", "Claim", "Verdict", "run_experiments"]
