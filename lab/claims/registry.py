"""All claims, the thesis's and ours, and their computation.

A claim that fails is reported as not reproduced; that is a result, not an error.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from lab.claims import outliers, settings
from lab.claims.calibration import biased_sensors
from lab.claims.calibration.box_claim import C25
from lab.claims.calibration.claims import CLAIMS as CALIBRATION
from lab.claims.claim import Claim, Verdict
from lab.claims.delivery import cameras, pieces
from lab.claims.delivery.claims import CLAIMS as DELIVERY
from lab.claims.depth.claims import CLAIMS as DEPTH
from lab.claims.depth.confidence import D10
from lab.claims.network import link, radio, selection, street
from lab.claims.planning import D12, D13
from lab.claims.registration.claims import CLAIMS as REGISTRATION
from lab.claims.surface import detail, growth, holes, rule
from packetmesh.errors import InputError
from packetmesh.progress import Progress

_ALL: tuple[Claim, ...] = (
    *CALIBRATION,
    *settings.CLAIMS,
    outliers.C10,
    *DEPTH,
    *REGISTRATION,
    *(rule.C21, holes.C22, detail.C23, growth.C24),
    C25,
    *(*link.CLAIMS, *street.CLAIMS, *radio.CLAIMS, *selection.CLAIMS),
    *(*DELIVERY, pieces.D07, cameras.D08),
    biased_sensors.D09,
    *(D10, D12, D13),
)
CLAIMS = {claim.id: claim for claim in sorted(_ALL, key=lambda claim: claim.id)}
"""Claims by number in SPEC 8, in its order."""


def run_claims(
    only: Iterable[str] = (), folder: Path | None = None, scheduler: str | None = None, full: bool = False
) -> Iterator[Progress | Verdict]:
    """Judge the named claims, or all: yield progress while trials run, and the verdict of each claim.

    Args:
        only: names of claims; empty for all.
        folder: folder that keeps the trials, so that an interrupted run resumes; None stores nothing.
        scheduler: address of a Dask scheduler for the trials; None takes this machine's cores.
        full: run also the trials that claims leave out by default; takes hours.

    Raises:
        InputError: a name is not a claim, the folder cannot be written, or there is no such scheduler.
        PacketMeshError: a process that ran trials was killed.
    """
    names = list(only) or list(CLAIMS)
    unknown = [name for name in names if name not in CLAIMS]
    if unknown:
        raise InputError(f"There is no claim {', '.join(unknown)}; known are {', '.join(CLAIMS)}")
    with tempfile.TemporaryDirectory() as temporary:
        prepared: dict[Any, Any] = {}
        for name in names:
            claim = CLAIMS[name]
            prepare = (full and claim.prepare_full) or claim.prepare
            if prepare is None:
                yield Progress(name, 0.0)
                yield claim.judge()
                continue
            if prepare not in prepared:
                prepared[prepare] = yield from prepare(folder or Path(temporary), scheduler)
            yield claim.judge(prepared[prepare])
