"""Compute the chain of the start settings while the first browser loads the page."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

from app.compute import jobs
from app.compute.pool import ComputePool, Outcome
from app.compute.state import CHAIN, SharedViews, Spec, Step
from app.compute.store import Store


def compute_ahead(pool: ComputePool, store: Store, shared: SharedViews, spec: Spec, owner: object) -> None:
    """Start computing the chain and return at once. Sessions find each view in ``shared`` or wait for it.

    A failed step is not reported here: the first session that needs it tries it again and shows the error.
    """
    steps = iter(CHAIN)

    def begin_next() -> None:
        step = next(steps, None)
        if step is not None:
            with suppress(RuntimeError):  # the pool is closed
                pool.submit(
                    owner,
                    jobs.run_step,
                    step,
                    store,
                    spec,
                    on_progress=lambda _: None,
                    on_end=partial(ended, step),
                    key=spec.key(step),
                )

    def ended(step: Step, outcome: Outcome) -> None:
        if outcome.kind == "result":
            shared.put(spec.key(step), outcome.value)
            begin_next()

    begin_next()
